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
"""Where an axis tells apart what does not add up to the light, the layer that is all of it."""


class Bins(NamedTuple):
    """How the film of a picture tells light apart by length or time."""

    axis: str
    """``"length"`` or ``"time"``."""
    edges: Doubles
    """Edges of the bins."""
    speed_of_light: float
    """Optical length by unit of the edges."""
    layers: List[List[str]]
    """Names of the layers of light in each bin; they add up to its light."""


def bins_of(picture: Union[Result, Image]) -> Optional[Bins]:
    """Those of a picture; none if its light is not separated so."""
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
    """Those of a layer: of a result, or of a file, which has the variance beside it."""
    layer = layers[name]
    if not isinstance(layer, np.ndarray):
        return np.asarray(layer.mean, float), np.asarray(layer.variance, float)
    if f"variance.{name}" not in layers:
        raise ValueError(f"the layer {name} has no variance: give all layers of an EXR file that morgana has written")
    return np.asarray(layer, float), np.asarray(layers[f"variance.{name}"], float)
