"""Sums over records, whose errors are those among particles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._records import Records

Doubles = NDArray[np.float64]


def by_particle(records: Records, factors: NDArray[Any]) -> NDArray[Any]:
    """Sums of weights times factors, (records, n), over the records of each particle that has some: (particles, n, channels)."""
    _, rows = np.unique(records.particle, return_inverse=True)
    shape = (int(rows.max(initial=-1)) + 1, factors.shape[1], records.weight.shape[1])
    sums = np.zeros(shape, factors.dtype)
    np.add.at(sums, rows, factors[:, :, None] * records.weight[:, None, :])
    return sums


def aligned(sums: NDArray[Any]) -> Doubles:
    """The parts of sums over particles, the first axis, in phase with their total: they add up to its absolute value, and their errors are its."""
    total = sums.sum(axis=0)
    turn = np.where(total == 0, 1, np.conj(total) / np.where(total == 0, 1, np.abs(total)))
    return np.asarray((sums * turn).real, float)


def error_of(sums: Doubles, particles: int) -> Doubles:
    """Standard error of a sum over particles of which the given ones are not zero."""
    mean = sums.sum(axis=0)
    spread = np.maximum((sums**2).sum(axis=0) - mean**2 / particles, 0.0)
    return np.asarray(np.sqrt(spread * particles / max(particles - 1, 1)))


def positive(value: float, name: str, least: float = 0.0) -> float:
    """The value, if it is finite and at least ``least``."""
    if not (np.isfinite(value) and value >= least):
        raise ValueError(f"{name} must be finite and {'positive' if least else 'not negative'}, not {value}")
    return float(value)
