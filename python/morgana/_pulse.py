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
"""Standard deviations of a Gaussian beyond which nothing is left in double precision."""
STEPS = 4000
"""Samples of a Gaussian: linear between them it is right to 1e-6 of its peak."""


@comparable
class Pulse(NamedTuple):
    """The shape of a pulse that an emitter sends, in place of all its light at once.

    Times are optical path lengths, the time in vacuum times the speed of light, as in the bins of meters. A meter measures the answer
    to light that starts at once; :meth:`Records.gated` and :meth:`Reading.convolved` make the answer to a pulse of it.

    Examples
    --------
    >>> morgana.Pulse.gaussian(fwhm=30.0)
    <morgana.Pulse from -115 to 115>
    """

    times: Doubles
    """Instants, ascending, (n,)."""
    values: Doubles
    """Power at these instants, (n,), linear between them; the energy of all is 1."""

    @classmethod
    def gaussian(cls, fwhm: float, center: float = 0.0) -> "Pulse":
        """A Gaussian.

        Parameters
        ----------
        fwhm : float
            Full width at half of its maximum, > 0.
        center : float
            When it is strongest.

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
        """The same power throughout.

        Parameters
        ----------
        width : float
            From its begin to its end, > 0.
        center : float
            Its middle.

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
        """Power at instants, linear between them and none before and after.

        Parameters
        ----------
        times : array_like
            Instants, ascending, at least two.
        values : array_like
            Power there, ≥ 0, in any unit.

        Returns
        -------
        Pulse
            The pulse.

        Raises
        ------
        ValueError
            Instants that do not ascend, power that is negative, or none at all.

        Examples
        --------
        >>> pulse = morgana.Pulse.table([0, 10, 40], [0, 1, 0])
        """
        t, v = numbers(times, "times"), numbers(values, "values")
        if t.ndim != 1 or t.shape != v.shape or len(t) < 2 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
            raise ValueError("a pulse is a table of at least two ascending times, and as many values")
        if not (np.all(np.isfinite(v)) and np.all(v >= 0) and v.any()):
            raise ValueError("the values of a pulse are at least 0, and not all 0")
        return cls(t, v / (0.5 * np.diff(t) * (v[1:] + v[:-1])).sum())

    @property
    def range(self) -> Tuple[float, float]:
        """When it begins and ends."""
        return float(self.times[0]), float(self.times[-1])

    def emitted(self, times: ArrayLike) -> Doubles:
        """The share of the energy that is emitted until some instants.

        Parameters
        ----------
        times : array_like
            Optical path lengths, of any shape.

        Returns
        -------
        numpy.ndarray
            From 0 to 1, of the same shape.

        Examples
        --------
        >>> pulse.emitted([0.0, 15.0])
        """
        piece, t = self._place(times)
        slope, energy, _ = self._sums()
        return np.asarray(np.clip(energy[piece] + t * (self.values[piece] + t * slope[piece] / 2), 0.0, 1.0))

    def kernel(self, edges: ArrayLike) -> Doubles:
        """How bins of light that starts at once become bins of the pulse: row i, column j is the share of what was in bin j that is in bin i.

        Light is spread evenly over its bin, which is of second order in the width of bins. Columns add up to 1, less what leaves the bins.

        Parameters
        ----------
        edges : array_like
            Edges of the bins, ascending, (bins + 1,).

        Returns
        -------
        numpy.ndarray
            The shares, (bins, bins).

        Examples
        --------
        >>> later = pulse.kernel(edges) @ energies
        """
        e = numbers(edges, "edges")
        between = self._integral(e[:, None] - e[None, :])
        passed = (between[:, :-1] - between[:, 1:]) / np.diff(e)
        return np.asarray(np.diff(passed, axis=0))

    def _place(self, times: ArrayLike) -> Tuple[NDArray[np.intp], Doubles]:
        """The piece of each instant, and how far in it."""
        t = np.clip(numbers(times, "times"), *self.range)
        piece = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        return piece, t - self.times[piece]

    def _sums(self) -> Tuple[Doubles, Doubles, Doubles]:
        """Slopes of pieces, and at their ends the energy until there and its integral."""
        width, v = np.diff(self.times), self.values
        slope = np.diff(v) / width
        energy = np.concatenate([[0.0], np.cumsum(0.5 * width * (v[1:] + v[:-1]))])
        moment = width * (energy[:-1] + width * (v[:-1] / 2 + width * slope / 6))
        return slope, energy, np.concatenate([[0.0], np.cumsum(moment)])

    def _integral(self, times: Doubles) -> Doubles:
        """The integral of :meth:`emitted` from before the pulse."""
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
