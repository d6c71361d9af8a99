#!/usr/bin/env python3
"""Runs the pages of the documentation, and compares what they print with what they show.

    scripts/documents.py [--write] [--long] [PAGE ...]

A page is a program that runs in an empty folder beside `scenes`, from top to bottom:

* A block with a title, such as ```` ```xml title="slab.xml" ````, is a file. If the block is a part of an XML file, it changes the file: its elements
  replace the elements of the same kind and name, or become the last of the scene. If a block repeats a whole scene, this scene must be as the parts have
  made it.
* A `console` block has commands after `$ `, each with its output. An empty output is not compared.
* A `python` block runs in the namespace of the page. A `text` block right after it shows its output.

Outputs have `…` in place of times, speeds and ratios of speeds, which differ from run to run (`MASKS`). A page may omit notes and warnings about scenes;
it must repeat exactly those that it shows. A comment before a block changes this:

* `<!-- long: REASON -->`: the block runs only with `--long`, and in the tests with `MORGANA_LONG_TESTS`;
* `<!-- not run: REASON -->`: the block never runs.

`--write` puts the outputs into the pages. The package `morgana` must be installed. The program is `morgana` in `$CARGO_TARGET_DIR/debug`, or else in `target/debug`.
"""

import argparse
import contextlib
import dataclasses
import difflib
import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/morgana"

PAGES = [
    "README.md",
    *sorted(path.relative_to(ROOT).as_posix() for folder in ["start", "guides"] for path in (ROOT / "docs" / folder).glob("*.md")),
    *(f"docs/{name}.md" for name in ["checks", "clusters", "gallery", "images", "meters", "python"]),
]
"""Pages that run."""

MASKS = [
    # The report of a render: time, speed, and ratios that a pilot has measured.
    (r"^(shard \d+ of \d+: )?(\d+ h |\d+ min )?[\d.]+ (s|min) · ", r"\1… · "),
    (r" · [\d.]+( [kMG])? (samples|particles)/s", " · …"),
    (r"a pilot finds it [^·\n]*[^·\s]", "a pilot finds it …"),
    # `morgana status`.
    (r" in [^\n]* of computing", " in … of computing"),
    (r" photons in [\d.]+ s\b", " photons in … s"),
]
"""Patterns of outputs that depend on the machine or on its load, each with its replacement."""

BLOCK = re.compile(
    r'(?:^<!-- (?P<marker>long|not run): [^\n]* -->\n+)?^```(?P<language>\w*)(?: title="(?P<title>[^"\n]+)")?\n(?P<content>.*?)^```$', re.DOTALL | re.MULTILINE
)
SHOWN = re.compile(r"\n\n```text\n(?P<content>.*?)^```$", re.DOTALL | re.MULTILINE)
DIAGNOSTIC = re.compile(r"^(?:note|warning)\[.*?(?:\n\n|\Z)", re.DOTALL | re.MULTILINE)
BUILD_AND_RUN = "cargo run --release -p morgana-cli -- "
"""Start of commands that build the program before they run it."""


@dataclasses.dataclass
class Page:
    """A page and the folder in which it runs."""

    name: str
    folder: Path
    long: bool = False
    namespace: dict = dataclasses.field(default_factory=lambda: {"__name__": "__main__"})

    def run(self):
        """Runs the page. Returns its text, with the outputs of this run."""
        (self.folder / "scenes").symlink_to(ROOT / "scenes")
        text = (ROOT / self.name).read_text()
        pieces, end = [], 0
        with contextlib.chdir(self.folder):
            for block in BLOCK.finditer(text):
                if block["marker"] == "not run" or (block["marker"] == "long" and not self.long):
                    continue
                if block["title"]:
                    self.save(block["title"], block["content"])
                elif block["language"] == "console":
                    pieces += [text[end : block.start("content")], self.console(block["content"])]
                    end = block.end("content")
                elif block["language"] == "python":
                    line = text.count("\n", 0, block.start("content"))
                    printed = self.python("\n" * line + block["content"])
                    shown = SHOWN.match(text, block.end())
                    if printed or shown:
                        pieces += [text[end : block.end()], f"\n\n```text\n{printed}```"]
                        end = shown.end() if shown else block.end()
        return "".join(pieces) + text[end:]

    def save(self, title, content):
        """Writes a block into a file, or changes the file by it."""
        path = self.folder / title
        if path.suffix == ".xml" and not content.startswith("<scene"):
            content = merged(path.read_text(), content)
        elif path.exists() and elements(path.read_text()) not in ([], elements(content)):
            raise ValueError(f"{self.name}: the parts of {title} make another scene than the whole file")
        path.write_text(content)

    def console(self, content):
        """Runs the commands of a block. Returns the block with their outputs."""
        parts = re.split(r"^\$ ", content, flags=re.MULTILINE)
        assert parts[0] == "", f"{self.name}: a console block starts with `$ `, not with {parts[0]!r}"
        return "".join(f"$ {command}{self.output(command, shown)}" for command, shown in map(divided, parts[1:]))

    def output(self, command, shown):
        """Runs a command. Returns its output as the page shows it."""
        path = os.pathsep.join([str(PROGRAM.parent), str(Path(sys.executable).parent), os.environ["PATH"]])
        done = subprocess.run(
            command.replace(BUILD_AND_RUN, "morgana "),
            shell=True,
            cwd=self.folder,
            env={**os.environ, "PATH": path},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        if done.returncode != 0:
            raise RuntimeError(f"{self.name}: `{command.strip()}` ends with status {done.returncode}:\n{done.stdout}")
        return abridged(masked(done.stdout), shown) if shown else ""

    def python(self, code):
        """Runs a block of Python. Returns its output."""
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(ROOT / self.name), "exec"), self.namespace)
        return masked(printed.getvalue())


def divided(part):
    """Divides a part of a console block into a command, which may have several lines, and its output."""
    lines = part.splitlines(keepends=True)
    for count in range(1, len(lines) + 1):
        command = "".join(lines[:count])
        with contextlib.suppress(ValueError):
            shlex.split(command)
            if not command.endswith("\\\n"):
                return command, "".join(lines[count:])
    raise ValueError(f"a quote or a line of the command does not end: {part}")


def masked(output):
    """Returns an output without what depends on the machine or on its load."""
    for pattern, replacement in MASKS:
        output = re.sub(pattern, replacement, output, flags=re.MULTILINE)
    return output


def abridged(output, shown):
    """Returns an output without the notes and warnings of kinds that the page does not show."""
    kinds = re.findall(r"^(?:note|warning)\[\w+\]", shown, re.MULTILINE)
    output = DIAGNOSTIC.sub(lambda found: found[0] if found[0].startswith(tuple(kinds)) else "", output)
    return output.strip("\n") + "\n"


def merged(scene, part):
    """Returns an XML file with the elements of a part of it."""
    scene, part = ET.fromstring(scene), ET.fromstring(f"<scene>{part}</scene>")
    for new in part:
        place = next(iter(places(scene, new)), None)
        if place:
            parent, index = place
            parent[index] = new
        else:
            # Declarations of parameters come first.
            scene.insert(0 if new.tag == "default" else len(scene), new)
    ET.indent(scene)
    return ET.tostring(scene, encoding="unicode") + "\n"


def elements(scene):
    """Returns the elements of a scene, whatever their order, spaces and comments."""
    return sorted(ET.canonicalize(ET.tostring(element, encoding="unicode"), strip_text=True) for element in ET.fromstring(scene))


def places(scene, new):
    """Yields the parents and indices of the elements with the tag and the name of an element: its id, its name, or else its type."""
    key = next(key for key in ("id", "name", "type") if key in new.attrib)
    for parent in scene.iter():
        for index, old in enumerate(parent):
            if old.tag == new.tag and old.get(key) == new.get(key) and (key != "type" or not {"id", "name"}.intersection(old.keys())):
                yield parent, index


def difference(name, text):
    """Returns the lines in which a page differs from a text, empty if there are none."""
    old, new = (ROOT / name).read_text().splitlines(), text.splitlines()
    return "\n".join(difflib.unified_diff(old, new, f"{name}, as it is", f"{name}, as it runs", lineterm=""))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", metavar="PAGE", default=PAGES, help="pages, relative to the repository (default: all that run)")
    parser.add_argument("--write", action="store_true", help="write the outputs into the pages")
    parser.add_argument("--long", action="store_true", help="run the blocks that are marked as long, too")
    options = parser.parse_args()
    os.environ.setdefault("MPLBACKEND", "Agg")
    differ = False
    for name in options.pages:
        with tempfile.TemporaryDirectory() as folder:
            text = Page(name, Path(folder), options.long).run()
        lines = difference(name, text)
        print(lines or f"{name}: as it runs")
        differ = differ or bool(lines)
        if options.write:
            (ROOT / name).write_text(text)
    sys.exit(differ and not options.write)


if __name__ == "__main__":
    main()
