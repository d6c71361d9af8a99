#!/usr/bin/env python3
"""Renders the pictures of pages whose own commands render them small and fast. Needs Pillow.

Usage: scripts/page_pictures.py [--program target/release/morgana] [NAME ...]

A NAME is a picture without its folder and ending, such as start/glass; by default, all. The script follows the page like `scripts/documents.py`, and runs
the page's command for the picture with the film and the samples of PICTURES.
"""

import argparse
import dataclasses
import re
import shlex
import subprocess
import tempfile
from pathlib import Path

import documents
import panels
from PIL import Image

PICTURES = {
    "docs/start/first-scene.md": {
        "start/wall": (600, 360, 64),
        "start/glass": (600, 360, 128),
        "start/graded": (600, 360, 64),
        "start/fog": (600, 360, 64),
        "start/path": (420, 252, 48),
        "start/beam": (420, 252, 64),
    },
    "docs/guides/graphics.md": {
        "guides/glass": (408, 272, 256),
        "guides/graded": (408, 272, 128),
    },
}
"""Width, height and samples per pixel of each picture, by page."""

INTEGRATORS = {"start/beam": "bdpt", "guides/glass": "bdpt", "guides/graded": "bdpt"}
"""Integrators of pictures whose commands leave the choice to the pilot, which depends on the size of the film."""


@dataclasses.dataclass
class Pictures(documents.Page):
    """A page that renders its pictures, and does nothing else."""

    names: set = dataclasses.field(default_factory=set)
    program: Path = documents.PROGRAM
    threads: list = dataclasses.field(default_factory=list)

    def output(self, command, shown):
        """Runs a command if it copies a scene or renders a picture."""
        words = shlex.split(command)
        if words[0] == "cp":
            return super().output(command, shown)
        if words[:2] == ["morgana", "render"]:
            for name in sorted(self.names):
                if f"{Path(name).name}.png" in words:
                    self.render(name, words[2:])
        return ""

    def python(self, code):
        return ""

    def render(self, name, words):
        """Renders a picture by the scene, the parameters and the integrator of the page's command."""
        width, height, spp = PICTURES[self.name][name]
        scene = (self.folder / words[0]).read_text()
        for key, value in {"width": width, "height": height}.items():
            scene = re.sub(rf'(name="{key}" value=")\d+', rf"\g<1>{value}", scene)
        (self.folder / "large.xml").write_text(scene)
        kept = [word for i, word in enumerate(words) if "-D" in (word, words[i - 1]) or "--integrator" in (word, words[i - 1])]
        picture = documents.ROOT / f"docs/images/{name}.png"
        sampled = ["--sampler", f"ldsampler:{spp & -spp}", "--spp", str(spp), *self.threads]
        chosen = ["--integrator", INTEGRATORS[name]] if name in INTEGRATORS else []
        command = [self.program, "render", "large.xml", *kept, *chosen, *sampled, "-o", "large.png"]
        print(*command, flush=True)
        subprocess.run(command, cwd=self.folder, check=True)
        panels.save(Image.open(self.folder / "large.png").convert("RGB"), picture)
        print(f"{picture.relative_to(documents.ROOT)}: {picture.stat().st_size} bytes", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=Path, default=documents.ROOT / "target/release/morgana")
    parser.add_argument("--threads", help="threads of a render (default: all)")
    parser.add_argument("names", nargs="*", metavar="NAME")
    options = parser.parse_args()
    known = {name for pictures in PICTURES.values() for name in pictures}
    if unknown := set(options.names) - known:
        parser.error(f"no picture {', '.join(sorted(unknown))}; there are {', '.join(sorted(known))}")
    for page, pictures in PICTURES.items():
        if names := set(pictures) & set(options.names or known):
            with tempfile.TemporaryDirectory() as folder:
                Pictures(page, Path(folder), names=names, program=options.program.resolve(), threads=["--threads", options.threads] if options.threads else []).run()


if __name__ == "__main__":
    main()
