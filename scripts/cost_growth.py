#!/usr/bin/env python3
"""Measures how the cost of a render grows with path length, grid size, optical thickness, field strength and film size.

Renders a ball of fog with an index of a grid, by the release binary, which it builds, on one thread. Prints a table with the
exponents of power laws fitted to the largest half of each sweep, for docs/performance.md, and writes
docs/images/cost_growth.svg. Needs NumPy and Matplotlib.

Usage: scripts/cost_growth.py [--repeats N] [--spp N]
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.ticker import NullFormatter  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
PLOT = ROOT / "docs/images/cost_growth.svg"
# What a sweep is called, its parameter, and the parameter's values; others are as in BASE.
BASE = {"depth": 8, "grid": 32, "sigma": 2.0, "delta": 0.05, "width": 48}
SWEEPS = (
    ("longest path, edges", "depth", (1, 2, 4, 8, 16, 32)),
    ("grid, samples along an edge", "grid", (8, 16, 32, 64, 128, 256)),
    ("extinction × radius", "sigma", (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)),
    ("contrast of the index", "delta", (0.003, 0.006, 0.012, 0.025, 0.05, 0.1)),
    ("film, pixels along an edge", "width", (12, 24, 48, 96, 192)),
)
COUNTS = ("edges", "field_evaluations", "shots")
SCENE = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="{depth}"/><integer name="rr_depth" value="1000"/></integrator>
  <sensor type="perspective"><float name="fov" value="22"/>
    <transform name="to_world"><lookat origin="0,0,-6" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{width}"/></film>
  </sensor>
  <emitter type="point"><point name="position" x="2" y="2" z="-2"/><rgb name="intensity" value="10"/></emitter>
  <shape type="sphere"><bsdf type="null"/>
    <medium name="interior" type="homogeneous">
      <float name="sigma_t" value="{sigma}"/><float name="albedo" value="1"/>
      <volume name="ior" type="bspline"><string name="filename" value="{grid}-{delta}.npy"/>
        <string name="axis_order" value="zyx"/><string name="placement" value="nodes"/>
        <transform name="to_world"><scale value="2.2"/><translate x="-1.1" y="-1.1" z="-1.1"/></transform></volume>
    </medium>
  </shape>
</scene>
"""


def program():
    build = ["cargo", "build", "--release", "--quiet", "-p", "morgana-cli", "--message-format=json"]
    output = subprocess.run(build, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    messages = (json.loads(line) for line in output.splitlines())
    return [m["executable"] for m in messages if m.get("executable")][-1]


def write_grid(folder, n, delta, precision="f8"):
    """1 + delta · exp(−2 r²) − its value at r = 1, so that the surface matches the index of air."""
    path = folder / f"{n}-{delta}.npy"
    if not path.exists():
        axis = np.linspace(-1.1, 1.1, n) ** 2
        grid = np.lib.format.open_memmap(path, mode="w+", dtype=precision, shape=(n, n, n))
        for plane, z in zip(grid, axis):
            plane[:] = 1 + delta * (np.exp(-2 * (z + axis[:, None] + axis)) - np.exp(-2))


def cost(binary, folder, values, spp):
    """Microseconds and counts, per sample of a pixel."""
    write_grid(folder, values["grid"], values["delta"])
    (folder / "scene.xml").write_text(SCENE.format(**values))
    command = [binary, "render", "scene.xml", "--quiet", "--threads", "1", "--spp", str(spp)]
    subprocess.run([*command, "-o", "image.npy", "--stats", "stats.json"], cwd=folder, check=True)
    stats = json.loads((folder / "stats.json").read_text())
    counts = {name: stats["counters"][name] / stats["samples"] for name in COUNTS}
    return {"microseconds": 1e6 * stats["seconds"] / stats["samples"], **counts}


def sweep(binary, folder, name, parameter, values, args):
    """Rows of medians; repeats go through all values in turn, so that a slow minute slows them all."""
    runs = {value: [] for value in values}
    for _ in range(args.repeats):
        for value in values:
            # As many samples for every film.
            spp = max(1, round(args.spp * (BASE["width"] / value) ** 2)) if parameter == "width" else args.spp
            runs[value].append(cost(binary, folder, {**BASE, parameter: value}, spp))
    return [(v, {k: statistics.median(run[k] for run in runs[v]) for k in runs[v][0]}) for v in values]


def exponent(rows, quantity):
    """Slope over the larger half, in logarithms."""
    half = rows[len(rows) // 2 - 1 :]
    x = np.log([value for value, _ in half])
    y = np.log([max(row[quantity], 1e-12) for _, row in half])
    return np.polyfit(x, y, 1)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--spp", type=int, default=16)
    args = parser.parse_args()
    binary = program()
    figure, axes = plt.subplots(1, len(SWEEPS), figsize=(14, 2.8), sharey=True, layout="constrained")
    print("| what grows | from … to | µs per sample | exponent: time | edges | field evaluations | shots |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for axis, (name, parameter, values) in zip(axes, SWEEPS):
            rows = sweep(binary, folder, name, parameter, values, args)
            times = " ".join(f"{row['microseconds']:.1f}" for _, row in rows)
            slopes = [f"{exponent(rows, q):+.2f}" for q in ("microseconds", *COUNTS)]
            print(f"| {name} | {values[0]:g} … {values[-1]:g} | {times} | {' | '.join(slopes)} |", flush=True)
            for quantity in ("microseconds", *COUNTS):
                shown = [row[quantity] or np.nan for _, row in rows]
                axis.loglog(values, shown, "o-", ms=3, label=quantity.replace("_", " "))
            axis.set_xlabel(name)
            axis.set_xticks(values[::2], [f"{value:g}" for value in values[::2]])
            axis.xaxis.set_minor_formatter(NullFormatter())
            axis.grid(alpha=0.3)
    axes[0].set_ylabel("per sample of a pixel")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)
    figure.savefig(PLOT)
    print(f"wrote {PLOT.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
