"""The autocorrelation of light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._values import comparable

Doubles = NDArray[np.float64]


@comparable
class Correlation(NamedTuple):
    """The field autocorrelation of detected light, by delay and channel. All errors are standard errors among particles."""

    delays: Doubles
    """Delays τ in seconds, (n,)."""
    mean: Doubles
    """G₁(τ), (n, channels), in the unit of the records' weights; G₁(0) is the power."""
    error: Doubles
    """Its standard error."""
    normalized: Doubles
    """g₁(τ) = G₁(τ)/G₁(0), (n, channels)."""
    normalized_error: Doubles
    """Its standard error: less than that of G₁, as both have the same particles."""

    def __repr__(self) -> str:
        return f"<morgana.correlation.Correlation at {len(self.delays)} delays>"
