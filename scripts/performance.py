#!/usr/bin/env python3
"""Measures the numbers of docs/performance.md and docs/development/cost.md for this build, and prints their tables.

Everything takes about half an hour on two quiet cores. Tables of experiments
(docs/development/speed.md) compare builds of different states: see scripts/variance.py and the
command beside each. Needs NumPy and Matplotlib; `mitsuba` also needs the requirements of
scripts/compare_mitsuba.py.

Usage: scripts/performance.py [connections|straight|mitsuba|whole|growth|sampling|adaptive ...]
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import cost_growth
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCRIPTS = ROOT / "scripts"
REFERENCES = ROOT / "crates/io/tests/data"
FOG = ROOT / "scenes/luneburg_fog.xml"
MITSUBA = ("p1b_fog_cube_outside", "p3_cornell", "p4_rough_glass", "p5_het_smoke", "p1_fog_cube", "p2_milk_ball")
# Options that make scenes small.
SMALL = ("-D", "width=48", "-D", "height=36")
EXAMPLES = ("luneburg_fog", "acoustic_waveguide", "grid_lens", "bos_jet", "schlieren_jet", "mirage")
SAMPLED = {
    **{REFERENCES / f"{name}.xml": () for name in MITSUBA},
    **{ROOT / f"scenes/{name}.xml": SMALL for name in EXAMPLES},
}


def run(*command):
    subprocess.run([str(word) for word in command], cwd=ROOT, check=True)


class Process:
    """A run of the release binary, with its wall time, processor time and peak memory."""

    program = None

    def __init__(self, *command):
        words = [str(word) for word in (Process.program, *command)]
        begin = time.perf_counter()
        child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(child.pid, 0)
        if status:
            sys.exit(f"failed: {' '.join(words)}")
        self.wall = time.perf_counter() - begin
        self.seconds = usage.ru_utime + usage.ru_stime
        self.bytes = 1024 * usage.ru_maxrss


class Run(Process):
    """A render by the release binary, with its image."""

    def __init__(self, scene, *options, suffix="npy"):
        with tempfile.TemporaryDirectory() as folder:
            image = pathlib.Path(folder) / f"image.{suffix}"
            super().__init__("render", scene, "--quiet", "-o", image, *options)
            self.image = np.load(image)[..., :3].astype(float) if suffix == "npy" else None


def connections():
    for part in ("connections", "methods", "accuracy"):
        run("cargo", "bench", "--quiet", "-p", "morgana-eikonal", "--", part)


def straight():
    run("cargo", "bench", "--quiet", "-p", "morgana-transport", "--bench", "straight")


def mitsuba():
    scenes = [REFERENCES / f"{name}.xml" for name in MITSUBA]
    run(SCRIPTS / "compare_mitsuba.py", "--spp", 64, "--seeds", 4, *scenes)


def threads():
    """Measures the speed-up by a second thread, in pairs of runs."""
    size = ("-D", "width=168", "-D", "height=100", "--spp", 24)
    ratios = []
    for _ in range(5):
        one, two = (Run(FOG, *size, "--threads", n).wall for n in (1, 2))
        ratios.append(one / two)
    return f"{statistics.median(ratios):.2f} times ({', '.join(f'{r:.2f}' for r in ratios)})"


def tracing():
    """Returns the fraction of a render's time that grows with its samples."""
    glass = REFERENCES / "p4_rough_glass.xml"
    few, many = (statistics.median(Run(glass, "--threads", 1, "--spp", n).seconds for _ in range(3)) for n in (1, 32))
    return f"{100 * (1 - few / many) * 32 / 31:.1f} %"


def grid_scene(folder, samples, precision):
    """Writes a scene to a folder, with a cubic grid of a number of samples along an edge. Returns
    also the memory of the samples in bytes."""
    values = {**cost_growth.BASE, "grid": samples, "width": 16}
    cost_growth.write_grid(folder, values["grid"], values["delta"], precision)
    scene = folder / "scene.xml"
    scene.write_text(cost_growth.SCENE.format(**values))
    return scene, samples**3 * np.dtype(precision).itemsize


def start_up():
    """Measures the processor time of a render of 256 paths through a grid of 128³ samples."""
    with tempfile.TemporaryDirectory() as folder:
        scene, _ = grid_scene(pathlib.Path(folder), 128, "f8")
        return f"{statistics.median(Run(scene, '--spp', 1).seconds for _ in range(3)):.2f} s"


def start_up_large():
    """Measures the cost of 512³ samples in single precision before the first sample: time of one
    processor and peak memory."""
    with tempfile.TemporaryDirectory() as folder:
        scene, size = grid_scene(pathlib.Path(folder), 512, "f4")
        runs = [Process("check", scene) for _ in range(3)]
        return f"{statistics.median(run.seconds for run in runs):.1f} s, {runs[0].bytes / size:.2f} times the samples' memory"


def memory():
    """Measures the peak memory of a large film over the film's own memory."""
    size = ("-D", "width=1400", "-D", "height=1400")
    info = subprocess.run([Process.program, "info", "--json", FOG, *size], check=True, capture_output=True, text=True)
    film = json.loads(info.stdout)["film"]["bytes"]
    ratios = [f"{Run(FOG, *size, '--spp', 1, suffix=s).bytes / film:.2f} ({s})" for s in ("npy", "exr")]
    return f"{', '.join(ratios)} of {film / 2**20:.0f} MiB"


def whole():
    print("| goal | measured |\n|---|---|")
    goals = {
        "two threads 1.95 times as fast as one": threads,
        "90 % of the time in tracing": tracing,
        "start-up with a 128³ grid under 0.3 s": start_up,
        "start-up with a 512³ grid in f32 under 3 s of one core and 1.3 times its memory": start_up_large,
        "memory under 1.2 times scene and film": memory,
    }
    for goal, measure in goals.items():
        print(f"| {goal} | {measure()} |", flush=True)


def growth():
    run(sys.executable, SCRIPTS / "cost_growth.py", "--spp", 8)


def beside(scene, options, kinds, fixed, seeds):
    """Returns, for options of each kind of sampling, images of a scene with several seeds, and the
    median processor time."""
    runs = [[Run(scene, *options, *kind, "--threads", 1, *fixed, "--seed", seed) for kind in kinds] for seed in range(1, seeds + 1)]
    by_kind = list(zip(*runs))
    images = [np.array([run.image for run in several], dtype=float) for several in by_kind]
    return images, [statistics.median(run.seconds for run in several) for several in by_kind]


def sampling():
    """Measures the gain of even samples over independent ones."""
    print("| scene | variance | most pixels | time |\n|---|---|---|---|")
    for scene, options in SAMPLED.items():
        kinds = (("--sampler", "independent"), ("--sampler", "ldsampler:8"))
        images, seconds = beside(scene, options, kinds, ("--spp", 16), 7)
        uneven, even = (several.var(axis=0, ddof=1) for several in images)
        most = even + uneven <= np.quantile(even + uneven, 0.99)
        ratios = (uneven.mean() / even.mean(), uneven[most].mean() / even[most].mean(), seconds[0] / seconds[1])
        print(f"| {scene.stem} | {' | '.join(f'{r:.2f}' for r in ratios)} |", flush=True)


def adaptive():
    """Measures the gain of adaptive sampling."""
    print("| scene | variance | time | efficiency | relative |\n|---|---|---|---|---|")
    for scene, options in SAMPLED.items():
        kinds = ((), ("--adaptive",))
        images, seconds = beside(scene, options, kinds, ("--spp", 64), 8)
        squares = (np.mean(images, axis=(0, 1)) + 0.05 * np.mean(images)) ** 2
        variances = [several.var(axis=0, ddof=1) for several in images]
        variance, relative = ((w * variances[0]).mean() / (w * variances[1]).mean() for w in (1, 1 / squares))
        faster = seconds[0] / seconds[1]
        ratios = (variance, faster, variance * faster, relative * faster)
        print(f"| {scene.stem} | {' | '.join(f'{r:.2f}' for r in ratios)} |", flush=True)


PARTS = {part.__name__: part for part in (connections, straight, mitsuba, whole, growth, sampling, adaptive)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"some of {', '.join(PARTS)}; all if none is named")
    wanted = parser.parse_args().parts
    unknown = [part for part in wanted if part not in PARTS]
    if unknown:
        parser.error(f"no part is called so: {', '.join(unknown)}")
    Process.program = cost_growth.program()
    for part in wanted or PARTS:
        print(f"\n== {part}", flush=True)
        PARTS[part]()


if __name__ == "__main__":
    main()
