"""Autocorrelation of light."""

from __future__ import annotations

import dataclasses
from typing import Any, Dict

import numpy as np
from numpy.typing import NDArray

from ._estimate import Axes, Estimate, Origin, Several, own_origin
from ._values import Fields

Doubles = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Correlation(Several, Fields):
    """Field autocorrelation of detected light, by delay and channel.

    All errors are standard errors over particles. Correlations compute like the NumPy array
    ``mean``, with its errors, over the axes ``delay`` and ``channel``: see :class:`Estimate`.

    Examples
    --------
    >>> found.sel(delay=1e-5, channel=0)
    >>> found.to_xarray()["normalized"].plot()
    """

    delays: Doubles
    """Delays τ in seconds, (n,)."""
    mean: Doubles
    """Autocorrelation G₁(τ), (n, channels), in the unit of the records' weights; G₁(0) is the
    power."""
    error: Doubles
    """Standard error of ``mean``, (n, channels)."""
    normalized: Doubles
    """Normalised autocorrelation g₁(τ) = G₁(τ)/G₁(0), (n, channels)."""
    normalized_error: Doubles
    """Standard error of ``normalized``. It is smaller than the error of G₁, because G₁(τ) and G₁(0)
    come from the same particles."""
    unit: str = ""
    """Unit of ``mean``."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _quantities(self) -> Dict[str, Estimate]:
        return {
            "correlation": over("delay", self.delays, self.mean, self.error, self._origin, self.unit),
            "normalized": over("delay", self.delays, self.normalized, self.normalized_error, self._origin),
        }

    def _from(self, origin: Origin) -> "Correlation":
        object.__setattr__(self, "_origin", origin)
        return self

    def __repr__(self) -> str:
        return f"<morgana.correlation.Correlation at {len(self.delays)} delays>"


def over(axis: str, points: Any, mean: Doubles, error: Doubles, origin: Origin, unit: str = "") -> Estimate:
    """Returns an estimate over an axis of points, and over channels."""
    axes: Axes = {axis: None, "channel": None}
    made: Estimate = Estimate(mean, error, axes, unit, names={axis: np.asarray(points).tolist()})._from(origin)
    return made
