"""The program whose output the site shows."""

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def path() -> Path:
    """Returns the program: the one that the variable MORGANA names, or the development build."""
    built = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/morgana"
    return Path(os.environ.get("MORGANA", built))


def output(*arguments: str) -> str:
    """Returns the output of the program."""
    return subprocess.run([path(), *arguments], check=True, capture_output=True, text=True).stdout
