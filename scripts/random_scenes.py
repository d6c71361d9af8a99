#!/usr/bin/env python3
"""Renders random scenes by several techniques, which must agree.

scene_generator.py makes the scenes. Scenes with a camera are rendered by path, bdpt and particle;
the means of the images are compared, and the means of layers of optical path length if the film has
them. Scenes with fluence meters are measured by track lengths and by collisions; the absorbed power
in each cell is compared (fluence is not: collisions do not see it in clear matter).

If two results differ by more than four standard errors, eight times as many samples are taken with
another seed, up to twice. If they still differ, the scene is written to a file and reported.

Not compared: estimators that warn of light they do not find, which leaves only one in two fifths of
the scenes; means whose errors cannot be trusted (`few`); means of less than a hundredth of the
whole or below a millionth, which come from too few paths to be normal.

Normal deviates differ so much three times in a row in less than one of a million comparisons. But
means of few samples are not normal if light is rare and bright, such as a distant particle through
a rough pane. Repeat reported scenes with more samples before calling them wrong.

Usage: scripts/random_scenes.py [--first N] [--count N] [--out FOLDER]   (with the Python package morgana installed)
"""

import argparse
import itertools
import json
import math
import pathlib
import sys
import tempfile
import time
import warnings

import morgana
import numpy as np
import scene_generator

ESTIMATORS = {"path": 160, "bdpt": 80, "particle": 160}
MEASURES = {"track_length": 10000, "collision": 10000}
LEVELS, FACTOR, LIMIT = 3, 8, 4.0
# Fraction of the whole below which means are not compared.
SMALL = 0.01
# Light so faint that a technique may find no path to it, for example by the tail of a Gaussian
# lobe. Emitters are of the order of one.
DARK = 1e-6
# Messages about light that an estimator does not find.
GAPS = ("missing", "mirror", "reflections", "do not find")
# Smallest fraction of scenes of which two techniques find all light; about 0.6 is usual. A smaller
# one means refused scenes, or a broken generator.
MIN_COMPARED = 1 / 3


class Technique:
    """A technique that computes the numbers."""

    def __init__(self, made: dict, name: str) -> None:
        self.name, self.meter = name, "meter" in made
        if self.meter:
            made = made | {"meter": made["meter"] | {"estimator": name}}
        self.scene = morgana.load_dict(made, integrator=None if self.meter else name)
        self.complete = self.meter or not any(gap in str(w) for w in self.scene.warnings for gap in GAPS)

    def means(self, level: int) -> dict:
        """Returns means and standard errors, by name; those of the whole come first."""
        effort = FACTOR**level
        if self.meter:
            # Techniques take different particles, so that their errors are independent.
            seed = 2 * level + (self.name == "collision")
            result = morgana.render(self.scene, particles=MEASURES[self.name] * effort, seed=seed)
            reading = result.meters["absorbed"]
            cells = zip(reading.mean.ravel(), np.where(reading.few, math.inf, reading.error).ravel())
            return {f"absorbed {i}": pair for i, pair in enumerate(cells)}
        result = morgana.render(self.scene, spp=ESTIMATORS[self.name] * effort, seed=level)
        # mean_few also flags images without light; here an estimator that finds none must not pass.
        found = {"image": (result.mean, known(result.mean_error, result.stats["trust"]["few"]))}
        layers = (result.stats["decomposition"] or {}).get("layers", [])
        return found | {one["name"]: (one["mean"], known(one["standard_error"] or math.inf, one["few"])) for one in layers}


def known(error: float, few: bool) -> float:
    """Returns an error, infinite if it cannot be trusted."""
    return math.inf if few else error


def differences(techniques: list, level: int) -> list:
    """Returns pairs of means that differ too much, with their deviation in standard errors."""
    means = {technique.name: technique.means(level) for technique in techniques}
    found = []
    for (a, these), (b, those) in itertools.combinations(means.items(), 2):
        whole = max(mean for mean, _ in these.values())
        for name, (x, x_error) in these.items():
            y, y_error = those[name]
            error = math.hypot(x_error, y_error)
            if max(x, y) >= max(SMALL * whole, DARK) and abs(x - y) > LIMIT * error:
                z = (x - y) / error if error > 0 else math.inf
                found.append(f"{name}: {a} {x:.4g} ± {x_error:.2g}, {b} {y:.4g} ± {y_error:.2g}: z = {z:.1f}")
    return found


def compare(made: dict) -> tuple:
    """Returns the result of a scene in words, and the remaining differences."""
    try:
        techniques = [Technique(made, name) for name in (MEASURES if "meter" in made else ESTIMATORS)]
    except morgana.SceneError as error:
        return "refused", [str(error)]
    techniques = [one for one in techniques if one.complete]
    if len(techniques) < 2:
        return "only one finds all light", []
    for level in range(LEVELS):
        found = differences(techniques, level)
        if not found:
            return f"agree with {FACTOR**level} times the samples", []
    return "differ", found


def plain(value: object) -> object:
    """Converts arrays to lists, for JSON."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"cannot write {type(value).__name__}")


def report(made: dict, number: int, out: pathlib.Path) -> pathlib.Path:
    """Writes a scene to a file, with its environment map beside it."""
    sky = made.get("light_sky", {})
    if "filename" in sky:
        source = pathlib.Path(sky["filename"])
        (out / source.name).write_bytes(source.read_bytes())
        sky["filename"] = source.name
    path = out / f"random_scene_{number}.json"
    path.write_text(json.dumps(made, indent=1, default=plain))
    return path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene, which is its seed")
    parser.add_argument("--count", type=int, default=100, help="number of scenes")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("."), help="where scenes that differ are written")
    parser.add_argument("--verbose", action="store_true", help="tell the outcome of each scene and its seconds")
    args = parser.parse_args()
    warnings.simplefilter("ignore", morgana.SceneWarning)
    outcomes: dict = {}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(args.first, args.first + args.count):
            began = time.process_time()
            made = scene_generator.make(number, pathlib.Path(folder))
            outcome, found = compare(made)
            outcomes[outcome] = outcomes.get(outcome, 0) + 1
            if outcome == "differ":
                print(f"{report(made, number, args.out)}: " + "; ".join(found), flush=True)
            if args.verbose:
                print(f"{number:6} {time.process_time() - began:7.1f} s  {outcome}" + "".join(f"\n    {line}" for line in found), flush=True)
    for outcome, count in sorted(outcomes.items()):
        print(f"{count:6} {outcome}")
    agree = sum(count for outcome, count in outcomes.items() if outcome.startswith("agree"))
    if agree < MIN_COMPARED * args.count:
        print(f"only {agree} of {args.count} scenes were compared and agree, fewer than a share of {MIN_COMPARED:.2f}")
        return 1
    return int("differ" in outcomes)


if __name__ == "__main__":
    sys.exit(main())
