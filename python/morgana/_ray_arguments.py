"""Checks of the arguments of :class:`morgana.grad.Rays`."""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._numbers import numbers, vectors
from ._system import GradError, Plane, check_starts, finite, unit

Doubles = NDArray[np.float64]
Box = Tuple[ArrayLike, ArrayLike]


def ray_starts(origins: ArrayLike, directions: ArrayLike) -> Tuple[Doubles, Doubles]:
    """Returns origins and directions of rays, (rays, 3) each, or raises an error."""
    x, d = vectors(origins, "origins"), vectors(directions, "directions")
    check_starts(x.shape, d.shape)
    d = np.broadcast_to(d, x.shape)
    for name, array in (("origins", x), ("directions", d)):
        bad = ~np.isfinite(array).all(axis=1)
        if name == "directions":
            bad |= ~array.any(axis=1)
        if bad.any():
            raise GradError(f"{np.count_nonzero(bad)} {name} are not finite, or of no length: the first is number {int(np.argmax(bad))}")
    return x, d


def box_corners(box: Box) -> Tuple[Doubles, Doubles]:
    """Returns the lower and the upper corner of a box, or raises an error."""
    lower, upper = (numbers(corner, "box") for corner in box)
    if lower.shape != (3,) or upper.shape != (3,) or not np.isfinite([lower, upper]).all() or not (lower < upper).all():
        raise GradError(f"box is {lower.tolist()} to {upper.tolist()} but must be its lower and its upper corner, three finite numbers each")
    return lower, upper


def exit_plane(plane: Plane) -> Tuple[Doubles, Doubles]:
    """Returns the point and the unit normal of an exit, or raises an error."""
    point, normal = plane
    return finite(point, "the point of the exit"), unit(normal, "the normal of the exit")[0]
