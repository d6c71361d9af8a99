#!/usr/bin/env python3
"""Compares two builds, by default the release build with the development build: equal seeds must give equal bits.

Tests run in the development profile, with checks of overflow. Users run release builds, and
compilers make errors: an iterator that development builds inlined correctly once put all light of
`bdpt` and `particle` one row too low in release builds. The script makes both builds and renders
the example scenes, small, by every integrator. A change that must leave all images as they are is
compared with the commit before it.

Usage: scripts/same_bits.py [--against COMMIT]
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
INTEGRATORS = ("path", "particle", "bdpt", "vcm", "photon", "sppm", "preview")
# Options of the render of a scene, and the type of its file.
PICTURE = (("-D", "width=24", "-D", "height=18", "--spp", "2"), "npy")
METERS = (("-D", "particles=2000"), "npz")


def variants(folder):
    """Returns example scenes as files beside links to their data, with the options and file type of
    each; scenes with cameras by each integrator."""
    for file in (ROOT / "scenes").iterdir():
        (folder / file.name).symlink_to(file)
    for scene in sorted((ROOT / "scenes").glob("*.xml")):
        text = scene.read_text()
        if "$particles" in text:
            yield scene, METERS
        elif '<integrator type="path"' not in text or '<sensor type="perspective"' not in text:
            yield scene, PICTURE
        else:
            for integrator in INTEGRATORS:
                copy = folder / f"{scene.stem}-{integrator}.xml"
                copy.write_text(text.replace('<integrator type="path"', f'<integrator type="{integrator}"'))
                yield copy, PICTURE


def render(program, scene, options, output):
    """Returns the bytes of a rendered scene; `None`, after a message, if the program fails."""
    command = [program, "render", scene, *options, "--seed", "3", "--quiet", "-o", output]
    if subprocess.run(command).returncode == 0:
        return output.read_bytes()
    print(f"{scene.stem}: {program} fails, see above", flush=True)
    return None


def build(root, target, profile):
    """Builds the program from the sources in `root`."""
    command = ["cargo", "build", "--quiet", "--bin", "morgana", "--target-dir", target]
    subprocess.run(command + ["--release"] * (profile == "release"), cwd=root, check=True)
    return target / profile / "morgana"


def build_commit(commit):
    """Makes the release build of a commit."""
    checkout = TARGET / "same_bits" / "checkout"
    git = ["git", "-C", ROOT, "worktree"]
    subprocess.run(git + ["add", "--force", "--detach", checkout, commit], check=True)
    try:
        return build(checkout, TARGET / "same_bits", "release")
    finally:
        subprocess.run(git + ["remove", "--force", checkout], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--against", metavar="COMMIT", help="compare release builds of this commit and of the sources as they are")
    against = parser.parse_args().against
    other = build_commit(against) if against else build(ROOT, TARGET, "debug")
    programs = (other, build(ROOT, TARGET, "release"))
    compared, differ = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for scene, (options, extension) in variants(folder):
            output = folder / f"output.{extension}"
            found = [render(program, scene, options, output) for program in programs]
            same = found[0] == found[1] and found[0] is not None
            compared += 1
            differ += not same
            print(f"{scene.stem}: {'the same' if same else 'DIFFERENT'}", flush=True)
    if differ:
        sys.exit(f"{differ} scenes differ")
    if not compared:
        sys.exit("there are no scenes to compare")


if __name__ == "__main__":
    main()
