"""Minimising a smooth function of many numbers within limits: limited-memory BFGS on those that are free, projected."""

from __future__ import annotations

from typing import Callable, Iterator, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["first_scale", "minimize"]

Doubles = NDArray[np.float64]
Place = Tuple[Doubles, float, Doubles]
"""Numbers, the value of the function there, and its gradient."""
Function = Callable[[Doubles], Tuple[float, Doubles]]
Operator = Callable[[Doubles], Doubles]
Pairs = List[Tuple[Doubles, Doubles]]
"""Steps, and changes of the gradient along them."""

MEMORY = 12
"""Pairs of steps and changes of the gradient that are kept."""
DECREASE = 1e-4
"""A step is taken if it brings this share of what the slope at its start promises (Armijo)."""
TRIES = 12
"""A step is shortened at most so often."""
SHORTEST, LONGEST = 0.1, 0.5
"""Each time to a share of its length between these."""
PROBE = 1e-4
"""Length of the step that measures the first curvature."""
CURVED = 1e-8
"""Pairs whose cosine is smaller say nothing about the curvature."""


def first_scale(function: Function, start: Doubles, gradient: Doubles, precondition: Operator) -> Tuple[float, Doubles]:
    """Along the preconditioned gradient at ``start``: how many times that the minimum is away, as the curvature lets expect, and the step there."""
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
    function: Function, start: Place, scale: float, limits: Tuple[Doubles, Doubles], precondition: Operator, pairs: Pairs
) -> Iterator[Tuple[Doubles, float]]:
    """Places that are lower and lower, with the value there, until none is found. ``start`` lies within the limits.

    Numbers at a limit that the gradient pushes beyond it stay there. The others make a step of limited-memory BFGS that begins with ``precondition``, a
    symmetric positive operator, and are clipped to the limits (Bertsekas 1982). As long as nothing is known of the
    curvature, it goes ``scale`` times down the preconditioned gradient (:func:`first_scale`).
    ``pairs``, empty at first, keep what is learnt, for functions of about the same curvature.
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
            # What was learnt about the curvature misleads: forget it.
            pairs.clear()
            continue
        before = (x, gradient)
        x, value, gradient = found
        pairs.append((x - before[0], gradient - before[1]))
        del pairs[:-MEMORY]
        yield x, value


def _along(function: Function, here: Place, down: Doubles, limits: Tuple[Doubles, Doubles]) -> Optional[Place]:
    """A lower place along a direction, projected on the limits."""
    x, value, gradient = here
    share = 1.0
    for _ in range(TRIES):
        there = np.clip(x + share * down, *limits)
        promised = float(np.vdot(gradient, there - x))
        if promised >= 0:
            return None
        new, slope = function(there)
        if new <= value + DECREASE * promised:
            return there, new, slope
        # To the minimum of the parabola through what is known, within limits.
        share *= min(max(0.5 * promised / (promised - (new - value)), SHORTEST), LONGEST)
    return None


def _direction(pairs: Pairs, gradient: Doubles, free: NDArray[np.bool_], precondition: Operator, scale: float) -> Doubles:
    """Down the gradient, times the inverse Hessian that the pairs let expect among the free numbers: the two loops of Nocedal (1980)."""
    left = np.where(free, gradient, 0.0)
    curved, shares = [], []
    for step, change in pairs:
        step, change = np.where(free, step, 0.0), np.where(free, change, 0.0)
        along = float(np.vdot(step, change))
        if along > CURVED * float(np.linalg.norm(step) * np.linalg.norm(change)):
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
