"""Sums over records, with errors over particles."""

from __future__ import annotations

import warnings
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import SceneWarning
from ._numbers import chosen, numbers
from ._records import Records

Doubles = NDArray[np.float64]


def by_particle(records: Records, factors: NDArray[Any]) -> NDArray[Any]:
    """Returns sums of weights times factors, (records, n), over the records of each particle that
    has records: (particles, n, channels)."""
    _, rows = np.unique(records.particle, return_inverse=True)
    shape = (factors.shape[1], records.weight.shape[1], int(rows.max(initial=-1)) + 1)
    sums = np.zeros(shape, factors.dtype)
    for i, column in enumerate(factors.T):
        for channel, weight in enumerate(records.weight.T):
            sums[i, channel] = _counted(rows, column * weight, shape[2])
    return np.moveaxis(sums, 2, 0)


def _counted(rows: NDArray[np.intp], values: NDArray[Any], count: int) -> NDArray[Any]:
    """Returns sums of values, real or complex, by their rows."""
    real = np.bincount(rows, values.real, count)
    return real + 1j * np.bincount(rows, values.imag, count) if np.iscomplexobj(values) else real


def aligned(sums: NDArray[Any], total: NDArray[Any]) -> Doubles:
    """Returns the parts of sums over particles, the first axis, that are in phase with a total. The
    absolute value of the total changes by these parts."""
    turn = np.where(total == 0, 1, np.conj(total) / np.where(total == 0, 1, np.abs(total)))
    return np.asarray((sums * turn).real, float)


def error_of(sums: Doubles, particles: int) -> Doubles:
    """Returns the standard error of a sum over particles, the first axis of ``sums``; infinite with
    fewer than two particles. ``particles`` is the number of all particles; particles without a row
    in ``sums`` count as zero."""
    return np.asarray(np.sqrt(variance_of(sums, particles))) if particles > 1 else np.full(sums.shape[1:], np.inf)


def variance_of(sums: NDArray[Any], particles: int) -> Doubles:
    """Returns the variance of a sum over particles, the first axis of ``sums``, real or complex.
    ``particles`` is the number of all particles, as for :func:`error_of`. Noise increases the
    squared absolute value of the sum by this variance."""
    squares = (np.abs(sums) ** 2).sum(axis=0)
    spread = np.maximum(squares - np.abs(sums.sum(axis=0)) ** 2 / max(particles, 1), 0.0)
    return np.asarray(spread * particles / max(particles - 1, 1))


def positive(value: Any, name: str, least: float = 0.0) -> float:
    """Returns the value if it is finite and at least ``least``, else raises an error."""
    what = f"finite and {'positive' if least else 'not negative'}"
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, {what}, not {value!r}") from None
    if isinstance(value, str):
        raise TypeError(f"{name} must be a number, {what}, not {value!r}")
    if not (np.isfinite(number) and number >= least):
        raise ValueError(f"{name} must be {what}, not {value}")
    return number


def by_channel(values: ArrayLike, name: str, channels: int) -> Doubles:
    """Returns a positive number for all channels, an array without axes, or one for each channel,
    (channels,). Raises an error for other values."""
    found = numbers(values, name)
    if found.shape not in [(), (channels,)] or not np.all(np.isfinite(found) & (found > 0)):
        raise ValueError(f"{name} must be finite and positive: one number, or one for each of {channels} channels")
    return found


def warn_about_wavelength(wavelength: ArrayLike, records: Records) -> None:
    """Warns if a wavelength exceeds the mean optical length between scatterings. A wrong unit is
    the likely cause. Independent scattering would not describe scatterers this dense."""
    flights = int(records.scatterings.sum()) + len(records.particle)
    mean = float(records.optical_length.sum()) / max(flights, 1)
    longest = float(np.max(wavelength))
    if 0 < mean < longest:
        warnings.warn(
            f"the wavelength of {longest:.4g} is longer than light goes between scatterings, {mean:.3g} on average: is it in scene units? "
            "532 nm are 532e-6 where these are millimetres",
            SceneWarning,
            stacklevel=3,
        )


def seconds(values: ArrayLike, name: str, which: str, least: float = 0.0) -> Doubles:
    """Returns times as an array of one axis. Raises an error for times below ``least``; ``which``
    describes valid times in its message."""
    times = np.atleast_1d(numbers(values, name))
    if times.ndim != 1 or not np.all(np.isfinite(times) & (times >= least)):
        raise ValueError(f"{name} are {which} in one row")
    return times


def recorded(records: Any) -> None:
    """Raises an error unless the argument is :class:`Records`."""
    if not isinstance(records, Records):
        found = type(records).__name__
        raise TypeError(f"expected Records, found {found}: take one from the records of a result, or morgana.Records.load")


def taken(records: Any, where: Optional[ArrayLike]) -> Records:
    """Returns the selected records, or all; raises an error unless the argument is
    :class:`Records`."""
    recorded(records)
    some: Records = records[chosen(where, len(records))]
    return some
