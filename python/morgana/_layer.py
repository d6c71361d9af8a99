"""Layers of pictures."""

from __future__ import annotations

import dataclasses
from typing import Dict, List, Optional

import numpy as np
from numpy.typing import NDArray

from ._estimate import Data, Estimate, Origin, own_origin
from ._pictures import caption, thumbnail
from ._values import Fields

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]

UNITS = {
    "arc_length": "unit",
    "deflection": "rad",
    "depth": "unit",
    "displacement": "pixels",
    "exit_position": "unit",
    "optical_length": "unit",
    "optical_path_difference": "unit",
    "position": "unit",
}
"""Units of quantities of rays, by the name that the integrator ``aov`` gives their layers."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Layer(Data, Fields):
    """Layer of a picture: a part of its light, or a quantity of its rays.

    Layers compute like NumPy arrays, with their errors: see :class:`Estimate`. Their axes are
    ``row``, ``column`` and ``channel``.

    Examples
    --------
    >>> length = quantities.layers["optical_length"].sel(channel="Y")
    >>> waves = length / 632.8e-9
    >>> waves.mean, waves.error
    """

    mean: Floats
    """Means of pixels, float32, (height, width, channels)."""
    variance: Floats
    """Variances of the means, of the same shape; infinite with fewer than two samples."""
    few: Bools
    """Mask of the variances that are unreliable, of the same shape: see ``Result.few``."""
    channels: List[str]
    """Names of the channels of the picture, or of the components of a quantity, such as ``X`` and
    ``Y``."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    @property
    def error(self) -> Floats:
        """Standard errors of the means, of the same shape."""
        return np.sqrt(self.variance)

    def _estimate(self) -> Estimate:
        return picture(self.mean, self.error, self.few, self.channels, self._origin)

    def _from(self, origin: Origin) -> "Layer":
        object.__setattr__(self, "_origin", origin)
        return self

    def __repr__(self) -> str:
        height, width, _ = self.mean.shape
        return f"<morgana.Layer of {width} × {height}, channels {', '.join(self.channels)}, mean {self.mean.mean(dtype=float):.5g}>"

    def _repr_html_(self) -> str:
        return thumbnail(self.mean, self.channels) + caption(repr(self).strip("<>"))


def picture(mean: Floats, error: Floats, few: Optional[Bools], channels: List[str], origin: Origin, unit: str = "") -> Estimate:
    """Returns a picture as an estimate over ``row``, ``column`` and ``channel``."""
    axes: Dict[str, Optional[NDArray[np.float64]]] = {"row": None, "column": None, "channel": None}
    made: Estimate = Estimate(mean, error, axes, unit, None, few, {"channel": list(channels)})._from(origin)
    return made


def undelayed(layer: str) -> str:
    """Returns the undelayed layer for a delayed layer of tagged light, and any other layer
    itself."""
    *before, word, number = ["", *layer.split(".")]
    return ".".join([*before[1:], "total"]) if word == "delay" and number.isdigit() else layer
