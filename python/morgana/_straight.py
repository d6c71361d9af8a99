"""Derivatives of directions of rays by samples of n along straight rays, and a search with them,
for :func:`morgana.reconstruct.fit`.

The direction of a ray changes by ∫∇n ds/n across the ray. For a spline of samples this integral is
a sparse matrix, which costs a tenth of a derivative along the curved ray.
"""

from __future__ import annotations

from typing import Any, Callable, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _descent as descent
from . import _penalties as penalties
from ._misfit import Misfit
from ._preconditioner import ReconstructionError, scipy
from ._ray_bundle import Rays

__all__ = ["Derivatives", "Search"]

Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]
Valued = Tuple[float, Doubles]

TAPS = 12
"""Samples of a slice that determine a slope: three along the slope, four across it."""
MAX_BYTES = 2 << 30
"""Maximum memory of the matrices, bytes."""
CHUNK = 1 << 19
"""Number of points on rays for which weights are computed at once."""
MIN_SAMPLES = 4
"""Minimum number of samples along an axis: the spline needs them."""
REDUCTION = 0.003
"""Factor by which the model reduces χ² before a trace along curved rays. Errors of the model leave
about this fraction: measured with a jet of sharp edges, where 5001 became 28."""
NOISE_REDUCTION = 0.9
"""χ² per datum of the model at which the search traces along curved rays: below 1, because the
trace adds the error of the model."""
MAX_STEPS = 60
"""Maximum number of steps in one model."""
STEPS_OF_AVERAGE = 3
"""Number of steps over which the decrease of the model is averaged."""


class Part(NamedTuple):
    """Rays that advance most along one axis, and their matrices."""

    axis: int
    """The axis, x, y or z: 0, 1 or 2."""
    rays: NDArray[np.int64]
    """Numbers of the rays."""
    slopes: List[Tuple[int, Any]]
    """Axes across, each with the sparse matrix from coefficients of the spline to ∫∂n ds."""
    rise: Any
    """Sparse matrix from samples to the difference of n between the ends of the rays in the box."""


class Derivatives:
    """Linear map from changes of samples to changes of the directions of straight rays."""

    def __init__(self, rays: Rays, shape: Tuple[int, ...]) -> None:
        if rays._exits.per_end != 1 or rays._box is None:
            raise ReconstructionError("derivatives along straight rays need one ray per end, through a box: use derivatives='exact'")
        if min(shape) < MIN_SAMPLES:
            raise ReconstructionError(f"a grid of {shape} has fewer than {MIN_SAMPLES} samples along an axis: use derivatives='exact'")
        self.sparse = scipy("scipy.sparse")
        self.shape, self.ambient = shape, rays.ambient
        origins, directions = rays.starts
        self.directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        self.spacing = rays.spacing(shape)
        low, high = np.asarray(rays._box, dtype=float)
        self.first = low + (0.5 * self.spacing if rays.placement == "centers" else 0.0)
        bytes_needed = 2 * 8 * TAPS * len(origins) * max(shape)
        if bytes_needed > MAX_BYTES:
            raise ReconstructionError(f"derivatives along straight rays would need {bytes_needed / 2**30:.1f} GB of memory: use derivatives='exact'")
        self.values = [_coefficients(n) for n in shape[::-1]]
        with np.errstate(divide="ignore", invalid="ignore"):
            faces = np.stack([(low - origins) / self.directions, (high - origins) / self.directions])
        flat = self.directions == 0
        enter = np.maximum(np.where(flat, -np.inf, faces.min(0)).max(1), 0.0)
        leave = np.where(flat, np.inf, faces.max(0)).min(1)
        axes = np.abs(self.directions / self.spacing).argmax(1)
        self.parts: List[Part] = []
        for axis in range(3):
            rows = np.flatnonzero((axes == axis) & (leave > enter))
            if rows.size:
                across = [other for other in range(3) if other != axis]
                given = (origins[rows], self.directions[rows], enter[rows], leave[rows])
                points = [origins[rows] + t[rows, None] * self.directions[rows] for t in (enter, leave)]
                self.parts.append(Part(axis, rows, [(slope, self._matrix(*given, axis, slope)) for slope in across], self._rise(*points)))

    def __call__(self, change: Doubles) -> Doubles:
        """Returns the change of all directions, (rays, 3)."""
        found = np.zeros(self.directions.shape)
        for axis, rows, slopes, rise in self.parts:
            for slope, matrix in slopes:
                found[rows, slope] = matrix @ self._spline(change, axis, slope).ravel().astype(np.float32)
            # The slope along the ray integrates to the rise, and does not turn the ray.
            along, risen = self.directions[rows], rise @ change.ravel()
            found[rows, axis] = (risen - np.sum(found[rows] * along, 1)) / along[:, axis]
            found[rows] -= risen[:, None] * along
        return found / self.ambient

    def transposed(self, by: Doubles) -> Doubles:
        """Returns derivatives by the samples, given derivatives by all directions, (rays, 3)."""
        total = np.zeros(self.shape)
        for axis, rows, slopes, rise in self.parts:
            along = self.directions[rows]
            across = by[rows] - np.sum(by[rows] * along, 1)[:, None] * along
            by_rise = across[:, axis] / along[:, axis]
            across = across - by_rise[:, None] * along
            total += np.asarray(rise.T @ by_rise).reshape(self.shape)
            for slope, matrix in slopes:
                total += self._spline_transposed(np.asarray(matrix.T @ across[:, slope].astype(np.float32), dtype=float), axis, slope)
        return total / self.ambient

    def _maps(self, axis: int, slope: int) -> List[Optional[Doubles]]:
        """Returns matrices along the array axes z, y, x: from samples to coefficients of the spline
        or, along the slope, to differences of neighbours; ``None`` along the axis of the rays."""
        along = {axis: None, slope: np.diff(self.values[slope], axis=0)}
        return [along.get(i, self.values[i]) for i in (2, 1, 0)]

    def _spline(self, samples: Doubles, axis: int, slope: int) -> Doubles:
        for place, matrix in enumerate(self._maps(axis, slope)):
            if matrix is not None:
                samples = np.moveaxis(np.tensordot(matrix, samples, (1, place)), 0, place)
        return samples

    def _spline_transposed(self, flat: Doubles, axis: int, slope: int) -> Doubles:
        maps = self._maps(axis, slope)
        found = flat.reshape([n if matrix is None else len(matrix) for n, matrix in zip(self.shape, maps)])
        for place, matrix in enumerate(maps):
            if matrix is not None:
                found = np.moveaxis(np.tensordot(matrix, found, (0, place)), 0, place)
        return found

    def _matrix(self, origins: Doubles, directions: Doubles, enter: Doubles, leave: Doubles, axis: int, slope: int) -> Any:
        """Returns the matrix of ∫∂n ds by one axis across: one point of the ray in each slice."""
        sizes = [n if matrix is None else len(matrix) for n, matrix in zip(self.shape, self._maps(axis, slope))][::-1]
        strides = np.array([1, sizes[0], sizes[0] * sizes[1]], np.int32)
        slices = self.shape[2 - axis]
        blocks = []
        for rows in np.array_split(np.arange(len(origins)), max(1, len(origins) * slices // CHUNK)):
            o, d = origins[rows], directions[rows]
            at = (self.first[axis] + self.spacing[axis] * np.arange(slices) - o[:, axis, None]) / d[:, axis, None]
            half = 0.5 * np.abs(self.spacing[axis] / d[:, axis, None])
            length = np.minimum(at + half, leave[rows, None]) - np.maximum(at - half, enter[rows, None])
            ray, place = np.nonzero(length > 0)
            points = o[ray] + at[ray, place, None] * d[ray]
            across = 3 - axis - slope
            cell, along = self._taps(points, slope, _quadratic, sizes[slope] - 2)
            other, weight = self._taps(points, across, _cubic, sizes[across] - 3)
            along = along * (length[ray, place] / self.spacing[slope])[:, None]
            base = place * strides[axis] + cell * strides[slope] + other * strides[across]
            offsets = (np.arange(3)[:, None] * strides[slope] + np.arange(4) * strides[across]).ravel()
            columns = (base[:, None] + offsets).astype(np.int32)
            weights = (along[:, :, None] * weight[:, None, :]).astype(np.float32)
            ends = np.concatenate([[0], np.cumsum(TAPS * np.bincount(ray, minlength=len(o)))])
            blocks.append(self.sparse.csr_matrix((weights.ravel(), columns.ravel(), ends), shape=(len(o), int(np.prod(sizes)))))
        return self.sparse.vstack(blocks, format="csr")

    def _rise(self, first: Doubles, last: Doubles) -> Any:
        """Returns the matrix from samples to differences of n between points, (rays, 3) each, by
        linear interpolation."""
        sizes = np.array(self.shape[::-1])
        strides = np.array([1, sizes[0], sizes[0] * sizes[1]])
        columns, weights = [], []
        for sign, points in ((-1.0, first), (1.0, last)):
            place = (points - self.first) / self.spacing
            cell = np.clip(np.floor(place), 0, sizes - 2).astype(np.int64)
            t = place - cell
            for corner in np.ndindex(2, 2, 2):
                columns.append((cell + corner) @ strides)
                weights.append(sign * np.prod(np.where(corner, t, 1 - t), axis=1))
        ends = np.arange(len(first) + 1) * len(columns)
        return self.sparse.csr_matrix((np.stack(weights, 1).ravel(), np.stack(columns, 1).ravel(), ends), shape=(len(first), int(np.prod(sizes))))

    def _taps(self, points: Doubles, axis: int, spline: Callable[[Doubles], Doubles], cells: int) -> Tuple[NDArray[np.int64], Doubles]:
        """Returns the first coefficient, and the weights of all coefficients at points."""
        place = (points[:, axis] - self.first[axis]) / self.spacing[axis]
        cell = np.clip(np.floor(place), 0, cells - 1).astype(np.int64)
        return cell, spline(place - cell)


class Search:
    """Search for the samples that minimise a misfit of directions, by derivatives along straight
    rays. Iteration yields improving samples, and χ² per datum along curved rays."""

    def __init__(self, misfit: Misfit, within: Tuple[Doubles, Doubles], precondition: descent.Operator, smooth_slope: float) -> None:
        if [kind.name for kind in misfit.measured] != ["directions"] or misfit.is_robust:
            raise ReconstructionError("derivatives along straight rays need directions alone, with loss='squares': use derivatives='exact'")
        self.misfit, self.within, self.precondition, self.smooth_slope = misfit, within, precondition, smooth_slope
        (self.kind,) = misfit.measured
        self.pairs: descent.Pairs = []
        self.finished = False
        """True if the last samples end the search."""

    def steps(self, index: Doubles, small: float) -> Iterator[Tuple[Doubles, float]]:
        """Yields samples and χ² until χ² with penalties falls by less than the fraction ``small``
        from one to the next."""
        misfit = self.misfit
        model = Derivatives(misfit.rays, index.shape)
        residual = self._residual(index)
        if misfit.explained:
            return
        scale = self._scale(model, index, residual)
        value = self._value(index, residual)
        while True:
            found = self._minimum(model, index, residual, scale, small)
            after = self._residual(found)
            new = self._value(found, after)
            if not new < value:
                misfit.chi_square = np.nan
                return
            index, residual, before, value = found, after, value, new
            self.finished = misfit.explained or before - value < small * before
            yield index, misfit.chi_square
            if self.finished:
                return

    def _residual(self, index: Doubles) -> Doubles:
        """Returns differences from the measured directions in units of the noise, (rays, 3); zero
        for rays without an end or a measurement."""
        ends = self.misfit.rays.forward(index)
        residual = (ends.directions - self.kind.values) / self.kind.sigma()
        lost = int(np.count_nonzero(self.misfit.is_measured & ~ends.valid))
        self.misfit.chi_square = self.misfit.per_datum(float(np.nansum(residual**2)), lost)
        return np.nan_to_num(residual)

    def _value(self, index: Doubles, residual: Doubles) -> float:
        return self.misfit.with_penalties(index, (0.5 * float(np.vdot(residual, residual)), np.zeros(index.shape)))[0]

    def _function(self, model: Derivatives, start: Doubles, residual: Doubles) -> Callable[[Doubles], Valued]:
        """Returns the misfit of the model without penalties."""
        noise = self.kind.sigma()
        seen = np.any(residual != 0, axis=1, keepdims=True)

        def of_data(index: Doubles) -> Valued:
            left = residual + seen * model(index - start) / noise
            return 0.5 * float(np.vdot(left, left)), model.transposed(seen * left / noise)

        return of_data

    def _scale(self, model: Derivatives, index: Doubles, residual: Doubles) -> float:
        """Returns the scale of the first step, and sets the slope below which total variation
        counts as flat."""
        of_data = self._function(model, index, residual)
        scale, first = descent.first_scale(of_data, index, of_data(index)[1], self.precondition)
        if self.misfit.weights.total_variation > 0:
            lattice = penalties.lattice_of(self.misfit.rays, index.shape)
            self.misfit.flat = max(self.smooth_slope * penalties.largest_slope(index + first, lattice), 1e-300)
        return scale

    def _minimum(self, model: Derivatives, start: Doubles, residual: Doubles, scale: float, small: float) -> Doubles:
        """Returns samples that reduce the misfit of the model, as far as the model holds."""
        of_data = self._function(model, start, residual)
        latest = [np.inf]

        def function(index: Doubles) -> Valued:
            value = of_data(index)
            latest[0] = value[0]
            return self.misfit.with_penalties(index, value)

        goal = max(REDUCTION * self.misfit.chi_square, 0.0 if any(self.misfit.weights) else NOISE_REDUCTION)
        values: List[float] = []
        index = start
        for index, value in descent.minimize(function, (start, *function(start)), scale, self.within, self.precondition, self.pairs):
            values.append(value)
            slow = len(values) > STEPS_OF_AVERAGE and values[-1 - STEPS_OF_AVERAGE] - value < STEPS_OF_AVERAGE * small * values[-1 - STEPS_OF_AVERAGE]
            if slow or len(values) == MAX_STEPS or 2 * latest[0] <= goal * self.misfit.count:
                break
        return index


def _coefficients(count: int) -> Doubles:
    """Returns the matrix from samples to coefficients of their cubic spline, (count + 2, count). The
    third difference of the coefficients vanishes at both ends."""
    system = np.zeros((count + 2, count + 2))
    for i in range(count):
        system[i, i : i + 3] = [1 / 6, 4 / 6, 1 / 6]
    system[count, :4] = system[count + 1, -4:] = [1, -3, 3, -1]
    return np.asarray(np.linalg.solve(system, np.eye(count + 2, count)))


def _cubic(t: Doubles) -> Doubles:
    """Returns weights of the four coefficients around a cell, at the position t in it."""
    return np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], -1) / 6


def _quadratic(t: Doubles) -> Doubles:
    """Returns weights of the three differences of coefficients around a cell."""
    return np.stack([(1 - t) ** 2, -2 * t**2 + 2 * t + 1, t**2], -1) / 2
