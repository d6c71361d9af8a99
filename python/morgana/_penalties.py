"""Penalties on an index where data leave it undetermined: integrals over the box, from differences
of neighbouring samples.

Each difference represents the part of the box next to it. On faces of the box that contain samples,
this part is half of its size elsewhere (trapezoidal rule). If the outermost samples lie inside,
slopes continue to the faces. The integrals are therefore exact for a linear index.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Iterator, List, Literal, NamedTuple, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._ray_bundle import Rays

__all__ = ["Lattice", "lattice_of", "largest_slope", "rough_noise", "roughness", "total_variation"]

Doubles = NDArray[np.float64]
Place = Tuple[slice, ...]

AXES = (2, 1, 0)
"""Array axes of samples, for x, y and z."""


class Lattice(NamedTuple):
    """Positions of samples in their box."""

    spacing: Doubles
    """Spacing along x, y and z, (3,)."""
    centers: bool
    """True if the outermost samples lie half a spacing inside the faces, False if they lie on
    them."""

    def ends_inside(self, count: int) -> bool:
        """True if ``count`` samples along an axis lie inside the faces. A single sample represents
        the whole box."""
        return self.centers or count == 1

    def volumes(self, shape: Sequence[int]) -> List[Doubles]:
        """Returns the volume that each difference represents, for differences along x, y and z."""
        along, across = [], []
        for count in shape:
            lengths, widths = np.ones(count - 1), np.ones(count)
            if not self.ends_inside(count):
                widths[[0, -1]] = 0.5
            elif count > 1:
                lengths[0] += 0.5
                lengths[-1] += 0.5
            along.append(lengths)
            across.append(widths)
        parts = [[along[a] if a == axis else across[a] for a in range(3)] for axis in AXES]
        return [float(np.prod(self.spacing)) * np.einsum("i,j,k->ijk", *lengths) for lengths in parts]


def lattice_of(rays: "Rays", shape: Tuple[int, ...]) -> Lattice:
    """Returns the lattice of samples in the box of rays."""
    return Lattice(rays.spacing(shape), rays.placement == "centers")


def roughness(index: Doubles, lattice: Lattice) -> Tuple[float, Doubles]:
    """Returns ½∫|∇n|² dV, and its derivatives (Tikhonov)."""
    slopes = _slopes(index, lattice)
    by = [volume * slope for volume, slope in zip(lattice.volumes(index.shape), slopes)]
    return 0.5 * sum(float(np.vdot(*pair)) for pair in zip(by, slopes)), _transposed(by, lattice)


def rough_noise(shape: Sequence[int], lattice: Lattice, rng: np.random.Generator) -> Doubles:
    """Returns noise whose covariance is the matrix of second derivatives of :func:`roughness`."""
    return _transposed([np.sqrt(volume) * rng.normal(size=volume.shape) for volume in lattice.volumes(shape)], lattice)


def total_variation(index: Doubles, lattice: Lattice, flat: float) -> Tuple[float, Doubles]:
    """Returns ∫(√(|∇n|² + f²) − f) dV, and its derivatives. The integrand is about |∇n| above
    ``flat``, f > 0, and smooth below."""
    slopes = _continued(index, lattice)
    value, by = 0.0, [np.zeros_like(slope) for slope in slopes]
    for volume, places in _octants(index.shape, lattice):
        here = [slope[place] for slope, place in zip(slopes, places)]
        size = np.sqrt(sum(slope**2 for slope in here) + flat**2)
        value += float(np.sum(volume * (size - flat)))
        for total, place, slope in zip(by, places, here):
            total[place] += volume * slope / size
    return value, _transposed([_folded(total, axis, lattice) for axis, total in zip(AXES, by)], lattice)


def largest_slope(index: Doubles, lattice: Lattice) -> float:
    """Returns the largest |∇n|."""
    slopes = _continued(index, lattice)
    squares = (sum(slope[place] ** 2 for slope, place in zip(slopes, places)) for _, places in _octants(index.shape, lattice))
    return float(np.sqrt(max(np.max(square) for square in squares)))


def _octants(shape: Sequence[int], lattice: Lattice) -> Iterator[Tuple[Doubles, List[Place]]]:
    """Yields the eight octants around each sample. Slopes in an octant are differences to the
    neighbours on its sides. Each item has the volumes of an octant, and the indices of the
    continued slopes along x, y and z in it."""
    for is_upper in itertools.product((False, True), repeat=3):
        widths = [np.full(count, 0.5) for count in shape]
        for width, upper in zip(widths, is_upper):
            if not lattice.ends_inside(len(width)):
                width[-1 if upper else 0] = 0.0
        sides = [slice(1, None) if upper else slice(-1) for upper in is_upper]
        places = [tuple(sides[a] if a == axis else slice(None) for a in range(3)) for axis in AXES]
        yield float(np.prod(lattice.spacing)) * np.einsum("i,j,k->ijk", *widths), places


def _slopes(index: Doubles, lattice: Lattice) -> List[Doubles]:
    """Returns differences of neighbours along x, y and z divided by the spacing."""
    return [np.diff(index, axis=axis) / step for axis, step in zip(AXES, lattice.spacing)]


def _transposed(by: List[Doubles], lattice: Lattice) -> Doubles:
    """Converts derivatives by the slopes to derivatives by the samples."""
    parts = [-np.diff(_padded(values, axis, "constant"), axis=axis) / step for axis, step, values in zip(AXES, lattice.spacing, by)]
    return np.asarray(parts[0] + parts[1] + parts[2])


def _continued(index: Doubles, lattice: Lattice) -> List[Doubles]:
    """Returns slopes along x, y and z with one more at either end: the adjacent slope if it
    continues to a face inside the box, else zero."""
    return [_padded(slope, axis, "edge" if lattice.centers and slope.size else "constant") for axis, slope in zip(AXES, _slopes(index, lattice))]


def _folded(by: Doubles, axis: int, lattice: Lattice) -> Doubles:
    """Converts derivatives by continued slopes to derivatives by slopes."""
    first, inner, last = np.split(by, [1, -1], axis=axis)
    if lattice.centers and inner.size:
        ends = np.moveaxis(inner, axis, 0)
        ends[0] += np.take(first, 0, axis=axis)
        ends[-1] += np.take(last, 0, axis=axis)
    return inner


def _padded(values: Doubles, axis: int, mode: Literal["edge", "constant"]) -> Doubles:
    return np.pad(values, [(int(a == axis), int(a == axis)) for a in range(3)], mode=mode)
