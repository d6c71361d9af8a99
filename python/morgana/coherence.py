"""Low-coherence interferometry of recorded light, as in optical coherence tomography.

Light of a broad spectrum interferes with its reference only where their optical lengths are equal.
:func:`a_scan` computes the power that a reference of each length selects: from a meter's light
(:class:`morgana.Records`), or from each pixel of a film that separates light by its length.
:func:`interferogram` computes the fringes of light with known paths, such as the rays of
:func:`morgana.trace`.

Lengths are optical, ∫n ds, in scene units. Light of a broad spectrum travels by the group index n_g
= n − λ dn/dλ. Where media disperse, add n_g − n times the length in each medium
(``Records.path_length``) to optical lengths, or give media the group index.

Theory: docs/theory.md#low-coherence-gating.

    >>> source = coherence.gaussian(1.3, 0.1)
    >>> scan = coherence.a_scan(records, np.linspace(20, 24, 400), source)
    >>> plt.semilogy(scan.lengths, scan.mean[:, 0])
"""

from __future__ import annotations

from typing import Any, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._bins import Bins, bins_of, mean_and_variance
from ._images import Image
from ._numbers import numbers
from ._records import Records
from ._result import Result
from ._sums import error_of, positive, taken
from ._values import comparable

__all__ = ["AScan", "Source", "a_scan", "gaussian", "interferogram", "tabulated"]

Doubles = NDArray[np.float64]
Complexes = NDArray[np.complex128]
BLOCK = 1 << 22
"""Number of length differences that are held in memory at a time."""
MIN_POSITIVE = float(np.nextafter(0, 1))
"""Smallest positive number."""


@comparable
class Source(NamedTuple):
    """Light source of an interferometer; see :func:`gaussian` and :func:`tabulated`.

    The spectrum is a line or a table, convolved with a Gaussian."""

    wave_numbers: Doubles
    """Wave numbers k = 2π/λ, (n,), ascending; a single one for a line."""
    density: Doubles
    """Power per wave number, (n,), in any unit; linear between wave numbers."""
    spread: float
    """Full width at half maximum of the Gaussian, in wave numbers."""
    coherence_length: float
    """Length difference at which the envelope |γ| has fallen to one half. This is also the full
    width at half maximum in depth, because light travels to a depth and back: the axial resolution
    in vacuum."""

    def degree(self, difference: ArrayLike) -> Complexes:
        """Complex degree of coherence γ by difference of optical lengths; γ(0) = 1.

        Parameters
        ----------
        difference : array_like
            Differences Δ, of any shape, in scene units.

        Returns
        -------
        array
            Degrees γ(Δ), of the same shape.
        """
        delta = numbers(difference, "difference")
        k, density = self.wave_numbers, self.density
        bell = np.exp(-((self.spread * delta) ** 2) / (16 * np.log(2)))
        if len(k) == 1:
            return np.asarray(bell * np.exp(1j * k[0] * delta))
        half, middle = np.diff(k) / 2, (k[1:] + k[:-1]) / 2
        mean, rise = (density[1:] + density[:-1]) / 2, np.diff(density) / 2
        result = np.zeros(delta.shape, complex)
        for h, m, a, b in zip(half, middle, mean, rise):
            # Integrate ∫ (a + b t) e^{iΔ(m + h t)} h dt over t in [−1, 1].
            x = h * delta
            result += 2 * h * np.exp(1j * m * delta) * (a * np.sinc(x / np.pi) + 1j * b * _bessel(x))
        return np.asarray(bell * result / np.sum(2 * half * mean))

    def __repr__(self) -> str:
        return f"<morgana.coherence.Source, coherence length {self.coherence_length:.4g}>"


@comparable
class AScan(NamedTuple):
    """Light that interferes with a reference.

    Values are by reference length and channel, and by pixel for a film."""

    lengths: Doubles
    """Optical lengths of the reference, (n,)."""
    mean: Doubles
    """Light that the coherence gate selects. For records, power, (n, channels), in the unit of
    their weights. For a film, radiance, (n, height, width, channels), in the unit of the
    picture."""
    error: Doubles
    """Standard error of ``mean``, of the same shape: over particles, or over samples of a pixel."""

    def __repr__(self) -> str:
        return f"<morgana.coherence.AScan of {len(self.lengths)} lengths>"


def gaussian(wavelength: float, width: float) -> Source:
    """Source with a Gaussian spectrum in wave number.

    Parameters
    ----------
    wavelength : float
        Centre λ in vacuum, > 0, in scene units.
    width : float
        Full width Δλ at half maximum, > 0 and at most λ, in scene units; 2π Δλ/λ² in wave numbers.

    Returns
    -------
    Source
        Source with the coherence length (2 ln 2/π) λ²/Δλ.

    Raises
    ------
    ValueError
        A number that is not positive and finite, or a width beyond the wavelength.

    Examples
    --------
    >>> coherence.gaussian(1.3e-3, 0.1e-3).coherence_length
    0.007457...
    """
    middle, full = positive(wavelength, "wavelength", least=MIN_POSITIVE), positive(width, "width", least=MIN_POSITIVE)
    if full > middle:
        raise ValueError(f"the spectrum is {width} wide, more than its wavelength of {wavelength}: use a narrower one, or coherence.tabulated")
    center, spread = 2 * np.pi / middle, 2 * np.pi * full / middle**2
    return Source(np.array([center]), np.ones(1), spread, float(4 * np.log(2) / spread))


def tabulated(wavelengths: ArrayLike, power: ArrayLike) -> Source:
    """Source with a measured spectrum, linear in wave number between its points.

    Parameters
    ----------
    wavelengths : array_like
        Wavelengths in vacuum, (n,), ascending, > 0, in scene units; at least two.
    power : array_like
        Power per wavelength, (n,), ≥ 0, in any unit.

    Returns
    -------
    Source
        Source with a degree of coherence without aliases: each piece of the spectrum is integrated
        exactly.

    Raises
    ------
    ValueError
        Wavelengths or powers that are not a spectrum.

    Examples
    --------
    >>> coherence.tabulated([0.8, 0.85, 0.9], [0, 1, 0])
    <morgana.coherence.Source, coherence length 6.375>
    """
    nm, values = numbers(wavelengths, "wavelengths"), numbers(power, "power")
    if nm.ndim != 1 or nm.shape != values.shape or len(nm) < 2 or not np.all(np.isfinite(nm)) or nm[0] <= 0 or np.any(np.diff(nm) <= 0):
        raise ValueError("wavelengths and power must be two rows of at least two numbers, with positive and ascending wavelengths")
    # Convert to power per wave number k = 2π/λ, ascending: |dλ/dk| ∝ λ².
    k, density = 2 * np.pi / nm[::-1], (values * nm**2)[::-1]
    if not np.all(np.isfinite(density) & (density >= 0)) or not density.any():
        raise ValueError("power must be finite, not negative, and not zero everywhere")
    source = Source(k, density, 0.0, np.nan)
    return source._replace(coherence_length=_half(source, 2 * np.pi / (k[-1] - k[0])))


def a_scan(light: Union[Records, Result, Image], lengths: ArrayLike, source: Source, *, where: Optional[ArrayLike] = None) -> AScan:
    """Light that interferes with references of given lengths: an A-scan of each meter or pixel.

    The scan is Σ w |γ(L − ℓ)|² over light of weight w and optical length ℓ. It is the mean, over
    speckle, of the squared envelope of the fringes, without the power of the reference. It holds
    for light whose paths have independent phases, in one polarisation and one mode of the detector.
    Fringes of a mirror, whose light all has one phase, have this squared envelope too. The index
    does not depend on the wavelength within the spectrum. A row of pixels gives a B-scan.

    Light of a film is spread evenly within each bin of length; light outside the bins is ignored.
    Of tagged light, all sidebands count; of Stokes parameters, S0. Errors of bins are taken as
    independent. They are slightly too small if one path contributes to several bins within a gate.
    They are too large if the samples of a pixel are evenly distributed, as with the sampler
    ``ldsampler`` and by default: take ``independent`` samples where the error matters.

    Parameters
    ----------
    light : Records, Result or Image
        Records of the light, or a picture whose film has a ``decomposition`` by ``length`` or
        ``time``. The picture is a render, or an EXR file that :func:`morgana.read` has read; its
        channels are in the order of the file.
    lengths : array_like
        Optical lengths L of the reference, (n,), measured from the emitter to the meter or
        sensor, like the lengths of the light.
    source : Source
        The light source.
    where : array_like of bool, optional
        Mask of the records to use, (n,): for instance records of light that leaves, ``records.side
        == 0``.

    Returns
    -------
    AScan
        The light by reference length, with its error.

    Raises
    ------
    ValueError
        Lengths that are not finite numbers in a row, or beyond the bins of the film. A picture
        without bins of length, or with bins wider than half the coherence length, which hide what
        the gate resolves. A ``where`` that is not one bool for each record, or is given for a
        picture.

    Examples
    --------
    >>> scan = coherence.a_scan(records, np.linspace(2, 4, 200), coherence.gaussian(1.3e-3, 0.05e-3))
    >>> depth = (scan.lengths - 2) / 2 / 1.37
    """
    reference = _row(lengths)
    _check(source)
    if isinstance(light, (Result, Image)):
        if where is not None:
            raise ValueError("'where' selects records, but a picture has none: select pixels of the scan")
        return _film_scan(light, reference, source)
    if not isinstance(light, Records):
        raise TypeError(f"expected Records, a Result or an Image, found {type(light).__name__}: give result.records, or an EXR file read by morgana.read")
    light = taken(light, where)
    _, rows = np.unique(light.particle, return_inverse=True)
    particles, channels = int(rows.max(initial=-1)) + 1, light.weight.shape[1]
    mean, error = np.zeros((2, len(reference), channels))
    step = max(1, BLOCK // max(len(rows), 1))
    for start in range(0, len(reference), step):
        part = reference[start : start + step]
        gate = np.abs(source.degree(part[:, None] - light.optical_length)) ** 2
        for c in range(channels):
            for i, row in enumerate(gate * light.weight[:, c]):
                sums = np.asarray(np.bincount(rows, row, particles), float)
                mean[start + i, c] = sums.sum()
                error[start + i, c] = error_of(sums, light.particles)
    return AScan(reference, mean, error)


def _film_scan(film: Union[Result, Image], reference: Doubles, source: Source) -> AScan:
    """Returns the scan of each pixel."""
    bins = bins_of(film)
    if bins is None:
        raise ValueError(
            "there are no layers of light by length: give its film the decomposition 'length' or 'time', and take the result or its EXR file; "
            "of meters take one of result.records"
        )
    if not all(bins.layers):
        raise ValueError("the picture has no layers for some of its bins of length: give an EXR file by morgana")
    edges = bins.edges * bins.speed_of_light
    width = (edges[-1] - edges[0]) / len(bins.layers)
    if width > source.coherence_length / 2:
        raise ValueError(
            f"the film's bins are {width:.4g} long, more than half of the coherence length, {source.coherence_length:.4g}: take a smaller bin_width"
        )
    if np.any((reference < edges[0]) | (reference > edges[-1])):
        raise ValueError(f"the film has light of the lengths {edges[0]:.4g} to {edges[-1]:.4g} only: give lengths within them, or change the bounds of the film")
    # Place three Gauss nodes in each bin.
    nodes, weights = np.polynomial.legendre.leggauss(3)
    places = (edges[1:] + edges[:-1])[:, None] / 2 + width / 2 * nodes
    gate = np.reshape([np.abs(source.degree(length - places)) ** 2 @ weights / 2 for length in reference], (len(reference), len(places)))
    mean, variance = _by_length(film, bins)
    error = np.sqrt(np.tensordot(gate**2, np.nan_to_num(variance, posinf=0.0), 1))
    error[:, ~np.isfinite(variance).all(axis=0)] = np.inf
    return AScan(reference, np.tensordot(gate, mean, 1), error)


def _by_length(film: Union[Result, Image], bins: Bins) -> Tuple[Doubles, Doubles]:
    """Returns means and their variances by bin and pixel, (bins, height, width, channels)."""
    mean, variance = np.stack([np.sum([mean_and_variance(film.layers, name) for name in names], axis=0) for names in bins.layers], axis=1)
    return mean, variance


def interferogram(lengths: ArrayLike, ways: ArrayLike, power: ArrayLike, source: Source, *, reference: float = 1.0) -> Doubles:
    """Intensity of light of given optical lengths with its reference: fringes in their envelopes.

    All light is coherent in phase: I = P + Σᵢⱼ √(pᵢ pⱼ) Re γ(ℓᵢ − ℓⱼ) + 2 √P Σᵢ √pᵢ Re γ(L − ℓᵢ).
    Half-wave phase shifts of mirrors are not included.

    Parameters
    ----------
    lengths : array_like
        Optical lengths L of the reference, (n,).
    ways : array_like
        Optical lengths ℓ of the light, (m,).
    power : array_like
        Powers p of the light of these lengths, (m,) or one number, ≥ 0.
    source : Source
        The light source.
    reference : float
        Power P of the reference, ≥ 0.

    Returns
    -------
    array
        Intensity, (n,), in the unit of the powers.

    Raises
    ------
    ValueError
        Lengths that are not finite, or a negative power.

    Examples
    --------
    >>> fringes = coherence.interferogram(np.linspace(5, 5.2, 4000), [5.14], 0.04, coherence.gaussian(1.3e-3, 0.1e-3))
    """
    arm, ell = _row(lengths), _row(ways)
    _check(source)
    p = numbers(power, "power")
    if p.shape not in [(), ell.shape]:
        raise ValueError(f"power must be one number, or one for each of {len(ell)} paths")
    p = np.broadcast_to(p, ell.shape)
    arm_power = positive(reference, "reference")
    if not np.all(np.isfinite(p) & (p >= 0)):
        raise ValueError("powers must be finite and not negative")
    amplitude = np.sqrt(p)
    among = amplitude @ _fields(ell, ell, amplitude, source)
    return np.asarray(arm_power + among + 2 * np.sqrt(arm_power) * _fields(arm, ell, amplitude, source))


def _fields(lengths: Doubles, ways: Doubles, amplitude: Doubles, source: Source) -> Doubles:
    """Returns Σⱼ aⱼ Re γ(L − ℓⱼ) for each length L, computed in blocks of lengths."""
    found, step = np.zeros(len(lengths)), max(1, BLOCK // max(len(ways), 1))
    for start in range(0, len(lengths), step):
        part = slice(start, start + step)
        found[part] = source.degree(lengths[part, None] - ways).real @ amplitude
    return found


def _bessel(x: Doubles) -> Doubles:
    """Returns the spherical Bessel function j₁."""
    small = np.abs(x) < 1e-2
    safe = np.where(small, 1.0, x)
    return np.asarray(np.where(small, x / 3 - x**3 / 30, (np.sin(safe) / safe - np.cos(safe)) / safe))


def _check(source: Any) -> None:
    """Raises an error if ``source`` is not a :class:`Source`."""
    if not isinstance(source, Source):
        raise TypeError(f"source must be a Source, found {type(source).__name__}: make one by coherence.gaussian or coherence.tabulated")


def _half(source: Source, scale: float) -> float:
    """Returns the difference at which the envelope first falls to one half. It always does, because
    the spectrum is not a line."""
    while True:
        grid = np.linspace(0, 16 * scale, 8193)
        envelope = np.abs(source.degree(grid))
        below = int(np.argmax(envelope < 0.5))
        if below > 0:
            a, b = envelope[below - 1], envelope[below]
            return float(grid[below - 1] + (a - 0.5) / (a - b) * (grid[1] - grid[0]))
        scale *= 16


def _row(values: ArrayLike) -> Doubles:
    row = np.atleast_1d(numbers(values, "lengths"))
    if row.ndim != 1 or not np.all(np.isfinite(row)):
        raise ValueError("lengths must be finite numbers in one row")
    return row
