#!/usr/bin/env python3
"""Builds the program by profile-guided optimisation (PGO): equal images bit for bit, in less time.

Builds the program with counters, renders small scenes, and builds it again with frequently run code
laid out to run fast. Checks that it gives equal bits to the plain release build, and measures the
gain. The result is target/pgo/release/morgana. The Python package is built likewise with
RUSTFLAGS="-Cprofile-use=…/target/pgo/morgana.profdata" pip install .

Needs llvm-profdata: `rustup component add llvm-tools`, or that of LLVM 19 or newer with its path
given by --profdata. Takes about ten minutes on two cores.

Usage: scripts/build_pgo.py [--profdata PATH]
"""

import argparse
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile

from same_bits import PICTURE, ROOT, TARGET, variants

PGO = TARGET / "pgo"
PROFILE = PGO / "morgana.profdata"
# Scenes with straight rays.
STRAIGHT = sorted((ROOT / "crates" / "io" / "tests" / "data").glob("p[1-5]*.xml"))
TIMED = [*STRAIGHT, *(ROOT / "scenes" / f"{name}.xml" for name in ("luneburg_fog", "grid_lens", "acoustic_waveguide"))]
PAIRS = 7


def profdata(given):
    """Returns the program that merges profiles."""
    if given:
        return shutil.which(given) or sys.exit(f"{given}: there is no such program")
    ask = lambda *what: subprocess.run(["rustc", *what], capture_output=True, text=True, check=True).stdout
    host = next(line.split()[1] for line in ask("-vV").splitlines() if line.startswith("host:"))
    own = pathlib.Path(ask("--print", "sysroot").strip()) / "lib" / "rustlib" / host / "bin" / "llvm-profdata"
    found = own if own.exists() else shutil.which("llvm-profdata")
    return found or sys.exit("llvm-profdata is missing: rustup component add llvm-tools, or --profdata PATH")


def build(target, *flags):
    """Builds the program into a folder with flags besides the user's; returns its path."""
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    if flags:
        # Use the encoded form, which allows paths with spaces.
        encoded = environment.get("CARGO_ENCODED_RUSTFLAGS")
        own = encoded.split("\x1f") if encoded else environment.get("RUSTFLAGS", "").split()
        environment["CARGO_ENCODED_RUSTFLAGS"] = "\x1f".join([*own, *flags])
    print(f"building {target / 'release'}", flush=True)
    subprocess.run(["cargo", "build", "--release", "-p", "morgana-cli"], cwd=ROOT, env=environment, check=True)
    return target / "release" / "morgana"


def render(program, scene, options, output):
    """Returns the bytes of a rendered scene, and the processor time of the render."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([program, "render", scene, *options, "--seed", "3", "--quiet", "-o", output], check=True)
    return output.read_bytes(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def scenes(folder):
    """Returns the scenes for training and comparison."""
    yield from variants(folder)
    yield from ((scene, (("--spp", "4"), "npy")) for scene in STRAIGHT)


def train(program, merge):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for scene, (options, extension) in scenes(folder):
            render(program, scene, options, folder / f"output.{extension}")
    raw = sorted((PGO / "raw").glob("*.profraw"))
    if not raw:
        sys.exit(f"no profiles in {PGO / 'raw'}: the program was not built with counters")
    if subprocess.run([merge, "merge", "-o", PROFILE, *raw]).returncode != 0:
        sys.exit(f"{merge} cannot merge the profiles: if their version is unsupported, a newer LLVM is needed")


def compare(plain, pgo):
    """Compares the bits of all scenes, and the times of some."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for scene, (options, extension) in scenes(folder):
            output = folder / f"output.{extension}"
            one, other = (render(program, scene, options, output)[0] for program in (plain, pgo))
            if one != other:
                sys.exit(f"{scene.stem}: the PGO build gives other bits")
        for scene in TIMED:
            size = () if scene in STRAIGHT else PICTURE[0][:4]
            options = (*size, "--spp", "32", "--threads", "1")
            time = lambda program: render(program, scene, options, folder / "output.npy")[1]
            ratio = statistics.median(time(plain) / time(pgo) for _ in range(PAIRS))
            print(f"{scene.stem}: {ratio:.2f} times as fast", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--profdata", help="path of llvm-profdata")
    merge = profdata(parser.parse_args().profdata)
    shutil.rmtree(PGO / "raw", ignore_errors=True)
    counting = build(PGO / "counting", f"-Cprofile-generate={PGO / 'raw'}")
    train(counting, merge)
    pgo = build(PGO, f"-Cprofile-use={PROFILE}")
    compare(build(TARGET), pgo)
    print(f"the same bits as the plain build: {pgo}")


if __name__ == "__main__":
    main()
