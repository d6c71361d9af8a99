#!/usr/bin/env python3
"""Measures how the cost of renders, of loading and of samples grows with the size of the scene.

The sweeps of renders are over path length, grid size, optical thickness, field strength and film
size. The sweeps of loading and of a sample are over the number of objects, wavelengths and
instants.

Renders a ball of fog with a sampled index, by the release binary, which it builds, on one thread.
Prints a table with the exponents of power laws fitted to the largest half of each sweep, for
docs/performance.md, and writes docs/images/cost_growth.svg. A second table has processor times and
peak memory. Needs NumPy and Matplotlib.

Usage: scripts/cost_growth.py [--repeats N] [--spp N]
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.ticker import NullFormatter

ROOT = pathlib.Path(__file__).resolve().parent.parent
PLOT = ROOT / "docs/images/cost_growth.svg"
# Defaults of the parameters. Each sweep below has a name, its parameter, and the parameter's
# values.
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


# Surfaces of balls that share a medium in a box of fog, by the name of the sweep.
BALLS = {"fog": "null", "glass": "dielectric"}
OBJECTS = (10, 100, 1000, 10_000, 100_000)
WAVELENGTHS = (3, 8, 32)
INSTANTS = (1, 2, 8)
# Triangles along an edge of the mesh and samples along an edge of the grid, for scenes with several
# wavelengths or instants.
MESH, GRID = 225, 256
VIEW = """<scene version="3.0.0"><integrator type="path"/><emitter type="constant"/>
  <sensor type="perspective"><transform name="to_world"><lookat origin="0,-5,0" target="0,0,0" up="0,0,1"/></transform>
    <sampler type="independent"><integer name="sample_count" value="{instants}"/><integer name="phases" value="{instants}"/></sampler>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>{channels}</film></sensor>
"""


def balls(count, bsdf):
    """Returns a scene of balls at the points of a lattice."""
    edge = next(n for n in range(1, 1000) if n**3 >= count)
    radius, index = 0.25 / edge, '<float name="ior" value="1.33"/>' if bsdf == "dielectric" else ""
    text = VIEW.format(instants=1, channels="") + f"""<medium type="homogeneous" id="fog"><float name="sigma_t" value="1"/></medium>
      <medium type="homogeneous" id="ball"><float name="sigma_t" value="2"/>{index}</medium>
      <shape type="cube"><bsdf type="null"/><ref id="fog" name="interior"/></shape>"""
    for place in range(count):
        x, y, z = (2 * ((place // edge**k % edge) + 0.5) / edge - 1 for k in range(3))
        text += f"""<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="{radius}"/>
          <bsdf type="{bsdf}"/><ref id="ball" name="interior"/><ref id="fog" name="exterior"/></shape>"""
    return text + "</scene>"


def write_mesh(path):
    """Writes a bumpy ball of about 100 000 triangles."""
    n = MESH
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.linspace(0.01, np.pi - 0.01, n), indexing="ij")
    r = 1 + 0.05 * np.sin(7 * u) * np.sin(5 * v)
    points = np.stack([r * np.cos(u) * np.sin(v), r * np.sin(u) * np.sin(v), r * np.cos(v)], -1).reshape(-1, 3)
    a = (np.arange(n)[:, None] * n + np.arange(n - 1)).ravel()
    b = ((np.arange(n)[:, None] + 1) % n * n + np.arange(n - 1)).ravel()
    poles, ring = len(points), np.arange(n) * n
    following = np.roll(ring, -1)
    north = np.stack([np.full(n, poles), following, ring], -1)
    south = np.stack([np.full(n, poles + 1), ring + n - 1, following + n - 1], -1)
    faces = np.concatenate([np.stack([a, b, b + 1], -1), np.stack([a, b + 1, a + 1], -1), north, south])
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]]).astype("<f4")
    records = np.zeros(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    records["count"], records["corners"] = 3, faces
    properties = "".join(f"property float {axis}\n" for axis in "xyz")
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{properties}element face {len(faces)}\n"
    path.write_bytes(f"{header}property list uchar int vertex_indices\nend_header\n".encode() + points.tobytes() + records.tobytes())


def body(folder, wavelengths=3, instants=1):
    """Returns a scene of a mesh with a grid of extinctions and an index with sound."""
    if not (folder / "body.ply").exists():
        write_mesh(folder / "body.ply")
        x = np.indices((GRID,) * 3, dtype="f4") / GRID
        np.save(folder / "body.npy", 0.5 + 0.4 * np.sin(9 * x[0]) * np.sin(7 * x[1]) * np.cos(5 * x[2]))
    listed = ", ".join(f"{400 + 10 * i}" for i in range(wavelengths))
    spectral = f'<string name="pixel_format" value="spectral"/><string name="wavelengths" value="{listed}"/>'
    return VIEW.format(instants=instants, channels=spectral if wavelengths > 3 else "") + """
      <shape type="ply"><string name="filename" value="body.ply"/><bsdf type="null"/><medium type="heterogeneous" name="interior">
        <volume type="gridvolume" name="sigma_t"><string name="filename" value="body.npy"/><string name="axis_order" value="zyx"/>
          <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2.4"/></transform></volume>
        <volume type="acoustic" name="ior"><float name="n0" value="1.33"/><float name="amplitude" value="1e-5"/>
          <float name="wave_number" value="9"/></volume></medium></shape></scene>"""


# Run programs from a small process: the peak memory of a child includes that of the process that
# starts it.
SHIM = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
usage = resource.getrusage(resource.RUSAGE_CHILDREN)
print(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3)
"""


def spent(command, folder):
    """Returns processor time in seconds and peak memory in megabytes of a program."""
    shim = [sys.executable, "-S", "-c", SHIM, *command]
    output = subprocess.run(shim, cwd=folder, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
    seconds, memory = map(float, output.split())
    return seconds, memory


def whole(binary, folder, text, spp, repeats):
    """Returns medians of seconds and megabytes of loading, and of microseconds of a sample, if
    `spp` is not 0."""
    (folder / "whole.xml").write_text(text)
    loading = [spent([binary, "check", "whole.xml"], folder) for _ in range(repeats)]
    seconds, memory = (statistics.median(column) for column in zip(*loading))
    if spp == 0:
        return seconds, memory, None
    # The difference cancels work that a render does once, such as its pilot.
    render = [binary, "render", "whole.xml", "--quiet", "--threads", "1", "-o", "image.npy", "--spp"]
    differences = []
    for _ in range(repeats):
        few, many = (spent([*render, str(n)], folder)[0] for n in (spp // 8, spp))
        differences.append((many - few) / (64 * (spp - spp // 8)))
    return seconds, memory, 1e6 * statistics.median(differences)


def wholes(binary, folder, repeats):
    """Prints the table of loading."""
    print("\n| parameter | from … to | loading, s of processor time | peak memory, MB | µs per sample |\n|---|---|---|---|---|")
    rows = [(f"balls of {name} in fog", OBJECTS, lambda n, bsdf=bsdf: balls(n, bsdf), 4096) for name, bsdf in BALLS.items()]
    rows += [
        ("wavelengths", WAVELENGTHS, lambda n: body(folder, wavelengths=n), 0),
        ("instants of sound", INSTANTS, lambda n: body(folder, instants=n), 0),
    ]
    for name, values, text, spp in rows:
        found = [whole(binary, folder, text(n), spp, repeats) for n in values]
        seconds = " ".join(f"{row[0]:.2f}" for row in found)
        memory = " ".join(f"{row[1]:.0f}" for row in found)
        samples = " ".join(f"{row[2]:.1f}" for row in found) if spp else ""
        print(f"| {name} | {values[0]} … {values[-1]} | {seconds} | {memory} | {samples} |", flush=True)


def program():
    build = ["cargo", "build", "--release", "--quiet", "-p", "morgana-cli", "--message-format=json"]
    output = subprocess.run(build, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    messages = (json.loads(line) for line in output.splitlines())
    return [m["executable"] for m in messages if m.get("executable")][-1]


def write_grid(folder, n, delta, precision="f8"):
    """Writes 1 + delta · exp(−2 r²) − its value at r = 1, so that the surface matches the index of
    air."""
    path = folder / f"{n}-{delta}.npy"
    if not path.exists():
        axis = np.linspace(-1.1, 1.1, n) ** 2
        grid = np.lib.format.open_memmap(path, mode="w+", dtype=precision, shape=(n, n, n))
        for plane, z in zip(grid, axis):
            plane[:] = 1 + delta * (np.exp(-2 * (z + axis[:, None] + axis)) - np.exp(-2))


def cost(binary, folder, values, spp):
    """Returns microseconds and counts, per sample of a pixel."""
    write_grid(folder, values["grid"], values["delta"])
    (folder / "scene.xml").write_text(SCENE.format(**values))
    command = [binary, "render", "scene.xml", "--quiet", "--threads", "1", "--spp", str(spp)]
    subprocess.run([*command, "-o", "image.npy", "--stats", "stats.json"], cwd=folder, check=True)
    stats = json.loads((folder / "stats.json").read_text())
    counts = {name: stats["counters"][name] / stats["samples"] for name in COUNTS}
    return {"microseconds": 1e6 * stats["seconds"] / stats["samples"], **counts}


def sweep(binary, folder, name, parameter, values, args):
    """Returns rows of medians. Repeats cycle through all values, so that a slow minute affects them
    all."""
    runs = {value: [] for value in values}
    for _ in range(args.repeats):
        for value in values:
            # Take equally many samples for every film.
            spp = max(1, round(args.spp * (BASE["width"] / value) ** 2)) if parameter == "width" else args.spp
            runs[value].append(cost(binary, folder, {**BASE, parameter: value}, spp))
    return [(v, {k: statistics.median(run[k] for run in runs[v]) for k in runs[v][0]}) for v in values]


def exponent(rows, quantity):
    """Returns the slope over the larger half, in logarithms."""
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
    print("| parameter | from … to | µs per sample | exponent: time | edges | field evaluations | shots |")
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
        wholes(binary, folder, args.repeats)
    axes[0].set_ylabel("per sample of a pixel")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)
    figure.savefig(PLOT)
    print(f"wrote {PLOT.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
