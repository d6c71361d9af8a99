"""Folders of OpenFOAM."""

from __future__ import annotations

import contextlib
import os
from typing import Optional, Set


def is_decomposed(case: str, time: Optional[float]) -> bool:
    """Whether an OpenFOAM case has this time, or its last, in the folders of its parts alone."""
    whole, parts = _instants(case), _instants(os.path.join(case, "processor0"))
    if not parts:
        return False
    if not os.path.isdir(os.path.join(case, "constant", "polyMesh")):
        return True
    wanted = max(whole | parts) if time is None else time
    return wanted in parts and wanted not in whole


def _instants(folder: str) -> Set[float]:
    """Times of the folders in a folder whose names are numbers."""
    found = set()
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            with contextlib.suppress(ValueError):
                found.add(float(entry.name))
    return found
