"""Parts of the scenes of the plugin reference: a studio, solids, lights, and files that scenes read."""

import math
from pathlib import Path
from typing import Any

Plugin = dict[str, Any]

WIDTH, HEIGHT = 256, 192

UP = [0, 1, 0]
CREAM = {"type": "rgb", "value": [0.75, 0.6, 0.42]}
RED = {"type": "rgb", "value": [0.62, 0.1, 0.06]}
BLUE = {"type": "rgb", "value": [0.06, 0.15, 0.45]}
GREEN = {"type": "rgb", "value": [0.1, 0.35, 0.12]}


def diffuse(reflectance: Any) -> Plugin:
    """A Lambertian surface."""
    return {"type": "diffuse", "reflectance": reflectance}


def lookat(origin: list[float], target: list[float], up: list[float] | None = None) -> list[Plugin]:
    """A transform from local +z to a direction of view."""
    return [{"lookat": {"origin": origin, "target": target, "up": up or UP}}]


def fields(count: int, dark: float = 0.22, light: float = 0.42) -> Plugin:
    """A checkerboard of grey fields."""
    return {"type": "checkerboard", "color0": dark, "color1": light, "to_uv": [{"scale": [count, count, 1]}]}


def floor(bsdf: Plugin | None = None) -> Plugin:
    """The floor, at y = 0."""
    turned = [{"scale": [20, 20, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}]
    return {"type": "rectangle", "to_world": turned, "bsdf": bsdf or diffuse(fields(20))}


def ball(bsdf: Plugin, radius: float = 0.9, x: float = 0.0, z: float = 0.0, **more: Any) -> Plugin:
    """A ball that lies on the floor."""
    return {"type": "sphere", "center": [x, radius, z], "radius": radius, "bsdf": bsdf, **more}


def window(origin: list[float], radiance: float, size: float = 1.2, target: list[float] | None = None) -> Plugin:
    """A square light."""
    placed = [{"scale": [size, size, 1]}, *lookat(origin, target or [0, 0.8, 0])]
    light = {"type": "area", "radiance": radiance}
    return {"type": "rectangle", "to_world": placed, "bsdf": diffuse(0), "emitter": light}


def camera(origin: list[float], target: list[float], fov: float, **more: Any) -> Plugin:
    """A pinhole camera, modified by `more`."""
    return {"type": "perspective", "fov": fov, "to_world": lookat(origin, target), **more}


VIEW = camera([0, 1.9, 5.2], [0, 0.8, 0], 31)
SKY = {"type": "constant", "radiance": 0.46}
STUDIO = {"key": window([-3, 4.2, 3], 2.75, 2.4), "rim": window([3.8, 3, -2.2], 2.5, 1.7), "sky": SKY, "floor": floor()}
"""Large, dim windows, because clear coats reflect small, bright windows as grain."""


def scene(objects: dict[str, Plugin], spp: int, sensor: Plugin = VIEW, integrator: Plugin | None = None, blur: float = 0.5) -> Plugin:
    """A scene with the size of an image. `blur` is the standard deviation of the film's filter in pixels: a wide filter smooths noise."""
    film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "gaussian", "stddev": blur}}
    sampler = {"type": "ldsampler", "sample_count": spp}
    seen = {**sensor, "film": film, "sampler": sampler}
    return {"type": "scene", "integrator": integrator or {"type": "path"}, "sensor": seen, **objects}


def in_studio(spp: int = 128, **objects: Plugin) -> Plugin:
    """Objects on the floor of the studio."""
    return scene({**STUDIO, **objects}, spp)


def with_caustics(**objects: Plugin) -> Plugin:
    """Objects in the studio that focus light."""
    return scene({**STUDIO, **objects}, 256, integrator={"type": "bdpt"})


# Bsdfs.


def surface(bsdf: Plugin, spp: int = 128) -> Plugin:
    """A ball with a bsdf."""
    return in_studio(spp, ball=ball(bsdf))


def coated(bsdf: Plugin) -> Plugin:
    """A ball with a bsdf that has a smooth coat, which needs more samples."""
    return surface(bsdf, 256)


def pane() -> Plugin:
    """A pane in front of a ball; it reflects a globe of light that is out of view."""
    placed = [{"scale": [0.85, 0.8, 1]}, {"rotate": {"axis": UP, "angle": -24}}, {"translate": [0.3, 0.8, 0.75]}]
    tint = {"type": "rgb", "value": [0.7, 0.85, 0.78]}
    glass = {"type": "rectangle", "to_world": placed, "bsdf": {"type": "thindielectric", "specular_transmittance": tint}}
    globe = {"type": "sphere", "center": [-1.9, 0.5, 2.9], "radius": 0.35, "bsdf": diffuse(0), "emitter": {"type": "area", "radiance": 1.5}}
    return in_studio(512, ball=ball(diffuse(RED), 0.7, -0.35, -0.5), pane=glass, globe=globe)


def open_tube() -> Plugin:
    """A tube seen from outside and from inside."""
    sides = {"type": "twosided", "front": diffuse(BLUE), "back": diffuse(CREAM)}
    tube = {"type": "cylinder", "p0": [-0.9, 0.8, 0.9], "p1": [0.6, 0.8, -0.9], "radius": 0.8, "bsdf": sides}
    return in_studio(tube=tube)


def invisible_hull() -> Plugin:
    """A ball of fog."""
    fog = {"type": "homogeneous", "sigma_t": 2.5, "albedo": CREAM}
    return in_studio(ball=ball({"type": "null"}, interior=fog))


def filters(*panes: tuple[Plugin, float, float]) -> Plugin:
    """Square filters of polarised light in front of a ball: each with half its side, and the place of its middle across."""
    objects = {"ball": ball(diffuse(CREAM), 0.7, z=-0.5)}
    for i, (bsdf, size, x) in enumerate(panes):
        placed = [{"scale": [size, size, 1]}, {"translate": [x, 0.85, 0.7 + 0.2 * i]}]
        objects[f"filter_{i}"] = {"type": "rectangle", "to_world": placed, "bsdf": bsdf}
    return scene({**STUDIO, **objects}, 128, integrator={"type": "stokes", "path": {"type": "path"}})


def sheet(bsdf: Plugin) -> Plugin:
    """A thin sheet that hides a light and a bar in front of this light."""
    placed = [{"scale": [0.8, 0.7, 1]}, *turned(-20, {"translate": [0, 0.72, 0]})]
    bar = {"type": "cylinder", "p0": [-0.9, 0.2, -0.45], "p1": [0.9, 1.3, -0.45], "radius": 0.07, "bsdf": {"type": "twosided", "bsdf": diffuse(0.1)}}
    light = window([0.1, 0.5, -3], 14, 0.4, [0, 0.7, 0])
    return scene({"sky": SKY, "floor": floor(), "light": light, "bar": bar, "sheet": {"type": "rectangle", "to_world": placed, "bsdf": bsdf}}, 128)


def relief(size: int = 64) -> list[list[float]]:
    """Heights of waves that repeat."""
    wave = [math.sin(2 * math.pi * 4 * i / size) for i in range(size)]
    return [[0.5 + 0.25 * (a + b) for a in wave] for b in wave]


def normals(size: int = 64) -> list[list[list[float]]]:
    """Normals of the waves of `relief`, as colours."""
    rows = []
    for j in range(size):
        row = []
        for i in range(size):
            slope = [0.6 * math.cos(2 * math.pi * 4 * k / size) for k in (i, j)]
            length = math.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
            row.append([0.5 - 0.5 * slope[0] / length, 0.5 - 0.5 * slope[1] / length, 0.5 + 0.5 / length])
        rows.append(row)
    return rows


# Phase functions.


def bowl(rows: int = 40, columns: int = 96) -> Plugin:
    """The lower half of a sphere, seen from inside."""
    positions, faces = [], []
    for i in range(rows + 1):
        for j in range(columns):
            polar, around = 0.5 * math.pi * (1 + i / rows), 2 * math.pi * j / columns
            across = math.sin(polar)
            positions.append([across * math.cos(around), math.cos(polar), across * math.sin(around)])
            if i < rows:
                a, b = i * columns + j, i * columns + (j + 1) % columns
                faces += [[a, b, a + columns], [b, b + columns, a + columns]]
    grey = {"type": "twosided", "bsdf": diffuse(0.2)}
    return {"type": "mesh", "vertex_positions": positions, "faces": faces, "bsdf": grey}


def scattered(phase: Plugin) -> Plugin:
    """A beam from the left through a small ball of fog, above the middle of a bowl that receives
    the scattered light."""
    fog = {"type": "homogeneous", "sigma_t": 1.5, "albedo": 1, "phase": phase}
    puff = {"type": "sphere", "center": [0, 0.1, 0], "radius": 0.09, "bsdf": {"type": "null"}, "interior": fog}
    beam = {"type": "collimated", "radius": 0.08, "power": 400, "to_world": lookat([-0.98, 0.1, 0], [0, 0.1, 0])}
    above = {"type": "orthographic", "to_world": [{"scale": [1.42, 1.42, 1]}, *lookat([0, 3, 0], [0, 0, 0], [0, 0, -1])]}
    return scene({"bowl": bowl(), "puff": puff, "beam": beam}, 64, above, {"type": "bdpt"}, blur=1.5)


# Emitters.


def lit(lights: dict[str, Plugin], haze: float = 0.0, integrator: str = "path") -> Plugin:
    """Two solids in front of a wall, in a light, and in haze if wanted. Paths in haze end early,
    because late scattering is dim and noisy."""
    wall = {"type": "rectangle", "to_world": [{"scale": [20, 20, 1]}, {"translate": [0, 0, -2.2]}], "bsdf": diffuse(0.6)}
    block = {
        "type": "cube",
        "to_world": [{"scale": [0.42, 0.42, 0.42]}, {"rotate": {"axis": UP, "angle": 28}}, {"translate": [-0.85, 0.42, -0.3]}],
        "bsdf": diffuse(CREAM),
    }
    solids = {"wall": wall, "floor": floor(diffuse(0.6)), "block": block, "ball": ball(diffuse(0.7), 0.5, 0.75, 0.1)}
    if haze:
        hull = {"type": "cube", "to_world": [{"scale": [3.2, 1.6, 2]}, {"translate": [0, 1.59, 0]}], "bsdf": {"type": "null"}}
        solids["haze"] = {**hull, "interior": {"type": "homogeneous", "sigma_t": haze, "albedo": 0.9}}
    chosen = {"type": "bdpt", "max_depth": 4} if haze else {"type": integrator}
    return scene({**solids, **lights}, 256, integrator=chosen, blur=1.0 if haze else 0.5)


def dusk(folder: Path) -> str:
    """Writes an image of a sky at sunset, with a low sun. Returns its path."""
    import numpy as np
    from PIL import Image

    rows, columns = np.mgrid[0:128, 0:256]
    height = (0.5 - (rows + 0.5) / 128) * math.pi
    azimuth = (columns + 0.5) / 256 * 2 * math.pi
    glow = np.exp(-np.abs(height) / 0.25)[..., None]
    colours = glow * [1.0, 0.55, 0.25] + (1 - glow) * [0.12, 0.2, 0.42]
    sun = np.exp(-((height - 0.35) ** 2 + (azimuth - 2.2) ** 2) / 0.01)[..., None]
    image = np.clip(colours + sun, 0, 1)
    Image.fromarray((255 * image ** (1 / 2.2)).astype(np.uint8)).save(folder / "dusk.png")
    return str(folder / "dusk.png")


def slide(folder: Path) -> str:
    """Writes an image with coloured fields and a circle. Returns its path."""
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (256, 192), (245, 235, 210))
    draw = ImageDraw.Draw(image)
    for i, colour in enumerate([(200, 40, 30), (240, 170, 30), (60, 140, 60), (40, 80, 180)]):
        draw.rectangle([16 + 56 * i, 128, 60 + 56 * i, 176], fill=colour)
    draw.ellipse([88, 24, 168, 104], fill=(40, 50, 70))
    draw.polygon([(128, 34), (162, 88), (94, 88)], fill=(245, 235, 210))
    image.save(folder / "slide.png")
    return str(folder / "slide.png")


def luminaire(folder: Path) -> str:
    """Writes a photometric file of a downlight with a bright ring. Returns its path."""
    angles = list(range(0, 95, 5))
    candela = [900 * math.exp(-(((a - 32) / 7) ** 2)) + 260 * math.exp(-((a / 13) ** 2)) for a in angles]
    lines = ["IESNA:LM-63-1995", "TILT=NONE", f"1 1000 1 {len(angles)} 1 1 2 0 0 0", "1 1 20"]
    lines += [" ".join(f"{a}" for a in angles), "0", " ".join(f"{c:.1f}" for c in candela)]
    (folder / "ring.ies").write_text("\n".join(lines) + "\n")
    return str(folder / "ring.ies")


# Shapes and textures.


def torus(bands: int = 48, sides: int = 24) -> tuple[list[list[float]], list[list[int]]]:
    """Returns positions and triangles of a torus around the y axis, on the floor."""
    positions, faces = [], []
    for i in range(bands):
        for j in range(sides):
            around, across = 2 * math.pi * i / bands, 2 * math.pi * j / sides
            r = 0.8 + 0.32 * math.cos(across)
            positions.append([r * math.cos(around), 0.32 + 0.32 * math.sin(across), r * math.sin(around)])
            a, b = i * sides + j, (i + 1) % bands * sides + j
            c, d = i * sides + (j + 1) % sides, (i + 1) % bands * sides + (j + 1) % sides
            faces += [[a, c, b], [b, c, d]]
    return positions, faces


def ring(bsdf: Plugin, **more: Any) -> Plugin:
    """A torus that leans towards the camera."""
    positions, faces = torus()
    leaning = [{"scale": 0.88}, {"rotate": {"axis": [1, 0, 0], "angle": 35}}, {"translate": [0, 0.6, 0]}]
    arrays = {"vertex_positions": positions, "faces": faces}
    return {"type": "mesh", **arrays, "to_world": leaning, "bsdf": {"type": "twosided", "bsdf": bsdf}, **more}


def copies() -> Plugin:
    """Seven copies of a group of two solids."""
    cap = {"type": "sphere", "radius": 0.3, "center": [0, 0.75, 0], "bsdf": {"type": "plastic", "diffuse_reflectance": RED}}
    stem = {"type": "cylinder", "p0": [0, 0.75, 0], "p1": [0, 0, 0], "radius": 0.12, "bsdf": {"type": "twosided", "bsdf": diffuse(CREAM)}}
    objects: dict[str, Plugin] = {"pin": {"type": "shapegroup", "id": "pin", "cap": cap, "stem": stem}}
    for i in range(7):
        turn = 2 * math.pi * i / 6
        away = 1.05 if i < 6 else 0.0
        placed = [{"scale": 0.75 if i < 6 else 1.4}, {"translate": [away * math.sin(turn), 0, away * math.cos(turn)]}]
        objects[f"copy_{i}"] = {"type": "instance", "group": {"type": "ref", "id": "pin"}, "to_world": placed}
    return in_studio(256, **objects)


def solid(shape: Plugin) -> Plugin:
    """A shape with a coat."""
    return in_studio(256, solid={"bsdf": {"type": "plastic", "diffuse_reflectance": BLUE}, **shape})


def turned(angle: float, *parts: Plugin) -> list[Plugin]:
    """A transform that first rotates about the vertical."""
    return [{"rotate": {"axis": UP, "angle": angle}}, *parts]


def upright(shape: str, size: float) -> Plugin:
    """A flat shape that stands on the floor, turned a little."""
    placed = [{"scale": [size, size, 1]}, *turned(-30, {"translate": [0, size, 0]})]
    return solid({"type": shape, "to_world": placed})


def shaded_ring() -> Plugin:
    """A torus with vertex colours by azimuth."""
    positions, _ = torus()
    turns = [math.atan2(z, x) for x, _, z in positions]
    colours = [[0.35 + 0.25 * math.cos(t - 2 * math.pi * k / 3) for k in range(3)] for t in turns]
    texture = {"type": "mesh_attribute", "name": "vertex_color"}
    return in_studio(ring=ring(diffuse(texture), vertex_color=colours))


def of_voxels(surface: str, x: float) -> Plugin:
    """A ball of voxels of clear gelatine, beside another ball."""
    size = 16
    middle = (size - 1) / 2
    near = lambda i, j, k: (i - middle) ** 2 + (j - middle) ** 2 + (k - middle) ** 2 < (0.47 * size) ** 2  # noqa: E731
    labels = [[[int(near(i, j, k)) for i in range(size)] for j in range(size)] for k in range(size)]
    gelatine = {"type": "homogeneous", "sigma_a": {"type": "rgb", "value": [0.1, 0.9, 1.6]}, "sigma_s": 0.3, "ior": 1.34}
    placed = [{"translate": [-0.5, -0.03, -0.5]}, {"scale": 1.5}, {"translate": [x, 0, 0]}]
    return {"type": "labels", "data": labels, "surface": surface, "to_world": placed, "1": gelatine}


def fur(folder: Path, strands: int = 1500) -> str:
    """Writes strands that grow out of a ball and bend down. Returns the path of the file."""
    lines = []
    for i in range(strands):
        height, turn = 1 - 2 * (i + 0.5) / strands, math.pi * (3 - math.sqrt(5)) * i
        across = math.sqrt(1 - height * height)
        out = [across * math.cos(turn), height, across * math.sin(turn)]
        for step in range(6):
            far, drop = 0.5 + 0.06 * step, 0.012 * step * step
            lines.append(" ".join(f"{far * a + b:.4f}" for a, b in zip(out, [0, 0.85 - drop, 0])))
        lines.append("")
    (folder / "fur.txt").write_text("\n".join(lines) + "\n")
    return str(folder / "fur.txt")


def furry(strands: str) -> Plugin:
    """A ball with the strands of a file."""
    hair = {"type": "hair", "filename": strands, "radius": 0.008, "bsdf": diffuse(CREAM)}
    return scene({**STUDIO, "fur": hair, "ball": {**ball(diffuse(RED), 0.5), "center": [0, 0.85, 0]}}, 128)


def puff(size: int = 24) -> list[list[list[list[float]]]]:
    """Extinctions of two clouds in the unit cube, [z][y][x][0]."""
    at = [2 * (i + 0.5) / size - 1 for i in range(size)]

    def cloud(x: float, y: float, z: float) -> float:
        return 9 * math.exp(-((x + 0.35) ** 2 + (y + 0.3) ** 2 + z * z) / 0.08) + 5 * math.exp(-((x - 0.3) ** 2 + (y - 0.25) ** 2 + z * z) / 0.12)

    return [[[[cloud(x, y, z)] for x in at] for y in at] for z in at]


def layers(size: int = 48) -> list[list[list[list[float]]]]:
    """Colours of tilted layers in the unit cube, [z][y][x][channel]."""
    at = [(i + 0.5) / size for i in range(size)]
    cream, red, blue = [0.75, 0.6, 0.42], [0.62, 0.1, 0.06], [0.06, 0.15, 0.45]
    colours = [cream, red, cream, blue]
    return [[[colours[int(10 * (y + 0.35 * x + 0.2 * z)) % 4] for x in at] for y in at] for z in at]


def ring_of_distances(size: int = 40) -> list[list[list[list[float]]]]:
    """Signed distances to a ring in the unit cube, [z][y][x][0]."""
    at = [2 * i / (size - 1) - 1 for i in range(size)]
    return [[[[math.hypot(math.hypot(x, y) - 0.62, z) - 0.28] for x in at] for y in at] for z in at]


def leaning(shape: Plugin) -> Plugin:
    """A shape over [0, 1]³, leaning towards the camera."""
    placed = [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 1.8}, {"rotate": {"axis": [1, 0, 0], "angle": -25}}, {"translate": [0, 0.85, 0]}]
    return in_studio(
        256,
        solid={**shape, "to_world": placed, "bsdf": {"type": "twosided", "bsdf": {"type": "plastic", "diffuse_reflectance": GREEN}}}
    )


# Indices.


def index_ball(volume: Any, radius: float = 0.9) -> Plugin:
    """A ball of clear matter in front of a checkerboard."""
    board = {
        "type": "rectangle",
        "to_world": [{"scale": [4, 4, 1]}, {"translate": [0, 0, -2]}],
        "bsdf": diffuse(0),
        "emitter": {"type": "area", "radiance": {**fields(12, 0.12, 0.75)}},
    }
    lens = {"type": "sphere", "radius": radius, "bsdf": {"type": "null"}, "interior": {"type": "transparent", "ior": volume}}
    return scene({"board": board, "lens": lens}, 64, camera([0, 0, 6], [0, 0, 0], 22), {"type": "path", "max_depth": 1})


def refracting_ball(index: Any, **film: Any) -> Plugin:
    """A ball with a smooth surface in front of the checkerboard of `index_ball`, on a film with further parameters."""
    made = index_ball(index)
    made["lens"]["bsdf"] = {"type": "dielectric"}
    made["sensor"]["film"].update(film)
    return {**made, "integrator": {"type": "path", "max_depth": 3}}


SAMPLED = {"axis_order": "zyx", "placement": "nodes", "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2}]}


def bumps(base: float, height: float, size: int = 32) -> list[list[list[float]]]:
    """Samples of two bumps over [-1, 1]³, [z][y][x]."""
    at = [2 * i / (size - 1) - 1 for i in range(size)]
    bump = lambda x, y, z: math.exp(-((x - 0.3) ** 2 + y**2 + z**2) / 0.08) - math.exp(-((x + 0.3) ** 2 + y**2 + z**2) / 0.08)  # noqa: E731
    return [[[base + height * bump(x, y, z) for x in at] for y in at] for z in at]


# Integrators and sensors.


def caustic(integrator: Plugin, spp: int) -> Plugin:
    """A glass ball under a small light."""
    lights = {"bulb": window([-1.8, 3.4, 0.8], 150, 0.16), "panel": window([0, 5, 4], 1.6, 2)}
    objects = {**lights, "floor": floor(), "ball": ball({"type": "dielectric"}, 0.8, 0.1)}
    return scene(objects, spp, VIEW, integrator)


def row_of(sensor: Plugin) -> Plugin:
    """Five balls in a row, seen by a sensor."""
    colours = [RED, CREAM, GREEN, BLUE, RED]
    balls = {f"ball_{i}": ball(diffuse(c), 0.45, 0.8 * (i - 2), 1.2 - 1.2 * i) for i, c in enumerate(colours)}
    sun = {"type": "directional", "direction": [0.6, -0.9, -0.5], "irradiance": 2}
    return scene({"sun": sun, "sky": SKY, "floor": floor(), **balls}, 128, sensor)


ORIGIN, TARGET = [-0.4, 2.4, 6.4], [0.1, 0.35, -1.0]


def fog_ball(medium: Plugin) -> Plugin:
    """A ball of a medium without a surface."""
    return with_caustics(ball=ball({"type": "null"}, interior=medium))


def clouds(medium: Plugin) -> Plugin:
    """A cube of a medium without a surface."""
    placed = [{"scale": 0.9}, {"translate": [0, 0.9, 0]}]
    return scene({**STUDIO, "cube": {"type": "cube", "to_world": placed, "bsdf": {"type": "null"}, "interior": medium}}, 256)


# Reconstruction filters.


def star(rfilter: Plugin) -> Plugin:
    """A star of black rays on 40 × 30 pixels."""
    count, spokes = 24, {}
    for i in range(count):
        placed = [{"scale": [2, 0.045, 1]}, {"translate": [2.1, 0, 0]}, {"rotate": {"axis": [0, 0, 1], "angle": 360 * i / count + 4}}]
        spokes[f"spoke_{i}"] = {"type": "rectangle", "to_world": placed, "bsdf": diffuse(0)}
    made = scene({"sky": {"type": "constant", "radiance": 0.8}, **spokes}, 1024, camera([0, 0, 6], [0, 0, 0], 32), {"type": "path", "max_depth": 1})
    made["sensor"]["film"] = {"type": "hdrfilm", "width": 40, "height": 30, "rfilter": rfilter}
    return made
