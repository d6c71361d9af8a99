"""Ends of rays, their changes, and derivatives of losses at the ends: results of
:class:`morgana.grad.Rays`."""

from __future__ import annotations

from typing import Dict, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

from ._system import Plane
from ._values import comparable

Doubles = NDArray[np.float64]

FAILURES = (
    "",
    "did not reach the exit",
    "left the field",
    "takes too much work",
    "missed a surface",
    "was totally reflected",
    "was stopped by an aperture",
)
"""Meanings of the failure codes of the compiled part."""


@comparable
class Ends(NamedTuple):
    """Ends of rays.

    Row i of each array belongs to ray i. Rays without an end are NaN."""

    positions: Doubles
    """Positions, (rays, 3), in scene units."""
    directions: Doubles
    """Unit directions, (rays, 3)."""
    optical_lengths: Doubles
    """∫ n ds from the start, (rays,), in scene units."""
    codes: NDArray[np.uint8]
    """0 for rays that have an end, (rays,); :attr:`failures` counts the others."""

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Mask of the rays that have an end, (rays,)."""
        return np.asarray(self.codes == 0)

    @property
    def failures(self) -> Dict[str, int]:
        """Numbers of rays without an end, by the cause; empty if all rays have an end."""
        counts = np.bincount(self.codes, minlength=len(FAILURES))
        return {name: int(count) for name, count in zip(FAILURES[1:], counts[1:]) if count}

    def __repr__(self) -> str:
        failed = [f"{count} {name}" for name, count in self.failures.items()]
        return f"<morgana.grad.Ends: {', '.join([f'{len(self.codes)} rays', *failed])}>"


@comparable
class Change(NamedTuple):
    """Changes of the ends of rays.

    Row i of each array belongs to ray i. Rays without an end are NaN."""

    positions: Doubles
    """Changes of positions, (rays, 3)."""
    directions: Doubles
    """Changes of unit directions, (rays, 3)."""
    optical_lengths: Doubles
    """Changes of optical lengths ∫ n ds, (rays,)."""

    def __repr__(self) -> str:
        return f"<morgana.grad.Change of the ends of {len(self.positions)} rays>"


@comparable
class Gradient(NamedTuple):
    """Derivatives of a loss."""

    field: Doubles
    """Derivatives by the samples of n, in their shape. For a :class:`morgana.Field` or a
    :class:`System`, derivatives by all its parameters, (parameters,), in the order of
    :func:`parameters`."""
    origins: Doubles
    """Derivatives by the origins, (rays, 3)."""
    directions: Doubles
    """Derivatives by the directions, as they were given, (rays, 3)."""
    parameters: Dict[str, Doubles]
    """The numbers of ``field`` by the names of the parameters, in the shapes of the parameters."""
    exit: Optional[Plane]
    """Derivatives by the point and the normal of the exit, as it was given; ``None`` without an
    exit plane."""

    def __repr__(self) -> str:
        size = float(np.linalg.norm(self.field))
        return f"<morgana.grad.Gradient: by an index of shape {self.field.shape}, norm {size:.6g}, and {len(self.origins)} rays>"


@comparable
class LeastSquares(NamedTuple):
    """A sum of squares over rays."""

    value: float
    """½Σ ((end − measured)/noise)²."""
    gradient: Doubles
    """Derivatives of ``value``, as :attr:`Gradient.field`."""
    lost: int
    """Number of measured rays that have no end. They are left out."""

    def __repr__(self) -> str:
        return f"<morgana.grad.LeastSquares: {self.value:.6g}, {self.lost} rays lost>"
