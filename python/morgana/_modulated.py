"""Amplitude and phase of recorded light whose power is modulated (docs/theory.md#frequency-domain)."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._estimate import Axes, Estimate, Origin
from ._numbers import numbers
from ._values import Fields
from ._xarray import SPEED_OF_LIGHT

if TYPE_CHECKING:
    from ._records import Records

Doubles = NDArray[np.float64]
Phasors = NDArray[np.complex128]

MIN_RATIO = 3.0
"""Smallest ratio of an amplitude to its standard error at which the phase has a meaning."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Modulated(Fields):
    """Amplitude and phase of recorded light, by modulation frequency and channel.

    Examples
    --------
    >>> light = records.modulated([100e6, 200e6], metres_per_unit=1e-3)
    >>> light.phase.sel(frequency=100e6).mean
    """

    amplitude: Estimate
    """Amplitudes over the axes ``frequency`` (in Hz) and ``channel``, in the unit of the weights."""
    phase: Estimate
    """Phases by which the light lags behind the emitters, −π to π, in rad. ``few`` also marks phases
    of amplitudes below three standard errors, which have no meaning."""

    def __repr__(self) -> str:
        return f"<morgana.Modulated light of {self.phase.shape[0]} frequencies>"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ModulatedJacobian(Fields):
    """Derivatives of the amplitude's logarithm and of the phase by coefficients of the regions.

    The axes are ``coefficient`` (``"mu_a"``, ``"mu_s"``), ``region``, ``frequency`` (in Hz) and
    ``channel``.

    Examples
    --------
    >>> rows = records.modulated_jacobian([100e6], metres_per_unit=1e-3, mu_s={"tissue": 10.0})
    >>> rows.phase.sel(coefficient="mu_a", region="tissue").mean
    """

    log_amplitude: Estimate
    """Derivatives of ln A, scene units."""
    phase: Estimate
    """Derivatives of the phase, rad times scene units."""

    def __repr__(self) -> str:
        return f"<morgana.ModulatedJacobian of {self.phase.shape[1]} regions and {self.phase.shape[2]} frequencies>"


def modulated(records: "Records", frequencies: ArrayLike, metres_per_unit: float, which: Any) -> Modulated:
    """Returns amplitude and phase of the records that ``which`` selects."""
    hertz, phasors = _phasors(records, frequencies, metres_per_unit, which)
    totals = _per_particle(records.particle[which], phasors)
    all_light = totals.sum(axis=0)
    # The logarithm of the sum changes by each particle's part of it.
    influence = _over(totals, all_light)
    amplitude, log_error, phase_error = np.abs(all_light), _error(influence.real, records.particles), _error(influence.imag, records.particles)
    power = _per_particle(records.particle[which], records.weight[which][:, None, :] + 0j).real
    largest = power.max(axis=0, initial=0.0) > 0.1 * power.sum(axis=0)
    few = np.broadcast_to(largest, amplitude.shape) | (records.particles < 2)
    unknown = ~(np.maximum(log_error, phase_error) * MIN_RATIO < 1)
    return Modulated(
        _estimate(amplitude, amplitude * log_error, {}, records.unit, few, hertz, records._origin),
        _estimate(np.angle(all_light), phase_error, {}, "rad", few | unknown, hertz, records._origin),
    )


def jacobian(records: "Records", frequencies: ArrayLike, metres_per_unit: float, mu_s: Doubles, which: Any) -> ModulatedJacobian:
    """Returns derivatives of ln A and of the phase of the records that ``which`` selects."""
    hertz, phasors = _phasors(records, frequencies, metres_per_unit, which)
    particle = records.particle[which]
    totals = _per_particle(particle, phasors)
    all_light = totals.sum(axis=0)
    length, scatterings = (of[which][:, :, None] for of in (records.path_length, records.scatterings))
    found: List[Tuple[Phasors, Doubles, Doubles]] = []
    # By μ_a, light changes by −ℓ; by μ_s, by k/μ_s − ℓ.
    for factor in (-length * np.ones_like(mu_s), scatterings / mu_s - length):
        changes = _per_particle(particle, factor[:, :, None, :] * phasors[:, None])
        # The derivative of the logarithm is a ratio of sums.
        ratio = _over(changes.sum(axis=0), all_light)
        influence = _over(changes - ratio * totals[:, None], all_light)
        found.append((ratio, _error(influence.real, records.particles), _error(influence.imag, records.particles)))
    ratios, log_errors, phase_errors = (np.stack(of) for of in zip(*found))
    names: Dict[str, List[Any]] = {"coefficient": ["mu_a", "mu_s"], "region": list(records.regions)}
    return ModulatedJacobian(
        _estimate(ratios.real, log_errors, names, "unit", None, hertz, records._origin),
        _estimate(ratios.imag, phase_errors, names, "rad*unit", None, hertz, records._origin),
    )


def _phasors(records: "Records", frequencies: ArrayLike, metres_per_unit: float, which: Any) -> Tuple[Doubles, Phasors]:
    """Returns frequencies, and weight times e^{ikL}, (n, frequencies, channels)."""
    hertz = np.atleast_1d(numbers(frequencies, "frequencies"))
    if hertz.ndim != 1 or not hertz.size or not np.all(np.isfinite(hertz) & (hertz > 0)):
        raise ValueError("frequencies must be one or more positive numbers in Hz")
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit is {metres_per_unit} but must be the positive length of a scene unit in m: 1e-3 for mm")
    wave_numbers = 2 * np.pi * hertz * metres_per_unit / SPEED_OF_LIGHT
    turn = np.exp(1j * records.optical_length[which][:, None] * wave_numbers)
    return hertz, records.weight[which][:, None, :] * turn[:, :, None]


def _per_particle(particle: NDArray[np.int64], values: Phasors) -> Phasors:
    """Returns sums over the records of each particle."""
    _, rows = np.unique(particle, return_inverse=True)
    totals = np.zeros((int(rows.max(initial=-1)) + 1, *values.shape[1:]), complex)
    np.add.at(totals, rows, values)
    return totals


def _over(values: Phasors, by: Phasors) -> Phasors:
    """Returns a quotient; NaN without light."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(values / by)


def _error(influence: Doubles, particles: int) -> Doubles:
    """Returns the standard error of a sum over particles, of which some have no records."""
    if particles < 2:
        return np.full(influence.shape[1:], np.inf)
    mean = influence.sum(axis=0)
    variance = np.maximum((influence**2).sum(axis=0) - mean**2 / particles, 0.0) * particles / (particles - 1)
    return np.asarray(np.sqrt(variance))


def _estimate(mean: Doubles, error: Doubles, names: Dict[str, List[Any]], unit: str, few: Optional[Any], hertz: Doubles, origin: Origin) -> Estimate:
    axes: Axes = {name: None for name in (*names, "frequency", "channel")}
    made: Estimate = Estimate(mean, error, axes, unit, None, few, {**names, "frequency": hertz.tolist()})._from(origin)
    return made
