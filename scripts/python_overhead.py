#!/usr/bin/env python3
"""Compares the time of a render from Python with that of the program, whole processes, in turn.

Builds the release binary and a release wheel, installs the wheel into target/overhead-venv, and renders the same scene with the
same seed both ways on one thread. Prints the ratios of processor time, pair by pair, and their median.

Usage: scripts/python_overhead.py [--pairs N] [--spp N]        about a minute for each render by default
"""

import argparse
import os
import pathlib
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
result = morgana.render(morgana.load_file(sys.argv[1]), spp=int(sys.argv[2]), threads=1)
morgana.write(sys.argv[3], result)
"""


def prepare():
    subprocess.run(["cargo", "build", "--release", "--quiet", "-p", "morgana"], cwd=ROOT, check=True)
    if not VENV.exists():
        venv.create(VENV, with_pip=True)
    python = VENV / "bin/python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", ROOT], check=True)
    return python


def seconds(command):
    """Processor time of a process."""
    pid = os.posix_spawn(command[0], command, os.environ)
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"failed: {command}")
    return usage.ru_utime + usage.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--spp", type=int, default=64)
    args = parser.parse_args()
    python = str(prepare())
    program = str(ROOT / "target/release/morgana")
    spp = str(args.spp)
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = f"{folder}/python.npy", f"{folder}/program.npy"
        for _ in range(args.pairs):
            a = seconds([python, "-c", CODE, str(SCENE), spp, ours])
            b = seconds([program, "render", str(SCENE), "--spp", spp, "--threads", "1", "--quiet", "-o", theirs])
            same = pathlib.Path(ours).read_bytes() == pathlib.Path(theirs).read_bytes()
            ratios.append(a / b)
            print(f"Python {a:.2f} s, program {b:.2f} s, ratio {a / b:.4f}, equal files: {same}", flush=True)
    print(f"median ratio {statistics.median(ratios):.4f}")


if __name__ == "__main__":
    main()
