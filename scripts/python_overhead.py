#!/usr/bin/env python3
"""Compares the cost of a render from Python with that of the program, as whole processes.

Builds the release binary and a release wheel, installs the wheel into target/overhead-venv, and
renders one scene with one seed both ways on one thread. First it counts instructions by Valgrind's
callgrind, at two numbers of samples of a small image, which separates the cost per sample from the
rest. Then it measures processor time, both ways in turn, and prints the ratios pair by pair, and
their median: on a busy machine these are less reliable.

Usage: scripts/python_overhead.py [--pairs N] [--spp N]        about a minute for each timed render by default
"""

import argparse
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import venv

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENE = ROOT / "scenes/luneburg_fog.xml"
VENV = ROOT / "target/overhead-venv"
CODE = """
import morgana, sys
scene, spp, path, *size = sys.argv[1:]
size = dict(zip(("width", "height"), map(int, size)))
result = morgana.render(morgana.load_file(scene, **size), spp=int(spp), threads=1)
morgana.write(path, result)
"""


def prepare():
    subprocess.run(["cargo", "build", "--release", "--quiet", "-p", "morgana-cli"], cwd=ROOT, check=True)
    if not VENV.exists():
        venv.create(VENV, with_pip=True)
    python = VENV / "bin/python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", ROOT], check=True)
    return str(python), str(ROOT / "target/release/morgana")


def from_python(python, spp, path, size=()):
    return [python, "-c", CODE, str(SCENE), str(spp), path, *map(str, size)]


def from_program(program, spp, path, size=()):
    sizes = (f"{name}={value}" for name, value in zip(("width", "height"), size))
    defines = [word for size in sizes for word in ("-D", size)]
    return [program, "render", str(SCENE), "--spp", str(spp), "--threads", "1", "--quiet", "-o", path, *defines]


def seconds(command):
    """Returns the processor time of a process."""
    pid = os.posix_spawn(command[0], command, os.environ)
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"failed: {command}")
    return usage.ru_utime + usage.ru_stime


def instructions(command):
    """Returns the instructions of a process."""
    callgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *command]
    output = subprocess.run(callgrind, check=True, capture_output=True, text=True, errors="replace").stderr
    return int(re.search(r"Collected : (\d+)", output)[1])


def count(python, program, folder):
    few, many, size = 1, 4, (48, 29)
    costs = []
    for command, path in ((lambda n, p: from_python(python, n, p, size), "python.npy"),
                          (lambda n, p: from_program(program, n, p, size), "program.npy")):
        a, b = (instructions(command(spp, f"{folder}/{path}")) for spp in (few, many))
        costs.append(((b - a) / (many - few), a - (b - a) / (many - few) * few))
    (sample, fixed), (program_sample, program_fixed) = costs
    print(f"instructions for a sample of every pixel: Python by program {sample / program_sample:.4f}")
    print(f"instructions besides: Python {fixed / 1e6:.0f} million, program {program_fixed / 1e6:.0f} million", flush=True)


def measure(python, program, folder, args):
    ratios = []
    ours, theirs = f"{folder}/python.npy", f"{folder}/program.npy"
    for _ in range(args.pairs):
        a = seconds(from_python(python, args.spp, ours))
        b = seconds(from_program(program, args.spp, theirs))
        same = pathlib.Path(ours).read_bytes() == pathlib.Path(theirs).read_bytes()
        ratios.append(a / b)
        print(f"Python {a:.2f} s, program {b:.2f} s, ratio {a / b:.4f}, equal files: {same}", flush=True)
    print(f"median ratio {statistics.median(ratios):.4f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--spp", type=int, default=64)
    args = parser.parse_args()
    python, program = prepare()
    with tempfile.TemporaryDirectory() as folder:
        count(python, program, folder)
        if args.pairs:
            measure(python, program, folder, args)


if __name__ == "__main__":
    main()
