"""Autocorrelation of light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._values import comparable

Doubles = NDArray[np.float64]


@comparable
class Correlation(NamedTuple):
    """Field autocorrelation of detected light, by delay and channel.

    All errors are standard errors over particles."""

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

    def __repr__(self) -> str:
        return f"<morgana.correlation.Correlation at {len(self.delays)} delays>"
