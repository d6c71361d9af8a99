"""Labels of axes, and colour bars."""

from __future__ import annotations

from typing import Any, Optional

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap

LENGTHS = {"length": "optical path length", "opl": "optical path length", "x": "x", "y": "y", "z": "z", "r": "r"}

BAD = "0.85"
"""Grey level of values that a scale cannot show."""


def axes(ax: Optional[Axes]) -> Axes:
    """Returns the axes to draw in."""
    return plt.gca() if ax is None else ax


def along(axis: str, unit: Optional[str]) -> str:
    """Returns the label of an axis."""
    if axis in ("row", "column"):
        return f"{axis} (pixels)"
    if axis in LENGTHS:
        return f"{LENGTHS[axis]} ({unit or 'scene units'})"
    return axis


def quantity(name: str, of_unit: str, unit: Optional[str]) -> str:
    """Returns a quantity with its unit, such as W/unit^2, in which ``unit`` stands for the unit of
    length."""
    text = (unit or "scene units") if of_unit == "unit" else of_unit.replace("unit", unit or "unit")
    text = text.replace("^2", "²").replace("^3", "³")
    if not name or not text:
        return name or text
    return f"{name} ({text})"


def colours(name: str = "viridis") -> Colormap:
    """Returns a colour map in which values that a scale cannot show are grey."""
    return colormaps[name].with_extremes(bad=BAD)


def colour_bar(artist: ScalarMappable, ax: Axes, label: str) -> Any:
    """Draws a colour bar beside the axes. Its ends are pointed where the scale clips values."""
    shown = artist.get_array()
    assert shown is not None
    values = np.ma.compressed(shown)
    low, high = artist.get_clim()
    ends = (bool((values < low).any()), bool((values > high).any()))
    extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(ends, "neither")
    return ax.figure.colorbar(artist, ax=ax, label=label, extend=extend)
