"""The program whose output the site shows."""

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def output(*arguments: str) -> str:
    """Returns the output of the program: the one that the variable MORGANA names, or the
    development build."""
    built = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/morgana"
    program = os.environ.get("MORGANA", built)
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout
