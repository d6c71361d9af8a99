"""What is added to a sum of squares where data leave an index open."""

from __future__ import annotations

from typing import List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["largest_slope", "rough_noise", "roughness", "total_variation"]

Doubles = NDArray[np.float64]


def roughness(index: Doubles, spacing: Doubles) -> Tuple[float, Doubles]:
    """½∫|∇n|² dV by differences of neighbours, and its derivative (Tikhonov)."""
    slopes, cell = _slopes(index, spacing), float(np.prod(spacing))
    return 0.5 * cell * sum(float(np.sum(slope**2)) for slope in slopes), cell * _transposed(slopes, spacing)


def rough_noise(shape: Sequence[int], spacing: Doubles, rng: np.random.Generator) -> Doubles:
    """Noise of which the covariance is the matrix of second derivatives of :func:`roughness`."""
    slopes = [rng.normal(size=tuple(shape)) for _ in range(3)]
    return float(np.sqrt(np.prod(spacing))) * _transposed(slopes, spacing)


def total_variation(index: Doubles, spacing: Doubles, flat: float) -> Tuple[float, Doubles]:
    """∫(√(|∇n|² + f²) − f) dV, and its derivative: |∇n| where it is above ``flat``, f > 0, and smooth below."""
    slopes, cell = _slopes(index, spacing), float(np.prod(spacing))
    size = np.sqrt(sum(slope**2 for slope in slopes) + flat**2)
    return cell * float(np.sum(size - flat)), cell * _transposed([slope / size for slope in slopes], spacing)


def largest_slope(index: Doubles, spacing: Doubles) -> float:
    """The largest |∇n|."""
    return float(np.sqrt(np.max(sum(slope**2 for slope in _slopes(index, spacing)))))


def _slopes(index: Doubles, spacing: Doubles) -> List[Doubles]:
    """Differences to the next sample along x, y and z over the spacing; zero for the last."""
    found = []
    for axis, step in zip((2, 1, 0), spacing):
        last = np.take(index, [-1], axis=axis)
        found.append(np.diff(index, axis=axis, append=last) / step)
    return found


def _transposed(by: List[Doubles], spacing: Doubles) -> Doubles:
    """Derivatives by the samples from those by the slopes."""
    total = np.zeros_like(by[0])
    for axis, step, values in zip((2, 1, 0), spacing, by):
        # The last slope is zero whatever the samples.
        inner = np.delete(values, -1, axis=axis) / step
        nothing = np.zeros_like(np.take(values, [0], axis=axis))
        total += np.concatenate([nothing, inner], axis=axis) - np.concatenate([inner, nothing], axis=axis)
    return total
