"""Abel inversion: the index of an axisymmetric flow from the deflections of one view."""

from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._numbers import numbers
from ._preconditioner import ReconstructionError
from ._values import comparable

__all__ = ["Profile", "abel"]

Doubles = NDArray[np.float64]

EQUAL = 1e-9
"""Difference of distances from the axis, relative to the largest, below which they count as
equal."""


@comparable
class Profile(NamedTuple):
    """Index of an axisymmetric flow: result of :func:`abel`."""

    radii: Doubles
    """Distances from the axis, (radii,), in scene units."""
    n: Doubles
    """Refractive index, (radii,)."""
    deviation: Doubles
    """Standard deviation of ``n`` due to noise, (radii,). Errors at different radii are
    correlated."""

    def __repr__(self) -> str:
        return f"<morgana.reconstruct.Profile of {len(self.radii)} radii: n from {self.n.min():.7g} to {self.n.max():.7g}>"


def abel(heights: ArrayLike, deflections: ArrayLike, *, noise: ArrayLike, radii: Optional[ArrayLike] = None, ambient: float = 1.0) -> Profile:
    """Index of an axisymmetric flow from deflections across its axis, without a search.

    Parallel rays cross the axis at right angles at the distance y. Their deflection is
    ε = (1/n₀) ∂/∂y ∫n ds for straight rays, and n(r) = n₀ − (n₀/π) ∫ε/√(y² − r²) dy from r to the
    largest distance (Abel). The function takes this integral exactly for deflections that are
    linear between the given distances. The result is linear in the deflections, so its standard
    deviation is exact. Bending within the flow has no effect on the result: for strong flows, use
    :func:`fit`.

    Parameters
    ----------
    heights : array_like, (rays,)
        Distances y of the rays from the axis, in scene units, negative on one side. At equal
        distances on both sides, the mean counts.
    deflections : array_like, (rays,)
        Deflections ε in radians, positive towards positive y. NaN if unknown. Deflections beyond
        the outermost ray count as zero.
    noise : float or array_like, (rays,)
        Standard deviation of the deflections, in radians, > 0.
    radii : array_like, optional
        Distances from the axis of the result, ≥ 0, in scene units; by default all distances of
        rays.
    ambient : float, optional
        Index n₀ around the flow, > 0.

    Returns
    -------
    Profile
        The index with its standard deviation.

    Raises
    ------
    ReconstructionError
        Shapes that do not match, numbers that are not finite, or fewer than two known deflections.

    Examples
    --------
    >>> y = np.linspace(-1, 1, 41)
    >>> profile = morgana.reconstruct.abel(y, -1e-3 * y * np.exp(-4 * y**2), noise=1e-6)
    >>> profile.n, profile.deviation
    """
    y, moved, sigma = _data(heights, deflections, noise)
    n0 = checks.positive(ambient, "ambient")
    y, moved, sigma = _folded(y, moved, sigma)
    r = y if radii is None else numbers(radii, "radii").ravel()
    if not (np.isfinite(r) & (r >= 0)).all():
        raise ReconstructionError("radii must be finite numbers of at least 0")
    weights = -n0 / np.pi * _integrals(y, r)
    return Profile(r.copy(), n0 + weights @ moved, np.sqrt(weights**2 @ sigma**2))


def _data(heights: ArrayLike, deflections: ArrayLike, noise: ArrayLike) -> Tuple[Doubles, Doubles, Doubles]:
    y, moved, sigma = numbers(heights, "heights"), numbers(deflections, "deflections"), numbers(noise, "noise")
    if y.ndim != 1 or moved.shape != y.shape or sigma.shape not in ((), y.shape):
        raise ReconstructionError(f"heights have the shape {y.shape}, deflections {moved.shape} and noise {sigma.shape}, but all must have (rays,)")
    if not np.isfinite(y).all():
        raise ReconstructionError("heights must be finite numbers")
    known = np.isfinite(moved)
    sigma = np.broadcast_to(sigma, y.shape)[known]
    if not (np.isfinite(sigma) & (sigma > 0)).all():
        raise ReconstructionError("noise must be positive numbers, in radians")
    if known.sum() < 2 or not y[known].any():
        raise ReconstructionError(f"{known.sum()} deflections are known, but an inversion needs at least two, off the axis")
    return y[known], moved[known], sigma


def _folded(y: Doubles, moved: Doubles, sigma: Doubles) -> Tuple[Doubles, Doubles, Doubles]:
    """Returns increasing distances from the axis, with deflections away from it and their standard
    deviations. Combines deflections at equal distances. Begins with the axis, where there is no
    deflection."""
    distance, outwards = np.abs(y), np.sign(y) * moved
    order = np.argsort(distance)
    distance, outwards, weight = distance[order], outwards[order], sigma[order] ** -2.0
    first = np.r_[True, np.diff(distance) > EQUAL * distance[-1]]
    off = distance > EQUAL * distance[-1]
    starts = np.flatnonzero(first & off)
    outwards, weight, kept = outwards[off], weight[off], starts - np.flatnonzero(off)[0]
    total = np.add.reduceat(weight, kept)
    means = np.add.reduceat(weight * outwards, kept) / total
    return np.r_[0.0, distance[starts]], np.r_[0.0, means], np.r_[0.0, total**-0.5]


def _integrals(y: Doubles, r: Doubles) -> Doubles:
    """Returns weights of the values at y, (radii, values), in ∫ε/√(y² − r²) dy from r, for ε that
    is linear between neighbours."""
    low, high = np.maximum(y[None, :-1], r[:, None]), np.maximum(y[None, 1:], r[:, None])
    roots = [np.sqrt(np.maximum(end**2 - r[:, None] ** 2, 0.0)) for end in (low, high)]
    with np.errstate(divide="ignore", invalid="ignore"):
        of_one = np.log((high + roots[1]) / (low + roots[0]))
    # The weight of the value on the axis, which is zero, does not matter.
    of_one = np.where((low + roots[0] > 0) & (high > low), of_one, 0.0)
    of_y = roots[1] - roots[0]
    step = np.diff(y)
    weights = np.zeros((len(r), len(y)))
    weights[:, :-1] += (y[None, 1:] * of_one - of_y) / step
    weights[:, 1:] += (of_y - y[None, :-1] * of_one) / step
    weights[:, 0] = 0.0
    return weights
