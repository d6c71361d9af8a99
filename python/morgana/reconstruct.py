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
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _losses as losses
from ._abel import Profile, abel
from ._checkpoint import Checkpoint
from ._errors import SceneWarning
from ._level import Level, Limits, Shape, Stage, centers_of, resampled
from ._misfit import MAX_RAYS, Misfit, Weights, measured_kinds, simulated
from ._numbers import grid_samples, in_order
from ._poisson import PathDifference, integrate
from ._posterior import Posterior
from ._preconditioner import ReconstructionError, scipy
from ._values import comparable
from ._ray_bundle import Rays

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

MIN_COARSE_SAMPLES = 8
"""Minimum number of samples along the shortest axis of the coarsest grid."""
RAYS_PER_SAMPLE = 0.5
"""Rays in a part of the data, for each sample of a grid. Coarse grids need only a part of the rays;
the finest grid starts with a part."""
GROWTH = 2
"""Factor by which parts grow on the last grid whenever a part brings no further progress."""
MAX_LOST = 0.1
"""Fraction of lost rays above which :func:`fit` warns."""
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


class _Problem(NamedTuple):
    """A reconstruction to solve."""

    misfit: Misfit
    grids: List[Shape]
    limits: Limits
    start: Doubles
    iterations: int
    straight: bool = False
    """True for derivatives along straight rays."""

    @property
    def stages(self) -> List[Stage]:
        """Stages from coarse to fine grids, with parts of the rays. On the last grid the parts grow
        until they hold all rays."""
        count = len(self.misfit.rays)
        if self.straight:
            return [Stage(grid, count) for grid in self.grids]
        stages = [Stage(grid, min(max(int(RAYS_PER_SAMPLE * np.prod(grid)), 1), count)) for grid in self.grids]
        last, rays = stages.pop()
        while 2 * rays <= count:
            stages.append(Stage(last, rays))
            rays *= GROWTH
        return [*stages, Stage(last, count)]

    def solve(self, progress: Optional[Callable[[Iteration], Any]], checkpoint: Optional[Checkpoint]) -> Reconstruction:
        """Solves the stages in turn, from the state of ``checkpoint`` if that has one."""
        index, history, stopped = self.start, [], "iterations"
        stages = self.stages
        last = stages[-1]
        if checkpoint is not None and checkpoint.saved is not None:
            index, told, stopped = checkpoint.saved
            history = [Iteration(*one) for one in told]
            reached = Stage(history[-1].shape, history[-1].rays)
            stages = [] if stopped in ("noise", "slow") else [stage for stage in stages if stage >= reached]
        for stage in stages:
            made = sum(one.shape == stage.grid for one in history)
            if made >= self.iterations:
                continue
            if checkpoint is not None:
                checkpoint.refuse_unwritable()
            level = Level(self.misfit, stage, self.limits, resampled(index, stage.grid, centers_of(self.misfit.rays)), stage == last, self.straight)
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
    derivatives: str = "exact",
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
    derivatives : str, optional
        ``"exact"``: derivatives along curved rays. ``"straight"``: derivatives along straight rays,
        which cost a tenth. Curved rays still determine χ². Use ``"straight"`` for weak fields such
        as gas flows, with ``directions`` alone. An iteration is then a trace along curved rays,
        with up to 60 steps before it. The search ends if χ² no longer falls.
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
    straight = _straight(derivatives)
    # The model of weak fields has no local minima, and coarse grids would add details that do not fit the last grid.
    grids = [goal] if straight else _grids(goal)
    index = np.full(grids[0], rays.ambient)
    if start is not None:
        index = grid_samples(start, "start").astype(float)
        if index.ndim != 3:
            raise ReconstructionError(f"start has the shape {index.shape} but must be samples [z, y, x]")
        grids = [goal] if index.shape == goal else grids
    problem = _Problem(Misfit(rays, measured, weights, _loss(loss)), grids, _limits(lower, upper, known, goal), index, iterations, straight)
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


def _weight(value: float, name: str) -> float:
    weight = checks.real(value, name, "a number of at least 0")
    if not (weight >= 0 and np.isfinite(weight)):
        raise ReconstructionError(f"{name} is {value} but must be at least 0")
    return weight


def _straight(name: str) -> bool:
    if not isinstance(name, str) or name not in ("exact", "straight"):
        raise ReconstructionError(f"derivatives is {checks.shown(name)} but must be 'exact' or 'straight'")
    return name == "straight"


def _loss(name: str) -> losses.Loss:
    kind = losses.LOSSES.get(name) if isinstance(name, str) else None
    if kind is None:
        raise ReconstructionError(f"loss is {checks.shown(name)} but must be one of {', '.join(map(repr, losses.LOSSES))}")
    found: losses.Loss = kind()
    return found


def _limits(lower: Optional[float], upper: Optional[float], known: Optional[ArrayLike], goal: Shape) -> Limits:
    low, high = (checks.optional_positive(lower, "lower"), checks.optional_positive(upper, "upper"))
    if low is not None and high is not None and low >= high:
        raise ReconstructionError(f"lower is {low} but must be below upper, {high}")
    if known is None:
        return Limits(low, high, None)
    mask = np.asarray(in_order(known, "known", "zyx"))
    if mask.dtype != bool or mask.shape != goal:
        raise ReconstructionError(f"known has the shape {mask.shape} and type {mask.dtype} but must be {goal} of bool")
    if mask.all():
        raise ReconstructionError("all samples are known: there is nothing to find")
    return Limits(low, high, mask)


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
