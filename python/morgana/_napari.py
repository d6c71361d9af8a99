"""Reader of readings for napari (docs/meters.md#files)."""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._archives import opened
from ._errors import Error
from ._reading import SPACE, Reading, names_in, reading_in
from ._xarray import SPEED_OF_LIGHT

BRIGHTEST = 0.99
"""Fraction of the bins below the largest value of the contrast: the bins at a source are much
brighter than all others."""

LayerData = Tuple[NDArray[Any], Dict[str, Any], str]
Path = Union[str, "os.PathLike[str]"]

UNITS = {1.0: "m", 1e-2: "cm", 1e-3: "mm", 1e-6: "um"}
"""Names of units of length, by their length in m."""


def get_reader(path: Union[Path, List[Path]]) -> Optional[Callable[[Any], List[LayerData]]]:
    """Returns a function that returns layers of napari; ``None`` for files without readings over x,
    y and z."""
    if isinstance(path, list):
        return None
    try:
        found = layers(path)
    except (Error, OSError):
        return None
    return (lambda _: found) if found else None


def layers(path: Path) -> List[LayerData]:
    """Returns an image layer for each reading over x, y and z in a file, and for each channel.

    Layers have their place in the scene: napari's axes are z, y and x. The first layer, a fluence
    if there is one, is shown. The others and the standard errors are hidden."""
    arrays, attributes = opened(path)
    names = sorted(names_in(arrays), key=lambda name: name.rpartition(".")[2] != "fluence")
    readings = {name: reading_in(arrays, name, attributes) for name in names}
    found: List[LayerData] = []
    for name, reading in readings.items():
        if reading.axes_to_world is not None:
            for label, one in _channels(name, reading):
                found += _layers(label, one, shown=not found)
    return found


def _channels(name: str, reading: Reading) -> List[Tuple[str, Any]]:
    if "channel" not in reading.axes:
        return [(name, reading)]
    names = reading.names.get("channel") or list(map(str, range(reading.shape[-1])))
    return [(f"{name} {channel}", reading.isel(channel=i)) for i, channel in enumerate(names)]


def _layers(name: str, reading: Reading, shown: bool) -> List[LayerData]:
    affine, units = _place(reading)
    common = {"affine": affine, "units": units, "axis_labels": tuple(reading.axes), "metadata": {"unit": reading.unit}}
    finite = reading.mean[np.isfinite(reading.mean)]
    brightest = float(np.quantile(finite, BRIGHTEST)) if finite.size else 0.0
    limits = {"contrast_limits": (0.0, brightest)} if brightest > 0 else {}
    return [
        (reading.mean, {**common, **limits, "name": name, "visible": shown}, "image"),
        (reading.error, {**common, "name": f"{name} error", "visible": False}, "image"),
    ]


def _place(reading: Reading) -> Tuple[NDArray[np.float64], Tuple[str, ...]]:
    """Returns the affine map from positions of bins to napari's world, whose axes are those of the
    reading, and the unit of each axis. Optical path lengths become times if the length of a scene
    unit is known."""
    axes, count = list(reading.axes), len(reading.axes)
    metres = reading.metres_per_unit
    scales, starts, units = np.ones(count), np.zeros(count), ["pixel"] * count
    for i, (axis, edges) in enumerate(reading.axes.items()):
        if edges is not None:
            scales[i], starts[i] = edges[1] - edges[0], 0.5 * (edges[0] + edges[1])
        if axis == "opl" and metres is not None:
            scales[i], starts[i], units[i] = (scales[i] * metres / SPEED_OF_LIGHT, starts[i] * metres / SPEED_OF_LIGHT, "s")
    bins_to_axes = np.diag([*scales, 1.0])
    bins_to_axes[:-1, -1] = starts
    axes_to_world = np.eye(count + 1)
    space = [axes.index(axis) for axis in SPACE]
    place = reading.axes_to_world
    if place is not None:
        axes_to_world[np.ix_(space, [*space, count])] = place
    length, unit = (1.0, "pixel") if metres is None else (1.0, UNITS[metres]) if metres in UNITS else (1e3 * metres, "mm")
    for i in space:
        axes_to_world[i] *= length
        units[i] = unit
    return axes_to_world @ bins_to_axes, tuple(units)
