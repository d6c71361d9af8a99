#!/usr/bin/env python3
"""Compares fluence, speed and efficiency in labelled voxels with MMC, cell by cell.

A cube of voxels of 1 mm has three labels that differ in every property, including the index. MMC
(https://mcx.space/mmc; its native program, not one of the GPU interfaces) has the voxels as six
tetrahedra each; with --tetrahedra, morgana has these, too. MMC reports no errors; they come from independent seeds. Both programs run
on one thread, and the particles per second refer to the processor time of the whole program. The
efficiency is 1/(variance x processor time), for all particles of either program; its ratio is the
mean over cells.

Usage: scripts/compare_mmc.py MMC [--particles N] [--seeds N] [--own N] [--gates N] [--size N] [--tetrahedra]
                              [--pmmc PYTHON]

MMC is the program; needs NumPy. PYTHON is one that has pmmc (PyPI) and finds an OpenCL
implementation for CPUs, such as pocl. Its particles per second are shown, too, after a first run
that compiles its kernel. Its fluence is not compared, because it scales the fluence of elements
with different absorption differently.
"""

import argparse
import itertools
import json
import os
import pathlib
import resource
import subprocess
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "morgana"

PROPERTIES = [[0, 0, 1, 1], [0.005, 1.0, 0.01, 1.37], [0.02, 5.0, 0.9, 1.37], [0.05, 2.0, 0.8, 1.5]]
LAST = {False: 5e-9, True: 1e-9}
"""End of the only gate, or of the last of several, in seconds."""
LIGHT = 2.99792458e11
"""mm/s"""


def labels(size):
    """Returns labels [x, y, z]: two layers and a ball."""
    x, y, z = (np.indices((size,) * 3) + 0.5) / size
    found = np.where(z > 0.4, 2, 1)
    found[(x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.3) ** 2 < 0.15**2] = 3
    return found


def source(size):
    """Returns the position of the beam's start, inside an element."""
    return [size / 2 + 0.01, size / 2 + 0.02, 0.0001]


def tetrahedra(size):
    """Returns nodes, and elements with their labels: Kuhn's six tetrahedra per voxel."""
    n = size + 1
    node = [[i, j, k] for k in range(n) for j in range(n) for i in range(n)]
    of = labels(size)
    elements = []
    for k, j, i in itertools.product(range(size), repeat=3):
        for order in itertools.permutations(range(3)):
            corner = [i, j, k]
            corners = [list(corner)]
            for axis in order:
                corner[axis] += 1
                corners.append(list(corner))
            a, b, c, d = np.array(corners, float)
            if np.linalg.det([b - a, c - a, d - a]) < 0:
                corners[2], corners[3] = corners[3], corners[2]
            numbers = [1 + x + n * (y + n * z) for x, y, z in corners]
            elements.append([*numbers, int(of[i, j, k])])
    return np.array(node, float), np.array(elements)


def first_element(node, elements, place):
    """Returns the number of the element that contains a place, from 1."""
    for i, element in enumerate(elements):
        a, b, c, d = node[element[:4] - 1]
        if np.abs((a + b + c + d) / 4 - place).max() > 1.2:
            continue
        w = np.linalg.solve(np.array([b - a, c - a, d - a]).T, place - a)
        if min(w.min(), 1 - w.sum()) > 0:
            return i + 1
    raise SystemExit("the source is outside of the mesh")


def run(command, folder):
    """Runs a program. Returns its processor time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, check=True, capture_output=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def by_mmc(args, folder):
    """Returns fluence [seed, gate, z, y, x] per joule, and the processor time."""
    size = args.size
    node, elements = tetrahedra(size)
    media = [dict(zip(["mua", "mus", "g", "n"], row)) for row in PROPERTIES]
    setting = {
        "Session": {"ID": "box", "Photons": args.particles, "DoMismatch": 1, "DoSpecular": 0, "DoNormalize": 1, "RayTracer": "g", "OutputType": "f", "OutputFormat": "mc2"},
        "Forward": {"T0": 0, "T1": args.last, "Dt": args.last / args.gates},
        "Domain": {"Media": media},
        "Optode": {"Source": {"Type": "pencil", "Pos": source(size), "Dir": [0, 0, 1]}},
        "Mesh": {"MeshID": "box", "InitElem": first_element(node, elements, source(size)), "MeshNode": node.tolist(), "MeshElem": elements.tolist()},
    }
    found, seconds = [], 0.0
    for seed in range(args.seeds):
        setting["Session"]["RNGSeed"] = 1000 + seed
        (folder / "box.json").write_text(json.dumps(setting))
        seconds += run([args.mmc, "-f", "box.json", "--gpu", "-1"], folder)
        grid = np.fromfile(folder / "box.mc2").reshape(args.gates, size + 1, size + 1, size + 1)
        found.append(grid[:, :size, :size, :size])
    return np.array(found), seconds


PMMC = """
import json, resource, sys
import numpy as np
import pmmc

setting = json.load(open("pmmc.json"))
arrays = {name: np.array(setting.pop(name)) for name in ["node", "elem", "elemprop"]}


def run(particles):
    before = resource.getrusage(resource.RUSAGE_SELF)
    pmmc.run({**setting, **arrays, "nphoton": particles})
    after = resource.getrusage(resource.RUSAGE_SELF)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


run(1000)
print("seconds", run(int(sys.argv[1])), file=sys.stderr)
"""


def by_pmmc(args, folder):
    """Returns particles per second by MMC's OpenCL interface."""
    node, elements = tetrahedra(args.size)
    setting = {
        "node": node.tolist(), "elem": elements[:, :4].tolist(), "elemprop": elements[:, 4].tolist(), "prop": PROPERTIES, "srcpos": source(args.size),
        "srcdir": [0, 0, 1], "tstart": 0, "tend": args.last, "tstep": args.last / args.gates, "e0": first_element(node, elements, source(args.size)), "isreflect": 1,
        "gpuid": 1, "method": "elem", "basisorder": 0, "outputtype": "flux",
    }  # fmt: skip
    (folder / "pmmc.json").write_text(json.dumps(setting))
    particles = args.particles * args.seeds
    done = subprocess.run([args.pmmc, "-c", PMMC, str(particles)], cwd=folder, check=True, capture_output=True, text=True)
    return particles / float(done.stderr.split()[-1])


def by_morgana(args, folder):
    """Returns arrays of the output, the number of particles and the processor time."""
    size = args.size
    if args.tetrahedra:
        node, elements = tetrahedra(size)
        tissue = {"type": "tetrahedra", "filename": "mesh.jmsh"}
        (folder / "mesh.jmsh").write_text(json.dumps({"MeshNode": node.tolist(), "MeshElem": elements.tolist()}))
    else:
        tissue = {"type": "labels", "filename": "labels.npy", "axis_order": "xyz", "to_world": [{"scale": size}]}
        np.save(folder / "labels.npy", labels(size).astype(np.uint8))
    cells = {
        "type": "fluencemeter", "normalization": "per_watt", "nx": size, "ny": size, "nz": size,
        "to_world": [{"scale": size}],
    }
    if args.gates > 1:
        cells |= {"max_bound": LIGHT * args.last, "bin_width": LIGHT * args.last / args.gates, "weight_windows": True}
    scene = {
        "type": "scene",
        "integrator": {"type": "particle"},
        "tissue": {**tissue, "properties": PROPERTIES},
        "beam": {"type": "collimated", "radius": 1e-4, "power": 1, "to_world": [{"translate": source(size)}]},
        "cells": cells,
    }
    (folder / "scene.json").write_text(json.dumps(scene))
    particles = args.own or args.particles * args.seeds
    seconds = run([PROGRAM, "render", "scene.json", "--particles", str(particles), "--threads", "1", "-o", "box.npz"], folder)
    return np.load(folder / "box.npz"), particles, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mmc", type=pathlib.Path)
    parser.add_argument("--particles", type=int, default=200_000, help="of MMC, for each seed")
    parser.add_argument("--own", type=int, help="of morgana; those of all seeds if not given")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--gates", type=int, default=1)
    parser.add_argument("--size", type=int, default=20, help="voxels along an edge")
    parser.add_argument("--tetrahedra", action="store_true", help="morgana has MMC's tetrahedra instead of voxels")
    parser.add_argument("--pmmc", help="a Python that has pmmc")
    args = parser.parse_args()
    args.mmc = args.mmc.resolve()
    args.last = LAST[args.gates > 1]
    with tempfile.TemporaryDirectory() as kept:
        folder = pathlib.Path(kept)
        theirs, their_seconds = by_mmc(args, folder)
        ours, particles, our_seconds = by_morgana(args, folder)
        rates = {"MMC": args.particles * args.seeds / their_seconds, "morgana": particles / our_seconds}
        if args.pmmc:
            rates["pmmc"] = by_pmmc(args, folder)
    mean, error = theirs.mean(0), theirs.std(0, ddof=1) / np.sqrt(args.seeds)
    shape = mean.shape
    fluence, own, few = (ours[name].reshape(shape) for name in ["fluence", "fluence_error", "fluence_few"])
    for gate in range(args.gates):
        sure = (few[gate] == 0) & (error[gate] > 0)
        z = (fluence[gate] - mean[gate])[sure] / np.hypot(own[gate], error[gate])[sure]
        total = fluence[gate].sum() / mean[gate].sum()
        gain = np.mean((error[gate] / own[gate])[sure] ** 2) * their_seconds / our_seconds
        print(
            f"gate {gate}: {sure.sum()} cells, z mean {z.mean():+.3f}, standard deviation {z.std():.3f}, sum {total:.4f} of MMC's; "
            f"efficiency {gain:.2f} of MMC's"
        )
    print("particles per second of processor time: " + ", ".join(f"{name} {rate:.0f}" for name, rate in rates.items()))


if __name__ == "__main__":
    main()
