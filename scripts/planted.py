#!/usr/bin/env python3
"""Plants known errors of physics one by one and checks that a test fails for each.

Works on a copy of the tracked files, so the working tree is never touched. Each planted error is one
replacement in one file (planted_errors.py); the test named with it must compile, run, and fail. With --check, only looks whether all places and tests are there.

Usage: scripts/planted.py [--check | NAME ...]
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from planted_errors import PLANTED

ROOT = pathlib.Path(__file__).resolve().parent.parent


def copy_tree(target: pathlib.Path) -> None:
    files = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    for name in filter(None, files.split("\0")):
        destination = target / name
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, destination)


def outcome(tree: pathlib.Path, package: str, target: str, test: str) -> str:
    program = ["--lib"] if target == "lib" else ["--test", target]
    command = ["cargo", "test", "-p", package, *program, "--", test]
    run = subprocess.run(
        command,
        cwd=tree,
        capture_output=True,
        text=True,
        env={**os.environ, "CARGO_TARGET_DIR": str(ROOT / "target" / "planted")},
    )
    if "test result: FAILED" in run.stdout:
        return "caught"
    return "MISSED" if "test result: ok" in run.stdout else "did not compile:\n" + run.stderr[-2000:]


def stale() -> list[str]:
    """Entries whose place is not in the source, or not just once, and those that change nothing."""
    return [
        f"{name}: the text to replace is not found exactly once in {file}, or is replaced by itself"
        for name, file, text, replacement, _ in PLANTED
        if text == replacement or (ROOT / file).read_text().count(text) != 1
    ]


def testless() -> list[str]:
    """Entries whose test is not where its name says, so that nothing would run."""
    messages = []
    for name, *_, (package, target, test) in PLANTED:
        crate = ROOT / "crates" / package.removeprefix("morgana-")
        *modules, function = test.split("::")
        if target == "lib":
            # Modules of tests are inline, or in files of other names.
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
            messages.append(f"{name}: there is no test {test} in {place.relative_to(ROOT)}")
    return messages


def main() -> int:
    if messages := stale() + testless():
        sys.exit("\n".join(messages))
    wanted = sys.argv[1:]
    if wanted == ["--check"]:
        return 0
    names = [planted[0] for planted in PLANTED]
    unknown = [word for word in wanted if not any(word in name for name in names)]
    if unknown:
        sys.exit(f"no planted error is called so: {', '.join(unknown)}")
    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        tree = pathlib.Path(directory)
        copy_tree(tree)
        for name, file, text, replacement, (package, target, test) in PLANTED:
            if wanted and not any(word in name for word in wanted):
                continue
            path = tree / file
            original = path.read_text()
            path.write_text(original.replace(text, replacement))
            result = outcome(tree, package, target, test)
            path.write_text(original)
            missed += result != "caught"
            print(f"{name}: {result} by {package}/{target}::{test}", flush=True)
    print(f"{missed} not caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
