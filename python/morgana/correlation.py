"""Correlation of laser light: fluctuations from moving scatterers, and phase shifts by ultrasound.

A detector of coherent light sees speckle that changes as scatterers move. :func:`correlate`
computes the field autocorrelation G₁(τ) of the light that a meter recorded.
:func:`speckle_contrast` computes the contrast in a camera of finite exposure. Both take
:class:`morgana.Records` and the mean square displacement of the scatterers in each region. New
motions need no new render. Where media have a ``velocity``, scatterers also move with the flow.

From the records of a ``tagged`` meter, :func:`tagged` computes the power that ultrasound shifts to
sidebands of the light, and :func:`correlate_tagged` computes the autocorrelation of the light.
:func:`modulation_depth` computes the modulation depth of pictures in pixels, and of meters in
cells.

Theory: docs/theory.md#diffuse-correlation, docs/theory.md#flow, docs/theory.md#tagged-light.

    >>> motion = {"tissue: label 1": correlation.brownian(6e-7), "tissue: label 2": correlation.brownian(6e-6, moving=0.5)}
    >>> found = correlation.correlate(records, np.logspace(-7, -3, 50), motion, wavelength=785e-6, index=1.37)
    >>> plt.semilogx(found.delays, found.normalized[:, 0])
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._correlation import Correlation, over
from ._errors import SceneWarning
from ._estimate import Data, Estimate, Origin, own_origin
from ._exposure import NODES, OCTAVES, panels
from ._numbers import numbers
from ._pictures import html_of
from ._records import Records
from ._sums import aligned, by_channel, by_particle, error_of, positive, seconds, taken, variance_of, warn_about_wavelength
from ._tagging import ModulationDepth, Sidebands, correlate_tagged, modulation_depth, tagged
from ._values import Fields

__all__ = [
    "Contrast",
    "Correlation",
    "ModulationDepth",
    "Sidebands",
    "ballistic",
    "brownian",
    "correlate",
    "correlate_tagged",
    "modulation_depth",
    "shear",
    "speckle_contrast",
    "tagged",
]

Doubles = NDArray[np.float64]
Motion = Callable[[Doubles], Doubles]
WORK = 1 << 24
"""Approximate maximum number of values, records times delays, for an exposure in which phases turn
too fast to be resolved."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Contrast(Data, Fields):
    """Speckle contrast by exposure and channel.

    Contrasts compute like NumPy arrays, with their errors, over the axes ``exposure`` and
    ``channel``: see :class:`Estimate`.

    Examples
    --------
    >>> flow_index = 1 / found.sel(exposure=5e-3, channel=0) ** 2
    """

    exposures: Doubles
    """Exposures T in seconds, (n,)."""
    mean: Doubles
    """Contrast K(T), the standard deviation of the intensity over its mean, (n, channels)."""
    error: Doubles
    """Standard error of the contrast, (n, channels)."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _estimate(self) -> Estimate:
        return over("exposure", self.exposures, self.mean, self.error, self._origin)

    def _from(self, origin: Origin) -> "Contrast":
        object.__setattr__(self, "_origin", origin)
        return self

    def _repr_html_(self) -> str:
        return html_of(self._estimate(), repr(self).strip("<>"))

    def __repr__(self) -> str:
        return f"<morgana.correlation.Contrast of {len(self.exposures)} exposures>"


def brownian(diffusion: float, moving: float = 1.0) -> Motion:
    """Mean square displacement 6 D τ of scatterers that diffuse.

    This law holds for delays much longer than the time in which a scatterer loses its velocity:
    0.06 µs for a bead of 1 µm in water. Scatterers diffuse freely at all delays, also through the
    walls of their region.

    Parameters
    ----------
    diffusion : float
        Diffusion coefficient D of the scatterers, ≥ 0, in squared scene units per second.
    moving : float
        Fraction of the scattering that moving scatterers cause, in [0, 1]: α of diffuse correlation
        spectroscopy.

    Returns
    -------
    callable
        The mean square displacement by delay.

    Raises
    ------
    ValueError
        A number out of range.

    Examples
    --------
    >>> correlation.brownian(6e-7)(1e-3)
    3.6e-09
    """
    rate = _moving(moving) * _finite(6 * positive(diffusion, "diffusion"), f"diffusion is {diffusion}")
    return lambda delays: rate * np.asarray(delays, float)


def ballistic(speed: float, moving: float = 1.0) -> Motion:
    """Mean square displacement ⟨v²⟩ τ² of scatterers that move in random directions.

    Each scatterer keeps its velocity over all delays. Take delays in which it travels less,
    ``speed`` τ, than the length over which it would turn.

    Parameters
    ----------
    speed : float
        Root mean square speed of the scatterers, ≥ 0, in scene units per second.
    moving : float
        Fraction of the scattering that moving scatterers cause, in [0, 1].

    Returns
    -------
    callable
        The mean square displacement by delay.

    Raises
    ------
    ValueError
        A number out of range.

    Examples
    --------
    >>> correlation.ballistic(2.0)(1e-3)
    4e-06
    """
    velocity = positive(speed, "speed")
    square = _moving(moving) * _finite(velocity * velocity, f"speed is {speed}")
    return lambda delays: square * np.asarray(delays, float) ** 2


def shear(rate: float, transport_length: float, g: float = 0.0) -> Motion:
    """Effective mean square displacement (Γ l* τ)²/(5 (1 + g)) of scatterers in a shear flow.

    Between two scatterings, the flow moves the scatterers relative to one another by Γ τ times
    their distance. The directions of multiply scattered light are random. The displacement depends
    on their second-order correlation. It decreases by g² at each scattering of Henyey and
    Greenstein's law. With the mean cosine ``g`` = 0, this is the law of Wu, Pine, Chaikin, Huang
    and Weitz (1990) for a path of length s, exp(−(n k₀ Γ l* τ)² s/(15 l*)).

    The law does not hold for light that is scattered a few times, nor where Γ changes over l*. An
    additional uniform flow has no effect. Each scatterer keeps its velocity: take delays in which
    it travels less than the length over which the flow changes.

    Parameters
    ----------
    rate : float
        Shear rate Γ = ∂v/∂x across the flow, ≥ 0, per second. For any incompressible flow, the root
        of 2 Σ S², where S is the symmetric part of its velocity gradient.
    transport_length : float
        Transport mean free path l* = 1/(μₛ(1 − g)) of the region, > 0, in scene units.
    g : float
        Mean cosine of scattering, in (−1, 1).

    Returns
    -------
    callable
        The effective mean square displacement by delay.

    Raises
    ------
    ValueError
        A number out of range.

    Examples
    --------
    >>> correlation.shear(100.0, 1.0)(1e-3)
    0.002...
    """
    if not -1 < g < 1:
        raise ValueError(f"g must be between -1 and 1, not {g}")
    length = positive(transport_length, "transport_length", least=np.nextafter(0, 1))
    speed = positive(rate, "rate") * length
    square = _finite(speed * speed, f"rate times transport_length is {speed}") / (5 * (1 + g))
    return lambda delays: square * np.asarray(delays, float) ** 2


def correlate(
    records: Records,
    delays: ArrayLike,
    motions: Mapping[str, Motion],
    *,
    wavelength: ArrayLike,
    index: Union[ArrayLike, Mapping[str, ArrayLike]],
    flow: float = 1.0,
    where: Optional[ArrayLike] = None,
) -> Correlation:
    """Field autocorrelation G₁(τ) of recorded light.

    Each record contributes its weight times exp(−⅓ k₀² Σ n² Y ⟨Δr²(τ)⟩). The sum is over regions; Y
    is the momentum transfer of the record in a region. This holds for light of one polarisation
    whose paths have independent phases, and for scatterers whose displacements are Gaussian and
    independent.

    Where media have a ``velocity``, scatterers also move with the flow. The phase of a record turns
    by k₀τ times its ``optical_length_rate``, and G₁(τ) is the absolute value of the sum. Noise
    increases the square of the absolute value by its variance, which is subtracted; if the
    difference is negative, g₁ is below its error, and the result is 0. Each scatterer keeps the
    velocity of the place where it scatters the light. A :class:`morgana.SceneWarning` warns if some
    velocities change by more than a tenth over a delay at which light is still correlated.

    Parameters
    ----------
    records : Records
        Records of the light.
    delays : array_like
        Delays τ in seconds, (n,), ≥ 0.
    motions : mapping
        For regions by name, a function from delays to mean square displacements in squared scene
        units, such as the result of :func:`brownian`. Scatterers of other regions do not move.
    wavelength : array_like
        Wavelength in vacuum, > 0, in scene units: one number, or one for each channel. In a scene
        in millimetres, 532 nm are 532e-6. A :class:`morgana.SceneWarning` warns if the wavelength
        exceeds the mean optical length between scatterings, which suggests a wrong unit.
    index : array_like or mapping
        Refractive index, of all regions or by the names of those that move: one number, or one for
        each channel.
    flow : float
        Factor on the velocities of media: 0 turns off the flow.
    where : array_like of bool, optional
        Mask of the records to use, (n,): for instance the records of a detector or a time gate, or
        of light that leaves, ``records.side == 0``.

    Returns
    -------
    Correlation
        G₁ and g₁ with their errors.

    Raises
    ------
    ValueError
        An unknown region, or a moving region without an index. A ``flow`` if no medium has a
        velocity. A number out of range. A ``where`` that is not one bool for each record.

    Examples
    --------
    >>> found = correlation.correlate(records, [0, 1e-5, 1e-4], {"brain": correlation.brownian(6e-7)}, wavelength=785e-6, index=1.4)
    >>> found.normalized[:, 0], found.normalized_error[:, 0]
    """
    records = taken(records, where)
    times = seconds(delays, "delays", "finite numbers of seconds, not negative,")
    parts = _alike(records, wavelength, index, flow)
    found = np.concatenate([_decayed(part, _Delayed.of(part, motions, light).at(times)) for part, light in parts], axis=2)
    warn_about_wavelength(wavelength, records)
    _doubt_flow(records, flow, times, found)
    mean, error, normalized, normalized_error = found
    return Correlation(times, mean, error, normalized, normalized_error, records.unit)._from(records._origin)


def speckle_contrast(
    records: Records,
    exposures: ArrayLike,
    motions: Mapping[str, Motion],
    *,
    wavelength: ArrayLike,
    index: Union[ArrayLike, Mapping[str, ArrayLike]],
    flow: float = 1.0,
    beta: float = 1.0,
    where: Optional[ArrayLike] = None,
) -> Contrast:
    """Speckle contrast K(T) of recorded light: K² = (2β/T) ∫₀ᵀ (1 − τ/T) g₁(τ)² dτ.

    The integral is over delays up to the exposure, under the assumptions of :func:`correlate`. The
    contribution of noise to g₁² is subtracted. If the difference K² is negative, K is 0, and its
    error is the root of the error of K². The error is up to twice too large where noise hides most
    of g₁: in exposures of as many correlation times as there are particles.

    Parameters
    ----------
    records : Records
        Records of the light.
    exposures : array_like
        Exposures T in seconds, (n,), > 0.
    motions : mapping
        As in :func:`correlate`.
    wavelength : array_like
        As in :func:`correlate`.
    index : array_like or mapping
        As in :func:`correlate`.
    flow : float
        As in :func:`correlate`.
    beta : float
        Squared contrast of light that does not fluctuate, in (0, 1]: ½ for unpolarised light, less
        if speckles are not resolved.
    where : array_like of bool, optional
        As in :func:`correlate`.

    Returns
    -------
    Contrast
        Contrast with its error.

    Raises
    ------
    ValueError
        As for :func:`correlate`; an exposure or ``beta`` out of range.

    Examples
    --------
    >>> correlation.speckle_contrast(records, [1e-3, 5e-3], motion, wavelength=785e-6, index=1.4, beta=0.5).mean
    """
    records = taken(records, where)
    times = seconds(exposures, "exposures", "finite, positive numbers of seconds", least=np.nextafter(0, 1))
    if not 0 < beta <= 1:
        raise ValueError(f"beta must be above 0 and at most 1, not {beta}")
    found = []
    for part, light in _alike(records, wavelength, index, flow):
        delayed, power = _Delayed.of(part, motions, light), _power(part)
        values = np.zeros((2, len(times), power.shape[1]))
        for i, time in enumerate(times):
            values[:, i] = _blurred(part, time, delayed, power, beta)
        found.append(values)
    mean, error = np.concatenate(found, axis=2)
    warn_about_wavelength(wavelength, records)
    if _changing(records, flow):
        delays = np.geomspace(1e-6, 1, 21) * times.max(initial=0.0)
        decayed = [_decayed(part, _Delayed.of(part, motions, light).at(delays)) for part, light in _alike(records, wavelength, index, flow)]
        _doubt_flow(records, flow, delays, np.concatenate(decayed, axis=2))
    return Contrast(times, mean, error)._from(records._origin)


MAX_CHANGE = 0.1
"""Largest relative change of a flow velocity over a delay that gives no warning."""


def _changing(records: Records, flow: float) -> float:
    """Returns an upper bound of the relative change of flow velocities, per second."""
    if records.velocity_change is None:
        return 0.0
    crossed = records.momentum_transfer.any(axis=0)
    return abs(flow) * float(np.max(records.velocity_change[crossed], initial=0.0))


def _doubt_flow(records: Records, flow: float, delays: Doubles, found: Doubles) -> None:
    """Warns if flows change over delays at which light is correlated; ``found`` is the result of
    `_decayed`."""
    change = _changing(records, flow)
    longest = np.max(delays[np.any(found[2] > 3 * found[3], axis=1)], initial=0.0)
    if change * longest > MAX_CHANGE:
        warnings.warn(
            f"the velocity of what flows changes by up to {change * longest:.0%} within {longest:.3g} s, a delay at which light is still correlated, but is "
            f"taken to be constant: delays up to {MAX_CHANGE / change:.2g} s are safe. Walls that cut voxels of the velocity obliquely count, too",
            SceneWarning,
            stacklevel=3,
        )


def _power(records: Records) -> Doubles:
    """Returns the power of each particle, (particles, channels)."""
    return np.asarray(by_particle(records, np.ones((len(records.particle), 1)))[:, 0])


def _decayed(records: Records, decay: NDArray[Any]) -> Doubles:
    """Returns G₁, g₁ and their errors as in `Correlation`, (4, delays, channels), from the decay of
    each record, (delays, records)."""
    power = _power(records)
    whole = power.sum(axis=0)
    mean, error, ratio, ratio_error = found = np.zeros((4, len(decay), len(whole)))
    for i, row in enumerate(decay):
        sums = by_particle(records, row[:, None])[:, 0]
        ratio[i], ratio_error[i] = _ratio(sums, power, records.particles)
        mean[i] = np.where(whole > 0, ratio[i] * whole, 0.0)
        error[i] = error_of(aligned(sums, sums.sum(axis=0)), records.particles)
    return found


def _total(power: Doubles) -> Tuple[Doubles, Doubles]:
    """Returns the power of all particles by channel, and a factor for ratios to it. They are 1 and
    NaN for channels without power, else the power and 1."""
    total = power.sum(axis=0)
    return np.where(total > 0, total, 1.0), np.where(total > 0, 1.0, np.nan)


def _ratio(sums: NDArray[Any], power: Doubles, particles: int) -> Tuple[Doubles, Doubles]:
    """Returns |Σ sums|/Σ power over particles, and its error."""
    total, lit = _total(power)
    ratio = sums.sum(axis=0) / total
    moved = sums - ratio * power
    if not np.iscomplexobj(sums):
        return ratio * lit, error_of(moved, particles) / total * lit
    # Subtract the variance of the noise, which increases the square if phases are random.
    square = np.abs(ratio) ** 2 - variance_of(moved, particles) / total**2
    return np.sqrt(np.maximum(square, 0.0)) * lit, error_of(aligned(moved, ratio), particles) / total * lit


def _blurred(records: Records, exposure: float, delayed: _Delayed, power: Doubles, beta: float) -> Tuple[Doubles, Doubles]:
    """Returns the contrast of an exposure and its error, by channel, for particles of the given
    powers."""
    total, lit = _total(power)
    square, moved = np.zeros_like(total), np.zeros_like(power)
    most = max(4, WORK // (NODES * OCTAVES * max(len(records.particle), 1)))
    for delays, weights in panels(exposure, delayed.fastest, delayed.spread, most):
        weights = 2 * beta / exposure * weights * (1 - delays / exposure)
        sums = by_particle(records, delayed.at(delays).T)
        ratio = sums.sum(axis=0) / total
        residual = (sums - ratio * power[:, None, :]) / total
        square += weights @ (np.abs(ratio) ** 2 - variance_of(residual, records.particles))
        # Linearise |g₁|²: it changes by 2 Re g₁* δg₁. Subtract the particle's own contribution to
        # g₁, as above.
        moved += np.einsum("t,ptc->pc", weights, 2 * (np.conj(ratio) * residual).real - 2 * np.abs(residual) ** 2)
    mean, error = np.sqrt(np.maximum(square, 0.0)), error_of(moved, records.particles)
    by_root = np.divide(error, 2 * mean, out=np.full_like(mean, np.inf), where=mean > 0)
    return mean * lit, np.minimum(by_root, np.sqrt(error)) * lit


class _Light(NamedTuple):
    """Properties of the light that convert motions of scatterers to phases."""

    wavelength: float
    indices: Dict[str, float]
    """Refractive indices of regions by name."""
    flow: float


def _alike(records: Records, wavelength: ArrayLike, index: Union[ArrayLike, Mapping[str, ArrayLike]], flow: float) -> List[Tuple[Records, _Light]]:
    """Groups records by channels whose light is equal: all channels together, or each
    separately."""
    channels = records.weight.shape[1]
    length = by_channel(wavelength, "wavelength", channels)
    named = index if isinstance(index, Mapping) else dict.fromkeys(records.regions, index)
    what = "the index of {!r}" if isinstance(index, Mapping) else "index"
    indices = {name: by_channel(value, what.format(name), channels) for name, value in named.items()}

    def light(channel: int) -> _Light:
        here = {name: float(np.broadcast_to(value, channels)[channel]) for name, value in indices.items()}
        return _Light(float(np.broadcast_to(length, channels)[channel]), here, flow)

    if length.ndim == 0 and all(value.ndim == 0 for value in indices.values()):
        return [(records, light(0))]
    return [(records._replace(weight=records.weight[:, [channel]]), light(channel)) for channel in range(channels)]


class _Delayed(NamedTuple):
    """Decay and phase of each record after a delay."""

    records: int
    """Number of records."""
    names: List[str]
    """Names of the regions that move."""
    motions: List[Motion]
    """Mean square displacements of these regions by delay."""
    transfers: List[Doubles]
    """Values ⅓ (n k₀)² Y of each of these regions, (records,)."""
    turn: Optional[Doubles]
    """Angular frequency of phases, (records,), rad/s; ``None`` if nothing flows."""

    @classmethod
    def of(cls, records: Records, motions: Mapping[str, Motion], light: _Light) -> _Delayed:
        k0 = 2 * np.pi / light.wavelength
        rate = _rate(records, light.flow)
        moving = checks.mapping(motions, "motions by region")
        transfers = []
        for name, motion in moving.items():
            if name not in records.regions:
                raise ValueError(f"no region {name!r}: the records have {', '.join(map(repr, records.regions))}")
            if name not in light.indices:
                raise ValueError(f"the region {name!r} moves, but has no index")
            if not callable(motion):
                raise ValueError(
                    f"the motion of {name!r} must be a function of delays, such as brownian() or shear() gives; for a field of velocities, give the "
                    "medium a 'velocity' in the scene"
                )
            transfers.append((light.indices[name] * k0) ** 2 / 3 * records.momentum_transfer[:, records.regions.index(name)])
        return cls(len(records.particle), list(moving), list(moving.values()), transfers, None if rate is None else k0 * rate)

    @property
    def spread(self) -> float:
        """Largest difference of angular frequencies, rad/s."""
        return 0.0 if self.turn is None or not len(self.turn) else float(np.ptp(self.turn))

    def at(self, delays: Doubles) -> Union[Doubles, NDArray[np.complex128]]:
        """Returns the factor of each record after each delay, (delays, records); complex if
        something flows."""
        exponent = np.zeros((len(delays), self.records))
        for square, transfer in zip(self._squares(delays), self.transfers):
            exponent += np.outer(square, transfer)
        if self.turn is None:
            return np.asarray(np.exp(-exponent))
        return np.asarray(np.exp(1j * np.outer(delays, self.turn) - exponent))

    def fastest(self, delays: Doubles) -> Doubles:
        """Returns an upper bound of the decay of a record and of its phase relative to other
        records, after each delay."""
        changes = delays * self.spread
        for square, transfer in zip(self._squares(delays), self.transfers):
            changes = changes + square * transfer.max(initial=0.0)
        return changes

    def _squares(self, delays: Doubles) -> Iterator[Doubles]:
        """Yields the mean square displacements of the regions."""
        for name, motion in zip(self.names, self.motions):
            square = numbers(motion(delays), f"mean square displacements of {name!r}")
            if square.shape != delays.shape or not np.all(np.isfinite(square) & (square >= 0)):
                raise ValueError(f"the motion of {name!r} must give one mean square displacement for each delay, not negative")
            yield square


def _rate(records: Records, flow: float) -> Optional[Doubles]:
    """Returns rates of change of optical lengths, scene units per second; ``None`` if nothing
    flows."""
    checks.optional_finite(flow, "flow")
    if records.optical_length_rate is None:
        if flow != 1:
            raise ValueError("nothing flows: give a medium of the scene a 'velocity'")
        return None
    return flow * records.optical_length_rate if flow else None


def _finite(square: float, what: str) -> float:
    """Returns a mean square displacement per unit of time; raises an error if it is not finite."""
    if not np.isfinite(square):
        raise ValueError(f"{what}, but mean square displacements must be finite: give it in scene units and seconds")
    return square


def _moving(share: float) -> float:
    if not 0 <= share <= 1:
        raise ValueError(f"the moving fraction of the scattering must be between 0 and 1, not {share}")
    return float(share)
