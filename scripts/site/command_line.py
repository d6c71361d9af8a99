"""The page on the command line, generated from the program's help."""

import re

import program

INTRODUCTION = """# Command line

What `morgana help` and `morgana COMMAND --help` print. Quantities and formats are described in [scene files](../scene-format.md),
[images](../images.md) and [meters](../meters.md).
"""


def page() -> str:
    """Returns the page, with a section per command."""
    overview = program.output("--help")
    sections = [INTRODUCTION, block(overview)]
    for command in commands(overview):
        sections.append(f"## morgana {command}\n\n{block(program.output(command, '--help'))}")
    return "\n".join(sections)


def commands(overview: str) -> list[str]:
    """Returns the commands that the overview lists."""
    listed = overview.split("\nCommands:\n")[1].split("\n\n")[0]
    names = re.findall(r"^  ([a-z]+)  ", listed, re.MULTILINE)
    return [name for name in names if name != "help"]


def block(text: str) -> str:
    """Returns a text verbatim, as a code block."""
    return f"```text\n{text.rstrip()}\n```\n"
