"""Correlation of laser light: how fast it fluctuates where its scatterers move, and what sound does to its phases.

A detector of coherent light sees speckle that changes as scatterers move. :func:`correlate` computes the field autocorrelation G₁(τ) of the
light that a meter has recorded, and :func:`speckle_contrast` what a camera of finite exposure sees, from :class:`morgana.Records` and the
mean square displacement of the scatterers in each region. Nothing is rendered again when motions change. Where media have a ``velocity``,
scatterers flow besides.

:func:`tagged` finds the power that ultrasound shifts to sidebands of the light, and :func:`correlate_tagged` its autocorrelation, from records
of a meter that is ``tagged``; :func:`modulation_depth` is that of pictures and meters, in pixels and cells.

Theory: docs/theory.md#diffuse-correlation, docs/theory.md#flow, docs/theory.md#tagged-light.

    >>> motion = {"tissue: label 1": correlation.brownian(6e-7), "tissue: label 2": correlation.brownian(6e-6, moving=0.5)}
    >>> found = correlation.correlate(records, np.logspace(-7, -3, 50), motion, wavelength=785e-6, index=1.37)
    >>> plt.semilogx(found.delays, found.normalized[:, 0])
"""

from __future__ import annotations

import warnings
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._correlation import Correlation
from ._errors import SceneWarning
from ._exposure import NODES, OCTAVES, panels
from ._numbers import numbers
from ._records import Records
from ._sums import aligned, by_channel, by_particle, doubt, error_of, positive, seconds, taken, variance_of
from ._tagging import ModulationDepth, Sidebands, correlate_tagged, modulation_depth, tagged
from ._values import comparable

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
"""Values of records by delay that are computed for an exposure, about, where phases turn faster than can be resolved."""


@comparable
class Contrast(NamedTuple):
    """Speckle contrast by exposure and channel."""

    exposures: Doubles
    """Exposures T in seconds, (n,)."""
    mean: Doubles
    """K(T), the standard deviation of the intensity over its mean, (n, channels)."""
    error: Doubles
    """Its standard error."""

    def __repr__(self) -> str:
        return f"<morgana.correlation.Contrast of {len(self.exposures)} exposures>"


def brownian(diffusion: float, moving: float = 1.0) -> Motion:
    """Scatterers that diffuse: a mean square displacement of 6 D τ.

    This holds for delays that are long beside the time in which a scatterer forgets its velocity, 0.06 µs for a bead of 1 µm in water. Scatterers
    diffuse freely at all delays: nothing holds them back, not even a wall of their region.

    Parameters
    ----------
    diffusion : float
        Their diffusion coefficient D, ≥ 0, in squared scene units per second.
    moving : float
        Share of the scattering that is by moving scatterers, in [0, 1]: α of diffuse correlation spectroscopy.

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
    """Scatterers that fly apart in random directions: a mean square displacement of ⟨v²⟩ τ².

    Each keeps its velocity over all delays: take delays in which it goes less far, ``speed`` τ, than the length over which it would turn.

    Parameters
    ----------
    speed : float
        Root mean square of their speeds, ≥ 0, in scene units per second.
    moving : float
        Share of the scattering that is by moving scatterers, in [0, 1].

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
    """Scatterers that a sheared flow carries apart: an effective mean square displacement of (Γ l* τ)²/(5 (1 + g)).

    Between two scatterings the flow moves the scatterers against one another by Γ τ times their distance. Directions of light that has been
    scattered many times are random, and forget one another: of the second order, which counts here, by g² at each scattering of Henyey and
    Greenstein's law. With the mean ``g`` = 0 this is the law of Wu, Pine, Chaikin, Huang and Weitz (1990) for a path of length s,
    exp(−(n k₀ Γ l* τ)² s/(15 l*)). It does not hold for light that is scattered a few times, nor where Γ changes over l*. A uniform
    flow on top changes nothing. Each scatterer keeps its velocity: take delays in which it goes less far than the length over which the flow
    changes.

    Parameters
    ----------
    rate : float
        Shear rate Γ = ∂v/∂x across the flow, ≥ 0, per second. Of any incompressible flow, the root of 2 Σ S², where S is the symmetric part of
        its velocity gradient.
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
    """The field autocorrelation G₁(τ) of recorded light.

    Each record counts with its weight times exp(−⅓ k₀² Σ n² Y ⟨Δr²(τ)⟩), summed over regions, where Y is its momentum transfer. This holds
    for light of one polarisation whose paths have independent phases, and for scatterers whose displacements are Gaussian and independent.

    Where media have a ``velocity``, scatterers flow besides: a record's phase turns by k₀τ times its ``optical_length_rate``, and G₁(τ) is the
    absolute value of the sum. Noise makes the square of such a value larger by its variance, which is taken off; where less than nothing is
    left, g₁ is below its error, and 0 is given. Each scatterer keeps the velocity of the place where it scatters the light. A
    :class:`morgana.SceneWarning` tells where some change it by more than a tenth over a delay at which light is still correlated.

    Parameters
    ----------
    records : Records
        Records of the light.
    delays : array_like
        Delays τ in seconds, (n,), ≥ 0.
    motions : mapping
        For regions by name, a function from delays to mean square displacements in squared scene units, such as :func:`brownian` gives.
        Scatterers of other regions rest.
    wavelength : array_like
        Wavelength in vacuum, > 0, in scene units: one number, or one for each channel. A :class:`morgana.SceneWarning`
        tells where it is longer than the mean optical length between scatterings, as it is in a wrong unit: 532 nm are 532e-6 in a scene of
        millimetres.
    index : array_like or mapping
        Refractive index, of all regions or by the names of those that move: one number, or one for each channel.
    flow : float
        By what velocities of media are multiplied: 0 for a flow at rest.
    where : array_like of bool, optional
        Which records count, (n,): such as those of a detector or a time gate, or of light that leaves, ``records.side == 0``.

    Returns
    -------
    Correlation
        G₁ and g₁ with their errors.

    Raises
    ------
    ValueError
        An unknown region, one without an index, a flow of media without velocities, a number out of range, or ``where`` that is no row of
        truths for each record.

    Examples
    --------
    >>> found = correlation.correlate(records, [0, 1e-5, 1e-4], {"brain": correlation.brownian(6e-7)}, wavelength=785e-6, index=1.4)
    >>> found.normalized[:, 0], found.normalized_error[:, 0]
    """
    records = taken(records, where)
    times = seconds(delays, "delays", "finite numbers of seconds, not negative,")
    parts = _alike(records, wavelength, index, flow)
    found = np.concatenate([_decayed(part, _Delayed.of(part, motions, light).at(times)) for part, light in parts], axis=2)
    doubt(wavelength, records)
    _doubt_flow(records, flow, times, found)
    return Correlation(times, *found)


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

    Delays up to the exposure count, with what :func:`correlate` assumes of them. What noise adds to g₁² is taken off. Where less than nothing is
    left of K², K is 0, and its error the root of that of K². The error is up to twice too large where noise hides most of g₁: in exposures of as
    many correlation times as there are particles.

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
        Contrast squared of light that does not fluctuate, in (0, 1]: ½ for unpolarised light, less where speckles are not resolved.
    where : array_like of bool, optional
        As in :func:`correlate`.

    Returns
    -------
    Contrast
        Contrast with its error.

    Raises
    ------
    ValueError
        As :func:`correlate`; an exposure or ``beta`` out of range.

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
    doubt(wavelength, records)
    if _changing(records, flow):
        delays = np.geomspace(1e-6, 1, 21) * times.max(initial=0.0)
        decayed = [_decayed(part, _Delayed.of(part, motions, light).at(delays)) for part, light in _alike(records, wavelength, index, flow)]
        _doubt_flow(records, flow, delays, np.concatenate(decayed, axis=2))
    return Contrast(times, mean, error)


STEADY = 0.1
"""By how much of it what flows may change its velocity over a delay."""


def _changing(records: Records, flow: float) -> float:
    """How fast what flows changes its velocity, at most, per second."""
    if records.velocity_change is None:
        return 0.0
    crossed = records.momentum_transfer.any(axis=0)
    return abs(flow) * float(np.max(records.velocity_change[crossed], initial=0.0))


def _doubt_flow(records: Records, flow: float, delays: Doubles, found: Doubles) -> None:
    """Warns of flows that change over delays at which light is correlated; ``found`` is as that of `_decayed`."""
    change = _changing(records, flow)
    longest = np.max(delays[np.any(found[2] > 3 * found[3], axis=1)], initial=0.0)
    if change * longest > STEADY:
        warnings.warn(
            f"the velocity of what flows changes by up to {change * longest:.0%} within {longest:.3g} s, a delay at which light is still correlated, but is "
            f"taken to be constant: delays up to {STEADY / change:.2g} s are safe. Walls that cut voxels of the velocity obliquely count, too",
            SceneWarning,
            stacklevel=3,
        )


def _power(records: Records) -> Doubles:
    """That of each particle, (particles, channels)."""
    return np.asarray(by_particle(records, np.ones((len(records.particle), 1)))[:, 0])


def _decayed(records: Records, decay: NDArray[Any]) -> Doubles:
    """G₁, g₁ and their errors as in `Correlation`, (4, delays, channels), of what is left of each record, (delays, records)."""
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
    """The power of all particles by channel, 1 where there is none, and by what to multiply ratios to it: 1, but NaN where there is none."""
    total = power.sum(axis=0)
    return np.where(total > 0, total, 1.0), np.where(total > 0, 1.0, np.nan)


def _ratio(sums: NDArray[Any], power: Doubles, particles: int) -> Tuple[Doubles, Doubles]:
    """|Σ sums|/Σ power over particles, and its error."""
    total, lit = _total(power)
    ratio = sums.sum(axis=0) / total
    moved = sums - ratio * power
    if not np.iscomplexobj(sums):
        return ratio * lit, error_of(moved, particles) / total * lit
    # Of random phases, noise makes the square larger by its variance.
    square = np.abs(ratio) ** 2 - variance_of(moved, particles) / total**2
    return np.sqrt(np.maximum(square, 0.0)) * lit, error_of(aligned(moved, ratio), particles) / total * lit


def _blurred(records: Records, exposure: float, delayed: _Delayed, power: Doubles, beta: float) -> Tuple[Doubles, Doubles]:
    """Contrast of an exposure and its error, by channel, of particles of the given powers."""
    total, lit = _total(power)
    square, moved = np.zeros_like(total), np.zeros_like(power)
    most = max(4, WORK // (NODES * OCTAVES * max(len(records.particle), 1)))
    for delays, weights in panels(exposure, delayed.fastest, delayed.spread, most):
        weights = 2 * beta / exposure * weights * (1 - delays / exposure)
        sums = by_particle(records, delayed.at(delays).T)
        ratio = sums.sum(axis=0) / total
        residual = (sums - ratio * power[:, None, :]) / total
        square += weights @ (np.abs(ratio) ** 2 - variance_of(residual, records.particles))
        # To first order |g₁|² moves by 2 Re g₁* δg₁, where a particle's own part of g₁ is what has been taken off.
        moved += np.einsum("t,ptc->pc", weights, 2 * (np.conj(ratio) * residual).real - 2 * np.abs(residual) ** 2)
    mean, error = np.sqrt(np.maximum(square, 0.0)), error_of(moved, records.particles)
    by_root = np.divide(error, 2 * mean, out=np.full_like(mean, np.inf), where=mean > 0)
    return mean * lit, np.minimum(by_root, np.sqrt(error)) * lit


class _Light(NamedTuple):
    """What turns motions into phases."""

    wavelength: float
    indices: Dict[str, float]
    """Of regions by name."""
    flow: float


def _alike(records: Records, wavelength: ArrayLike, index: Union[ArrayLike, Mapping[str, ArrayLike]], flow: float) -> List[Tuple[Records, _Light]]:
    """Records by channels whose light is the same: all of them, or each by itself."""
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
    """What is left of each record after a delay."""

    records: int
    """Number of records."""
    names: List[str]
    """Of the regions that move."""
    motions: List[Motion]
    """Their mean square displacements by delay."""
    transfers: List[Doubles]
    """⅓ (n k₀)² Y in each of them, (records,)."""
    turn: Optional[Doubles]
    """How fast phases turn, (records,); none if nothing flows."""

    @classmethod
    def of(cls, records: Records, motions: Mapping[str, Motion], light: _Light) -> _Delayed:
        k0 = 2 * np.pi / light.wavelength
        rate = _rate(records, light.flow)
        moving = checks.mapping(motions, "motions by region")
        transfers = []
        for name, motion in moving.items():
            if name not in records.regions:
                raise ValueError(f"no region is named {name!r}; there are {', '.join(map(repr, records.regions))}")
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
        """How fast phases turn apart, at most, per second."""
        return 0.0 if self.turn is None or not len(self.turn) else float(np.ptp(self.turn))

    def at(self, delays: Doubles) -> Union[Doubles, NDArray[np.complex128]]:
        """Of each record after each delay, (delays, records): complex if something flows."""
        exponent = np.zeros((len(delays), self.records))
        for square, transfer in zip(self._squares(delays), self.transfers):
            exponent += np.outer(square, transfer)
        if self.turn is None:
            return np.asarray(np.exp(-exponent))
        return np.asarray(np.exp(1j * np.outer(delays, self.turn) - exponent))

    def fastest(self, delays: Doubles) -> Doubles:
        """An upper bound of how much a record has decayed and turned against others, after each delay."""
        changes = delays * self.spread
        for square, transfer in zip(self._squares(delays), self.transfers):
            changes = changes + square * transfer.max(initial=0.0)
        return changes

    def _squares(self, delays: Doubles) -> Iterator[Doubles]:
        """Mean square displacements of regions."""
        for name, motion in zip(self.names, self.motions):
            square = numbers(motion(delays), f"mean square displacements of {name!r}")
            if square.shape != delays.shape or not np.all(np.isfinite(square) & (square >= 0)):
                raise ValueError(f"the motion of {name!r} must give one mean square displacement for each delay, not negative")
            yield square


def _rate(records: Records, flow: float) -> Optional[Doubles]:
    """How fast optical lengths change; none if nothing flows."""
    checks.optional_finite(flow, "flow")
    if records.optical_length_rate is None:
        if flow != 1:
            raise ValueError("nothing flows: give a medium a 'velocity' in the scene whose light is recorded")
        return None
    return flow * records.optical_length_rate if flow else None


def _finite(square: float, what: str) -> float:
    """A mean square displacement by the unit of time, if it is a number that there is."""
    if not np.isfinite(square):
        raise ValueError(f"{what}, but mean square displacements must be finite: give it in scene units and seconds")
    return square


def _moving(share: float) -> float:
    if not 0 <= share <= 1:
        raise ValueError(f"the moving share of the scattering must be between 0 and 1, not {share}")
    return float(share)
