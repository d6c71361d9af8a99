#!/usr/bin/env python3
"""Finds an index inside tissue from images of a pattern behind it: a warm spot, or standing ultrasound.

The pattern is seen through three mean free paths of tissue (g = 0.85): e^-3 of its light is not
scattered. Each step of a stochastic descent (Adam) takes `morgana.derivatives` of a sum of squares
by the parameters of the index, with new random numbers.

Usage: scripts/index_behind_tissue.py [--sound] [--steps N] [--spp N] [--figure FILE]
"""

import argparse
import time
import warnings
from typing import Callable, NamedTuple

import morgana
import numpy as np

SIZE = 24
"""Pixels along a side."""
HALF = 0.8
"""Half the width of the image, in halves of the slab."""
PATTERN = "pattern.exr"
"""The file of the pattern, in the current folder while the script runs."""


def pattern():
    """Returns a pattern that fades towards its edges."""
    y, x = np.mgrid[:64, :64] / 63
    window = np.sin(np.pi * x) * np.sin(np.pi * y)
    waves = (1 + np.sin(2 * np.pi * 5 * x)) * (1 + np.sin(2 * np.pi * 5 * y))
    image = window * waves
    image[[0, -1]] = image[:, [0, -1]] = 0
    return image.astype(np.float32)


def scene(ior):
    """Returns a slab of tissue in front of the pattern."""
    return morgana.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 40},
            "sensor": {
                "type": "orthographic",
                "to_world": [{"scale": [HALF, HALF, 1]}, {"translate": [0, 0, -3]}],
                "film": {
                    "type": "hdrfilm",
                    "width": SIZE,
                    "height": SIZE,
                    "pixel_format": "luminance",
                    "rfilter": {"type": "box"},
                },
            },
            "slab": {
                "type": "cube",
                "bsdf": {"type": "null"},
                "interior": {
                    "type": "homogeneous",
                    "id": "tissue",
                    "sigma_t": 1.5,
                    "albedo": 0.99,
                    "phase": {"type": "hg", "g": 0.85},
                    "ior": ior,
                },
            },
            "panel": {
                "type": "rectangle",
                "to_world": [
                    {"scale": 1.6},
                    {"rotate": {"axis": [0, 1, 0], "angle": 180}},
                    {"translate": [0, 0, 1.2]},
                ],
                "bsdf": {"type": "diffuse", "reflectance": 0.0},
                "light": {
                    "type": "area",
                    "radiance": {
                        "type": "bitmap",
                        "filename": PATTERN,
                        "raw": True,
                        "wrap_mode": "clamp",
                    },
                },
            },
        }
    )


def bump(p):
    """Returns the index with a warm spot, by height, position and width."""
    delta, x, y, width = p
    return {
        "type": "gaussian",
        "n0": 1.37,
        "delta": delta,
        "center": [x, y, 0.0],
        "width": width,
    }


def sound(p):
    """Returns the index in standing ultrasound around the line of sight, by amplitude and phase of
    a mode."""
    amplitude, phase = p
    return {
        "type": "acoustic",
        "n0": 1.37,
        "order": 1,
        "wave_number": 6.0,
        "amplitude": amplitude,
        "phase": phase,
        "reference": [1, 0, 0],
    }


class Problem(NamedTuple):
    """The unknown index and its parameters."""

    make: Callable[[np.ndarray], dict]
    """Function that returns the index for given parameters."""
    names: dict[str, tuple[str, int]]
    """Parameters: names of the field's parameters, and the number within each."""
    truth: np.ndarray
    start: np.ndarray
    steps: np.ndarray
    """Sizes of the first steps."""


BUMP = Problem(
    bump,
    {
        "delta": ("delta", 0),
        "x": ("center", 0),
        "y": ("center", 1),
        "width": ("width", 0),
    },
    np.array([0.05, 0.15, -0.1, 0.3]),
    np.array([0.02, 0.0, 0.0, 0.4]),
    np.array([0.003, 0.02, 0.02, 0.015]),
)
SOUND = Problem(
    sound,
    {"amplitude": ("amplitude", 0), "phase": ("phase", 0)},
    np.array([0.04, 0.9]),
    np.array([0.015, 0.0]),
    np.array([0.002, 0.08]),
)


def descend(problem, measured, steps, spp):
    """Minimises by Adam, with steps that shrink towards the end. Returns the parameters of all
    steps."""
    p, way = problem.start.copy(), [problem.start.copy()]
    names = sorted({f"tissue.ior.{name}" for name, _ in problem.names.values()})
    first, second = np.zeros_like(p), np.zeros_like(p)
    for step in range(1, steps + 1):
        at = scene(problem.make(p))
        loss = lambda result: 2 * (result.image - measured) / measured.size
        found = morgana.derivatives(at, names, loss, spp=spp, seed=step)
        slope = [found[f"tissue.ior.{name}"].value.flat[i] for name, i in problem.names.values()] * problem.steps
        first = 0.8 * first + 0.2 * slope
        second = 0.95 * second + 0.05 * slope**2
        size = first / (1 - 0.8**step) / (np.sqrt(second / (1 - 0.95**step)) + 1e-30)
        p = p - min(1.0, 2 * (1 - step / (steps + 1))) * problem.steps * size
        way.append(p.copy())
        print(step, *np.round(p, 4), flush=True)
    return np.array(way)


def figure(path, problem, measured, way):
    """Draws the image, and the convergence of the parameters to their true values."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import panels

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    # The camera looks along +z, so that +x is on the left.
    drawn = left.imshow(measured[..., 0], cmap="gray", vmin=0, extent=[HALF, -HALF, -HALF, HALF])
    left.set(title="measured image", xlabel="x (halves of the slab)", ylabel="y (halves of the slab)")
    figure.colorbar(drawn, ax=left, label="radiance (scene units)")
    for i, name in enumerate(problem.names):
        span = problem.truth[i] - problem.start[i]
        right.plot((way[:, i] - problem.start[i]) / span, label={"delta": "Δn"}.get(name, name))
    right.axhline(1, color="k", lw=0.8)
    right.set(title="parameters during the descent", xlabel="step", ylabel="fraction of the way to the true value")
    right.legend()
    panels.save_figure(figure, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--sound",
        action="store_true",
        help="look for ultrasound instead of a warm spot",
    )
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--figure", help="write a figure to this file")
    options = parser.parse_args()
    problem = SOUND if options.sound else BUMP
    warnings.simplefilter("ignore", morgana.SceneWarning)  # The slab's boundary passes light unchanged.
    morgana.write(PATTERN, pattern())
    measured = morgana.render(scene(problem.make(problem.truth)), spp=16 * options.spp, seed=99).image
    began = time.process_time()
    way = descend(problem, measured, options.steps, options.spp)
    seconds = time.process_time() - began
    tail = way[-max(1, options.steps // 4) :].mean(0)
    for name, truth, start, found in zip(problem.names, problem.truth, problem.start, tail):
        print(f"{name}: {found:.4f}, true {truth}, from {start}")
    print(f"{seconds:.0f} CPU seconds")
    if options.figure:
        figure(options.figure, problem, measured, way)


if __name__ == "__main__":
    main()
