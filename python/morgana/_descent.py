"""Minimisation of a smooth function of many numbers within limits.

The method is projected limited-memory BFGS on the free numbers."""

from __future__ import annotations

from typing import Callable, Iterator, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["first_scale", "minimize"]

Doubles = NDArray[np.float64]
Iterate = Tuple[Doubles, float, Doubles]
"""Numbers, the value of the function there, and its gradient."""
Function = Callable[[Doubles], Tuple[float, Doubles]]
Operator = Callable[[Doubles], Doubles]
Pairs = List[Tuple[Doubles, Doubles]]
"""Steps, and changes of the gradient along them."""

MEMORY = 12
"""Number of pairs of steps and gradient changes that are kept."""
DECREASE = 1e-4
"""Fraction of the decrease that the initial slope predicts, which a step must reach (Armijo)."""
MAX_TRIES = 12
"""Maximum number of step reductions."""
MIN_REDUCTION, MAX_REDUCTION = 0.1, 0.5
"""Bounds of the factor of each step reduction."""
PROBE = 1e-4
"""Largest component of the step that measures the initial curvature."""
MIN_COSINE = 1e-8
"""Smallest cosine of a pair that determines the curvature."""


def first_scale(function: Function, start: Doubles, gradient: Doubles, precondition: Operator) -> Tuple[float, Doubles]:
    """Returns the distance of the minimum along the preconditioned gradient at ``start``, as a
    multiple of the preconditioned gradient. Also returns the unit of this distance: the negative
    preconditioned gradient.

    The estimate uses the curvature along the gradient."""
    down = -precondition(gradient)
    largest = float(np.abs(down).max(initial=0.0))
    if largest == 0:
        return 1.0, down
    small = PROBE / largest
    _, moved = function(start + small * down)
    curvature = float(np.vdot(moved - gradient, down)) / small
    scale = abs(float(np.vdot(gradient, down))) / max(abs(curvature), 1e-300)
    return scale, scale * down


def minimize(
    function: Function, start: Iterate, scale: float, limits: Tuple[Doubles, Doubles], precondition: Operator, pairs: Pairs
) -> Iterator[Tuple[Doubles, float]]:
    """Yields points of decreasing value, with the value, until there is no lower value along the
    search direction. ``start`` lies within the limits.

    Numbers at a limit stay there if the gradient pushes them beyond it. The others take a step of
    limited-memory BFGS that begins with ``precondition``, a symmetric positive operator, and are
    clipped to the limits (Bertsekas 1982). While the curvature is unknown, the step is ``scale``
    times the negative preconditioned gradient (:func:`first_scale`). ``pairs``, initially empty,
    keeps curvature information for functions of similar curvature.
    """
    low, high = limits
    x, value, gradient = start
    while True:
        free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
        down = _direction(pairs, gradient, free, precondition, scale)
        found = _along(function, (x, value, gradient), down, limits)
        if found is None and not pairs:
            return
        if found is None:
            # Discard the pairs: their curvature is misleading.
            pairs.clear()
            continue
        before = (x, gradient)
        x, value, gradient = found
        pairs.append((x - before[0], gradient - before[1]))
        del pairs[:-MEMORY]
        yield x, value


def _along(function: Function, here: Iterate, down: Doubles, limits: Tuple[Doubles, Doubles]) -> Optional[Iterate]:
    """Returns a point of lower value along a direction, projected onto the limits; ``None`` if
    there is none."""
    x, value, gradient = here
    share = 1.0
    for _ in range(MAX_TRIES):
        there = np.clip(x + share * down, *limits)
        promised = float(np.vdot(gradient, there - x))
        if promised >= 0:
            return None
        new, slope = function(there)
        if new <= value + DECREASE * promised:
            return there, new, slope
        # Move to the minimum of the parabola through the known values, within bounds.
        share *= min(max(0.5 * promised / (promised - (new - value)), MIN_REDUCTION), MAX_REDUCTION)
    return None


def _direction(pairs: Pairs, gradient: Doubles, free: NDArray[np.bool_], precondition: Operator, scale: float) -> Doubles:
    """Returns the negative gradient times the inverse Hessian that the pairs imply among the free
    numbers: the two loops of Nocedal (1980)."""
    left = np.where(free, gradient, 0.0)
    curved, shares = [], []
    for step, change in pairs:
        step, change = np.where(free, step, 0.0), np.where(free, change, 0.0)
        along = float(np.vdot(step, change))
        if along > MIN_COSINE * float(np.linalg.norm(step) * np.linalg.norm(change)):
            curved.append((step, change, along))
    for step, change, along in reversed(curved):
        shares.append(float(np.vdot(step, left)) / along)
        left = left - shares[-1] * change
    if curved:
        _, change, along = curved[-1]
        scale = along / float(np.vdot(change, np.where(free, precondition(change), 0.0)))
    found = scale * np.where(free, precondition(left), 0.0)
    for (step, change, along), share in zip(curved, reversed(shares)):
        found = found + step * (share - float(np.vdot(change, found)) / along)
    return -found
