#!/usr/bin/env python3
"""Renders random scenes by Mitsuba 3 and by morgana, and compares the images.

A scene has one object, a floor, one emitter and one camera, drawn from the plugins that both know.
Both programs read one file, several times with other seeds. The table lists the difference of the
images' means in standard errors, and its root mean square over blocks of the images (about 1.1 if
all is well). The differences that docs/mitsuba.md allows, --tolerance, are subtracted first.

Two kinds of scenes are marked and not counted. `caustic` scenes have light of point-like emitters
that passes smooth glass, which morgana finds and Mitsuba's path tracer does not. To `known` scenes,
rows of docs/mitsuba.md apply that are more than round-off.

Usage: scripts/random_mitsuba_scenes.py [--count N] [--seed N] [--exe PATH] [--out FOLDER]
(with any Python that has mitsuba and numpy)
"""

import argparse
import pathlib
import random
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIMIT = 4.0
# Blocks along a side of the image.
BLOCKS = 4
# Root mean square over blocks from which images count as different: 16 standard normals exceed it
# once in 1e6.
ROUGH = 1.9
# Differences up to this fraction of the image's mean count as at most a standard error.
DARK = 1e-3
PARTIAL = {"mask", "thindielectric", "polarizer", "circular", "retarder", "null"}
# Mitsuba's mixtures of these with others are wrong.
MIRRORS = {"conductor", "plastic"}
DELTA_EMITTERS = ("point", "spot", "projector", "directional")


class Plugin:
    """A plugin with its parameters and children, by name."""

    def __init__(self, tag: str, type_: str, **parameters: Any) -> None:
        self.tag, self.type, self.parameters = tag, type_, parameters

    def element(self, name: str | None = None) -> ElementTree.Element:
        element = ElementTree.Element(self.tag, type=self.type)
        if name and not name.startswith("_"):
            element.set("name", name)
        if "id" in self.parameters:
            element.set("id", self.parameters["id"])
        for key, value in self.parameters.items():
            if key != "id":
                element.append(_parameter(key, value))
        return element

    def names(self) -> list[str]:
        """Returns its type and the types within it."""
        nested = (value for value in self.parameters.values() if isinstance(value, Plugin))
        return [self.type, *(name for one in nested for name in one.names())]


class Rgb(tuple):
    """A colour."""


class Vector(tuple):
    """A direction."""


class Ref(str):
    """A reference to a plugin of the scene."""


class Transform(list):
    """Parts of a transform: element names with attributes."""


def _parameter(name: str, value: Any) -> ElementTree.Element:
    if isinstance(value, Plugin):
        return value.element(name)
    if isinstance(value, Ref):
        return ElementTree.Element("ref", id=value)
    if isinstance(value, Transform):
        element = ElementTree.Element("transform", name=name)
        for tag, attributes in value:
            ElementTree.SubElement(element, tag, {k: _text(v) for k, v in attributes.items()})
        return element
    tags = {bool: "boolean", int: "integer", float: "float", str: "string", Rgb: "rgb", Vector: "vector"}
    return ElementTree.Element(tags[type(value)], name=name, value=_text(value))


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (tuple, list)):
        return ", ".join(f"{v:.9g}" for v in value)
    return value if isinstance(value, str) else f"{value:.9g}"


class Generator:
    """Draws scenes; the files that they need go to a folder."""

    def __init__(self, seed: str, folder: pathlib.Path) -> None:
        self.r, self.folder = random.Random(seed), folder

    def scene(self, size: int) -> tuple[Plugin | ElementTree.Element, dict[str, str]]:
        """Returns a scene, and its ingredients."""
        cloud = self.r.random() < 0.1
        bsdf = Plugin("bsdf", "null") if cloud else self.bsdf()
        shape = self.cloud(bsdf) if cloud else self.shape(bsdf)
        emitter, light = self.emitter()
        sensor = self.sensor(size)
        floor_bsdf = Plugin("bsdf", "diffuse", reflectance=self.reflectance())
        floor = Plugin(
            "shape", "rectangle", bsdf=floor_bsdf, to_world=Transform([("scale", {"value": "6"}), ("translate", {"z": -1.2})])
        )
        root = ElementTree.Element("scene", version="3.0.0")
        # Mitsuba's path drops light that it finds through partly transparent surfaces, unless there
        # is an environment.
        integrator = "volpath" if PARTIAL & set(bsdf.names()) else "path"
        for part in [Plugin("integrator", integrator), sensor, floor, *shape, light]:
            root.append(part.element())
        if light.type == "sphere" and "bitmap" in light.names():
            emitter += "/sphere/bitmap"
        parts = {"shape": shape[-1].type, "bsdf": "/".join(bsdf.names()), "emitter": emitter, "sensor": sensor.type}
        return root, parts

    # Textures

    def colour(self) -> Any:
        return self.r.choice([lambda: Rgb(self.r.uniform(0.1, 0.9) for _ in range(3)), lambda: self.r.uniform(0.1, 0.9), self.texture])()

    def reflectance(self) -> Any:
        """Returns a colour, or a volume whose mean Mitsuba's coats cannot tell."""
        if self.r.random() < 0.85:
            return self.colour()
        around = [("scale", {"value": "8"}), ("translate", {"x": -4, "y": -4, "z": -4})]
        grid = Plugin("volume", "gridvolume", filename=self.grid(), to_world=Transform(around))
        return Plugin("texture", "volume", volume=grid)

    def texture(self) -> Plugin:
        to_uv = Transform([("scale", {"value": self.r.uniform(0.5, 4)})])
        if self.r.random() < 0.5:
            colours = {f"color{k}": Rgb(self.r.uniform(0.05, 0.95) for _ in range(3)) for k in range(2)}
            return Plugin("texture", "checkerboard", to_uv=to_uv, **colours)
        picture = self.picture(4, 3, 0.05, 0.95)
        filters = self.r.choice(["nearest", "bilinear"])
        wrap = self.r.choice(["repeat", "mirror", "clamp"])
        return Plugin("texture", "bitmap", filename=picture, raw=True, filter_type=filters, wrap_mode=wrap, to_uv=to_uv)

    def picture(self, width: int, height: int, low: Any, high: Any) -> str:
        """Writes an image with values in a range, or in one for each channel."""
        import mitsuba

        shares = np.array([self.r.random() for _ in range(width * height * 3)], np.float32).reshape(-1, 3)
        pixels = (np.array(low) + shares * (np.array(high) - np.array(low))).astype(np.float32)
        name = f"picture_{self.r.randrange(10**9)}.exr"
        mitsuba.Bitmap(pixels.reshape(height, width, 3)).write(str(self.folder / name))
        return name

    # Surfaces

    def bsdf(self) -> Plugin:
        if self.r.random() < 0.25:
            return self.compound()
        return self.simple()

    def compound(self) -> Plugin:
        first, second = self.opaque(), self.opaque()
        kind = self.r.choice(["blendbsdf", "mask", "twosided", "bumpmap", "normalmap"])
        if kind == "bumpmap":
            heights = Plugin("texture", "bitmap", filename=self.picture(6, 5, 0, 0.1), raw=True)
            return Plugin("bsdf", kind, _map=heights, _a=first)
        if kind == "normalmap":
            # Keep normals within 30° of the true one.
            normals = Plugin("texture", "bitmap", filename=self.picture(6, 5, (0.35, 0.35, 0.95), (0.65, 0.65, 1)), raw=True)
            return Plugin("bsdf", kind, normalmap=normals, _a=first)
        if kind == "blendbsdf":
            return Plugin("bsdf", kind, weight=self.r.uniform(0, 1), _a=first, _b=second)
        if kind == "mask":
            return Plugin("bsdf", kind, opacity=self.r.uniform(0.1, 0.9), _a=first)
        return Plugin("bsdf", kind, _a=first, _b=second)

    def facets(self) -> dict[str, Any]:
        return {"alpha": self.r.uniform(0.15, 0.6), "distribution": self.r.choice(["beckmann", "ggx"])}

    def brushed(self) -> dict[str, Any]:
        """Makes facets anisotropic, half of the time."""
        facets = self.facets()
        if self.r.random() < 0.5:
            facets["alpha_u"] = facets.pop("alpha")
            facets["alpha_v"] = self.r.uniform(0.15, 0.6)
        return facets

    def metal(self) -> dict[str, Any]:
        return self.r.choice([{"material": self.r.choice(["Ag", "Al", "Au", "Cr", "Cu", "W"])}, {"material": "none"}])

    def opaque(self) -> Plugin:
        r = self.r
        coat = {"diffuse_reflectance": self.colour(), "int_ior": r.uniform(1.3, 1.8), "nonlinear": r.random() < 0.5}
        names = ("anisotropic", "metallic", "specular", "spec_tint", "sheen", "sheen_tint", "flatness", "clearcoat", "clearcoat_gloss")
        disney = {name: r.uniform(0, 1) for name in names if r.random() < 0.5}
        return r.choice(
            [
                lambda: Plugin("bsdf", "diffuse", reflectance=self.reflectance()),
                lambda: Plugin("bsdf", "conductor", **self.metal()),
                lambda: Plugin("bsdf", "roughconductor", **self.metal(), **self.brushed()),
                lambda: Plugin("bsdf", "plastic", **coat),
                lambda: Plugin("bsdf", "roughplastic", **coat, **self.facets()),
                lambda: Plugin("bsdf", "pplastic", diffuse_reflectance=self.colour(), **self.brushed()),
                lambda: Plugin("bsdf", "principled", base_color=self.colour(), roughness=r.uniform(0.3, 0.9), **disney),
            ]
        )()

    def simple(self) -> Plugin:
        r = self.r
        ior = {"int_ior": r.uniform(1.2, 1.8), "ext_ior": 1.0}
        sheet = {"spec_trans": r.uniform(0, 1), "diff_trans": r.uniform(0, 2), "roughness": r.uniform(0.3, 0.8)}
        sheet["anisotropic"] = r.choice([0.0, 0.7])
        return r.choice(
            [self.opaque] * 6
            + [
                lambda: Plugin("bsdf", "dielectric", **ior),
                lambda: Plugin("bsdf", "roughdielectric", **ior, **self.brushed()),
                lambda: Plugin("bsdf", "thindielectric", **ior),
                lambda: Plugin("bsdf", "principledthin", base_color=self.colour(), **sheet),
                lambda: Plugin("bsdf", "principled", base_color=self.colour(), roughness=0.5, spec_trans=r.uniform(0.3, 1)),
                lambda: Plugin("bsdf", r.choice(["polarizer", "circular", "retarder"])),
            ]
        )()

    # Shapes

    def place(self, even: bool = True) -> Transform:
        """Returns a transform to somewhere around the middle; Mitsuba's round shapes take one scale
        along all axes."""
        r = self.r
        # Mitsuba does not normalise the axis, and shears if it is not a unit vector.
        axis = np.array([r.gauss(0, 1) for _ in "xyz"])
        axis /= np.linalg.norm(axis)
        scale: dict[str, Any] = {"value": r.uniform(0.6, 1.0)}
        if not even:
            scale = {axis: r.uniform(0.5, 1.0) for axis in "xyz"}
        turn = {name: float(v) for name, v in zip("xyz", axis)} | {"angle": r.uniform(0, 360)}
        return Transform([("scale", scale), ("rotate", turn)])

    def shape(self, bsdf: Plugin) -> list[Plugin]:
        """Returns a shape, after the objects that it refers to."""
        r = self.r
        # A transmitting surface encloses something, or has nothing behind it.
        closed = any(name in ("dielectric", "roughdielectric") or "spec_trans" in bsdf.parameters for name in bsdf.names())
        kinds = ["sphere", "cube", "sphere"] if closed else ["sphere", "cube", "cylinder", "disk", "rectangle", "obj", "ply", "instance", "merge", "bsplinecurve", "linearcurve"]
        kind = r.choice(kinds)
        common = {"bsdf": bsdf, "to_world": self.place(even=kind not in ("cube", "rectangle", "obj", "ply"))}
        if kind in ("bsplinecurve", "linearcurve"):
            return [Plugin("shape", kind, filename=self.curve(), **common)]
        if kind in ("obj", "ply"):
            file = self.tetrahedron(kind)
            if kind == "ply" and r.random() < 0.5:
                colours = Plugin("texture", "mesh_attribute", name="vertex_color")
                common["bsdf"] = Plugin("bsdf", "diffuse", reflectance=colours)
            return [Plugin("shape", kind, filename=file, face_normals=True, **common)]
        if kind == "instance":
            member = Plugin("shape", r.choice(["sphere", "cube"]), bsdf=bsdf)
            group = Plugin("shape", "shapegroup", id="group", _a=member)
            return [group, Plugin("shape", "instance", _group=Ref("group"), to_world=self.place())]
        if kind == "merge":
            return [Plugin("shape", "merge", _a=Plugin("shape", "cube", **common), _b=Plugin("shape", "disk", to_world=self.place()))]
        more: dict[str, Any] = {"cylinder": {"radius": 0.7}, "sphere": {"flip_normals": r.random() < 0.2}}.get(kind, {})
        if closed:
            more = {}
        return [Plugin("shape", kind, **more, **common)]

    def cloud(self, bsdf: Plugin) -> list[Plugin]:
        """A scattering medium."""
        r = self.r
        albedo = Rgb(r.uniform(0.3, 1) for _ in range(3))
        if r.random() < 0.5:
            medium = Plugin("medium", "homogeneous", sigma_t=r.uniform(0.5, 4), albedo=albedo, phase=self.phase())
            return [Plugin("shape", r.choice(["sphere", "cube"]), bsdf=bsdf, interior=medium, to_world=self.place())]
        # Use a grid parallel to the axes, as Mitsuba's boxes around grids are.
        around = [("scale", {"value": "2"}), ("translate", {"x": -1, "y": -1, "z": -1})]
        grid = Plugin("volume", "gridvolume", filename=self.grid(), to_world=Transform(around))
        medium = Plugin("medium", "heterogeneous", sigma_t=grid, albedo=albedo, scale=r.uniform(1, 3), phase=self.phase())
        return [Plugin("shape", "cube", bsdf=bsdf, interior=medium)]

    def phase(self) -> Plugin:
        r = self.r
        lobes = [lambda: Plugin("phase", "hg", g=r.uniform(-0.8, 0.8)), lambda: Plugin("phase", "isotropic"), lambda: Plugin("phase", "rayleigh"), self.tabulated]
        first, second = (r.choice(lobes)() for _ in range(2))
        return r.choice([first, Plugin("phase", "blendphase", weight=r.uniform(0, 1), _a=first, _b=second)])

    def tabulated(self) -> Plugin:
        return Plugin("phase", "tabphase", values=", ".join(f"{self.r.uniform(0.2, 2):.6f}" for _ in range(5)))

    def grid(self) -> str:
        """Writes a volume file of random extinctions."""
        import mitsuba

        values = np.array([self.r.uniform(0, 1) for _ in range(4 * 3 * 2)], np.float32).reshape(4, 3, 2, 1)
        name = f"grid_{self.r.randrange(10**9)}.vol"
        mitsuba.VolumeGrid(values).write(str(self.folder / name))
        return name

    def curve(self) -> str:
        """Returns a curve of some control points, thick in the middle."""
        points = [[0.35 * k - 1.4, *(self.r.uniform(-0.8, 0.8) for _ in range(2)), 0.15 if 1 < k < 7 else 0.0] for k in range(9)]
        path = self.folder / "curve.txt"
        path.write_text("".join(" ".join(f"{v:.6f}" for v in point) + "\n" for point in points))
        return path.name

    def tetrahedron(self, kind: str) -> str:
        corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
        faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
        path = self.folder / f"tetrahedron.{kind}"
        if kind == "obj":
            lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        else:
            header = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {name}" for name in "xyzrgb")]
            header += ["element face 4", "property list uchar int vertex_index", "end_header"]
            colours = [" ".join(f"{self.r.uniform(0.1, 0.9):.6f}" for _ in "rgb") for _ in corners]
            lines = header + [f"{x} {y} {z} {colour}" for (x, y, z), colour in zip(corners, colours, strict=True)] + [f"3 {a} {b} {c}" for a, b, c in faces]
        path.write_text("\n".join(lines) + "\n")
        return path.name

    # Light

    def emitter(self) -> tuple[str, Plugin]:
        r = self.r
        above = [r.uniform(-2, 2), r.uniform(-2, 2), r.uniform(2.5, 4)]
        down = Transform([("lookat", {"origin": above, "target": [0.1, 0.05, 0], "up": "0.3, 1, 0.2"})])
        upright = Transform([("rotate", {"x": "1", "angle": "90"}), ("rotate", {"z": "1", "angle": r.uniform(0, 360)})])
        toward_sun = Vector([r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(0.3, 1)])
        kinds = {
            "point": lambda: Plugin("emitter", "point", to_world=down, intensity=self.light()),
            "spot": lambda: Plugin("emitter", "spot", to_world=down, intensity=self.light(), cutoff_angle=r.uniform(20, 50)),
            "projector": lambda: Plugin(
                "emitter",
                "projector",
                to_world=down,
                fov=r.uniform(30, 60),
                irradiance=Plugin("texture", "bitmap", raw=True, filename=self.picture(4, 3, 0.5, 20)),
            ),
            "directional": lambda: Plugin("emitter", "directional", to_world=down, irradiance=self.light()),
            "constant": lambda: Plugin("emitter", "constant", radiance=self.light()),
            "envmap": lambda: Plugin("emitter", "envmap", filename=self.picture(8, 5, 0, 3), scale=r.uniform(0.5, 2), to_world=upright),
            "sunsky": lambda: Plugin(
                "emitter", "sunsky", sun_direction=toward_sun, turbidity=r.uniform(1, 10), sun_aperture=20.0, albedo=r.uniform(0, 1)
            ),
            "area": lambda: Plugin(
                "shape",
                r.choice(["rectangle", "disk", "sphere"]),
                to_world=Transform([("scale", {"value": 0.6}), *down]),
                emitter=Plugin("emitter", "area", radiance=r.choice([self.light, self.bright])()),
            ),
        }
        kind = r.choice(list(kinds))
        return kind, kinds[kind]()

    def bright(self) -> Plugin:
        """A texture of radiance."""
        filters = self.r.choice(["nearest", "bilinear"])
        return Plugin("texture", "bitmap", raw=True, filename=self.picture(4, 3, 0, 15), filter_type=filters)

    def light(self) -> Any:
        return self.r.choice([lambda: Rgb(self.r.uniform(1, 10) for _ in range(3)), lambda: self.r.uniform(1, 10)])()

    # Cameras

    def sensor(self, size: int) -> Plugin:
        r = self.r
        kind = r.choice(["perspective", "thinlens", "orthographic", "batch"])
        view = {"origin": [r.uniform(-4, 4), r.uniform(-4, -3), r.uniform(0.5, 3)], "target": [0, 0, -0.2], "up": "0, 0, 1"}
        parts: list[Any] = [("lookat", view)]
        more: dict[str, Any] = {"fov": r.uniform(25, 45), "fov_axis": r.choice(["x", "y", "smaller", "larger", "diagonal"])}
        if kind == "thinlens":
            more |= {"aperture_radius": r.uniform(0.05, 0.2), "focus_distance": r.uniform(3, 5)}
        if kind == "orthographic":
            parts, more = [("scale", {"x": 1.8, "y": 1.8}), *parts], {}
        if kind == "perspective" and r.random() < 0.3:
            more |= {f"principal_point_offset_{axis}": r.uniform(-0.2, 0.2) for axis in "xy"}
        rfilter = r.choice(["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"])
        sides = {"width": size, "height": size}
        if r.random() < 0.3:
            sides = {"width": 2 * size, "height": 2 * size, "crop_width": size, "crop_height": size}
            sides |= {f"crop_offset_{axis}": r.randrange(size // 4, 3 * size // 4) for axis in "xy"}
        film = Plugin("film", "hdrfilm", sample_border=True, pixel_format="rgb", rfilter=Plugin("rfilter", rfilter), **sides)
        if kind == "batch":
            cameras = {f"_{k}": Plugin("sensor", "perspective", to_world=Transform(parts), fov=r.uniform(25, 45)) for k in range(2)}
            # Wider filters would reach beyond the pixels of one camera into those of the other.
            box = Plugin("rfilter", "box")
            film = Plugin("film", "hdrfilm", width=size, height=size, pixel_format="rgb", rfilter=box)
            return Plugin("sensor", kind, film=film, **cameras)
        return Plugin("sensor", kind, to_world=Transform(parts), film=film, **more)


def compared(theirs: np.ndarray, ours: np.ndarray, tolerance: float) -> tuple[float, float, float]:
    """Returns the fraction by which the means differ, this difference in standard errors, and its
    root mean square over blocks."""
    share = ours.mean() / theirs.mean() - 1
    blocks = [means_of_blocks(image) for image in (theirs, ours)]
    whole = [image.mean(axis=(1, 2, 3)) for image in (theirs, ours)]
    return share, float(deviations(*whole, tolerance)), float(np.sqrt((deviations(*blocks, tolerance) ** 2).mean()))


def means_of_blocks(images: np.ndarray) -> np.ndarray:
    """Returns means over BLOCKS × BLOCKS parts of each image; remaining rows and columns do not
    count."""
    height, width = (size // BLOCKS for size in images.shape[1:3])
    whole = images[:, : height * BLOCKS, : width * BLOCKS]
    return whole.reshape(len(images), BLOCKS, height, BLOCKS, width, 3).mean(axis=(2, 4, 5))


def deviations(theirs: np.ndarray, ours: np.ndarray, tolerance: float) -> np.ndarray:
    """Returns differences of means over runs, in standard errors, beyond a fraction of the mean."""
    difference = ours.mean(axis=0) - theirs.mean(axis=0)
    variances = [image.var(axis=0, ddof=1) / len(image) for image in (theirs, ours)]
    # Nearly dark blocks have little weight.
    error = np.sqrt(variances[0] + variances[1]) + DARK * np.abs(theirs.mean())
    excess = np.maximum(np.abs(difference) - tolerance * np.abs(theirs.mean(axis=0)), 0)
    return np.sign(difference) * excess / error


def render(path: pathlib.Path, args: argparse.Namespace) -> tuple[np.ndarray, np.ndarray]:
    """Renders images of several seeds, by Mitsuba and by morgana."""
    import mitsuba

    scene = mitsuba.load_file(str(path))
    seeds = range(1, args.runs + 1)
    theirs = [np.array(mitsuba.render(scene, spp=args.spp, seed=seed)) for seed in seeds]
    ours = []
    for seed in seeds:
        image = path.with_name("image.npy")
        command = [args.exe, "render", path, "--quiet", "-o", image, "--spp", str(args.spp), "--seed", str(seed)]
        subprocess.run(command, check=True, capture_output=True, text=True)
        ours.append(np.load(image)[..., :3])
    return np.array(theirs, float)[..., :3], np.array(ours, float)


def known(parts: dict[str, str]) -> str | None:
    """Returns the reason why the images of a scene may differ, if there is one."""
    names = parts["bsdf"].split("/")
    if parts["emitter"] in DELTA_EMITTERS and "dielectric" in names:
        return "caustic"
    if names[0] == "blendbsdf" and MIRRORS & set(names):
        return "blendbsdf"
    if parts["emitter"].endswith("/sphere/bitmap"):
        return "textured sphere"
    if parts["shape"] in ("bsplinecurve", "linearcurve") and (PARTIAL | {"bitmap", "checkerboard"}) & set(names):
        return "curves"
    if "principledthin" in names:
        return "principledthin"
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=40, help="scenes")
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--exe", type=pathlib.Path, default=ROOT / "target" / "release" / "morgana", help="the program morgana")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel of a run")
    parser.add_argument("--runs", type=int, default=12, help="seeds")
    parser.add_argument("--size", type=int, default=16, help="pixels of a side, a multiple of 4")
    parser.add_argument("--tolerance", type=float, default=0.01, help="share by which means may differ")
    parser.add_argument("--variant", default="scalar_rgb", help="of Mitsuba")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("random_mitsuba_scenes"), help="for scenes that differ")
    args = parser.parse_args()
    if args.runs < 2 or args.size % BLOCKS:
        parser.error(f"errors need two runs, and blocks a size that is a multiple of {BLOCKS}")
    import mitsuba

    mitsuba.set_variant(args.variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    print("| scene | shape | bsdf | emitter | sensor | morgana/Mitsuba − 1 | z | block rms | |\n|---|---|---|---|---|---|---|---|---|")
    differing = 0
    for number in range(args.seed, args.seed + args.count):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.xml"
            root, parts = Generator(str(number), path.parent).scene(args.size)
            ElementTree.indent(root)
            ElementTree.ElementTree(root).write(path)
            row = f"| {number} | " + " | ".join(parts.values())
            try:
                share, z, rms = compared(*render(path, args), args.tolerance)
                verdict = "" if abs(z) <= LIMIT and rms <= ROUGH else known(parts) or "differ"
                print(f"{row} | {100 * share:+.2f} % | {z:.1f} | {rms:.2f} | {verdict} |", flush=True)
            except (RuntimeError, subprocess.CalledProcessError) as problem:
                verdict, text = "failed", getattr(problem, "stderr", None) or str(problem)
                print(f"{row} | | | | failed: {' '.join(text.split())[:400]} |", flush=True)
            if verdict in ("differ", "failed"):
                differing += 1
                kept = args.out / str(number)
                kept.mkdir(parents=True, exist_ok=True)
                for file in path.parent.iterdir():
                    (kept / file.name).write_bytes(file.read_bytes())
    if differing:
        sys.exit(f"{differing} of {args.count} scenes differ: see {args.out}")


if __name__ == "__main__":
    main()
