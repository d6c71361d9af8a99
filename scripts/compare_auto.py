#!/usr/bin/env python3
"""Compares the integrator auto with each single choice, for equal time.

Renders each scene by auto, path, particle and bdpt for a number of seeds, each for --time seconds
on one thread. Writes a table of the root of the relative mean square error times processor time,
relative to the smallest of the single choices, which has 1.0. Light that an estimator does not find
counts as error: means that differ from the median of all by more than noise are marked with *.

Scenes: the example scenes; the files given; random ones (--random N, see random_mitsuba_scenes.py).

Usage: scripts/compare_auto.py [--time SECONDS] [--seeds N] [--random N] [--exe PATH] [SCENE[,NAME=VALUE...] ...]
(with any Python that has numpy)
"""

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
SINGLE = ("path", "particle", "bdpt")
EXAMPLES = (
    ("luneburg_fog", {"width": 60, "height": 36}),
    ("aquarium_laser", {"width": 80, "height": 25, "reflections": 2}),
    ("acoustic_waveguide", {"width": 48, "height": 31}),
    ("acousto_optic_tissue", {"width": 32, "height": 32}),
    ("grid_lens", {"width": 48, "height": 36}),
    ("mirage", {"width": 40, "height": 20}),
    ("bos_jet", {"width": 32, "height": 24}),
    ("schlieren_jet", {"width": 40, "height": 30}),
    ("shock", {"width": 40, "height": 30}),
    ("grin_glass", {"width": 40, "height": 25}),
    ("laser_tank", {"width": 40, "height": 16}),
    ("light_in_flight", {"width": 40, "height": 22}),
    ("mirror_caustic", {"width": 40, "height": 25}),
)
# Smallest brightness for relative errors, as a fraction of the image's mean.
DARK = 0.05
# Difference of image means, in standard errors, beyond which (and beyond a hundredth) they count as
# different.
FAR = 5.0


class TooShort(Exception):
    """A render that ended before it had an image."""


class Runs:
    """Renders of a scene by one integrator: images, processor seconds, and the chosen estimator."""

    def __init__(self, images: list[np.ndarray], seconds: list[float], told: list[dict]) -> None:
        self.images, self.seconds = np.array(images), float(np.median(seconds))
        self.chosen = [stats["integrator"] for stats in told]

    def mean(self) -> np.ndarray:
        return self.images.mean(0)

    def error(self, reference: np.ndarray) -> float:
        """Returns the root of relative MSE × time."""
        scale = reference**2 + (DARK * reference.mean()) ** 2
        return float(np.sqrt((self.images.var(0, ddof=1) / scale).mean() * self.seconds))

    def is_far(self, reference: float) -> bool:
        means = self.images.mean(tuple(range(1, self.images.ndim)))
        error = means.std(ddof=1) / np.sqrt(len(means))
        return bool(abs(means.mean() - reference) > max(FAR * error, 0.01 * abs(reference)))


def processor_time() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def renders(args: argparse.Namespace, path: pathlib.Path, defines: dict, integrator: str, first_seed: int) -> Runs:
    images, seconds, told = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        image, stats = pathlib.Path(folder) / "image.npy", pathlib.Path(folder) / "stats.json"
        for seed in range(first_seed, first_seed + args.seeds):
            command = [args.exe, "render", path, "--quiet", "--threads", "1", "--integrator", integrator, "--seed", str(seed)]
            command += ["--time", f"{args.time}s", "-o", image, "--stats", stats]
            command += [item for name, value in defines.items() for item in ("-D", f"{name}={value}")]
            before = processor_time()
            subprocess.run(command, check=True, capture_output=True, text=True)
            seconds.append(processor_time() - before)
            images.append(np.load(image).astype(float))
            told.append(json.loads(stats.read_text()))
            if told[-1]["spp"] == 0:
                raise TooShort(f"{integrator}: no sample of the whole image in {args.time:g} s")
    return Runs(images, seconds, told)


def row(args: argparse.Namespace, name: str, path: pathlib.Path, defines: dict) -> tuple[str, float]:
    runs = {name: renders(args, path, defines, name, 1000 * i) for i, name in enumerate((*SINGLE, "auto"))}
    reference = np.median([r.mean() for r in runs.values()], axis=0)
    level = float(np.median([r.mean().mean() for r in runs.values()]))
    errors = {name: r.error(reference) for name, r in runs.items()}
    far = {name for name, r in runs.items() if r.is_far(level)}
    whole = {name: e for name, e in errors.items() if name != "auto" and name not in far}
    best = min(whole.values(), default=float("nan"))
    cells = [f"{errors[name] / best:.2f}{'*' if name in far else ''}" for name in (*SINGLE, "auto")]
    chosen = sorted(set(runs["auto"].chosen), key=runs["auto"].chosen.count, reverse=True)
    return f"| {name} | " + " | ".join(cells) + f" | {', '.join(chosen)} |", errors["auto"] / best


def scenes(args: argparse.Namespace, folder: pathlib.Path):
    if not args.scenes and not args.random:
        for name, defines in EXAMPLES:
            yield name, ROOT / "scenes" / f"{name}.xml", defines
    for scene in args.scenes:
        path, *defines = scene.split(",")
        yield pathlib.Path(path).stem, pathlib.Path(path), dict(define.split("=", 1) for define in defines)
    if args.random:
        sys.path.append(str(ROOT / "scripts"))
        import mitsuba
        from random_mitsuba_scenes import Generator

        # This variant writes grids.
        mitsuba.set_variant("scalar_rgb")
    for number in range(args.random):
        place = folder / str(number)
        place.mkdir()
        root, parts = Generator(str(number), place).scene(32)
        if parts["sensor"] == "batch":
            # Only path can render it.
            continue
        ElementTree.ElementTree(root).write(place / "scene.xml")
        yield f"random {number}: {parts['bsdf']}, {parts['emitter']}", place / "scene.xml", {}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--time", type=float, default=4.0, help="seconds per render")
    parser.add_argument("--seeds", type=int, default=5, help="renders per integrator, at least 2")
    parser.add_argument("--random", type=int, default=0, help="number of random scenes")
    parser.add_argument("--exe", type=pathlib.Path, default=ROOT / "target" / "release" / "morgana", help="the program morgana")
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    args = parser.parse_args()
    if args.seeds < 2:
        parser.error("errors are told from differences: at least two seeds are needed")
    print("| scene | path | particle | bdpt | auto | auto chose |\n|---|---|---|---|---|---|", flush=True)
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        for name, path, defines in scenes(args, pathlib.Path(folder)):
            try:
                text, ratio = row(args, name, path, defines)
                ratios.append(ratio)
                print(text, flush=True)
            except (subprocess.CalledProcessError, json.JSONDecodeError, TooShort) as problem:
                text = getattr(problem, "stderr", None) or str(problem)
                print(f"| {name} | | | | | failed: {' '.join(text.split())[:200]} |", flush=True)
    if ratios:
        print(f"\nauto over the best single choice: median {np.median(ratios):.2f}, largest {max(ratios):.2f}")


if __name__ == "__main__":
    main()
