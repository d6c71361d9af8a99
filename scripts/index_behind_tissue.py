#!/usr/bin/env python3
"""Finds an index inside tissue from pictures of a pattern behind it: a warm spot, or standing ultrasound.

Three mean free paths of tissue (g = 0.85) hide a panel with a smooth pattern; one picture in twenty of the light is unscattered. The index bends what is scattered,
too, and `morgana.derivatives` says how pictures change with it. Gauss-Newton steps would need derivatives of every pixel; these are by all parameters at once, of
a sum of squares, so that a stochastic descent (Adam) takes them as they come, each with random numbers of its own.

Usage: scripts/index_behind_tissue.py [--sound] [--steps N] [--spp N] [--figure FILE]
"""

import argparse
import time
import warnings

import morgana
import numpy as np

SIZE = 24
"""Pixels along a side."""
PATTERN = "pattern.exr"
"""The file of the pattern, in the current folder while the script runs."""


def pattern():
    """A pattern that fades towards its edges."""
    y, x = np.mgrid[:64, :64] / 63
    window = np.sin(np.pi * x) * np.sin(np.pi * y)
    waves = (1 + np.sin(2 * np.pi * 5 * x)) * (1 + np.sin(2 * np.pi * 5 * y))
    image = window * waves
    image[[0, -1]] = image[:, [0, -1]] = 0
    return image.astype(np.float32)


def scene(ior):
    """A slab of tissue in front of the pattern."""
    return morgana.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 40},
        "sensor": {
            "type": "orthographic",
            "to_world": [{"scale": [0.8, 0.8, 1]}, {"translate": [0, 0, -3]}],
            "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "pixel_format": "luminance", "rfilter": {"type": "box"}},
        },
        "slab": {
            "type": "cube",
            "bsdf": {"type": "null"},
            "interior": {
                "type": "homogeneous", "id": "tissue", "sigma_t": 1.5, "albedo": 0.99,
                "phase": {"type": "hg", "g": 0.85}, "ior": ior,
            },
        },
        "panel": {
            "type": "rectangle",
            "to_world": [{"scale": 1.6}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 1.2]}],
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "light": {
                "type": "area",
                "radiance": {"type": "bitmap", "filename": PATTERN, "raw": True, "wrap_mode": "clamp"},
            },
        },
    })


def bump(p):
    """A warm spot: height, place and width."""
    delta, x, y, width = p
    return {"type": "gaussian", "n0": 1.37, "delta": delta, "center": [x, y, 0.0], "width": width}


BUMP = {
    "make": bump,
    "names": ["delta", "x", "y", "width"],
    "places": [1, 2, 3, 5],
    "truth": np.array([0.05, 0.15, -0.1, 0.3]),
    "start": np.array([0.02, 0.0, 0.0, 0.4]),
    "steps": np.array([0.003, 0.02, 0.02, 0.015]),
}


def descend(problem, measured, steps, spp):
    """Adam, with steps that shrink towards the end. All parameters on the way."""
    p, way = problem["start"].copy(), [problem["start"].copy()]
    first, second = np.zeros_like(p), np.zeros_like(p)
    for step in range(1, steps + 1):
        at = scene(problem["make"](p))
        loss = lambda result: 2 * (result.image - measured) / measured.size
        found = morgana.derivatives(at, ["tissue.ior"], loss, spp=spp, seed=step)["tissue.ior"]
        slope = found.value[problem["places"]] * problem["steps"]
        first = 0.8 * first + 0.2 * slope
        second = 0.95 * second + 0.05 * slope**2
        size = first / (1 - 0.8**step) / (np.sqrt(second / (1 - 0.95**step)) + 1e-30)
        p = p - min(1.0, 2 * (1 - step / (steps + 1))) * problem["steps"] * size
        way.append(p.copy())
        print(step, p, flush=True)
    return np.array(way)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--figure")
    options = parser.parse_args()
    problem = BUMP
    morgana.write(PATTERN, pattern())
    warnings.simplefilter("ignore", morgana.SceneWarning)  # The slab's boundary passes light as it comes.
    measured = morgana.render(scene(problem["make"](problem["truth"])), spp=4096, seed=99).image
    began = time.process_time()
    way = descend(problem, measured, options.steps, options.spp)
    seconds = time.process_time() - began
    tail = way[-max(1, options.steps // 6):]
    for name, truth, start, found, spread in zip(problem["names"], problem["truth"], problem["start"], tail.mean(0), tail.std(0)):
        print(f"{name}: {found:.4f} ± {spread:.4f}, true {truth}, from {start}")
    print(f"{seconds:.0f} CPU seconds")


if __name__ == "__main__":
    main()
