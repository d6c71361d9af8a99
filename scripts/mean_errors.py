#!/usr/bin/env python3
"""Counts how often the mean of an image is farther from the truth than its stated error allows.

The scenes are those of scene_generator.py that have a camera. Each is rendered by path, bdpt and
particle with many seeds. The truth for a seed is the mean over all others. Means with flagged
errors (`Result.mean_few`) are left out, as a user would do. Of the others, the script counts those
more than three errors away, beside the number expected from Student's t distribution. Errors of
`bdpt` and `particle` come from samples of the whole image, one for each sample per pixel, and
errors of `path` from the samples of all pixels.

Exits with 1 if more than twice the expected number are outside. Somewhat more than expected are
outside, because rare light that no sample of a render found leaves no trace.

Usage: scripts/mean_errors.py [--scenes 40] [--seeds 40] [--spp 32]   (with the Python package morgana and SciPy installed)
"""

import argparse
import pathlib
import sys
import tempfile
import warnings
from collections.abc import Iterator

import numpy as np
import scene_generator
from scipy import stats

import morgana

ESTIMATORS = ("path", "bdpt", "particle")
WIDTH, HEIGHT = 24, 16
LIMIT = 3.0
# Smallest mean that is compared: in darker images too few paths carry the light.
DARK = 1e-9


def scenes(count: int, folder: pathlib.Path) -> Iterator[tuple[int, dict]]:
    """Returns the first scenes that have a camera, with their numbers."""
    number = 0
    while count:
        number += 1
        made = scene_generator.make(number, folder)
        if "sensor" not in made:
            continue
        film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}}
        yield number, made | {"sensor": made["sensor"] | {"film": film}}
        count -= 1


def deviations(made: dict, estimator: str, seeds: int, spp: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns deviations from the mean over the other seeds, in combined errors, and which are
    flagged."""
    scene = morgana.load_dict(made, integrator=estimator)
    results = [morgana.render(scene, spp=spp, seed=seed) for seed in range(seeds)]
    mean = np.array([result.mean for result in results])
    error = np.array([result.mean_error for result in results])
    flagged = np.array([result.mean_few for result in results])
    truth = (mean.sum() - mean) / (seeds - 1)
    # An error of zero claims that the mean is exact.
    uncertain = np.hypot(error, mean.std(ddof=1) / np.sqrt(seeds - 1))
    far = np.where(mean == truth, 0.0, np.inf)
    z = np.divide(mean - truth, uncertain, out=far, where=uncertain > 0)
    return z, flagged | (mean < DARK)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=40, help="number of scenes")
    parser.add_argument("--seeds", type=int, default=40, help="renders of each scene by each estimator")
    parser.add_argument("--spp", type=int, default=32, help="samples per pixel")
    arguments = parser.parse_args()
    outside = expected = trusted = renders = 0.0
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number, made in scenes(arguments.scenes, pathlib.Path(folder)):
            for estimator in ESTIMATORS:
                z, flagged = deviations(made, estimator, arguments.seeds, arguments.spp)
                scores = arguments.spp * (WIDTH * HEIGHT if estimator == "path" else 1)
                far = np.abs(z[~flagged]) > LIMIT
                outside += far.sum()
                expected += 2 * stats.t.sf(LIMIT, scores - 1) * far.size
                trusted += far.size
                renders += flagged.size
                if far.any():
                    worst = z[~flagged][np.abs(z[~flagged]).argmax()]
                    print(f"scene {number} by {estimator}: {far.sum()} of {far.size} outside, {flagged.sum()} flagged, worst {worst:.1f}")
    print(f"{renders:.0f} renders, {trusted:.0f} not flagged: {outside:.0f} farther than {LIMIT:.0f} errors, {expected:.1f} expected")
    return int(outside > 2 * expected)


if __name__ == "__main__":
    sys.exit(main())
