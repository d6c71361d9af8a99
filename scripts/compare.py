#!/usr/bin/env python3
"""Compares the estimators for equal time on the example scenes.

Renders each scene by path, particle and bdpt, several times with independent seeds. Writes a table
of errors to docs/comparison.md and a figure to docs/images/comparison.png. Needs Pillow, and the
release binary, which it builds; its own files go to a temporary folder.

Usage: scripts/compare.py [--time SECONDS] [--seeds N] [--threads N] [SCENE ...]
"""

import argparse
import array
import ast
import json
import pathlib
import resource
import struct
import subprocess
import tempfile

from PIL import Image

import panels

ROOT = pathlib.Path(__file__).resolve().parent.parent
ESTIMATORS = ("path", "particle", "bdpt")
# Scene, parameters, and exposure of the figure in stops.
SCENES = (
    ("luneburg_fog", {"width": 264, "height": 158}, 0),
    ("aquarium_laser", {"width": 264, "height": 82, "reflections": 2}, 1),
    ("acoustic_waveguide", {"width": 264, "height": 170}, 0),
    ("grid_lens", {"width": 264, "height": 198}, 0),
    ("mirage", {"width": 264, "height": 132}, 0),
)
# Smallest brightness for relative errors, as a fraction of the image's mean.
DARK = 0.05


class Run:
    """A render: the image as rows of floats, and its report."""

    def __init__(self, width, values, stats, seconds):
        self.width, self.values = width, values
        self.height = len(values) // (3 * width)
        self.mean = stats["mean"]
        self.spp, self.connections = stats["spp"], stats["connections"]
        self.seconds = seconds


def program():
    build = ["cargo", "build", "--release", "--quiet", "-p", "morgana-cli", "--message-format=json"]
    output = subprocess.run(build, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    messages = (json.loads(line) for line in output.splitlines())
    found = [m["executable"] for m in messages if m.get("executable")]
    return found[-1]


def render(binary, folder, scene, parameters, estimator, seed, args):
    image, stats = folder / "image.npy", folder / "stats.json"
    command = [binary, "render", ROOT / "scenes" / f"{scene}.xml", "--quiet"]
    command += ["--integrator", estimator, "--seed", str(seed), "--time", f"{args.time}s"]
    command += ["--threads", str(args.threads), "-o", image, "--stats", stats]
    for name, value in parameters.items():
        command += ["-D", f"{name}={value}"]
    before = processor_time()
    subprocess.run(command, check=True)
    seconds = processor_time() - before
    return Run(*read_npy(image), json.loads(stats.read_text()), seconds)


def processor_time():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def read_npy(path):
    data = path.read_bytes()
    length = struct.unpack_from("<H", data, 8)[0]
    header = ast.literal_eval(data[10 : 10 + length].decode())
    assert header["descr"] == "<f4" and not header["fortran_order"], header
    values = array.array("f")
    values.frombytes(data[10 + length :])
    return header["shape"][1], values


def averages(runs):
    """Returns the mean over runs of every value."""
    return [sum(column) / len(runs) for column in zip(*(run.values for run in runs))]


def relative_error(runs, reference):
    """Returns the mean over the image of a run's variance over the squared reference, from the
    differences between runs."""
    floor = (DARK * sum(reference) / len(reference)) ** 2
    total = 0.0
    for mean, r, *values in zip(averages(runs), reference, *(run.values for run in runs)):
        variance = sum((v - mean) ** 2 for v in values) / (len(runs) - 1)
        total += variance / (r * r + floor)
    return total / len(reference)


def overall(runs):
    """Returns the mean of the image over all runs, and its standard error from their differences."""
    mean = sum(run.mean for run in runs) / len(runs)
    variance = sum((run.mean - mean) ** 2 for run in runs) / (len(runs) - 1)
    return mean, (variance / len(runs)) ** 0.5


def compare(scene, runs):
    """Returns the rows of the table."""
    # Take the median of the three estimators: in a mean, a rare bright sample would hide its own
    # error.
    reference = [sorted(means)[1] for means in zip(*(averages(several) for several in runs.values()))]
    errors = {name: relative_error(several, reference) for name, several in runs.items()}
    cost = {n: errors[n] * sum(r.seconds for r in several) / len(several) for n, several in runs.items()}
    rows = []
    for name, several in runs.items():
        mean, error = overall(several)
        spp = sum(run.spp for run in several) / len(several)
        capped = sum(run.connections["capped"] for run in several)
        gain = cost["path"] / cost[name] if cost[name] > 0 else float("inf")
        gain = "> 100" if gain > 100 else f"{gain:.2g}"
        rows.append(
            f"| {scene} | {name} | {spp:.0f} | {mean:.5f} ± {error:.5f} | {errors[name]:.2e} "
            f"| {gain} | {capped} |"
        )
    return rows


def pixel(value, stops):
    """Converts a linear value to sRGB."""
    v = min(max(value * 2.0**stops, 0.0), 1.0)
    v = 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055
    return round(255 * v)


def picture(run, stops):
    """Converts a run to a picture."""
    values = bytes(pixel(value, stops) for value in run.values)
    return Image.frombytes("RGB", (run.width, run.height), values)


TEXT = """# Comparison of the estimators

Use this page to choose between `path`, `particle` and `bdpt`. It compares these estimators on the example scenes at equal time.
The numbers come from one run of `scripts/compare.py`, which you can repeat on any machine. The run made {seeds} independent renders per row, {time:g} s
each on {threads} thread(s).

![Each scene by path, particle and bdpt, from left to right](images/comparison.png)

*One render of each, at equal time and exposure.*

| scene | estimator | samples per pixel | mean of the image | relative MSE | gain | capped |
|---|---|---|---|---|---|---|
{rows}

| column | meaning |
|---|---|
| mean of the image | with its standard error, from the differences between the renders. If estimators differ by much more than this error, one of them misses light ([which light](scene/integrator.md#what-connections-find)) |
| relative MSE | variance of a pixel between renders of one estimator, divided by the square of the pixel's brightness, averaged over pixels and channels. The brightness is the median of the estimators' means, plus {dark:g} % of the image's mean |
| gain | processor time of `path` for an equal error, divided by the processor time of the estimator |
| capped | branches with a weighting that was cut off, in all renders together |

Variances from a few renders are themselves uncertain. A relative MSE above 1 comes from rare bright samples; only its order of magnitude is
meaningful.

[photons.md](photons.md) compares photon maps.

Parameters: {parameters}.
"""


def describe(scenes):
    def words(parameters):
        return " ".join(f"-D {k}={v}" for k, v in parameters.items())

    return "; ".join(f"{scene}, `{words(parameters)}`" for scene, parameters, _ in scenes)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--time", type=float, default=8.0, help="seconds per render")
    parser.add_argument("--seeds", type=int, default=3, help="renders per estimator, at least 2")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs")
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    args = parser.parse_args()
    scenes = [s for s in SCENES if not args.scenes or s[0] in args.scenes]
    if args.seeds < 2:
        parser.error("errors are told from differences: at least two seeds are needed")
    binary = program()
    rows, shown = [], []
    with tempfile.TemporaryDirectory() as folder:
        for scene, parameters, stops in scenes:
            runs = {}
            for estimator in ESTIMATORS:
                one = lambda seed: render(
                    binary, pathlib.Path(folder), scene, parameters, estimator, seed, args
                )
                # Use different seeds for the estimators, too.
                first = 1000 * ESTIMATORS.index(estimator)
                runs[estimator] = [one(first + i) for i in range(args.seeds)]
            table = compare(scene, runs)
            print("\n".join(table), flush=True)
            rows += table
            shown += [(f"{scene}, {name}", picture(several[0], stops)) for name, several in runs.items()]
    (args.out / "images").mkdir(parents=True, exist_ok=True)
    panels.save(panels.arrange(shown, len(ESTIMATORS)), args.out / "images" / "comparison.png")
    text = TEXT.format(
        seeds=args.seeds,
        time=args.time,
        threads=args.threads,
        dark=100 * DARK,
        parameters=describe(scenes),
        rows="\n".join(rows),
    )
    (args.out / "comparison.md").write_text(text)


if __name__ == "__main__":
    main()
