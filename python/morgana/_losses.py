"""Losses of differences between the ends of rays and measured ends, which may be robust against
outliers.

A difference is a vector of k components: k = 2 for positions on an exit plane and for unit
directions, 1 for optical lengths. Its length r, in units of the noise, has Rayleigh's distribution
for k = 2. A loss is ½s²ρ(r²/s²), with ρ(u) ≈ u for small u, and the scale s ≥ 1. Its derivative by
the difference is the difference times the weight ρ′.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, NamedTuple, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._ends import Ends, LeastSquares

if TYPE_CHECKING:
    from ._ray_bundle import Rays

__all__ = ["LOSSES", "OUTLYING", "Huber", "Kind", "Loss", "Squares", "Sum", "lengths_of", "robust_scale", "sum_of_losses"]

Doubles = NDArray[np.float64]

MEDIANS = {1: 0.4549364231195724, 2: 2 * float(np.log(2))}
"""Median of the χ² distribution with 1 or 2 degrees of freedom: of r² for normal noise."""
OUTLYING = 4.0
"""Length r/s of a difference above which a ray is an outlier. Normal noise exceeds it with
probability exp(−8) = 3e-4 for two components, and 6e-5 for one."""


class Kind(NamedTuple):
    """Measured ends of one kind, with their noise."""

    name: str
    """``"positions"``, ``"directions"`` or ``"optical_lengths"``."""
    values: Doubles
    """Measured values, (ends, 3) or (ends,); NaN if unknown."""
    noise: Union[float, Doubles]
    """Standard deviation of each component: one for all ends, or one for each, (ends,)."""
    data: float
    """Number of independent values."""

    @classmethod
    def of(cls, name: str, values: Doubles, noise: Union[float, Doubles]) -> "Kind":
        """Returns measured ends. Rows that are not finite count as unknown."""
        known = np.asarray(np.isfinite(values.reshape(len(values), -1)).all(axis=1))
        return cls(name, np.where(column(known, values.ndim), values, np.nan), noise, cls.freedom(name) * int(known.sum()))

    @staticmethod
    def freedom(name: str) -> int:
        """Number of independent components: a unit direction, and a position on a plane, have
        two."""
        return 1 if name == "optical_lengths" else 2

    @property
    def known(self) -> NDArray[np.bool_]:
        """Mask of the ends that were measured, (ends,)."""
        return np.asarray(np.isfinite(self.values.reshape(len(self.values), -1)).all(axis=1))

    def select(self, rows: NDArray[np.int64], share: float) -> "Kind":
        """Returns the values of some ends, which are a fraction ``share`` of the data."""
        noise = self.noise if isinstance(self.noise, float) else self.noise[rows]
        return Kind(self.name, self.values[rows], noise, share * self.data)

    def sigma(self) -> Union[float, Doubles]:
        """Returns the noise in a shape that divides ``values``."""
        return self.noise if isinstance(self.noise, float) else column(self.noise, self.values.ndim)


class Squares:
    """Half the sum of squares, without robustness."""

    scale = 1.0

    def adapted(self, lengths: Dict[str, Doubles]) -> "Loss":
        """Returns this loss: it has no scale."""
        return self

    def values(self, squares: Doubles) -> Tuple[Doubles, Doubles]:
        """Returns ½ρ s² and the weights ρ′, given r²."""
        return 0.5 * squares, np.ones_like(squares)


class Huber:
    """Quadratic up to r = c s, and linear beyond.

    The loss is convex in the difference. Losses that fall off faster, such as the logarithm of
    Student's distribution, reject whole regions of good data before they are fitted."""

    c = 2.0
    """Length in units of the scale. Normal noise exceeds it with probability 0.14 for two
    components, and 0.05 for one."""

    def __init__(self, scale: float = 1.0) -> None:
        self.scale = scale

    def adapted(self, lengths: Dict[str, Doubles]) -> "Loss":
        """Returns this loss with the scale of the given differences."""
        return Huber(robust_scale(lengths))

    def values(self, squares: Doubles) -> Tuple[Doubles, Doubles]:
        """Returns ½ρ s² and the weights ρ′, given r²."""
        edge = self.c * self.scale
        lengths = np.sqrt(squares)
        weights = edge / np.maximum(lengths, edge)
        return np.where(lengths <= edge, 0.5 * squares, edge * (lengths - 0.5 * edge)), weights


Loss = Union[Squares, Huber]
LOSSES: Dict[str, Any] = {"squares": Squares, "huber": Huber}
"""Losses by their names in :func:`morgana.reconstruct.fit`."""


class Sum(NamedTuple):
    """Sum of losses over rays."""

    least_squares: LeastSquares
    """The sum, its derivatives by the index, and the number of measured rays without an end."""
    lengths: Dict[str, Doubles]
    """Length r of the difference of each end, by kind; NaN if it is unknown."""
    loss: Loss
    """The loss, with its scale."""


def sum_of_losses(rays: "Rays", index: Any, kinds: Sequence[Kind], loss: Loss, adapt: bool = False) -> Sum:
    """Returns the sum of losses over rays, from two passes: the second has the derivatives.

    With ``adapt``, the loss takes its scale from the differences."""
    ends = rays.forward(index)
    lengths = lengths_of(ends, kinds)
    loss = loss.adapted(lengths) if adapt else loss
    value, by = 0.0, {}
    for kind in kinds:
        known = np.isfinite(lengths[kind.name])
        values, weights = loss.values(np.where(known, lengths[kind.name], 0.0) ** 2)
        value += float(np.sum(values[known]))
        pull = column(weights, kind.values.ndim) * (getattr(ends, kind.name) - kind.values) / np.square(kind.sigma())
        by[kind.name] = np.where(column(known, kind.values.ndim), pull, 0.0)
    lost = int(np.count_nonzero(np.any([kind.known for kind in kinds], axis=0) & ~ends.valid))
    return Sum(LeastSquares(value, rays.vjp(index, **by).field, lost), lengths, loss)


def lengths_of(ends: Ends, kinds: Sequence[Kind]) -> Dict[str, Doubles]:
    """Returns the length of the difference of each end from its measurement in units of the noise,
    (ends,), by kind; NaN if it is unknown."""
    found = {}
    for kind in kinds:
        away = (getattr(ends, kind.name) - kind.values) / kind.sigma()
        found[kind.name] = np.abs(away) if away.ndim == 1 else np.sqrt(np.sum(away**2, axis=1))
    return found


def robust_scale(lengths: Dict[str, Doubles]) -> float:
    """Returns the standard deviation of the components of differences, in units of the noise, from
    their median length: at least 1. Up to half of the differences may be outliers.

    For one component this is the median absolute deviation (MAD) times 1.48."""
    scales: List[float] = [1.0]
    for name, values in lengths.items():
        known = values[np.isfinite(values)]
        if known.size:
            scales.append(float(np.median(known)) / float(np.sqrt(MEDIANS[Kind.freedom(name)])))
    return max(scales)


def column(values: NDArray[Any], dimensions: int) -> NDArray[Any]:
    """Returns numbers of ends in a shape that broadcasts against arrays of ``dimensions`` axes."""
    return values.reshape(-1, *[1] * (dimensions - 1))
