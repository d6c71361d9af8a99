"""Pulses of light in time."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._numbers import numbers
from ._values import comparable

Doubles = NDArray[np.float64]

SPAN = 9.0
"""Number of standard deviations beyond which a Gaussian vanishes in double precision."""
STEPS = 4000
"""Number of samples of a Gaussian: linear interpolation is accurate to 1e-6 of its peak."""


@comparable
class Pulse(NamedTuple):
    """Shape of a pulse that an emitter sends, instead of an impulse.

    Times are optical path lengths, the time in vacuum times the speed of light, as in the bins of
    meters. A meter measures the impulse response; :meth:`Records.gated` and
    :meth:`Reading.convolved` convert it to the response to a pulse.

    Examples
    --------
    >>> morgana.Pulse.gaussian(fwhm=30.0)
    <morgana.Pulse from -115 to 115>
    """

    times: Doubles
    """Times, ascending, (n,), in scene units."""
    values: Doubles
    """Power at these times, (n,), linear between them; the total energy is 1."""

    @classmethod
    def gaussian(cls, fwhm: float, center: float = 0.0) -> "Pulse":
        """A Gaussian pulse.

        Parameters
        ----------
        fwhm : float
            Full width at half maximum, > 0, in scene units.
        center : float
            Time of the maximum.

        Returns
        -------
        Pulse
            The pulse.

        Raises
        ------
        ValueError
            A width that is not positive.

        Examples
        --------
        >>> pulse = morgana.Pulse.gaussian(fwhm=30.0)
        """
        deviation = _positive(fwhm, "fwhm") / math.sqrt(8 * math.log(2))
        x = np.linspace(-SPAN, SPAN, STEPS + 1)
        return cls.table(center + deviation * x, np.exp(-0.5 * x**2))

    @classmethod
    def rectangle(cls, width: float, center: float = 0.0) -> "Pulse":
        """A pulse of constant power.

        Parameters
        ----------
        width : float
            Duration, > 0, in scene units.
        center : float
            Time of the middle.

        Returns
        -------
        Pulse
            The pulse.

        Raises
        ------
        ValueError
            A width that is not positive.

        Examples
        --------
        >>> pulse = morgana.Pulse.rectangle(30.0, center=15.0)
        """
        half = 0.5 * _positive(width, "width")
        return cls.table([center - half, center + half], [1.0, 1.0])

    @classmethod
    def table(cls, times: ArrayLike, values: ArrayLike) -> "Pulse":
        """A pulse from power at given times, linear between them and zero before and after.

        Parameters
        ----------
        times : array_like
            Times, ascending, at least two, in scene units.
        values : array_like
            Power at these times, ≥ 0, in any unit.

        Returns
        -------
        Pulse
            The pulse.

        Raises
        ------
        ValueError
            Times that do not ascend, negative power, or zero power everywhere.

        Examples
        --------
        >>> pulse = morgana.Pulse.table([0, 10, 40], [0, 1, 0])
        """
        t, v = numbers(times, "times"), numbers(values, "values")
        if t.ndim != 1 or t.shape != v.shape or len(t) < 2 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
            raise ValueError("a pulse needs at least two ascending times, and a value for each")
        if not (np.all(np.isfinite(v)) and np.all(v >= 0) and v.any()):
            raise ValueError("the values of a pulse must be at least 0, and not all 0")
        return cls(t, v / (0.5 * np.diff(t) * (v[1:] + v[:-1])).sum())

    @property
    def range(self) -> Tuple[float, float]:
        """Times of the beginning and the end."""
        return float(self.times[0]), float(self.times[-1])

    def emitted(self, times: ArrayLike) -> Doubles:
        """Fraction of the energy that is emitted before given times.

        Parameters
        ----------
        times : array_like
            Optical path lengths, of any shape.

        Returns
        -------
        numpy.ndarray
            Fractions from 0 to 1, of the same shape.

        Examples
        --------
        >>> pulse.emitted([0.0, 15.0])
        """
        piece, t = self._place(times)
        slope, energy, _ = self._sums()
        return np.asarray(np.clip(energy[piece] + t * (self.values[piece] + t * slope[piece] / 2), 0.0, 1.0))

    def kernel(self, edges: ArrayLike) -> Doubles:
        """Matrix that converts bins of the impulse response to bins of the pulse.

        Row i, column j is the fraction of the light of bin j that the pulse moves to bin i.

        The light of a bin is assumed to be spread evenly, which causes an error of second order in
        the width of bins. Columns add up to 1, minus the fraction that leaves the bins.

        Parameters
        ----------
        edges : array_like
            Edges of the bins, ascending, (bins + 1,).

        Returns
        -------
        numpy.ndarray
            The fractions, (bins, bins).

        Examples
        --------
        >>> later = pulse.kernel(edges) @ energies
        """
        e = numbers(edges, "edges")
        between = self._integral(e[:, None] - e[None, :])
        passed = (between[:, :-1] - between[:, 1:]) / np.diff(e)
        return np.asarray(np.diff(passed, axis=0))

    def _place(self, times: ArrayLike) -> Tuple[NDArray[np.intp], Doubles]:
        """Returns the piece that contains each time, and the time since its beginning."""
        t = np.clip(numbers(times, "times"), *self.range)
        piece = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        return piece, t - self.times[piece]

    def _sums(self) -> Tuple[Doubles, Doubles, Doubles]:
        """Returns slopes of the pieces, and at their ends the energy emitted before and its
        integral."""
        width, v = np.diff(self.times), self.values
        slope = np.diff(v) / width
        energy = np.concatenate([[0.0], np.cumsum(0.5 * width * (v[1:] + v[:-1]))])
        moment = width * (energy[:-1] + width * (v[:-1] / 2 + width * slope / 6))
        return slope, energy, np.concatenate([[0.0], np.cumsum(moment)])

    def _integral(self, times: Doubles) -> Doubles:
        """Returns the integral of :meth:`emitted` from before the pulse."""
        piece, t = self._place(times)
        slope, energy, moment = self._sums()
        within = moment[piece] + t * (energy[piece] + t * (self.values[piece] / 2 + t * slope[piece] / 6))
        return np.asarray(within + np.maximum(times - self.times[-1], 0.0))

    def __repr__(self) -> str:
        begin, end = self.range
        return f"<morgana.Pulse from {begin:.4g} to {end:.4g}>"


def _positive(value: float, name: str) -> float:
    if not (value > 0 and math.isfinite(value)):
        raise ValueError(f"{name} is {value} but must be positive")
    return float(value)
