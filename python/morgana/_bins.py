"""Light of pictures in bins of optical length or time."""

from __future__ import annotations

import json
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._images import Image
from ._result import Result

Doubles = NDArray[np.float64]
WHOLE = {"tagged": "total", "stokes": "S0"}
"""Name of the layer that contains all light, by the axis whose layers do not add up to the
light."""


class Bins(NamedTuple):
    """Bins of a picture's film by length or time."""

    axis: str
    """``"length"`` or ``"time"``."""
    edges: Doubles
    """Edges of the bins."""
    speed_of_light: float
    """Optical length per unit of the edges."""
    layers: List[List[str]]
    """Names of the layers of light in each bin, which add up to the light of the bin."""


def bins_of(picture: Union[Result, Image]) -> Optional[Bins]:
    """Returns the bins of a picture; ``None`` if its light is not separated by length or time."""
    axes: List[Dict[str, Any]] = picture.axes if isinstance(picture, Result) else json.loads(picture.attributes.get("decomposition", "[]"))
    by_name = {axis["name"]: axis for axis in axes}
    axis = by_name.get("length") or by_name.get("time")
    if axis is None:
        return None
    whole = [last for name, last in WHOLE.items() if name in by_name]
    layers: List[List[str]] = [[] for _ in range(axis["bins"])]
    for name in picture.layers:
        parts = name.split(".")
        if parts[0] == axis["name"] and len(parts) > 1 and parts[1].isdigit() and all(parts[-1] == of for of in whole):
            layers[int(parts[1])].append(name)
    edges = axis["min"] + axis["width"] * np.arange(axis["bins"] + 1)
    return Bins(axis["name"], edges, axis["speed_of_light"] or 1.0, layers)


def mean_and_variance(layers: Mapping[str, Any], name: str) -> Tuple[Doubles, Doubles]:
    """Returns mean and variance of a layer of a result, or of a file, which has a layer of
    variances."""
    layer = layers[name]
    if not isinstance(layer, np.ndarray):
        return np.asarray(layer.mean, float), np.asarray(layer.variance, float)
    if f"variance.{name}" not in layers:
        raise ValueError(f"the layer {name} has no variance: give all layers of an EXR file by morgana")
    return np.asarray(layer, float), np.asarray(layers[f"variance.{name}"], float)
