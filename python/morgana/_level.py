"""Search on one grid of a reconstruction: see :func:`morgana.reconstruct.fit`."""

from __future__ import annotations

from typing import Iterator, List, NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _descent as descent
from . import _penalties as penalties
from ._misfit import Misfit
from ._preconditioner import Filter, scipy
from ._straight import Search
from ._ray_bundle import Rays

__all__ = ["Level", "Limits", "Shape", "Stage", "centers_of", "resampled"]

Doubles = NDArray[np.float64]
Shape = Tuple[int, int, int]

MIN_DECREASE = 2e-3
"""Relative decrease of χ² with penalties, per iteration, below which the search ends."""
MIN_COARSE_DECREASE = 5e-2
"""Relative decrease per iteration below which the search ends if finer grids or more rays
follow."""
AVERAGED_ITERATIONS = 3
"""Number of iterations over which the decrease of χ² is averaged."""
ITERATIONS_PER_PART = 3
"""Iterations with one part of the rays before the next part replaces it."""
ITERATIONS_PER_SCALE = 5
"""Iterations with one scale of a robust loss before a new scale replaces it."""
SMOOTH_SLOPE = 0.05
"""Slope below which total variation counts as smooth, as a fraction of the largest slope after the
first step that the data alone request."""
EXTREMES = (0.1, 10.0)
"""Least and greatest index of the search, relative to the ambient index. Tracing rays through
extreme indices takes too long."""


class Limits(NamedTuple):
    """Bounds of the samples."""

    lower: Optional[float]
    upper: Optional[float]
    known: Optional[NDArray[np.bool_]]
    """Samples of the last grid that keep their value."""

    def of(self, index: Doubles, ambient: float, centers: bool) -> Tuple[Doubles, Doubles]:
        """Returns the least and the greatest value of each sample. Both are the given value where a
        sample is known."""
        least, greatest = EXTREMES
        low = np.full(index.shape, least * ambient if self.lower is None else self.lower)
        high = np.full(index.shape, greatest * ambient if self.upper is None else self.upper)
        if self.known is None:
            return low, high
        # Mark samples between known samples of the last grid as known on coarser grids.
        known = resampled(self.known.astype(float), (index.shape[0], index.shape[1], index.shape[2]), centers, order=1) > 1 - 1e-9
        return np.where(known, index, low), np.where(known, index, high)


class Stage(NamedTuple):
    """Stage of the search: a grid and a number of rays."""

    grid: Shape
    rays: int


class Level:
    """Search on one grid, with all rays or with parts of them in turn. Iteration yields improving
    samples and χ² per datum there."""

    def __init__(self, misfit: Misfit, stage: Stage, limits: Limits, index: Doubles, is_last: bool, straight: bool) -> None:
        rays = misfit.rays
        self.parts, self.has_all = misfit.parts(stage.rays), stage.rays == len(rays)
        self.straight = straight
        self.small = MIN_DECREASE if is_last else MIN_COARSE_DECREASE
        self.stopped = ""
        """Reason for the end of the search: ``"noise"`` or ``"slow"``; empty until it ends."""
        low, high = limits.of(index, rays.ambient, centers_of(rays))
        self.start, self.within = np.clip(index, low, high), (low, high)
        # Skip the filter if an offset is undetermined: the filter changes samples far from the
        # data, and limits would turn these changes into an offset, to which deflections are
        # insensitive.
        limited = limits.lower is not None or limits.upper is not None
        open_offset = misfit.is_of_slopes and limited and limits.known is None
        self.precondition = np.asarray if open_offset else Filter(index.shape, rays.spacing(index.shape))

    def __iter__(self) -> Iterator[Tuple[Doubles, float]]:
        return self._along_straight() if self.straight else self._along_curved()

    def _along_straight(self) -> Iterator[Tuple[Doubles, float]]:
        misfit = next(self.parts)
        search = Search(misfit, self.within, self.precondition, SMOOTH_SLOPE)
        for index, chi_square in search.steps(self.start, self.small):
            self.stopped = ("noise" if misfit.explained else "slow") if search.finished else ""
            yield index, chi_square
        self.stopped = "noise" if misfit.explained else "slow"

    def _along_curved(self) -> Iterator[Tuple[Doubles, float]]:
        index = self.start
        pairs: descent.Pairs = []
        scale: Optional[float] = None
        before = np.inf
        for misfit in self.parts:
            of_data = misfit.of_data(index, adapt=True)
            if misfit.explained:
                self.stopped = "noise"
                return
            if scale is None:
                scale, flat = self._scales(misfit, index, of_data[1])
            misfit.flat = flat
            value, gradient = misfit.with_penalties(index, of_data)
            # Measure progress by rays that have not been fitted yet.
            if not self.has_all and before - value < ITERATIONS_PER_PART * self.small * before:
                break
            before, found = value, index
            for index, chi_square in self._turn(misfit, descent.minimize(misfit, (index, value, gradient), scale, self.within, self.precondition, pairs)):
                yield index, chi_square
            if self.stopped:
                return
            if (self.has_all and not misfit.is_robust) or found is index:
                break
        self.stopped = "slow"

    def _scales(self, misfit: Misfit, index: Doubles, gradient: Doubles) -> Tuple[float, float]:
        """Returns the scale of the first step, and the slope below which total variation counts as
        flat."""
        scale, first = descent.first_scale(misfit.of_data, index, gradient, self.precondition)
        if misfit.weights.total_variation == 0:
            return scale, 1.0
        return scale, max(SMOOTH_SLOPE * penalties.largest_slope(index + first, penalties.lattice_of(misfit.rays, index.shape)), 1e-300)

    def _turn(self, misfit: Misfit, steps: Iterator[Tuple[Doubles, float]]) -> Iterator[Tuple[Doubles, float]]:
        """Yields the steps with one part of the rays, or with one scale of a robust loss. With all
        rays and without a scale, yields the steps until the search ends."""
        values: List[float] = []
        last = ITERATIONS_PER_SCALE if misfit.is_robust else None
        for index, value in steps:
            values.append(value)
            if self.has_all:
                self.stopped = "noise" if misfit.explained else "slow" if _is_slow(values, self.small) else ""
            yield index, misfit.chi_square
            if self.stopped or len(values) == last or (not self.has_all and (misfit.explained or len(values) == ITERATIONS_PER_PART)):
                return


def _is_slow(values: List[float], small: float) -> bool:
    """True if a value fell, on average over the last iterations, by less than the fraction
    ``small`` in each."""
    if len(values) <= AVERAGED_ITERATIONS:
        return False
    before = values[-1 - AVERAGED_ITERATIONS]
    return before - values[-1] < AVERAGED_ITERATIONS * small * before


def centers_of(rays: Rays) -> bool:
    return rays.placement == "centers"


def resampled(index: Doubles, shape: Shape, centers: bool, order: int = 3) -> Doubles:
    """Resamples the box on another grid, by splines."""
    if index.shape == shape:
        return index
    zoom = scipy("scipy.ndimage").zoom
    factors = [new / old for new, old in zip(shape, index.shape)]
    return np.asarray(zoom(index, factors, order=min(order, min(index.shape) - 1), mode="nearest", grid_mode=centers))
