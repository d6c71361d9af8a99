#!/usr/bin/env python3
"""Plants known errors of physics one by one and checks that a test fails for each.

Errors stand in the source as comments above the line that they replace:

    // Planted error "refraction to the wrong side", found by morgana-optics/optics::dielectric::refracts:
    // let cos = -normal.dot(direction);
    let cos = normal.dot(direction);

An error in place of N lines has "(N lines)" after its name; "// (no line)" leaves the line out. Works on a copy of the tracked files, so the
working tree is never touched. The test named with an error must compile, run, and fail. With --check, only looks whether all errors are
well formed and all tests are there.

Usage: scripts/planted.py [--check | NAME ...]
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from typing import NamedTuple

ROOT = pathlib.Path(__file__).resolve().parent.parent
MARK = "// Planted error"
HEAD = re.compile(r'// Planted error "([^"]+)"(?: \((\d+) lines\))?, found by ([\w-]+)/(\w+)::([\w:]+):$')
NO_LINE = "(no line)"


class Planted(NamedTuple):
    name: str
    file: pathlib.Path
    """Numbers of the first replaced line, from 0, and of the line after the last one."""
    first: int
    end: int
    replacement: list[str]
    package: str
    target: str
    test: str

    def plant(self, text: str) -> str:
        lines = text.split("\n")
        return "\n".join([*lines[: self.first], *self.replacement, *lines[self.end :]])


def planted_in(file: pathlib.Path) -> list[Planted]:
    """Returns the errors that a source file lists; ends the program at a malformed one."""
    lines = [line.strip() for line in file.read_text().split("\n")]
    found = []
    for i, line in enumerate(lines):
        if not line.startswith(MARK):
            continue
        head = HEAD.match(line)
        if not head:
            sys.exit(f"{file.relative_to(ROOT)}:{i + 1}: not a planted error: {line}")
        name, count, package, target, test = head.groups()
        end = i + 1
        while lines[end].startswith("//") and not lines[end].startswith(MARK):
            end += 1
        replacement = [line.removeprefix("//").strip() for line in lines[i + 1 : end]]
        # Skip other errors in place of this line.
        while lines[end].startswith("//"):
            end += 1
        replaced = lines[end : end + int(count or 1)]
        if not replacement or replacement == replaced:
            sys.exit(f"{file.relative_to(ROOT)}:{i + 1}: '{name}' changes nothing")
        replacement = [] if replacement == [NO_LINE] else replacement
        found.append(Planted(name, file, end, end + len(replaced), replacement, package, target, test))
    return found


def copy_tree(target: pathlib.Path) -> None:
    files = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    for name in filter(None, files.split("\0")):
        destination = target / name
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, destination)


def outcome(tree: pathlib.Path, error: Planted) -> str:
    program = ["--lib"] if error.target == "lib" else ["--test", error.target]
    command = ["cargo", "test", "-p", error.package, *program, "--", error.test]
    run = subprocess.run(
        command,
        cwd=tree,
        capture_output=True,
        text=True,
        env={**os.environ, "CARGO_TARGET_DIR": str(ROOT / "target" / "planted"), "MORGANA_FULL_SAMPLES": "1"},
    )
    if "test result: FAILED" in run.stdout:
        return "caught"
    return "MISSED" if "test result: ok" in run.stdout else "did not compile:\n" + run.stderr[-2000:]


def testless(errors: list[Planted]) -> list[str]:
    """Returns errors whose test is not where its name says, so that nothing would run."""
    messages = []
    for error in errors:
        target = error.target
        crate = ROOT / "crates" / error.package.removeprefix("morgana-")
        *modules, function = error.test.split("::")
        if target == "lib":
            # Modules of tests are inline, or in files with other names.
            place, files, is_module = crate / "src", list((crate / "src").rglob("*.rs")), False
        elif (crate / "tests" / target / "main.rs").exists():
            place = crate / "tests" / target
            module = place.joinpath(*modules)
            files = [module.with_suffix(".rs"), module / "mod.rs"]
            is_module = (module / function).with_suffix(".rs").exists()
        else:
            place = crate / "tests" / f"{target}.rs"
            files, is_module = [place], False
        is_there = any(f.exists() and f"fn {function}" in f.read_text() for f in files)
        if not (is_module or is_there):
            messages.append(f"{error.name}: there is no test {error.test} in {place.relative_to(ROOT)}")
    return messages


def main() -> int:
    sources = sorted(path for suffix in ["rs", "wgsl"] for path in (ROOT / "crates").glob(f"*/src/**/*.{suffix}"))
    errors = [error for file in sources for error in planted_in(file)]
    names = [error.name for error in errors]
    twice = [f"{name}: two planted errors are called so" for name in sorted(names) if names.count(name) > 1]
    if messages := twice + testless(errors):
        sys.exit("\n".join(messages))
    wanted = sys.argv[1:]
    if wanted == ["--check"]:
        print(f"{len(errors)} planted errors")
        return 0
    unknown = [word for word in wanted if not any(word in error.name for error in errors)]
    if unknown:
        sys.exit(f"no planted error is called so: {', '.join(unknown)}")
    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        tree = pathlib.Path(directory)
        copy_tree(tree)
        for error in errors:
            if wanted and not any(word in error.name for word in wanted):
                continue
            path = tree / error.file.relative_to(ROOT)
            original = path.read_text()
            path.write_text(error.plant(original))
            result = outcome(tree, error)
            path.write_text(original)
            missed += result != "caught"
            print(f"{error.name}: {result} by {error.package}/{error.target}::{error.test}", flush=True)
    print(f"{missed} not caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
