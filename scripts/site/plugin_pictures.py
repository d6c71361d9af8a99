"""Images of the plugin reference: captions, scenes, and the script that renders them.

The parts of the scenes are in `plugin_scenes`.

python3 scripts/site/plugin_pictures.py [KIND-NAME ...]    all pictures, or some; needs NumPy and Pillow

The program is the one that the variable MORGANA names, or the development build; MORGANA_THREADS
limits its threads. All images take about 45 minutes of processor time, and are written to
docs/images/plugins/ with 256 colours each.
"""

import json
import math
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import program
from plugin_scenes import (
    BLUE,
    CREAM,
    GREEN,
    HEIGHT,
    ORIGIN,
    RED,
    SAMPLED,
    STUDIO,
    TARGET,
    WIDTH,
    Plugin,
    ball,
    bumps,
    camera,
    caustic,
    clouds,
    coated,
    copies,
    diffuse,
    dusk,
    filters,
    floor,
    fog_ball,
    fur,
    furry,
    in_studio,
    index_ball,
    invisible_hull,
    layers,
    leaning,
    lit,
    lookat,
    luminaire,
    normals,
    of_voxels,
    open_tube,
    pane,
    puff,
    refracting_ball,
    relief,
    ring,
    ring_of_distances,
    row_of,
    scattered,
    scene,
    shaded_ring,
    sheet,
    slide,
    solid,
    star,
    surface,
    turned,
    upright,
    window,
    with_caustics,
)

FOLDER = program.ROOT / "docs/images/plugins"
COLOURS = 256


# Bsdfs.

BSDFS = {
    "bsdf-circular": (
        "A right-handed and a left-handed circular polariser in front of a matt ball: where they overlap, they block the light",
        lambda: filters(({"type": "circular"}, 0.55, -0.35), ({"type": "circular", "left_handed": True}, 0.55, 0.35)),
    ),
    "bsdf-polarizer": (
        "Two crossed polarisers in front of a matt ball: where they overlap, they block the light",
        lambda: filters(({"type": "polarizer"}, 0.55, -0.35), ({"type": "polarizer", "theta": 90}, 0.55, 0.35)),
    ),
    "bsdf-retarder": (
        "A small quarter-wave plate between crossed polarisers: the light behind it passes",
        lambda: filters(
            ({"type": "polarizer"}, 0.62, 0), ({"type": "retarder", "theta": 45, "delta": 90}, 0.25, 0), ({"type": "polarizer", "theta": 90}, 0.62, 0)
        ),
    ),
    "bsdf-normalmap": (
        "A matt ball with a map of normals: its outline stays round",
        lambda: surface(
            {
                "type": "normalmap",
                "normalmap": {"type": "bitmap", "data": normals(), "raw": True, "to_uv": [{"scale": [6, 3, 1]}]},
                "bsdf": diffuse(CREAM),
            }
        ),
    ),
    "bsdf-pplastic": (
        "A blue ball with a rough coat, alpha = 0.1",
        lambda: surface({"type": "pplastic", "diffuse_reflectance": BLUE, "alpha": 0.1}),
    ),
    "bsdf-principledthin": (
        "A thin sheet before a light: it shows the shadow of a bar behind it",
        lambda: sheet({"type": "principledthin", "base_color": CREAM, "roughness": 0.4, "diff_trans": 1.4}),
    ),
    "bsdf-bumpmap": (
        "A matt ball with bumps: its outline stays round",
        lambda: surface(
            {
                "type": "bumpmap",
                "scale": 0.05,
                "texture": {"type": "bitmap", "data": relief(), "raw": True, "to_uv": [{"scale": [6, 3, 1]}]},
                "bsdf": diffuse(CREAM),
            }
        ),
    ),
    "bsdf-mixturebsdf": (
        "A ball of 70 % matt red and 30 % rough gold",
        lambda: surface(
            {
                "type": "mixturebsdf",
                "weights": "0.7, 0.3",
                "first": diffuse(RED),
                "second": {"type": "roughconductor", "material": "Au", "alpha": 0.2},
            }
        ),
    ),
    "bsdf-roughcoating": (
        "A matt ball under a rough layer, alpha = 0.1",
        lambda: surface({"type": "roughcoating", "alpha": 0.1, "int_ior": 1.5, "bsdf": diffuse(CREAM)}),
    ),
    "bsdf-ward": (
        "A ball with a highlight that is longer across: alpha_u = 0.08, alpha_v = 0.3",
        lambda: surface({"type": "ward", "diffuse_reflectance": BLUE, "specular_reflectance": 0.3, "alpha_u": 0.08, "alpha_v": 0.3}),
    ),
    "bsdf-blendbsdf": (
        "A ball of red plastic and rough gold in alternate fields",
        lambda: coated(
            {
                "type": "blendbsdf",
                "weight": {"type": "checkerboard", "color0": 0, "color1": 1, "to_uv": [{"scale": [6, 2, 1]}]},
                "first": {"type": "plastic", "diffuse_reflectance": RED},
                "second": {"type": "roughconductor", "material": "Au", "alpha": 0.15},
            }
        ),
    ),
    "bsdf-coating": (
        "A ball of rough gold under a tinted layer",
        lambda: coated(
            {
                "type": "coating",
                "int_ior": 1.5,
                "sigma_a": {"type": "rgb", "value": [0.05, 0.4, 0.5]},
                "base": {"type": "roughconductor", "material": "Au", "alpha": 0.3},
            }
        ),
    ),
    "bsdf-conductor": ("A ball of gold", lambda: with_caustics(ball=ball({"type": "conductor", "material": "Au"}))),
    "bsdf-dielectric": ("A ball of glass", lambda: with_caustics(ball=ball({"type": "dielectric", "int_ior": "bk7"}))),
    "bsdf-diffuse": ("A matt red ball", lambda: surface(diffuse(RED))),
    "bsdf-mask": (
        "A ball with holes: opacity is 0 or 1 in alternate fields",
        lambda: surface(
            {
                "type": "mask",
                "opacity": {"type": "checkerboard", "color0": 0, "color1": 1, "to_uv": [{"scale": [8, 4, 1]}]},
                "bsdf": {"type": "twosided", "bsdf": diffuse(CREAM)},
            }
        ),
    ),
    "bsdf-null": ("A ball of fog: the boundary itself is invisible", invisible_hull),
    "bsdf-phong": (
        "A blue ball with a glossy lobe",
        lambda: surface({"type": "phong", "exponent": 40, "diffuse_reflectance": BLUE, "specular_reflectance": 0.3}),
    ),
    "bsdf-plastic": (
        "A blue plastic ball: the coat reflects the windows",
        lambda: coated({"type": "plastic", "diffuse_reflectance": BLUE}),
    ),
    "bsdf-principled": (
        "A ball with metallic = 0.6 and roughness = 0.35",
        lambda: surface({"type": "principled", "base_color": CREAM, "metallic": 0.6, "roughness": 0.35}),
    ),
    "bsdf-roughconductor": (
        "A ball of rough copper, alpha = 0.2",
        lambda: surface({"type": "roughconductor", "material": "Cu", "alpha": 0.2, "distribution": "ggx"}),
    ),
    "bsdf-roughdielectric": (
        "A ball of frosted glass, alpha = 0.15",
        lambda: with_caustics(ball=ball({"type": "roughdielectric", "int_ior": "bk7", "alpha": 0.15, "distribution": "ggx"})),
    ),
    "bsdf-roughdiffuse": (
        "A ball of clay: rough, it looks flat",
        lambda: surface({"type": "roughdiffuse", "alpha": 0.9, "reflectance": CREAM}),
    ),
    "bsdf-roughplastic": (
        "A blue ball with a rough coat, alpha = 0.15",
        lambda: surface({"type": "roughplastic", "diffuse_reflectance": BLUE, "alpha": 0.15}),
    ),
    "bsdf-thindielectric": ("A tinted pane in front of a ball: it reflects a globe of light and bends no rays", pane),
    "bsdf-twosided": ("A tube: blue outside, cream inside", open_tube),
}


# Phase functions.

CAUGHT = "A beam from the left hits a small ball of fog; the bowl around it shows the directions of the scattered light"
PHASES = {
    "phase-blendphase": (
        f"{CAUGHT}: four fifths Rayleigh scattering, one fifth hg with g = 0.8",
        lambda: scattered({"type": "blendphase", "weight": 0.2, "first": {"type": "rayleigh"}, "second": {"type": "hg", "g": 0.8}}),
    ),
    "phase-hg": (f"{CAUGHT}: g = 0.5, mostly forwards", lambda: scattered({"type": "hg", "g": 0.5})),
    "phase-isotropic": (f"{CAUGHT}: all directions are equal", lambda: scattered({"type": "isotropic"})),
    "phase-mie": (
        f"{CAUGHT}: polystyrene spheres of 0.6 µm in water, in green light, mostly forwards, with lobes",
        lambda: scattered({"type": "mie", "radius": 0.3, "eta": 1.6, "ext_eta": 1.335, "wavelength": 550}),
    ),
    "phase-mixturephase": (
        f"{CAUGHT}: 60 % hg with g = 0.8, 40 % isotropic",
        lambda: scattered(
            {"type": "mixturephase", "weights": "0.6, 0.4", "first": {"type": "hg", "g": 0.8}, "second": {"type": "isotropic"}}
        ),
    ),
    "phase-rayleigh": (f"{CAUGHT}: more forwards and backwards than to the sides", lambda: scattered({"type": "rayleigh"})),
    "phase-sggx": (
        f"{CAUGHT}: plates that lie across the beam reflect it back and to the sides",
        lambda: scattered({"type": "sggx", "S": [1, 0.1, 0.1, 0, 0, 0]}),
    ),
    "phase-tabphase": (
        f"{CAUGHT}: a table with several maxima",
        lambda: scattered({"type": "tabphase", "values": "2, 0.2, 1, 0.2, 1, 0.2, 1, 0.2, 2"}),
    ),
    "phase-vmf": (f"{CAUGHT}: kappa = 3, mostly forwards", lambda: scattered({"type": "vmf", "kappa": 3})),
}


# Emitters.


def emitters(folder: Path) -> dict[str, tuple[str, Any]]:
    """Returns the images of emitters; their files go to a folder."""
    fill = {"type": "constant", "radiance": 0.04}
    down = lookat([0, 2.6, 0.4], [0, 0, -0.2], [0, 0, 1])
    return {
        "emitter-area": (
            "A square light above two solids: soft shadows",
            lambda: lit({"light": window([-1.4, 3, 1.6], 16, 0.7, [0, 0.3, 0])}),
        ),
        "emitter-collimated": (
            "A beam in haze that hits a ball",
            lambda: lit(
                {
                    "beam": {
                        "type": "collimated",
                        "radius": 0.1,
                        "irradiance": 170,
                        "to_world": lookat([-2.2, 1.7, 1.7], [0.75, 0.55, 0.1]),
                    },
                    "fill": {"type": "constant", "radiance": 0.1},
                },
                0.15,
            ),
        ),
        "emitter-constant": (
            "Light from all directions: shadows only near the floor",
            lambda: lit({"sky": {"type": "constant", "radiance": 0.9}}),
        ),
        "emitter-directional": (
            "Sunlight: sharp, parallel shadows",
            lambda: lit({"sun": {"type": "directional", "direction": [0.6, -0.75, -0.55], "irradiance": 3}, "fill": fill}),
        ),
        "emitter-directionalarea": (
            "A square that sends its light along its normal: a square of light with sharp shadows",
            lambda: lit(
                {
                    "panel": {
                        "type": "rectangle",
                        "to_world": [{"scale": [0.7, 0.7, 1]}, *lookat([-1.4, 3, 1.6], [0, 0.3, 0])],
                        "emitter": {"type": "directionalarea", "radiance": 4},
                    },
                    "fill": fill,
                }
            ),
        ),
        "emitter-envmap": (
            "A mirror ball under an image of a sunset",
            lambda: scene(
                {"sky": {"type": "envmap", "filename": dusk(folder), "scale": 1.6}, "floor": floor(), "ball": ball({"type": "conductor"})},
                256,
            ),
        ),
        "emitter-fiber": (
            "The end of a fibre in haze: its light widens from the aperture on",
            lambda: lit(
                {
                    "fibre": {
                        "type": "fiber",
                        "radius": 0.12,
                        "cutoff_angle": 12,
                        "power": 22,
                        "to_world": lookat([-2.0, 2.1, 1.5], [0.6, 0.5, 0.1]),
                    },
                    "fill": {"type": "constant", "radiance": 0.1},
                },
                0.15,
            ),
        ),
        "emitter-ies": (
            "A luminaire whose file describes a bright ring",
            lambda: lit({"light": {"type": "ies", "filename": luminaire(folder), "scale": 0.02, "to_world": down}, "fill": fill}),
        ),
        "emitter-sunsky": (
            "An afternoon under a clear sky",
            lambda: scene(
                {
                    "sky": {
                        "type": "sunsky",
                        "turbidity": 3,
                        "sun_direction": [-0.8, 0.6, 0.3],
                        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}],
                        "sun_scale": 3.5,
                        "sky_scale": 3.5,
                    },
                    "floor": floor(),
                    "ball": ball({"type": "conductor"}, 0.8, 0.8, -0.8),
                    "other": ball(diffuse(CREAM), 0.7, -0.7, 0.3),
                },
                128,
            ),
        ),
        "emitter-point": (
            "A point light between two solids: sharp shadows",
            lambda: lit({"light": {"type": "point", "position": [-0.2, 1.5, 0.9], "intensity": 4}, "fill": fill}),
        ),
        "emitter-projector": (
            "An image projected on a wall",
            lambda: scene(
                {
                    "wall": {"type": "rectangle", "to_world": [{"scale": [20, 20, 1]}, {"translate": [0, 0, -2.2]}], "bsdf": diffuse(0.6)},
                    "floor": floor(diffuse(0.6)),
                    "light": {
                        "type": "projector",
                        "irradiance": {"type": "bitmap", "filename": slide(folder), "filter_type": "nearest"},
                        "scale": 36,
                        "fov": 23,
                        "to_world": lookat([0, 0.95, 3], [0, 0.95, -2.2]),
                    },
                    "fill": fill,
                },
                256,
            ),
        ),
        "emitter-spot": (
            "Two cones of light in haze",
            lambda: lit(
                {
                    "left": {"type": "spot", "intensity": 40, "cutoff_angle": 16, "to_world": lookat([-1.6, 2.6, 0.4], [-0.8, 0, -0.2])},
                    "right": {
                        "type": "spot",
                        "intensity": {"type": "rgb", "value": [40, 26, 13]},
                        "cutoff_angle": 16,
                        "to_world": lookat([1.6, 2.6, 0.4], [0.6, 0, -0.2]),
                    },
                },
                0.12,
            ),
        ),
        "emitter-volumelight": (
            "A thin box that glows above two solids",
            lambda: lit(
                {
                    "glow": {
                        "type": "volumelight",
                        "power": 40,
                        "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": [0.12, 1.3, 0.12]}, {"translate": [-0.1, 1.15, 0.9]}],
                    },
                    "fill": fill,
                },
                integrator="bdpt",
            ),
        ),
    }


# Shapes and textures.


def curves(folder: Path) -> dict[str, tuple[str, Any]]:
    """Returns the images of curves; their files go to a folder."""

    def helix(turns: float, radius: float, count: int = 60) -> list[str]:
        rows = []
        for i in range(count):
            angle, height = 2 * math.pi * turns * i / (count - 1), 0.15 + 1.4 * i / (count - 1)
            rows.append(f"{0.6 * math.cos(angle):.4f} {height:.4f} {0.6 * math.sin(angle):.4f} {radius}")
        return rows

    def shown(plugin: str, name: str, rows: list[str], bsdf: Plugin, **more: Any) -> Plugin:
        (folder / name).write_text("\n".join(rows) + "\n")
        return in_studio(curve={"type": plugin, "filename": str(folder / name), **more, "bsdf": {"type": "twosided", "bsdf": bsdf}})

    return {
        "shape-bsplinecurve": ("A tube along a spiral", lambda: shown("bsplinecurve", "spiral.txt", helix(3, 0.07), diffuse(BLUE))),
        "shape-linearcurve": ("A tube along straight parts", lambda: shown("linearcurve", "zigzag.txt", helix(3, 0.07, 16), diffuse(BLUE))),
        "shape-hair": (
            "A ball with 1500 strands",
            lambda: furry(fur(folder)),
        ),
    }


SHAPES = {
    "shape-sdfgrid": (
        "A ring, from 40 × 40 × 40 distances",
        lambda: leaning({"type": "sdfgrid", "grid": ring_of_distances()}),
    ),
    "shape-cube": (
        "A cube",
        lambda: solid({"type": "cube", "to_world": [{"scale": 0.6}, *turned(32, {"translate": [0, 0.6, 0]})]}),
    ),
    "shape-cylinder": (
        "A cylinder with caps",
        lambda: solid({"type": "cylinder", "p0": [-0.75, 0.55, 0.45], "p1": [0.75, 0.55, -0.35], "radius": 0.55, "capped": True}),
    ),
    "shape-disk": ("A disk", lambda: upright("disk", 0.85)),
    "shape-instance": ("Seven instances of one group: a ball on a cylinder", copies),
    "shape-labels": (
        "Balls of voxels: left by their faces, right with a smooth surface",
        lambda: scene({**STUDIO, "faces": of_voxels("voxels", -0.85), "smooth": of_voxels("smooth", 0.85)}, 256),
    ),
    "shape-mesh": ("A torus of 2304 triangles", lambda: in_studio(ring=ring(diffuse(GREEN)))),
    "shape-rectangle": ("A rectangle", lambda: upright("rectangle", 0.75)),
    "shape-sphere": ("A sphere", lambda: solid({"type": "sphere", "radius": 0.85, "center": [0, 0.85, 0]})),
}


def textures(folder: Path) -> dict[str, tuple[str, Any]]:
    """Returns the images of textures; their files go to a folder."""

    def board(texture: Plugin) -> Plugin:
        placed = [{"scale": [1.05, 0.79, 1]}, *turned(-20, {"translate": [0, 0.8, 0]})]
        return in_studio(board={"type": "rectangle", "to_world": placed, "bsdf": diffuse(texture)})

    return {
        "texture-bitmap": (
            "An image on a rectangle",
            lambda: board({"type": "bitmap", "filename": slide(folder), "to_uv": [{"scale": [1, -1, 1]}]}),
        ),
        "texture-checkerboard": (
            "A checkerboard on a rectangle, scaled by 4 with to_uv",
            lambda: board({"type": "checkerboard", "color0": BLUE, "color1": CREAM, "to_uv": [{"scale": [4, 4, 1]}]}),
        ),
        "texture-scale": (
            "An image times (1, 0.6, 0.3)",
            lambda: board(
                {
                    "type": "scale",
                    "scale": {"type": "rgb", "value": [1, 0.6, 0.3]},
                    "texture": {"type": "bitmap", "filename": slide(folder), "to_uv": [{"scale": [1, -1, 1]}]},
                }
            ),
        ),
        "texture-volume": (
            "A ball cut out of a volume of tilted layers",
            lambda: surface(
                diffuse(
                    {
                        "type": "volume",
                        "volume": {
                            "type": "gridvolume",
                            "data": layers(),
                            "raw": True,
                            "to_world": [{"translate": [-0.5, 0, -0.5]}, {"scale": 1.9}],
                        },
                    }
                )
            ),
        ),
        "texture-mesh_attribute": ("A torus with colours stored at its vertices", shaded_ring),
    }


# Indices.

BEFORE = "A checkerboard seen through a ball of this index"
VOLUMES = {
    "volume-cauchy": (
        f"{BEFORE}, with a refracting surface: n = 1.35 + 0.05 µm²/λ²",
        lambda: refracting_ball({"type": "cauchy", "a": 1.35, "b": 0.05}, pixel_format="spectral", wavelengths=list(range(430, 680, 20))),
    ),
    "volume-transducer": (
        f"{BEFORE}: a wave of sound from the left that converges to the middle",
        lambda: index_ball(
            {
                "type": "transducer",
                "aperture": "bowl",
                "radius": 3,
                "diameter": 3.6,
                "origin": [-3, 0, 0],
                "direction": [1, 0, 0],
                "pressure": 1.5e4,
                "frequency": 1e6,
                "sound_speed": 4e5,
                "n0": 1,
                "dn_dp": 1e-7,
                "min": [-0.95, -0.95, -0.95],
                "max": [0.95, 0.95, 0.95],
            }
        ),
    ),
    "volume-bspline": (
        f"{BEFORE}: 32 × 32 × 32 samples of two bumps",
        lambda: index_ball({"type": "bspline", "data": bumps(1, 0.12), **SAMPLED}),
    ),
    "volume-expression": (
        f"{BEFORE}: ripples around the z axis",
        lambda: index_ball({"type": "expression", "n": "1 + a*cos(k*rho^2)", "a": 0.02, "k": 20}),
    ),
    "volume-gladstone_dale": (
        f"{BEFORE}: a gas of up to 500 times the density of air, and none",
        lambda: index_ball({"type": "gladstone_dale", "data": bumps(300, 290), "wavelength": 550, **SAMPLED}),
    ),
    "volume-linear_square": (
        f"{BEFORE}: slope 0.3 to the right",
        lambda: index_ball({"type": "linear_square", "n0": 1.0, "slope": [0.3, 0, 0]}),
    ),
    "volume-mode": (
        f"{BEFORE}: a mode of order 3",
        lambda: index_ball({"type": "acoustic", "n0": 1, "wave": {"type": "mode", "amplitude": 0.04, "order": 3, "wave_number": 10}}),
    ),
    "volume-pressure": (
        f"{BEFORE}: a liquid under pressure on the right, under tension on the left",
        lambda: index_ball({"type": "pressure", "data": bumps(0, 4e8), "n0": 1, "dn_dp": 1.46e-10, **SAMPLED}),
    ),
    "volume-profile": (
        f"{BEFORE}: rings of a table over the radius",
        lambda: index_ball({"type": "profile", "coordinate": "r", "table": "0, 1.1, 0.3, 1.02, 0.5, 1.08, 0.7, 1.01, 1, 1"}),
    ),
    "volume-acoustic": (
        f"{BEFORE}: rings of a standing wave",
        lambda: index_ball({"type": "acoustic", "n0": 1, "wave": {"type": "mode", "amplitude": 0.012, "wave_number": 14}}),
    ),
    "volume-fisheye": (f"{BEFORE}: n0 = 1.5", lambda: index_ball({"type": "fisheye", "n0": 1.5, "radius": 1.273})),
    "volume-gaussian": (
        f"{BEFORE}: delta = 0.15, width = 0.3",
        lambda: index_ball({"type": "gaussian", "n0": 1, "delta": 0.15, "width": 0.3}),
    ),
    "volume-linear": (f"{BEFORE}: slope 0.15 to the right", lambda: index_ball({"type": "linear", "n0": 1.0, "slope": [0.15, 0, 0]})),
    "volume-luneburg": (f"{BEFORE}", lambda: index_ball({"type": "luneburg", "radius": 0.9})),
    "volume-selfoc": (
        f"{BEFORE}: alpha = 0.35, axis to the right",
        lambda: index_ball({"type": "selfoc", "n0": 1, "alpha": 0.35, "direction": [1, 0, 0]}),
    ),
    "volume-sum": (
        f"{BEFORE}: two Gaussians, delta = 0.12 on the left and −0.12 on the right",
        lambda: index_ball(
            {
                "type": "sum",
                "left": {"type": "gaussian", "n0": 1, "delta": 0.12, "width": 0.2, "center": [-0.35, 0, 0]},
                "right": {"type": "gaussian", "n0": 1, "delta": -0.12, "width": 0.2, "center": [0.35, 0, 0]},
            }
        ),
    ),
}


# Integrators and sensors.

UNDER = "A glass ball under a small light"
INTEGRATORS = {
    "integrator-bdpt": (f"{UNDER}, 48 samples per pixel", lambda: caustic({"type": "bdpt"}, 48)),
    "integrator-direct": (
        f"{UNDER}: the ball reflects the lights, and refracted light is missing",
        lambda: caustic({"type": "direct"}, 96),
    ),
    "integrator-particle": (
        f"{UNDER}, 96 particles per pixel: reflections in the ball are missing",
        lambda: caustic({"type": "particle"}, 96),
    ),
    "integrator-path": (f"{UNDER}, 96 samples per pixel: the caustic is noisy", lambda: caustic({"type": "path"}, 96)),
    "integrator-photon": (f"{UNDER}, 64 photon maps", lambda: caustic({"type": "photon"}, 64)),
    "integrator-preview": (f"{UNDER}, 400 photon maps", lambda: caustic({"type": "preview"}, 400)),
    "integrator-sppm": (f"{UNDER}, 64 photon maps", lambda: caustic({"type": "sppm"}, 64)),
    "integrator-vcm": (f"{UNDER}, 48 samples per pixel", lambda: caustic({"type": "vcm"}, 48)),
}
SENSORS = {
    "sensor-orthographic": (
        "Five balls in a row: all appear equally large",
        lambda: row_of({"type": "orthographic", "to_world": [{"scale": [2.4, 2.4, 1]}, *lookat(ORIGIN, TARGET)]}),
    ),
    "sensor-perspective": ("Five balls in a row", lambda: row_of(camera(ORIGIN, TARGET, 34))),
    "sensor-telecentric": (
        "Five balls in a row: all appear equally large, and the third is in focus",
        lambda: row_of(
            {"type": "telecentric", "acceptance_angle": 1.5, "focus_distance": 7.6, "to_world": [{"scale": [2.4, 2.4, 1]}, *lookat(ORIGIN, TARGET)]}
        ),
    ),
    "sensor-thinlens": (
        "Five balls in a row: the third is in focus",
        lambda: row_of(camera(ORIGIN, TARGET, 34, type="thinlens", aperture_radius=0.25, focus_distance=7.6)),
    ),
}
MEDIA = {
    "medium-heterogeneous": (
        "Two clouds, from 24 × 24 × 24 samples",
        lambda: clouds(
            {
                "type": "heterogeneous",
                "sigma_t": {"type": "gridvolume", "data": puff(), "to_world": [{"translate": [-0.5, 0, -0.5]}, {"scale": 1.8}]},
                "albedo": 0.95,
            }
        ),
    ),
    "medium-transparent": (
        "A checkerboard seen through a ball of water",
        lambda: refracting_ball(1.333),
    ),
    "medium-homogeneous": (
        "A ball of coloured fog: g = 0.4",
        lambda: fog_ball({"type": "homogeneous", "sigma_t": 2, "albedo": CREAM, "phase": {"type": "hg", "g": 0.4}}),
    ),
}


SEEN = "A star of 24 rays on 40 × 30 pixels"
FILTERS = {
    "rfilter-box": (f"{SEEN}: jagged edges", lambda: star({"type": "box"})),
    "rfilter-tent": (f"{SEEN}: smooth edges", lambda: star({"type": "tent"})),
    "rfilter-gaussian": (f"{SEEN}: smooth, soft edges", lambda: star({"type": "gaussian"})),
    "rfilter-mitchell": (f"{SEEN}: edges sharper than by a Gaussian", lambda: star({"type": "mitchell"})),
    "rfilter-catmullrom": (f"{SEEN}: sharp edges", lambda: star({"type": "catmullrom"})),
    "rfilter-lanczos": (f"{SEEN}: the sharpest edges", lambda: star({"type": "lanczos"})),
}


def pictures(folder: Path) -> dict[str, tuple[str, Any]]:
    """Returns all images: caption, and function that makes the scene. Files that scenes need go to
    a folder."""
    made = [BSDFS, PHASES, emitters(folder), SHAPES, curves(folder), textures(folder), VOLUMES, MEDIA, INTEGRATORS, SENSORS, FILTERS]
    return {name: entry for group in made for name, entry in group.items()}


def caption(name: str) -> str | None:
    """Returns the caption of the image of a plugin, as KIND-NAME; `None` if there is none."""
    entry = pictures(Path()).get(name)
    return entry[0] if entry else None


def orphans(plugins: set[str]) -> list[str]:
    """Returns images without a plugin or a scene, and scenes without an image."""
    stored = {path.stem for path in FOLDER.glob("*")}
    made = set(pictures(Path()))
    return sorted((stored - made) | (made - stored) | (stored - plugins))


def render(name: str, make: Any, folder: Path) -> int:
    """Renders an image. Returns its size in bytes."""
    from PIL import Image

    source, raw = folder / f"{name}.json", folder / f"{name}.png"
    source.write_text(json.dumps(make()))
    program.output("render", str(source), "--quiet", "--threads", os.environ.get("MORGANA_THREADS", "2"), "--exposure", "0", "-o", str(raw))
    image = Image.open(raw).convert("RGB").resize((WIDTH, HEIGHT), Image.Resampling.NEAREST)
    image = image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    image.save(FOLDER / f"{name}.png", optimize=True)
    return (FOLDER / f"{name}.png").stat().st_size


def main() -> None:
    """Renders the images that the arguments name, or all."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        known = pictures(folder)
        for name in sys.argv[1:] or known:
            print(f"{name}: {render(name, known[name][1], folder)} bytes", flush=True)


if __name__ == "__main__":
    main()
