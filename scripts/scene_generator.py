"""Random scenes for random_scenes.py, as dictionaries for morgana.load_dict.

A scene has up to four lights and up to six shapes of random surfaces (some textured, some instances
of a group). Some shapes contain scattering media whose extinction and index may vary, in closed
form or on a grid of single precision. Haze may surround everything. Transforms may be matrices
rounded to a few digits, as exporters write them. A camera sees the scene, whose film may separate
light by optical path length, or fluence meters measure it, which may have gates of the length.
"""

import math
import pathlib
import random
from typing import Any

import numpy as np

Scene = dict
DIGITS = (4, 6, 8)
# Half the side of the cube that grids fill, beyond all shapes and the haze.
REACH = 4.5


def make(number: int, folder: pathlib.Path) -> Scene:
    """Returns the scene of this number. Environment maps are written into the folder."""
    r = random.Random(number)
    made: Scene = {"type": "scene"}
    measured = r.random() < 0.2
    camera, reflections = _camera(r)
    if not measured:
        made["sensor"] = camera
    made["integrator"] = {"type": "path", "max_depth": r.choice([2, 3, 4, 6, 8]), "reflections": reflections}
    if r.random() < 0.5:
        made["floor"] = {
            "type": "rectangle",
            "to_world": [{"scale": 3}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"translate": [0, -1.3, 0]}],
            "bsdf": {"type": "diffuse", "reflectance": _reflectance(r)},
        }
    if measured or r.random() < 0.3:
        haze = _medium(r) | {"sigma_t": r.choice([0.1, 0.1, _grid_of_extinction(r, 0.05, 0.3)]), "ior": r.choice([1, 1, _index(r)])}
        made["room"] = {"type": "sphere", "radius": 4, "bsdf": {"type": "null"}, "interior": haze}
    made |= _shapes(r) | _lights(r, folder / f"random_environment_{number}.exr")
    if measured:
        made["meter"] = _meter(r)
    _round_transforms(r, made)
    return made


# Sensors


def _camera(r: random.Random) -> tuple:
    camera: Scene = {
        "type": r.choice(["perspective", "thinlens", "orthographic", "telecentric"]),
        "to_world": [{"lookat": {"origin": [0.3, 0.4, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 7, "height": 5, "rfilter": {"type": "box"}},
    }
    if camera["type"] == "thinlens":
        camera |= {"aperture_radius": 0.2, "focus_distance": 5.0}
    if camera["type"] == "telecentric":
        camera |= {"acceptance_angle": 2.0, "focus_distance": 5.0}
    if r.random() < 0.3:
        camera["film"] |= {"decomposition": "length", "min_bound": 3.0, "max_bound": 12.0, "bin_width": 3.0}
    parallel = camera["type"] in ("orthographic", "telecentric")
    if parallel:
        camera["to_world"].insert(0, {"scale": 1.5})
    # Connections of particles to parallel views find reflections too rarely for this number of
    # samples.
    return camera, 0 if parallel else r.choice([0, 1])


def _meter(r: random.Random) -> Scene:
    """Returns a meter of two by two by two cells in the middle of the scene."""
    meter = {"type": "fluencemeter", "nx": 2, "ny": 2, "nz": 2, "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2}]}
    return meter | r.choice([{}, {"min_bound": 0.0, "max_bound": 12.0, "bin_width": 4.0}])


# Lights


def _lights(r: random.Random, environment: pathlib.Path) -> Scene:
    made: Scene = {}
    for i in range(r.randint(1, 4)):
        light = _light(r)
        if light["type"] == "area":
            body = _shape(r)
            body.pop("interior", None)
            made[f"luminaire_{i}"] = body | {"bsdf": {"type": "diffuse", "reflectance": 0.5}, "emitter": light}
        elif light["type"] not in ("constant", "envmap"):
            made[f"light_{i}"] = light
        elif "light_sky" not in made:
            if light["type"] == "envmap":
                _write_environment(r, environment)
                light |= {"filename": str(environment), "to_world": [_turn(r)]}
            made["light_sky"] = light
    return made


def _light(r: random.Random) -> Scene:
    return r.choice(
        [
            {"type": "point", "position": [r.uniform(-2, 2), r.uniform(0, 2), r.uniform(-1, 3)], "intensity": 2},
            {"type": "constant", "radiance": 0.3},
            {"type": "envmap"},
            {"type": "directional", "direction": [r.uniform(-1, 1), -1, r.uniform(-1, 1)], "irradiance": 1},
            {"type": "directional", "to_world": _aimed(r), "irradiance": 1},
            {"type": "spot", "to_world": _aimed(r), "intensity": 5},
            {"type": "collimated", "to_world": _aimed(r), "radius": 0.3, "irradiance": 3},
            {"type": "area", "radiance": 2},
        ]
    )


def _aimed(r: random.Random) -> list:
    """Returns a transform from somewhere above towards the middle."""
    origin = [r.uniform(-1.5, 1.5), r.uniform(1, 2), r.uniform(-1, 2)]
    return [{"lookat": {"origin": origin, "target": _vector(r, -0.3, 0.3), "up": [0.1, 0.2, 1]}}]


def _write_environment(r: random.Random, path: pathlib.Path) -> None:
    """Writes a dim sky with a bright window."""
    import morgana

    image = np.full((8, 16, 3), 0.1, np.float32)
    row, column = r.randrange(6), r.randrange(13)
    image[row : row + 2, column : column + 3] = [3.0, 2.0, 1.0]
    morgana.write(path, image)


# Shapes and surfaces


def _shapes(r: random.Random) -> Scene:
    made: Scene = {f"shape_{i}": _shape(r) for i in range(r.randint(1, 6))}
    if r.random() < 0.2:
        # Keep copies separate, and within media: a group's shapes are small.
        member = _shape(r) | {"to_world": [{"scale": 0.3}, _turn(r)]}
        made["group"] = {"type": "shapegroup", "member": member}
        for i in range(r.randint(1, 3)):
            to_world = [_turn(r), {"scale": r.uniform(0.5, 1)}, {"translate": _vector(r, -1, 1)}]
            made[f"instance_{i}"] = {"type": "instance", "group": {"type": "ref", "id": "group"}, "to_world": to_world}
    return made


def _shape(r: random.Random) -> Scene:
    kind = r.choice(["sphere", "cube", "cylinder", "rectangle", "disk"])
    turn = {"rotate": {"axis": [1, 0.3, 0.1], "angle": r.uniform(0, 180)}}
    to_world = [{"scale": r.uniform(0.15, 0.6)}, turn, {"translate": _vector(r, -1, 1)}]
    made: Scene = {"type": kind, "to_world": to_world}
    # Only a shape that encloses a volume has an inside.
    if kind not in ("sphere", "cube") or r.random() < 0.3:
        return made | {"bsdf": _surface(r)}
    if r.random() < 0.4:
        return made | {"bsdf": {"type": "null"}, "interior": _medium(r) | r.choice([{}, {"ior": _index(r)}])}
    filled = {"interior": _medium(r) | {"ior": _index(r)}}
    return made | {"bsdf": _dielectric(r)} | r.choice([{}, filled])


def _dielectric(r: random.Random) -> Scene:
    return r.choice([{"type": "dielectric"}, {"type": "roughdielectric", "alpha": 0.4, "distribution": r.choice(["beckmann", "ggx"])}])


def _surface(r: random.Random) -> Scene:
    diffuse = {"type": "diffuse", "reflectance": _reflectance(r)}
    distribution = r.choice(["beckmann", "ggx"])
    return r.choice(
        [
            diffuse,
            {"type": "roughconductor", "alpha": 0.4, "distribution": distribution},
            {"type": "plastic"},
            {"type": "roughplastic", "alpha": 0.4, "distribution": distribution},
            {"type": "principled", "roughness": 0.4, "metallic": 0.3},
            {"type": "thindielectric"},
            {"type": "twosided", "bsdf": diffuse},
            {"type": "mask", "opacity": 0.5, "bsdf": diffuse},
            {"type": "blendbsdf", "weight": 0.3, "a": diffuse, "b": {"type": "roughconductor", "alpha": 0.4}},
        ]
    )


def _reflectance(r: random.Random) -> Any:
    board = {"type": "checkerboard", "color0": 0.1, "color1": 0.9, "to_uv": [{"scale": [r.randint(1, 4), r.randint(1, 4), 1]}]}
    return r.choice([0.2, 0.5, 0.8, board])


# Media


def _medium(r: random.Random) -> Scene:
    phase = r.choice([{"type": "hg", "g": -0.5}, {"type": "hg", "g": 0.3}, {"type": "hg", "g": 0.8}, {"type": "isotropic"}])
    albedo = r.choice([0.3, 0.9, 1.0, {"type": "rgb", "value": [0.9, 0.5, 0.2]}])
    sigma_t = r.choice([0.2, 1, 3, _grid_of_extinction(r, 0.2, 3)])
    return {"type": "homogeneous", "sigma_t": sigma_t, "albedo": albedo, "phase": phase}


def _index(r: random.Random) -> Any:
    return r.choice(
        [
            1.2,
            1.33,
            {"type": "linear", "n0": 1.2, "slope": [0, 0.1, 0.05]},
            {"type": "gaussian", "n0": 1.1, "delta": 0.1, "width": 0.7},
            {"type": "luneburg", "radius": 6.0},
            {"type": "selfoc", "n0": 1.3, "alpha": 0.2},
            {"type": "acoustic", "n0": 1.2, "amplitude": 0.01, "wave_number": 4},
            {"type": "bspline"} | _grid(_waves(r, 16, 1.2, 0.02)),
        ]
    )


def _grid_of_extinction(r: random.Random, low: float, high: float) -> Scene:
    return {"type": "gridvolume"} | _grid(_waves(r, 8, (low + high) / 2, (high - low) / 2))


def _grid(samples: np.ndarray) -> Scene:
    to_world = [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2 * REACH}]
    return {"data": samples.astype(np.float32), "placement": "nodes", "to_world": to_world}


def _waves(r: random.Random, size: int, mean: float, peak: float) -> np.ndarray:
    """Returns three waves of random directions, at most as long as the grid and at least six
    samples."""
    places = np.stack(np.meshgrid(*3 * [np.arange(size)], indexing="ij"), axis=-1)
    total = np.zeros(3 * [size])
    for _ in range(3):
        wave = np.array(_vector(r, -1, 1))
        wave *= 2 * math.pi / r.uniform(6, max(size, 7)) / np.linalg.norm(wave)
        total += np.cos(places @ wave + r.uniform(0, 2 * math.pi)) / 3
    return mean + peak * total


# Transforms


def _turn(r: random.Random) -> Scene:
    return {"rotate": {"axis": _vector(r, -1, 1), "angle": r.uniform(0, 360)}}


def _vector(r: random.Random, low: float, high: float) -> list:
    return [r.uniform(low, high) for _ in range(3)]


def _round_transforms(r: random.Random, made: Scene) -> None:
    """Converts some transforms to matrices, rounded to a few significant digits."""
    for key, value in made.items():
        if isinstance(value, dict):
            _round_transforms(r, value)
        elif key == "to_world" and r.random() < 0.3:
            made[key] = _rounded(_matrix(value), r.choice(DIGITS))


def _rounded(matrix: np.ndarray, digits: int) -> list:
    return [[float(f"{x:.{digits - 1}e}") for x in row] for row in matrix]


def _matrix(parts: list) -> np.ndarray:
    matrix = np.eye(4)
    for part in parts:
        (kind, value), *_ = part.items()
        matrix = PARTS[kind](value) @ matrix
    return matrix


def _scale(value: Any) -> np.ndarray:
    return np.diag([*np.broadcast_to(value, 3), 1.0])


def _translate(value: list) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = value
    return matrix


def _rotate(value: Scene) -> np.ndarray:
    """Rotates by Rodrigues' formula."""
    x, y, z = np.array(value["axis"]) / np.linalg.norm(value["axis"])
    angle = math.radians(value["angle"])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return matrix


def _look_at(value: Scene) -> np.ndarray:
    origin, target, up = (np.array(value[key], float) for key in ("origin", "target", "up"))
    forward = (target - origin) / np.linalg.norm(target - origin)
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3] = np.stack([left, np.cross(forward, left), forward, origin], axis=-1)
    return matrix


PARTS = {"scale": _scale, "translate": _translate, "rotate": _rotate, "lookat": _look_at}
