"""Refractive indices from rays that were measured: deflections, displacements, optical lengths of several views.

    >>> import morgana.reconstruct
    >>> found = morgana.reconstruct.fit(rays, (64, 64, 64), directions=measured, direction_noise=1e-4, lower=1.0)
    >>> found.samples, found.chi_square

Needs SciPy: ``pip install "morgana-render[reconstruct]"``. See docs/guides/inverse-problems.md.
"""

from __future__ import annotations

from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._errors import Error
from ._numbers import numbers
from ._values import comparable
from .grad import Rays

__all__ = ["Iteration", "Reconstruction", "ReconstructionError", "fit"]

Doubles = NDArray[np.float64]
Shape = Tuple[int, int, int]

COARSEST = 8
"""Samples along the shortest axis of the coarsest grid, at least."""
SMALL = 2e-3
"""The search ends when χ² falls by less than this share in an iteration."""
SMALL_COARSE = 2e-2
"""The same on grids that others follow."""
RAYS_PER_SAMPLE = 1
"""Rays for each sample of a coarse grid: not all are needed there."""
MEMORY = 12
"""Pairs of steps and gradients that L-BFGS keeps."""


class ReconstructionError(Error, ValueError):
    """A reconstruction that cannot be done as it was asked for."""


class Iteration(NamedTuple):
    """How far a reconstruction has come, as ``progress`` is told."""

    shape: Shape
    """The grid, (nz, ny, nx): they are coarse first."""
    number: int
    """The iteration on this grid, from 1."""
    chi_square: float
    """Σ ((ray − measured)/noise)² per datum: 1 is what noise explains."""


@comparable
class Reconstruction(NamedTuple):
    """What :func:`fit` has found."""

    samples: Doubles
    """Samples of n, (nz, ny, nx)."""
    chi_square: float
    """Σ ((ray − measured)/noise)² per datum."""
    stopped: str
    """Why it ended: ``"noise"``, where the rest is explained by noise; ``"slow"``, where little changed; ``"iterations"``."""
    history: List[Iteration]
    """All iterations."""
    lost: int
    """Rays that have no end in this index, and were left out."""

    def __repr__(self) -> str:
        return f"<morgana.reconstruct.Reconstruction of {self.samples.shape}, χ² {self.chi_square:.4g} after {len(self.history)} iterations: {self.stopped}>"


class _Stop(Exception):
    """Ends a level."""


class _Measured(NamedTuple):
    """One kind of data."""

    name: str
    values: Doubles
    noise: float
    data: float


class _Misfit:
    """½χ² of rays and the penalty on slopes, and their derivatives by the samples."""

    def __init__(self, rays: Rays, measured: List[_Measured], smoothness: float) -> None:
        self.rays, self.measured, self.smoothness = rays, measured, smoothness
        self.count = sum(kind.data for kind in measured)
        self.is_of_slopes = any(kind.name != "optical_lengths" for kind in measured)
        self.chi_square, self.lost = np.inf, 0

    def with_rays(self, most: int) -> "_Misfit":
        """Of so many of the rays at most, drawn at random."""
        if len(self.rays) <= most:
            return self
        rows = np.sort(np.random.default_rng(0).permutation(len(self.rays))[:most])
        share = most / len(self.rays)
        measured = [kind._replace(values=kind.values[rows], data=share * kind.data) for kind in self.measured]
        return _Misfit(self.rays.select(rows), measured, share * self.smoothness)

    def __call__(self, index: Doubles) -> Tuple[float, Doubles]:
        ends = self.rays.forward(index)
        by, total = {}, 0.0
        for name, values, noise, _ in self.measured:
            residual = (getattr(ends, name) - values) / noise
            # Neither rays without an end nor data that are missing count.
            residual = np.where(np.isfinite(residual), residual, 0.0)
            by[name] = residual / noise
            total += float(np.sum(residual**2))
        self.chi_square, self.lost = total / self.count, int(np.count_nonzero(~ends.valid))
        gradient = self.rays.vjp(index, **by).field
        penalty, slope = _roughness(index, self.rays.spacing(index.shape))
        return 0.5 * total + self.smoothness * penalty, gradient + self.smoothness * slope


def _roughness(index: Doubles, spacing: Doubles) -> Tuple[float, Doubles]:
    """½∫|∇n|² dV by differences of neighbours, and its derivative."""
    gradient, total, cell = np.zeros_like(index), 0.0, float(np.prod(spacing))
    for axis, step in zip((2, 1, 0), spacing):
        if index.shape[axis] < 2:
            continue
        slope = np.diff(index, axis=axis) / step
        total += 0.5 * cell * float(np.sum(slope**2))
        first = [slice(None)] * 3
        last = list(first)
        first[axis], last[axis] = slice(None, -1), slice(1, None)
        gradient[tuple(first)] -= cell / step * slope
        gradient[tuple(last)] += cell / step * slope
    return total, gradient


def fit(
    rays: Rays,
    shape: Sequence[int],
    *,
    positions: Optional[ArrayLike] = None,
    position_noise: Optional[float] = None,
    directions: Optional[ArrayLike] = None,
    direction_noise: Optional[float] = None,
    optical_lengths: Optional[ArrayLike] = None,
    optical_length_noise: Optional[float] = None,
    start: Optional[ArrayLike] = None,
    lower: Optional[float] = None,
    upper: Optional[float] = None,
    smoothness: float = 0.0,
    iterations: int = 40,
    progress: Optional[Callable[[Iteration], Any]] = None,
) -> Reconstruction:
    """Find the samples of n with which rays end where they were measured.

    χ², the sum of squared differences over noise, is made smaller by L-BFGS, on coarse grids first, with some of the rays. It
    ends when noise explains what is left (the discrepancy principle): further iterations would fit noise.

    Parameters
    ----------
    rays : Rays
        The rays that were measured, of all views, with the box that the index fills.
    shape : three of int
        Samples of the grid, (nz, ny, nx).
    positions : array_like, (rays, 3), optional
        Measured positions of the ends. NaN where they are not known.
    position_noise : float, optional
        Standard deviation of their components, in scene units, > 0.
    directions : array_like, (rays, 3), optional
        Measured unit directions of the ends. NaN where they are not known.
    direction_noise : float, optional
        Standard deviation of their components, in radians, > 0.
    optical_lengths : array_like, (rays,), optional
        Measured ∫ n ds. NaN where they are not known.
    optical_length_noise : float, optional
        Their standard deviation, in scene units, > 0.
    start : array_like, (nz, ny, nx), optional
        Samples to start from, of any shape; a uniform ``ambient`` index of the rays by default. The search is on the last grid alone if they have its shape.
    lower, upper : float, optional
        Limits of n, such as that of the surroundings for a gas that is dense.
    smoothness : float, optional
        Weight of ½∫|∇n|² dV, which is added to ½χ² (Tikhonov): for few views.
    iterations : int, optional
        At most so many on each grid.
    progress : callable, optional
        Called with an :class:`Iteration` after each one. What it raises ends the search.

    Returns
    -------
    Reconstruction
        The index, how well it fits, and why the search ended.

    Raises
    ------
    ReconstructionError
        No data, data without noise, shapes that do not fit, or SciPy is missing.

    Examples
    --------
    >>> found = morgana.reconstruct.fit(rays, (64, 64, 64), directions=measured, direction_noise=1e-4)
    """
    goal = _shape(shape)
    measured = [
        *_data(rays, "positions", positions, position_noise, 2),
        *_data(rays, "directions", directions, direction_noise, 2),
        *_data(rays, "optical_lengths", optical_lengths, optical_length_noise, 1),
    ]
    if not measured:
        raise ReconstructionError("there is nothing to fit: give positions, directions or optical_lengths with their noise")
    if not smoothness >= 0:
        raise ReconstructionError(f"smoothness is {smoothness} but must be at least 0")
    checks.whole(iterations, "iterations", 1)
    misfit = _Misfit(rays, measured, float(smoothness))
    grids = _grids(goal)
    index = np.full(grids[0], rays.ambient)
    if start is not None:
        index = numbers(start, "start").astype(float)
        if index.ndim != 3:
            raise ReconstructionError(f"start has the shape {index.shape} but must be samples [z, y, x]")
        grids = [goal] if index.shape == goal else grids
    history: List[Iteration] = []
    for grid in grids:
        coarse = grid != goal
        some = misfit.with_rays(RAYS_PER_SAMPLE * int(np.prod(grid))) if coarse else misfit
        search = _Level(some, _resampled(index, grid), (lower, upper), history, progress)
        stopped = search.run(iterations, SMALL_COARSE if coarse else SMALL)
        index = search.index
    return Reconstruction(index, search.chi_square, stopped, history, search.lost)


class _Level:
    """The search on one grid."""

    def __init__(
        self,
        misfit: _Misfit,
        index: Doubles,
        limits: Tuple[Optional[float], Optional[float]],
        history: List[Iteration],
        progress: Optional[Callable[[Iteration], Any]],
    ) -> None:
        self.misfit, self.index, self.limits = misfit, index, limits
        self.history, self.progress = history, progress
        self.chi_square, self.lost, self.number, self.stopped = np.inf, 0, 0, "iterations"

    def run(self, iterations: int, small: float) -> str:
        """Makes at most so many iterations, as long as χ² falls by more than a ``small`` share in each. Says why it ended."""
        optimize = _scipy("scipy.optimize")
        low, high = self.limits
        base = self._limited(self.index)
        # Limits hold for samples, not for what is filtered.
        limited = self.limits != (None, None)
        filtered = _Filter(base.shape) if self.misfit.is_of_slopes and not limited else np.asarray

        def samples(x: Doubles) -> Doubles:
            return self._limited(base + filtered(x.reshape(base.shape)))

        def misfit(x: Doubles) -> Tuple[float, Doubles]:
            value, gradient = self.misfit(samples(x))
            return value, filtered(gradient).ravel()

        _, gradient = misfit(np.zeros(base.size))
        self.index = base
        if self._note() <= 1:
            return "noise"
        unit = _first_step(misfit, gradient)
        if unit == 0:
            return "slow"
        room = [((low or 0) - n, np.inf if high is None else high - n) for n in base.ravel()] if limited else []
        bounds = [(below / unit, above / unit) for below, above in room] or None

        def scaled(x: Doubles) -> Tuple[float, Doubles]:
            value, gradient = misfit(x * unit)
            return value, gradient * unit

        def step(x: Doubles) -> None:
            self.index = samples(x * unit)
            self._step(small)

        try:
            optimize.minimize(
                scaled,
                np.zeros(base.size),
                jac=True,
                method="L-BFGS-B",
                bounds=bounds,
                callback=step,
                options={"maxiter": iterations, "maxcor": MEMORY, "ftol": 0, "gtol": 0},
            )
        except _Stop:
            pass
        return self.stopped

    def _limited(self, index: Doubles) -> Doubles:
        """Within the limits, which rounding may have passed."""
        low, high = self.limits
        return np.clip(index, -np.inf if low is None else low, np.inf if high is None else high)

    def _note(self) -> float:
        self.chi_square, self.lost = self.misfit.chi_square, self.misfit.lost
        return self.chi_square

    def _step(self, small: float) -> None:
        before = self.chi_square
        self._note()
        self.number += 1
        nz, ny, nx = self.index.shape
        done = Iteration((nz, ny, nx), self.number, self.chi_square)
        self.history.append(done)
        if self.progress is not None:
            self.progress(done)
        if self.chi_square <= 1:
            self.stopped = "noise"
        elif before - self.chi_square < small * before and self.number > 3:
            self.stopped = "slow"
        else:
            return
        raise _Stop


class _Filter:
    """A symmetric filter of samples that makes the Hessian of χ² of deflections more like one: that of waves grows in proportion to their number."""

    def __init__(self, shape: Tuple[int, ...]) -> None:
        self.fft = _scipy("scipy.fft")
        waves = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij", sparse=True)
        number = np.sqrt(sum(np.square(wave, dtype=float) for wave in waves))
        self.weights = (1 + number) ** -0.5

    def __call__(self, values: Doubles) -> Doubles:
        return np.asarray(self.fft.idctn(self.weights * self.fft.dctn(values, norm="ortho"), norm="ortho"))


def _first_step(misfit: Callable[[Doubles], Tuple[float, Doubles]], gradient: Doubles) -> float:
    """The length of the step to the minimum along the gradient, as the curvature there lets expect: L-BFGS begins with a step of length 1."""
    size = float(np.linalg.norm(gradient))
    if size == 0:
        return 0.0
    small = 1e-4 / float(np.abs(gradient).max())
    _, moved = misfit(-small * gradient)
    return small * size**3 / abs(float(np.sum((gradient - moved) * gradient)))


def _data(rays: Rays, name: str, values: Optional[ArrayLike], noise: Optional[float], independent: int) -> List[_Measured]:
    """One kind of data, if it is given. A direction and a position on a plane have two independent components."""
    word = f"{name[:-1]}_noise"
    if values is None:
        if noise is not None:
            raise ReconstructionError(f"{word} is given without {name}")
        return []
    if noise is None:
        raise ReconstructionError(f"{name} need their standard deviation: give {word}")
    array = numbers(values, name)
    shape = (len(rays),) if name == "optical_lengths" else (len(rays), 3)
    if array.shape != shape:
        raise ReconstructionError(f"{name} have the shape {array.shape} but must have {shape}, a row for each ray")
    known = np.isfinite(array.reshape(len(rays), -1)).all(axis=1)
    if not known.any():
        raise ReconstructionError(f"none of the {name} is known")
    return [_Measured(name, array, checks.positive(noise, word), independent * int(known.sum()))]


def _shape(shape: Sequence[int]) -> Shape:
    if len(shape) != 3:
        raise ReconstructionError(f"the shape of a grid is (nz, ny, nx), not {tuple(shape)}")
    nz, ny, nx = (checks.whole(n, "a number of samples", 1) for n in shape)
    return nz, ny, nx


def _grids(goal: Shape) -> List[Shape]:
    """From coarse to fine, by factors of two."""
    grids = [goal]
    while min(n for n in grids[0] if n > 1) >= 2 * COARSEST if max(goal) > 1 else False:
        nz, ny, nx = (max(1, (n + 1) // 2) for n in grids[0])
        grids.insert(0, (nz, ny, nx))
    return grids


def _resampled(index: Doubles, shape: Shape) -> Doubles:
    """Samples of the same box on another grid, by cubic splines."""
    if index.shape == shape:
        return index
    zoom = _scipy("scipy.ndimage").zoom
    factors = [new / old for new, old in zip(shape, index.shape)]
    return np.asarray(zoom(index, factors, order=min(3, min(index.shape) - 1), mode="nearest"))


def _scipy(module: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise ReconstructionError('reconstructions need SciPy: pip install "morgana-render[reconstruct]"') from None
