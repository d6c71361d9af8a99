#!/usr/bin/env python3
"""Renders random scenes by path, bdpt and particle, which must agree.

A scene has up to four lights, up to six shapes of random surfaces, some of which hold scattering media whose index may vary, and may have
haze around it all. The means of its images are compared. Where two differ by more than four standard errors, eight times as many
samples are taken with another seed, up to twice; if they still differ, the scene is written to a file and reported. Estimators are left
out that warn of light they do not find: in half of the scenes only one is left then, and nothing is compared.

Normal deviates differ so far three times in a row in less than one of a million scenes; but means of few samples are not
normal where light is rare and bright, as that of a distant particle through a rough pane: look at what is reported with more samples
before calling it wrong.

Usage: scripts/random_scenes.py [--first N] [--count N] [--out FOLDER]   (with the Python package morgana installed)
"""

import argparse
import itertools
import json
import math
import pathlib
import random
import sys
import warnings

import morgana

ESTIMATORS = {"path": 40, "bdpt": 20, "particle": 40}
LEVELS, FACTOR, LIMIT = 3, 8, 4.0
# Messages about light that an estimator does not find.
GAPS = ("missing", "mirror", "reflections", "do not find")


def vector(r: random.Random, low: float, high: float) -> list:
    return [r.uniform(low, high) for _ in range(3)]


def aimed(r: random.Random) -> list:
    """From somewhere above towards the middle."""
    origin = [r.uniform(-1.5, 1.5), r.uniform(1, 2), r.uniform(-1, 2)]
    return [{"lookat": {"origin": origin, "target": vector(r, -0.3, 0.3), "up": [0.1, 0.2, 1]}}]


def light(r: random.Random) -> dict:
    return r.choice(
        [
            {"type": "point", "position": [r.uniform(-2, 2), r.uniform(0, 2), r.uniform(-1, 3)], "intensity": 2},
            {"type": "constant", "radiance": 0.3},
            {"type": "directional", "direction": [r.uniform(-1, 1), -1, r.uniform(-1, 1)], "irradiance": 1},
            {"type": "spot", "to_world": aimed(r), "intensity": 5},
            {"type": "collimated", "to_world": aimed(r), "radius": 0.3, "irradiance": 3},
            {"type": "area", "radiance": 2},
        ]
    )


def dielectric(r: random.Random) -> dict:
    return r.choice([{"type": "dielectric"}, {"type": "roughdielectric", "alpha": 0.4}])


def surface(r: random.Random) -> dict:
    diffuse = {"type": "diffuse", "reflectance": r.choice([0.2, 0.8])}
    return r.choice(
        [
            diffuse,
            {"type": "roughconductor", "alpha": 0.4},
            {"type": "plastic"},
            {"type": "roughplastic", "alpha": 0.4},
            {"type": "principled", "roughness": 0.4, "metallic": 0.3},
            {"type": "thindielectric"},
            {"type": "twosided", "bsdf": diffuse},
            {"type": "mask", "opacity": 0.5, "bsdf": diffuse},
        ]
    )


def index(r: random.Random) -> object:
    return r.choice(
        [
            1.2,
            1.33,
            {"type": "linear", "n0": 1.2, "slope": [0, 0.1, 0.05]},
            {"type": "gaussian", "n0": 1.1, "delta": 0.1, "width": 0.7},
            {"type": "luneburg", "radius": 3.0},
            {"type": "selfoc", "n0": 1.3, "alpha": 0.3},
            {"type": "acoustic", "n0": 1.2, "amplitude": 0.01, "wave_number": 4},
        ]
    )


def medium(r: random.Random) -> dict:
    phase = r.choice([{"type": "hg", "g": -0.5}, {"type": "hg", "g": 0.3}, {"type": "hg", "g": 0.8}, {"type": "isotropic"}])
    albedo = r.choice([0.3, 0.9, 1.0, {"type": "rgb", "value": [0.9, 0.5, 0.2]}])
    return {"type": "homogeneous", "sigma_t": r.choice([0.2, 1, 3]), "albedo": albedo, "phase": phase}


def shape(r: random.Random) -> dict:
    kind = r.choice(["sphere", "cube", "cylinder", "rectangle", "disk"])
    turn = {"rotate": {"axis": [1, 0.3, 0.1], "angle": r.uniform(0, 180)}}
    to_world = [{"scale": r.uniform(0.15, 0.6)}, turn, {"translate": vector(r, -1, 1)}]
    made: dict = {"type": kind, "to_world": to_world}
    # Only what encloses a volume has an inside.
    if kind not in ("sphere", "cube") or r.random() < 0.3:
        return made | {"bsdf": surface(r)}
    if r.random() < 0.4:
        return made | {"bsdf": {"type": "null"}, "interior": medium(r) | r.choice([{}, {"ior": index(r)}])}
    filled = {"interior": medium(r) | {"ior": index(r)}}
    return made | {"bsdf": dielectric(r)} | r.choice([{}, filled])


def scene(r: random.Random) -> dict:
    camera = {
        "type": r.choice(["perspective", "thinlens", "orthographic", "telecentric"]),
        "to_world": [{"lookat": {"origin": [0.3, 0.4, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 7, "height": 5, "rfilter": {"type": "box"}},
    }
    if camera["type"] == "thinlens":
        camera |= {"aperture_radius": 0.2, "focus_distance": 5.0}
    if camera["type"] == "telecentric":
        camera |= {"acceptance_angle": 2.0, "focus_distance": 5.0}
    parallel = camera["type"] in ("orthographic", "telecentric")
    if parallel:
        camera["to_world"].insert(0, {"scale": 1.5})
    # Connections of particles to parallel views find reflections too rarely for so few samples.
    reflections = 0 if parallel else r.choice([0, 1])
    made: dict = {"type": "scene", "sensor": camera}
    made["integrator"] = {"type": "path", "max_depth": r.choice([2, 3, 4, 6, 8]), "reflections": reflections}
    if r.random() < 0.5:
        made["floor"] = {
            "type": "rectangle",
            "to_world": [{"scale": 3}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"translate": [0, -1.3, 0]}],
            "bsdf": {"type": "diffuse"},
        }
    if r.random() < 0.3:
        haze = medium(r) | {"sigma_t": 0.1, "ior": r.choice([1, 1, index(r)])}
        made["room"] = {"type": "sphere", "radius": 4, "bsdf": {"type": "null"}, "interior": haze}
    for i in range(r.randint(1, 6)):
        made[f"shape_{i}"] = shape(r)
    for i in range(r.randint(1, 4)):
        lamp = light(r)
        if lamp["type"] == "area":
            body = shape(r)
            body.pop("interior", None)
            made[f"lamp_{i}"] = body | {"bsdf": {"type": "diffuse", "reflectance": 0.5}, "emitter": lamp}
        elif lamp["type"] != "constant" or "light_sky" not in made:
            made["light_sky" if lamp["type"] == "constant" else f"light_{i}"] = lamp
    return made


def usable(made: dict) -> dict:
    """The scene as each estimator has it that finds all light."""
    loaded = {name: morgana.load_dict(made, integrator=name) for name in ESTIMATORS}
    return {name: one for name, one in loaded.items() if not any(gap in str(w) for w in one.warnings for gap in GAPS)}


def differences(loaded: dict, level: int) -> list:
    """Pairs whose means differ by too much, with their deviation in standard errors."""
    results = {}
    for name, one in loaded.items():
        results[name] = morgana.render(one, spp=ESTIMATORS[name] * FACTOR**level, seed=level)
    found = []
    for (a, x), (b, y) in itertools.combinations(results.items(), 2):
        error = math.hypot(x.mean_error, y.mean_error)
        if abs(x.mean - y.mean) > LIMIT * error:
            z = (x.mean - y.mean) / error if error > 0 else math.inf
            found.append(f"{a} {x.mean:.4g} ± {x.mean_error:.2g}, {b} {y.mean:.4g} ± {y.mean_error:.2g}: z = {z:.1f}")
    return found


def compare(made: dict) -> tuple:
    """What came of a scene, in words, and the differences that remain."""
    try:
        loaded = usable(made)
    except morgana.SceneError:
        return "refused", []
    if len(loaded) < 2:
        return "only one finds all light", []
    for level in range(LEVELS):
        found = differences(loaded, level)
        if not found:
            return f"agree with {FACTOR**level} times the samples", []
    return "differ", found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene, which is its seed")
    parser.add_argument("--count", type=int, default=100, help="number of scenes")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("."), help="where scenes that differ are written")
    args = parser.parse_args()
    warnings.simplefilter("ignore", morgana.SceneWarning)
    outcomes: dict = {}
    for number in range(args.first, args.first + args.count):
        made = scene(random.Random(number))
        outcome, found = compare(made)
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        if found:
            path = args.out / f"random_scene_{number}.json"
            path.write_text(json.dumps(made, indent=1))
            print(f"{path}: " + "; ".join(found), flush=True)
    for outcome, count in sorted(outcomes.items()):
        print(f"{count:6} {outcome}")
    return int("differ" in outcomes)


if __name__ == "__main__":
    sys.exit(main())
