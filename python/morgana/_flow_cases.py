"""Folders of OpenFOAM cases."""

from __future__ import annotations

import contextlib
import os
from typing import Optional, Set


def is_decomposed(case: str, time: Optional[float]) -> bool:
    """True if an OpenFOAM case has this time, or by default its last, only in the folders of its
    parts."""
    whole, parts = _instants(case), _instants(os.path.join(case, "processor0"))
    if not parts:
        return False
    if not os.path.isdir(os.path.join(case, "constant", "polyMesh")):
        return True
    wanted = max(whole | parts) if time is None else time
    return wanted in parts and wanted not in whole


def _instants(folder: str) -> Set[float]:
    """Returns the times that are names of subfolders."""
    found = set()
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            with contextlib.suppress(ValueError):
                found.add(float(entry.name))
    return found
