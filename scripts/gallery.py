#!/usr/bin/env python3
"""Renders pictures of docs/gallery.md by the commands of the page. Needs NumPy and Pillow.

Usage: scripts/gallery.py [--program target/release/morgana] [NAME ...]

A NAME is a picture without its folder and ending, such as laser_tank; by default, all. The commands
run one after the other, in a temporary folder for intermediate files. The script then halves the
pictures in HALVED, and reduces large pictures to 256 colours.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import panels
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.DOTALL | re.MULTILINE)
LARGE = 300_000
"""Size of a file above which a picture has 256 colours, in bytes. Gradients of small pictures would show steps."""
HALVED = {"grin_glass", "mirage", "mirror_caustic"}
"""Pictures that are stored with half their width and height: means over four pixels have half the noise."""
PICTURE = re.compile(r"docs/images/(\w+)\.(?:png|svg)")


def blocks() -> list[tuple[set[str], str]]:
    """Returns the blocks of commands, each with the names of its pictures."""
    page = (ROOT / "docs/gallery.md").read_text()
    return [(set(PICTURE.findall(block)), block) for block in BLOCK.findall(page)]


def shrink(path: pathlib.Path) -> None:
    """Halves a picture if it is noisy, and reduces it to 256 colours if its file is large."""
    if path.stem in HALVED:
        Image.open(path).convert("RGB").reduce(2).save(path, optimize=True)
    if path.exists() and path.stat().st_size > LARGE:
        panels.save(Image.open(path).convert("RGB"), path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/morgana")
    parser.add_argument("names", nargs="*", metavar="NAME")
    args = parser.parse_args()
    known = set().union(*(names for names, _ in blocks()))
    if unknown := set(args.names) - known:
        parser.error(f"no commands for {', '.join(sorted(unknown))}; there are {', '.join(sorted(known))}")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for part in ("docs", "scenes", "scripts"):
            (folder / part).symlink_to(ROOT / part)
        (folder / "bin").mkdir()
        (folder / "bin/morgana").symlink_to(args.program.resolve())
        places = [folder / "bin", pathlib.Path(sys.executable).parent, os.environ["PATH"]]
        environment = {**os.environ, "PATH": ":".join(map(str, places))}
        for names, block in blocks():
            if names & set(args.names or known):
                subprocess.run(["bash", "-e", "-c", block], cwd=folder, env=environment, check=True)
                for picture in names:
                    shrink(ROOT / f"docs/images/{picture}.png")


if __name__ == "__main__":
    main()
