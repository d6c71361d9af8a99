"""Documentation of the Python package on the site: texts of the compiled part come from Rust; links and roles become Markdown."""

import importlib
import inspect
import re
from typing import Any

import griffe

COMPILED = "morgana._morgana"


class Docstrings(griffe.Extension):
    """Completes the texts from the package's sources and stubs."""

    def on_package(self, *, pkg: griffe.Module, loader: griffe.GriffeLoader, **_: Any) -> None:
        """Takes the texts of the compiled part from the part itself, and rewrites all texts."""
        if pkg.name == "morgana":
            module = pkg[COMPILED.removeprefix("morgana.")]
            complete(module, importlib.import_module(COMPILED), loader)
            rewrite(pkg)


def complete(stub: Any, compiled: object, loader: griffe.GriffeLoader) -> None:
    """Gives every object of a stub the documentation of the compiled object."""
    for name, member in stub.members.items():
        found = getattr(compiled, name, None)
        if member.is_alias or found is None:
            continue
        text = inspect.getdoc(found)
        if text and not member.docstring and not name.startswith("_"):
            member.docstring = griffe.Docstring(
                text, parent=member, parser=loader.docstring_parser, parser_options=loader.docstring_options
            )
        if member.is_class:
            complete(member, found, loader)


def rewrite(parent: Any) -> None:
    """Converts roles to Markdown, and names of documents to links."""
    for member in parent.members.values():
        if member.is_alias:
            continue
        if member.docstring:
            member.docstring.value = markdown(member.docstring.value)
        rewrite(member)


def markdown(text: str) -> str:
    """Returns a docstring's text as Markdown for a page in reference/."""
    text = re.sub(r"^( +)(\w+(?:, \w+)+): (.*(?:\n\1 +.*)*)", apart, text, flags=re.MULTILINE)
    text = re.sub(r":(?:attr|class|exc|func|meth|mod):`", "`", text)
    return re.sub(r"docs/([a-z-]+)\.md(#[a-z0-9-]+)?", r"[\g<0>](../\1.md\2)", text)


def apart(arguments: re.Match[str]) -> str:
    """Separates arguments that a docstring describes together."""
    indent, names, text = arguments.groups()
    return "\n".join(f"{indent}{name}: {text}" for name in names.split(", "))
