"""Reconstruction of refractive indices from measured rays of several views.

The data are deflections, displacements and optical lengths.

    >>> import morgana.reconstruct
    >>> found = morgana.reconstruct.fit(rays, (64, 64, 64), directions=measured, direction_noise=1e-4, lower=1.0)
    >>> found.samples, found.chi_square

Needs SciPy: ``pip install ".[reconstruct]"`` in a clone of morgana. See docs/guides/inverse-problems.md.
"""

from __future__ import annotations

import os
import warnings
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _descent as descent
from . import _losses as losses
from . import _penalties as penalties
from ._abel import Profile, abel
from ._checkpoint import Checkpoint
from ._errors import SceneWarning
from ._misfit import MAX_RAYS, Misfit, Weights, measured_kinds, simulated
from ._numbers import grid_samples, in_order
from ._poisson import PathDifference, integrate
from ._posterior import Posterior
from ._preconditioner import Filter, ReconstructionError, scipy
from ._values import comparable
from .grad import Rays

__all__ = [
    "Iteration",
    "PathDifference",
    "Posterior",
    "Profile",
    "Reconstruction",
    "ReconstructionError",
    "Residuals",
    "abel",
    "fit",
    "integrate",
    "posterior",
    "residuals",
]

Doubles = NDArray[np.float64]
Shape = Tuple[int, int, int]

MIN_COARSE_SAMPLES = 8
"""Minimum number of samples along the shortest axis of the coarsest grid."""
MIN_DECREASE = 2e-3
"""Relative decrease of χ² with penalties, per iteration, below which the search ends."""
MIN_COARSE_DECREASE = 5e-2
"""Relative decrease per iteration below which the search ends if finer grids or more rays
follow."""
AVERAGED_ITERATIONS = 3
"""Number of iterations over which the decrease of χ² is averaged."""
RAYS_PER_SAMPLE = 0.5
"""Rays in a part of the data, for each sample of a grid. Coarse grids need only a part of the rays;
the finest grid starts with a part."""
ITERATIONS_PER_PART = 3
"""Iterations with one part of the rays before the next part replaces it."""
ITERATIONS_PER_SCALE = 5
"""Iterations with one scale of a robust loss before a new scale replaces it."""
GROWTH = 2
"""Factor by which parts grow on the last grid whenever a part brings no further progress."""
SMOOTH_SLOPE = 0.05
"""Slope below which total variation counts as smooth, as a fraction of the largest slope after the
first step that the data alone request."""
MAX_LOST = 0.1
"""Fraction of lost rays above which :func:`fit` warns."""
EXTREMES = (0.1, 10.0)
"""Least and greatest index of the search, relative to the ambient index. Tracing rays through
extreme indices takes too long."""


class Iteration(NamedTuple):
    """Progress of a reconstruction: the argument of ``progress``."""

    shape: Shape
    """Shape of the grid, (nz, ny, nx). Coarse grids come first."""
    number: int
    """Number of the iteration on this grid, from 1."""
    chi_square: float
    """Σ ((ray − measured)/noise)² per datum, over the rays of this iteration. Noise alone gives 1.
    With a robust loss, outliers do not count."""
    rays: int
    """Number of rays of this iteration."""


@comparable
class Reconstruction(NamedTuple):
    """Result of :func:`fit`."""

    samples: Doubles
    """Samples of n, (nz, ny, nx)."""
    chi_square: float
    """Σ ((ray − measured)/noise)² per datum, over all rays that have an end. If there are more than
    a million (2²⁰) rays, over a million of them, drawn at random. With a robust loss, outliers do
    not count: rays that are further from their measurement than 4 times the scale of the loss."""
    stopped: str
    """Reason for the end of the search: ``"noise"`` if noise explains all remaining differences,
    over all rays; ``"slow"`` if χ² hardly decreased; ``"iterations"`` if the limit of iterations
    was reached."""
    history: List[Iteration]
    """All iterations, over all grids."""
    lost: int
    """Number of rays of ``chi_square`` that have no end in this index. They are left out."""
    deviation: Optional[Doubles] = None
    """Standard deviation of the samples due to noise, (nz, ny, nx), if ``replicates`` is above 0;
    else ``None``."""

    def __repr__(self) -> str:
        return f"<morgana.reconstruct.Reconstruction of {self.samples.shape}, χ² {self.chi_square:.4g} after {len(self.history)} iterations: {self.stopped}>"


class _Limits(NamedTuple):
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
        known = _resampled(self.known.astype(float), (index.shape[0], index.shape[1], index.shape[2]), centers, order=1) > 1 - 1e-9
        return np.where(known, index, low), np.where(known, index, high)


class _Stage(NamedTuple):
    """Stage of the search: a grid and a number of rays."""

    grid: Shape
    rays: int


class _Problem(NamedTuple):
    """A reconstruction to solve."""

    misfit: Misfit
    grids: List[Shape]
    limits: _Limits
    start: Doubles
    iterations: int

    @property
    def stages(self) -> List[_Stage]:
        """Stages from coarse to fine grids, with parts of the rays. On the last grid the parts grow
        until they hold all rays."""
        count = len(self.misfit.rays)
        stages = [_Stage(grid, min(max(int(RAYS_PER_SAMPLE * np.prod(grid)), 1), count)) for grid in self.grids]
        last, rays = stages.pop()
        while 2 * rays <= count:
            stages.append(_Stage(last, rays))
            rays *= GROWTH
        return [*stages, _Stage(last, count)]

    def solve(self, progress: Optional[Callable[[Iteration], Any]], checkpoint: Optional[Checkpoint]) -> Reconstruction:
        """Solves the stages in turn, from the state of ``checkpoint`` if that has one."""
        index, history, stopped = self.start, [], "iterations"
        stages = self.stages
        last = stages[-1]
        if checkpoint is not None and checkpoint.saved is not None:
            index, told, stopped = checkpoint.saved
            history = [Iteration(*one) for one in told]
            reached = _Stage(history[-1].shape, history[-1].rays)
            stages = [] if stopped in ("noise", "slow") else [stage for stage in stages if stage >= reached]
        for stage in stages:
            made = sum(one.shape == stage.grid for one in history)
            if made >= self.iterations:
                continue
            if checkpoint is not None:
                checkpoint.refuse_unwritable()
            level = _Level(self.misfit, stage, self.limits, _resampled(index, stage.grid, _centers(self.misfit.rays)), stage == last)
            index = level.start
            for number, (index, chi_square) in enumerate(level, made + 1):
                history.append(Iteration(stage.grid, number, chi_square, stage.rays))
                stopped = level.stopped or ("iterations" if number >= self.iterations else "")
                if progress is not None:
                    progress(history[-1])
                if checkpoint is not None:
                    checkpoint.save(index, history, stopped if stage == last else "")
                if stopped:
                    break
            stopped = level.stopped or "iterations"
        chi_square, lost = next(self.misfit.parts(MAX_RAYS)).without_derivatives(index)
        return Reconstruction(index, chi_square, stopped, history, lost)

    def replicate(self, truth: Doubles, rng: np.random.Generator) -> Doubles:
        """Returns the reconstruction from simulated measurements of ``truth`` with new noise."""
        ends = self.misfit.rays.forward(truth)
        again = self.misfit.with_measured([simulated(kind, getattr(ends, kind.name), rng) for kind in self.misfit.measured])
        return self._replace(misfit=again).solve(None, None).samples


def fit(
    rays: Rays,
    shape: Sequence[int],
    *,
    positions: Optional[ArrayLike] = None,
    position_noise: Optional[ArrayLike] = None,
    directions: Optional[ArrayLike] = None,
    direction_noise: Optional[ArrayLike] = None,
    optical_lengths: Optional[ArrayLike] = None,
    optical_length_noise: Optional[ArrayLike] = None,
    start: Optional[ArrayLike] = None,
    known: Optional[ArrayLike] = None,
    lower: Optional[float] = None,
    upper: Optional[float] = None,
    smoothness: float = 0.0,
    total_variation: float = 0.0,
    loss: str = "squares",
    iterations: int = 40,
    replicates: int = 0,
    checkpoint: Optional[Union[str, "os.PathLike[str]"]] = None,
    progress: Optional[Callable[[Iteration], Any]] = None,
) -> Reconstruction:
    """Find the samples of n with which rays end where they were measured.

    χ² is the sum of squared differences over noise. Limited-memory BFGS decreases it within the
    limits, on coarse grids first.

    With far more rays than samples, random parts of the rays take turns: on coarse grids, and at
    first on the last grid. On the last grid, the parts grow until they hold all rays. They grow
    whenever the samples fit a new part no better than the previous part.

    Without penalties, the search ends when noise explains the remaining differences (the
    discrepancy principle): further iterations would fit noise. A direction and a position have two
    independent components each: directions are unit vectors, and positions lie on the exit.

    Parameters
    ----------
    rays : Rays
        The measured rays of all views, with the box that the index fills.
    shape : three of int
        Samples of the grid, (nz, ny, nx).
    positions : array_like, (rays, 3), optional
        Measured positions of the ends. NaN if unknown.
    position_noise : float or array_like, (rays,), optional
        Standard deviation of the components of ``positions``, in scene units, > 0: one for all
        rays, or one for each.
    directions : array_like, (rays, 3), optional
        Measured directions of the ends, of any length. NaN if unknown.
    direction_noise : float or array_like, (rays,), optional
        Standard deviation of the components of the unit directions, in radians, > 0.
    optical_lengths : array_like, (rays,), optional
        Measured ∫ n ds, in scene units. NaN if unknown.
    optical_length_noise : float or array_like, (rays,), optional
        Standard deviation of ``optical_lengths``, in scene units, > 0.
    start : array_like, (nz, ny, nx), optional
        Initial samples, of any shape; by default the uniform ``ambient`` index of the rays. If they
        have the shape of the grid, the search uses this grid alone.
    known : array_like of bool, (nz, ny, nx), optional
        Mask of the samples, in the shape of the grid, that keep the value of ``start``. Deflections
        determine only differences of n: mark samples where n equals the index of the surroundings,
        as at the walls around a jet.
    lower, upper : float, optional
        Limits of n, such as ``lower`` at the index of the surroundings for a dense gas. By default
        a tenth of ``ambient`` and ten times ``ambient``.
    smoothness : float, optional
        Weight of ½∫|∇n|² dV, which is added to ½χ² (Tikhonov). Use it with few views.
    total_variation : float, optional
        Weight of ∫|∇n| dV, which is added to ½χ². Use it with few views of bodies with edges.
        Slopes below 5 % of the largest slope count as smooth.
    loss : str, optional
        Loss of a ray whose end is r standard deviations of the noise from its measurement.
        ``"squares"`` is ½r², so that χ² is minimised. ``"huber"`` is linear beyond r = 2s, which
        limits the effect of outliers. The scale s follows from the median of r. It starts at the
        size of the signal and falls to 1, the size of the noise. An evaluation takes 1.3 times as
        long as with ``"squares"``.
    iterations : int, optional
        Maximum number of iterations on each grid. It determines the run time: each iteration traces
        half a ray per sample of the grid, or more after parts have grown.
    replicates : int, optional
        Number of reconstructions, 2 or more, from which the standard deviation of the samples is
        estimated (parametric bootstrap); 0 for none. They use data that are simulated from the
        result, with new noise. Each costs as much as the first reconstruction. The deviation does
        not include what views, limits and penalties leave undetermined.
    checkpoint : str or path, optional
        File that is written after each iteration. If the file exists, a search with the same data
        continues from it.
    progress : callable, optional
        Function that is called with an :class:`Iteration` after each iteration. An exception that
        it raises ends the search.

    Returns
    -------
    Reconstruction
        The index, its misfit, and the reason for the end of the search.

    Raises
    ------
    ReconstructionError
        No data, data without noise, shapes that do not fit, or no measured ray that has an end. A
        checkpoint that belongs to other data, is damaged, or cannot be written. SciPy is missing.

    Warns
    -----
    SceneWarning
        More than a tenth of the measured rays have no end in the resulting index.

    Examples
    --------
    >>> found = morgana.reconstruct.fit(rays, (64, 64, 64), directions=measured, direction_noise=1e-4)
    """
    scipy("scipy.ndimage")
    goal = _shape(shape)
    measured = measured_kinds(rays, (positions, position_noise), (directions, direction_noise), (optical_lengths, optical_length_noise))
    weights = Weights(_weight(smoothness, "smoothness"), _weight(total_variation, "total_variation"))
    checks.whole(iterations, "iterations", 1)
    if checks.whole(replicates, "replicates", 0) == 1:
        raise ReconstructionError("replicates is 1 but must be 0, or at least 2 for a deviation")
    grids = _grids(goal)
    index = np.full(grids[0], rays.ambient)
    if start is not None:
        index = grid_samples(start, "start").astype(float)
        if index.ndim != 3:
            raise ReconstructionError(f"start has the shape {index.shape} but must be samples [z, y, x]")
        grids = [goal] if index.shape == goal else grids
    problem = _Problem(Misfit(rays, measured, weights, _loss(loss)), grids, _limits(lower, upper, known, goal), index, iterations)
    saved = None if checkpoint is None else Checkpoint(checkpoint, problem, ReconstructionError)
    problem.misfit.check_start(index)
    found = problem.solve(progress, saved)
    _check_lost(problem.misfit.lost_share(found.lost))
    if replicates == 0:
        return found
    rng = np.random.default_rng(0)
    others = [problem.replicate(found.samples, rng) for _ in range(replicates)]
    return found._replace(deviation=np.std(others, axis=0, ddof=1))


def _check_lost(share: float) -> None:
    """Raises an error if no ray has an end in an index, and warns if many rays have none."""
    if share == 1:
        raise ReconstructionError("no measured ray has an end in the current index: start from another index, or give lower and upper")
    if share > MAX_LOST:
        message = f"{share:.0%} of the measured rays have no end in the index that was found, and were left out: do they reach the exit?"
        warnings.warn(message, SceneWarning, stacklevel=3)


@comparable
class Residuals(NamedTuple):
    """Differences between the ends of rays in an index and their measurements: result of
    :func:`residuals`."""

    lengths: Doubles
    """Length of the difference of each end in units of the noise, (rays,): √2 root mean square for
    normal noise of directions or positions, 1 for optical lengths. The greatest of the kinds of
    data. NaN for rays without data or without an end."""
    scale: float
    """Standard deviation of the components of differences, in units of the noise, from their median
    length: at least 1. 1 if noise explains all differences except outliers."""
    outliers: NDArray[np.bool_]
    """Mask of the rays with a length above 4 times ``scale``, (rays,). Normal noise exceeds this
    limit for 3 rays of 10 000."""

    def __repr__(self) -> str:
        return f"<morgana.reconstruct.Residuals of {len(self.lengths)} rays: scale {self.scale:.4g}, {np.count_nonzero(self.outliers)} outliers>"


def residuals(
    rays: Rays,
    samples: ArrayLike,
    *,
    positions: Optional[ArrayLike] = None,
    position_noise: Optional[ArrayLike] = None,
    directions: Optional[ArrayLike] = None,
    direction_noise: Optional[ArrayLike] = None,
    optical_lengths: Optional[ArrayLike] = None,
    optical_length_noise: Optional[ArrayLike] = None,
) -> Residuals:
    """Differences between the ends of rays in an index and measured ends, with outliers.

    Parameters
    ----------
    rays : Rays
        As for :func:`fit`.
    samples : array_like, (nz, ny, nx)
        Samples of n, such as :attr:`Reconstruction.samples`.
    positions, position_noise, directions, direction_noise, optical_lengths, optical_length_noise
        As for :func:`fit`.

    Returns
    -------
    Residuals
        Residuals of all rays, and the rays that are outliers.

    Raises
    ------
    ReconstructionError
        No data, data without noise, or shapes that do not fit.

    Examples
    --------
    >>> found = morgana.reconstruct.fit(rays, (32, 32, 32), directions=measured, direction_noise=1e-4, loss="huber")
    >>> left = morgana.reconstruct.residuals(rays, found.samples, directions=measured, direction_noise=1e-4)
    >>> measured[left.outliers]
    """
    measured = measured_kinds(rays, (positions, position_noise), (directions, direction_noise), (optical_lengths, optical_length_noise))
    each = losses.lengths_of(rays.forward(samples), measured)
    lengths = np.fmax.reduce(list(each.values()))
    scale = losses.robust_scale(each)
    return Residuals(lengths, scale, np.asarray(lengths > losses.OUTLYING * scale))


def posterior(
    rays: Rays,
    samples: ArrayLike,
    *,
    positions: Optional[ArrayLike] = None,
    position_noise: Optional[ArrayLike] = None,
    directions: Optional[ArrayLike] = None,
    direction_noise: Optional[ArrayLike] = None,
    optical_lengths: Optional[ArrayLike] = None,
    optical_length_noise: Optional[ArrayLike] = None,
    known: Optional[ArrayLike] = None,
    smoothness: float = 0.0,
    prior_deviation: Optional[float] = None,
) -> Posterior:
    """Gauss–Newton approximation of the posterior distribution of an index, given data.

    :func:`fit` gives the most probable samples with a penalty on slopes. This function gives their
    covariance, which has two causes: noise in the data, and too few views, which do not determine
    all samples. Prior assumptions limit the covariance from too few views. ``smoothness``, as in
    :func:`fit`, assumes that differences of neighbouring samples are Gaussian. ``prior_deviation``
    assumes that the samples are Gaussian. Limits and total variation have no effect.

    Parameters
    ----------
    rays : Rays
        As for :func:`fit`.
    samples : array_like, (nz, ny, nx)
        The samples of the result, such as :attr:`Reconstruction.samples`.
    positions, position_noise, directions, direction_noise, optical_lengths, optical_length_noise
        As for :func:`fit`. Values of the data have no effect, except which of them are NaN.
    known, smoothness
        As for :func:`fit`.
    prior_deviation : float, optional
        Standard deviation of all samples before the measurement, > 0.

    Returns
    -------
    Posterior
        The distribution.

    Raises
    ------
    ReconstructionError
        No data, data without noise, or shapes that do not match. No prior for samples that rays do
        not determine. Measured rays that have no end. SciPy is missing.

    Examples
    --------
    >>> found = morgana.reconstruct.fit(rays, (32, 32, 32), directions=measured, direction_noise=1e-4, smoothness=1e3)
    >>> spread = morgana.reconstruct.posterior(rays, found.samples, directions=measured, direction_noise=1e-4, smoothness=1e3)
    >>> spread.deviation()
    """
    index = grid_samples(samples, "samples").astype(float)
    if index.ndim != 3:
        raise ReconstructionError(f"samples have the shape {index.shape} but must be samples [z, y, x]")
    measured = measured_kinds(rays, (positions, position_noise), (directions, direction_noise), (optical_lengths, optical_length_noise))
    per_variance = checks.optional_positive(prior_deviation, "prior_deviation")
    prior = (_weight(smoothness, "smoothness"), 0.0 if per_variance is None else per_variance**-2)
    if not any(prior):
        raise ReconstructionError("give smoothness or prior_deviation: nothing else limits samples that no ray crosses")
    mask = _limits(None, None, known, _shape(index.shape)).known
    valid = rays.forward(index).valid
    noise = {kind.name: (kind.noise, kind.known) for kind in measured}
    lost = sum(int(np.count_nonzero(known & ~valid)) for _, known in noise.values())
    if lost:
        raise ReconstructionError(f"{lost} data belong to rays that have no end in this index: set them to NaN")
    free = np.ones(index.shape, bool) if mask is None else ~mask
    scipy("scipy.sparse.linalg")
    return Posterior(rays, index, noise, free, prior)


class _Level:
    """Search on one grid, with all rays or with parts of them in turn. Iteration yields improving
    samples and χ² per datum there."""

    def __init__(self, misfit: Misfit, stage: _Stage, limits: _Limits, index: Doubles, is_last: bool) -> None:
        rays = misfit.rays
        self.parts, self.has_all = misfit.parts(stage.rays), stage.rays == len(rays)
        self.small = MIN_DECREASE if is_last else MIN_COARSE_DECREASE
        self.stopped = ""
        """Reason for the end of the search: ``"noise"`` or ``"slow"``; empty until it ends."""
        low, high = limits.of(index, rays.ambient, _centers(rays))
        self.start, self.within = np.clip(index, low, high), (low, high)
        # Skip the filter if an offset is undetermined: the filter changes samples far from the
        # data, and limits would turn these changes into an offset, to which deflections are
        # insensitive.
        limited = limits.lower is not None or limits.upper is not None
        open_offset = misfit.is_of_slopes and limited and limits.known is None
        self.precondition = np.asarray if open_offset else Filter(index.shape, rays.spacing(index.shape))

    def __iter__(self) -> Iterator[Tuple[Doubles, float]]:
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


def _weight(value: float, name: str) -> float:
    weight = checks.real(value, name, "a number of at least 0")
    if not (weight >= 0 and np.isfinite(weight)):
        raise ReconstructionError(f"{name} is {value} but must be at least 0")
    return weight


def _loss(name: str) -> losses.Loss:
    kind = losses.LOSSES.get(name) if isinstance(name, str) else None
    if kind is None:
        raise ReconstructionError(f"loss is {checks.shown(name)} but must be one of {', '.join(map(repr, losses.LOSSES))}")
    found: losses.Loss = kind()
    return found


def _limits(lower: Optional[float], upper: Optional[float], known: Optional[ArrayLike], goal: Shape) -> _Limits:
    low, high = (checks.optional_positive(lower, "lower"), checks.optional_positive(upper, "upper"))
    if low is not None and high is not None and low >= high:
        raise ReconstructionError(f"lower is {low} but must be below upper, {high}")
    if known is None:
        return _Limits(low, high, None)
    mask = np.asarray(in_order(known, "known", "zyx"))
    if mask.dtype != bool or mask.shape != goal:
        raise ReconstructionError(f"known has the shape {mask.shape} and type {mask.dtype} but must be {goal} of bool")
    if mask.all():
        raise ReconstructionError("all samples are known: there is nothing to find")
    return _Limits(low, high, mask)


def _centers(rays: Rays) -> bool:
    return rays.placement == "centers"


def _shape(shape: Sequence[int]) -> Shape:
    try:
        nz, ny, nx = shape
    except (TypeError, ValueError):
        raise ReconstructionError(f"the shape of a grid is {checks.shown(shape)} but must be (nz, ny, nx)") from None
    return checks.whole(nz, "nz", 1), checks.whole(ny, "ny", 1), checks.whole(nx, "nx", 1)


def _grids(goal: Shape) -> List[Shape]:
    """Returns the shapes of grids from coarse to fine, by factors of two."""
    grids = [goal]
    while min(n for n in grids[0] if n > 1) >= 2 * MIN_COARSE_SAMPLES if max(goal) > 1 else False:
        nz, ny, nx = (max(1, (n + 1) // 2) for n in grids[0])
        grids.insert(0, (nz, ny, nx))
    return grids


def _resampled(index: Doubles, shape: Shape, centers: bool, order: int = 3) -> Doubles:
    """Resamples the box on another grid, by splines."""
    if index.shape == shape:
        return index
    zoom = scipy("scipy.ndimage").zoom
    factors = [new / old for new, old in zip(shape, index.shape)]
    return np.asarray(zoom(index, factors, order=min(order, min(index.shape) - 1), mode="nearest", grid_mode=centers))
