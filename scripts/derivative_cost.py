"""CPU time of an image's derivatives over that of its render, for few and many parameters, straight and bent rays.

    PYTHON scripts/derivative_cost.py --rounds 5

Render and derivatives take turns, on one thread; the table has medians of their ratios.
"""

import argparse
import pathlib
import statistics
import time
import warnings

import morgana
import numpy as np

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"
LOOK = [{"lookat": {"origin": [0, 1, -5], "target": [0, 0, 0], "up": [0, 1, 0]}}]
FILM = {"type": "hdrfilm", "width": 48, "height": 48, "pixel_format": "luminance", "rfilter": {"type": "box"}}
BENT = {"type": "linear", "n0": 1.2, "slope": [0, 0.1, 0]}


def smoke(voxels, index):
    """A cube of voxels, lit by a sky and a point light."""
    data = np.random.default_rng(0).random(3 * [voxels]).astype(np.float32) + 0.2
    grid = {"type": "gridvolume", "data": data, "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]}
    interior = {"type": "heterogeneous", "id": "smoke", "sigma_t": grid, "albedo": 0.9, "ior": index}
    return morgana.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 16},
            "sensor": {"type": "perspective", "fov": 40, "to_world": LOOK, "film": FILM},
            "cube": {"type": "cube", "bsdf": {"type": "null"}, "interior": interior},
            "sky": {"type": "constant", "radiance": 1.0},
            "light": {"type": "point", "position": [2, 2, -2], "intensity": 5.0},
        }
    )


def ratio(scene, names, spp, rounds):
    width, height = scene.size
    weights, ratios = np.ones((height, width, len(scene.channels))), []
    for seed in range(rounds):
        begin = time.process_time()
        morgana.render(scene, spp=spp, integrator="path", seed=seed, threads=1)
        middle = time.process_time()
        morgana.derivatives(scene, names, weights, spp=spp, seed=seed, threads=1)
        ratios.append((time.process_time() - middle) / (middle - begin))
    return statistics.median(ratios)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    warnings.simplefilter("ignore", morgana.SceneWarning)
    all_names = [f"smoke.{name}" for name in ("sigma_t", "sigma_a", "sigma_s", "albedo")]
    print("| scene | parameters | numbers | time over that of the render |\n|---|---|---|---|")
    fog = morgana.load_file(SCENES / "luneburg_fog.xml", width=48, height=36)
    print(f"| luneburg_fog, rays bend | 2 | 6 | {ratio(fog, ['fog.sigma_t', 'fog.albedo'], 16, rounds):.2f} |")
    for voxels in (8, 64):
        for rays, index, spp in (("straight", 1.0, 64), ("bent", BENT, 16)):
            scene = smoke(voxels, index)
            for names in (all_names[:1], all_names):
                # The albedo has one number.
                numbers = min(len(names), 3) * voxels**3 + (len(names) == 4)
                found = ratio(scene, names, spp, rounds)
                print(f"| smoke of {voxels}³ voxels, {rays} rays | {len(names)} | {numbers} | {found:.2f} |")


if __name__ == "__main__":
    main()
