"""Misfit of an index and measured rays, with penalties, for :mod:`morgana.reconstruct`."""

from __future__ import annotations

import itertools
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _losses as losses
from . import _penalties as penalties
from ._losses import Kind, Loss, Squares, column
from ._numbers import numbers
from ._preconditioner import ReconstructionError
from ._ray_bundle import Rays

__all__ = ["MAX_RAYS", "Given", "Misfit", "Weights", "measured_kinds"]

Doubles = NDArray[np.float64]
Valued = Tuple[float, Doubles]
"""Value of a function, and its derivatives."""
Given = Tuple[Optional[ArrayLike], Optional[ArrayLike]]
"""Measured values of one kind and their noise, as users give them."""

MAX_RAYS = 1 << 20
"""Largest number of rays that the final χ² takes. If there are more rays, it takes this number,
drawn at random: the standard error of χ² is far below a per cent."""


class Weights(NamedTuple):
    """Weights of the penalties that are added to ½χ²."""

    smoothness: float
    total_variation: float


class Misfit:
    """Half of χ² of the rays, or another loss, plus penalties, and its derivatives by the
    samples."""

    def __init__(self, rays: Rays, measured: List[Kind], weights: Weights, loss: Loss) -> None:
        self.rays, self.measured, self.weights, self.loss = rays, measured, weights, loss
        self.count = sum(kind.data for kind in measured)
        self.is_measured = np.any([kind.known for kind in measured], axis=0)
        self.is_of_slopes = all(kind.name != "optical_lengths" for kind in measured)
        self.flat, self.chi_square = 1.0, np.inf
        self.is_robust = not isinstance(loss, Squares)
        is_plain = not self.is_robust and all(isinstance(kind.noise, float) for kind in measured)
        self.given: Optional[Dict[str, Any]] = {} if is_plain else None
        """Arguments of :meth:`Rays.least_squares`, which is faster than two passes; ``None`` if the
        misfit is not a sum of squares over one noise."""
        if self.given is not None:
            self.given.update({kind.name: kind.values for kind in measured})
            self.given.update({noise_of(kind.name): kind.noise for kind in measured})

    def parts(self, size: int) -> "Iterator[Misfit]":
        """Yields parts of ``size`` rays, drawn at random, repeating forever. Yields all rays each
        time if ``size`` is at least their number."""
        count = len(self.rays)
        if size >= count:
            yield from itertools.repeat(self)
        order = np.random.default_rng(0).permutation(count)
        for part in itertools.cycle(range(count // size)):
            yield self.with_rays(np.sort(order[part * size : (part + 1) * size]))

    def with_rays(self, rows: NDArray[np.int64]) -> "Misfit":
        """Returns the misfit of some of the rays, with penalties in proportion."""
        share = len(rows) / len(self.rays)
        measured = [kind.select(rows, share) for kind in self.measured]
        return Misfit(self.rays.select(rows), measured, Weights(*(share * weight for weight in self.weights)), self.loss)

    def with_measured(self, measured: List[Kind]) -> "Misfit":
        """Returns the misfit of other measurements."""
        return Misfit(self.rays, measured, self.weights, self.loss)

    def of_data(self, index: Doubles, adapt: bool = False) -> Valued:
        """Returns ½χ² or another loss without penalties, and its derivatives. With ``adapt``, the
        loss takes its scale from the differences."""
        if self.given is not None:
            found = self.rays.least_squares(index, **self.given)
            self.chi_square = self.per_datum(2 * found.value, found.lost)
            return found.value, found.gradient
        found, lengths, self.loss = losses.sum_of_losses(self.rays, index, self.measured, self.loss, adapt)
        self.chi_square = self._chi_square(lengths)
        return found.value, found.gradient

    def per_datum(self, squares: float, lost: int) -> float:
        """Returns χ² per datum over the rays that have an end; NaN if all are lost."""
        share = 1 - lost / np.count_nonzero(self.is_measured)
        return float(squares / (share * self.count)) if share > 0 else np.nan

    def _chi_square(self, lengths: Dict[str, Doubles]) -> float:
        """Returns χ² per datum over the rays that have an end; for a robust loss, without
        outliers."""
        limit = losses.OUTLYING * losses.robust_scale(lengths) if self.is_robust else np.inf
        squares, count = 0.0, 0
        for name, values in lengths.items():
            kept = values[values <= limit]
            squares, count = squares + float(np.sum(kept**2)), count + Kind.freedom(name) * kept.size
        return squares / count if count else np.nan

    def __call__(self, index: Doubles) -> Valued:
        return self.with_penalties(index, self.of_data(index))

    def with_penalties(self, index: Doubles, of_data: Valued) -> Valued:
        """Returns the loss plus penalties, given the loss."""
        value, gradient = of_data
        smoothness, total_variation = self.weights
        lattice = penalties.lattice_of(self.rays, index.shape)
        if smoothness > 0:
            penalty, slope = penalties.roughness(index, lattice)
            value, gradient = (value + smoothness * penalty, gradient + smoothness * slope)
        if total_variation > 0:
            penalty, slope = penalties.total_variation(index, lattice, self.flat)
            value, gradient = (value + total_variation * penalty, gradient + total_variation * slope)
        return value, gradient

    def without_derivatives(self, index: Doubles) -> Tuple[float, int]:
        """Returns χ² per datum, and the number of measured rays that have no end."""
        ends = self.rays.forward(index)
        lengths = losses.lengths_of(ends, self.measured)
        lost = int(np.count_nonzero(self.is_measured & ~ends.valid))
        if self.is_robust:
            return self._chi_square(lengths), lost
        return self.per_datum(sum(float(np.nansum(values**2)) for values in lengths.values()), lost), lost

    def lost_share(self, lost: int) -> float:
        """Returns the fraction of the measured rays that have no end, given
        :attr:`Reconstruction.lost`."""
        return lost / np.count_nonzero(next(self.parts(MAX_RAYS)).is_measured)

    def check_start(self, index: Doubles) -> None:
        """Raises an error if no measured ray has an end in the index at the start."""
        part = next(self.parts(MAX_RAYS))
        if not (part.is_measured & part.rays.forward(index).valid).any():
            raise ReconstructionError(
                "no measured ray has an end in the index at the start: the rays miss the exit. Check that it is ahead of the origins along the "
                "directions, and max_length"
            )

    @property
    def explained(self) -> bool:
        """True if noise explains the remaining differences, which ends the search. Always False
        with penalties, which keep noise out themselves."""
        return self.chi_square <= 1 and not any(self.weights)


def measured_kinds(rays: Rays, positions: Given, directions: Given, optical_lengths: Given) -> List[Kind]:
    """Returns all kinds of data that are given, at least one."""
    measured = [*_data(rays, "positions", *positions), *_data(rays, "directions", *directions), *_data(rays, "optical_lengths", *optical_lengths)]
    if not measured:
        raise ReconstructionError("there is nothing to fit: give positions, directions or optical_lengths with their noise")
    return measured


def _data(rays: Rays, name: str, values: Optional[ArrayLike], noise: Optional[ArrayLike]) -> List[Kind]:
    """Returns one kind of data if it is given."""
    word = noise_of(name)
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
    kind = Kind.of(name, array, _sigma(noise, word, len(rays)))
    if not kind.known.any():
        raise ReconstructionError(f"none of the {name} is known")
    if not isinstance(kind.noise, float):
        bad = kind.known & ~(np.isfinite(kind.noise) & (kind.noise > 0))
        if bad.any():
            raise ReconstructionError(f"{word} is {kind.noise[bad][0]} for ray {int(np.argmax(bad))} but must be a positive number")
    if name == "directions":
        if (np.linalg.norm(kind.values[kind.known], axis=1) == 0).any():
            raise ReconstructionError("some directions have no length")
        kind = kind._replace(values=unit(kind.values))
    return [kind]


def _sigma(noise: ArrayLike, word: str, rays: int) -> Union[float, Doubles]:
    """Returns a positive number, or a number for each ray. The mask of known rays decides which of
    these must be positive."""
    if np.ndim(noise) == 0:
        return checks.positive(noise, word)
    sigma = numbers(noise, word)
    if sigma.shape != (rays,):
        raise ReconstructionError(f"{word} has the shape {sigma.shape} but must be a positive number, or one for each ray, ({rays},)")
    return sigma


def noise_of(name: str) -> str:
    """Returns the name of the noise of data."""
    return f"{name[:-1]}_noise"


def unit(vectors: Doubles) -> Doubles:
    """Returns vectors of length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def simulated(kind: Kind, exact: Doubles, rng: np.random.Generator) -> Kind:
    """Returns a measurement of ``exact`` ends with new noise, where ``kind`` was measured."""
    values = np.where(column(kind.known, exact.ndim), exact + kind.sigma() * rng.normal(size=exact.shape), np.nan)
    return kind._replace(values=unit(values) if kind.name == "directions" else values)
