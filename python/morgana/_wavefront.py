"""Wavefronts in the exit pupil of a lens, and their diffraction: see
:func:`morgana.lens.wavefront`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._numbers import numbers
from ._prescription import Prescription
from ._pupil import Bundle, data_of, optics, trace
from ._system import GradError
from ._values import comparable

Doubles = NDArray[np.float64]

MAX_RADIUS = 1e5
"""Largest radius of a reference sphere, in focal lengths. A telecentric exit pupil has this radius:
rounding then adds about 1e-6 waves for a focal length of 100 mm."""

MAX_NOLL = 400
"""Largest number of Zernike polynomials: the sums of factorials lose digits above."""


SUBDIVISION = 8
"""Parts of a cell along each axis by which the rim of the pupil divides it: the area of the pupil is
right to 1e-4 for 64 cells."""


@comparable
class Wavefront(NamedTuple):
    """Wavefront of a field point in the exit pupil.

    Its reference sphere has its centre where the chief ray meets the image plane, and passes
    through the chief ray in the plane of the paraxial exit pupil. Row i of each array belongs to
    ray i. Rays without an end are NaN."""

    pupil: Doubles
    """Aims (x, y) in the stop, (rays, 2), relative to its radius."""
    waves: Doubles
    """Optical length of the chief ray to the reference sphere minus the optical length of each ray,
    (rays,), in wavelengths: > 0 where light arrives early."""
    cosines: Doubles
    """Direction cosines (x, y) of light from each point of the reference sphere to or from its
    centre, (rays, 2)."""
    wavelength: float
    """Wavelength in nanometres, in vacuum."""
    n_image: float
    """Index in image space."""
    metres_per_unit: float
    """Length of the scene unit in metres."""
    bundle: Bundle
    """Rays of the wavefront."""

    @property
    def rms(self) -> float:
        """Standard deviation of ``waves`` over the stop, in wavelengths. It contains tilt and defocus
        against the reference sphere."""
        known = np.isfinite(self.waves)
        if not known.any():
            return math.nan
        waves, weights = self.waves[known], self.bundle.weights[known]
        return float(np.sqrt(np.average((waves - np.average(waves, weights=weights)) ** 2, weights=weights)))

    @property
    def peak_to_valley(self) -> float:
        """Difference of the largest and the smallest of ``waves``."""
        return float(np.nanmax(self.waves) - np.nanmin(self.waves))

    def zernikes(self, count: int = 37) -> Doubles:
        """Zernike coefficients in Noll's convention, by least squares over the stop.

        Parameters
        ----------
        count : int, optional
            Number of polynomials, 1 to 400.

        Returns
        -------
        numpy.ndarray
            Coefficients of :func:`zernike` 1 to ``count``, (count,), in wavelengths. The root of
            the sum of the squares of all but the first is the RMS wavefront over a uniform pupil.

        Raises
        ------
        GradError
            Fewer rays with an end than polynomials.

        Examples
        --------
        >>> wave = morgana.lens.wavefront(triplet, field=14.0)
        >>> wave.zernikes(11)[10]
        """
        checks.whole(count, "count", 1, MAX_NOLL)
        known = np.isfinite(self.waves)
        if known.sum() < count:
            raise GradError(f"{known.sum()} rays have an end, too few for {count} Zernike polynomials: trace more rays, or fit fewer")
        basis = np.column_stack([zernike(j, self.pupil[known]) for j in range(1, count + 1)])
        weight = np.sqrt(self.bundle.weights[known])
        return np.asarray(np.linalg.lstsq(basis * weight[:, None], self.waves[known] * weight, rcond=None)[0])

    def __repr__(self) -> str:
        return f"<morgana.lens.Wavefront: {len(self.waves)} rays, {self.wavelength:g} nm, RMS {self.rms:.6g} waves>"


@comparable
class Psf(NamedTuple):
    """Point spread function in the image plane, around the chief ray."""

    values: Doubles
    """Irradiance [y, x] relative to the peak without aberrations: the largest value is the Strehl
    ratio."""
    spacing: float
    """Distance of neighbouring values, in scene units."""
    wavelength: float
    """Wavelength in nanometres."""

    @property
    def coordinates(self) -> Doubles:
        """Positions of the values along x and y, (size,), in scene units; 0 is the chief ray."""
        size = len(self.values)
        return np.asarray((np.arange(size) - size // 2) * self.spacing)

    @property
    def strehl(self) -> float:
        """Largest value."""
        return float(self.values.max())

    def __repr__(self) -> str:
        return f"<morgana.lens.Psf: {len(self.values)} × {len(self.values)}, spacing {self.spacing:.6g}, Strehl ratio {self.strehl:.4g}>"


@comparable
class Mtf(NamedTuple):
    """Modulation transfer function of a field point."""

    frequencies: Doubles
    """Spatial frequencies in the image plane, (frequencies,), in cycles per scene unit."""
    x: Doubles
    """Modulation of stripes that vary along x, (frequencies,)."""
    y: Doubles
    """Modulation of stripes that vary along y, (frequencies,). For fields along y, x is sagittal
    and y tangential."""
    cutoff: float
    """Frequency 2 NA/λ above which a lens with a round pupil transfers nothing; infinite without
    diffraction."""

    def __repr__(self) -> str:
        return f"<morgana.lens.Mtf: {len(self.frequencies)} frequencies up to {self.frequencies.max():.6g}, cutoff {self.cutoff:.6g}>"


def noll(j: int) -> Tuple[int, int]:
    """Radial order n and azimuthal order m of a Zernike polynomial in Noll's convention.

    Parameters
    ----------
    j : int
        Number of the polynomial, 1 to 400.

    Returns
    -------
    two of int
        (n, m); m < 0 for sines.

    Raises
    ------
    RenderError
        A number outside its range.

    Examples
    --------
    >>> morgana.lens.noll(11)
    (4, 0)
    """
    checks.whole(j, "j", 1, MAX_NOLL)
    n = int((math.sqrt(8 * j - 7) - 1) // 2)
    rest = j - n * (n + 1) // 2 - 1
    m = 2 * ((rest + 1) // 2) if n % 2 == 0 else 2 * (rest // 2) + 1
    return n, m if m == 0 or j % 2 == 0 else -m


def zernike(j: int, points: ArrayLike) -> Doubles:
    """Zernike polynomial in Noll's convention (J. Opt. Soc. Am. 66, 207 (1976)).

    The polynomials are orthonormal: the mean of the square over the unit disc is 1. Angles count
    from x towards y.

    Parameters
    ----------
    j : int
        Number of the polynomial, 1 to 400: 1 is constant, 2 and 3 are tilts along x and y, 4 is
        defocus, 11 is spherical aberration.
    points : array_like, (..., 2)
        Points (x, y) of the unit disc.

    Returns
    -------
    numpy.ndarray
        Values, (...).

    Raises
    ------
    RenderError
        A number outside its range.

    Examples
    --------
    >>> morgana.lens.zernike(4, [0.0, 1.0])
    array(1.73205081)
    """
    n, signed = noll(j)
    m = abs(signed)
    xy = numbers(points, "points")
    r, angle = np.hypot(xy[..., 0], xy[..., 1]), np.arctan2(xy[..., 1], xy[..., 0])
    radial = np.zeros_like(r)
    for k in range((n - m) // 2 + 1):
        factor = math.comb(n - k, k) * math.comb(n - 2 * k, (n - m) // 2 - k)
        radial = radial + (-1) ** k * factor * r ** (n - 2 * k)
    if m == 0:
        return np.asarray(math.sqrt(n + 1) * radial)
    return np.asarray(math.sqrt(2 * n + 2) * radial * (np.cos(m * angle) if signed > 0 else np.sin(m * angle)))


def wavefront(
    prescription: Prescription,
    field: Any = 0.0,
    wavelength: Optional[float] = None,
    *,
    pupil: Any = "hexapolar",
    count: int = 10,
    seed: int = 0,
    defocus: float = 0.0,
) -> Wavefront:
    """Wavefront of a field point against the reference sphere of the exit pupil.

    Parameters
    ----------
    prescription : Prescription
        The lens. Image space must be homogeneous.
    field, wavelength, pupil, count, seed, defocus
        As for :func:`trace`.

    Returns
    -------
    Wavefront
        Path differences in waves.

    Raises
    ------
    GradError
        As for :func:`trace`, or a field as the medium of image space.

    Examples
    --------
    >>> morgana.lens.wavefront(triplet, field=14.0).rms
    """
    bundle = trace(prescription, field, wavelength, pupil=pupil, count=count, seed=seed, defocus=defocus)
    if not isinstance(prescription.system(bundle.wavelength).media[-1], (int, float)):
        raise GradError("image space is a field, but a wavefront needs a homogeneous medium behind the last surface")
    lens = optics(prescription, bundle.wavelength)
    n, data = lens.n_image, data_of(prescription, lens)
    center, way = bundle.chief.positions[0], bundle.chief.directions[0]
    largest = MAX_RADIUS * (abs(data.focal_length) if math.isfinite(data.focal_length) else 1.0)
    # Distance along the chief ray from the exit pupil to the image point, < 0 for a pupil behind the image.
    distance = (center[2] - data.exit_pupil) / way[2]
    distance = math.copysign(min(abs(distance), largest), distance) if math.isfinite(distance) else largest
    if distance == 0:
        raise GradError("the exit pupil lies in the image plane: there is no reference sphere")
    offset = bundle.ends.positions - center
    along = np.einsum("ri,ri->r", offset, bundle.ends.directions)
    # |offset + s d|² = distance², on the side of the pupil.
    root = np.sqrt(distance**2 - (np.einsum("ri,ri->r", offset, offset) - along**2))
    # Subtract before adding large numbers: s + distance, the path from the sphere of the chief ray.
    s = -along - math.copysign(1.0, distance) * root
    path = bundle.optical_lengths + n * (s + distance)
    metres = prescription.metres_per_unit
    sphere = offset + s[:, None] * bundle.ends.directions
    cosines = -sphere[:, :2] / distance
    return Wavefront(bundle.pupil, -path * metres / (bundle.wavelength * 1e-9), cosines, bundle.wavelength, n, metres, bundle)


def psf(
    prescription: Prescription,
    field: Any = 0.0,
    wavelength: Optional[float] = None,
    *,
    count: int = 64,
    padding: int = 4,
    defocus: float = 0.0,
) -> Psf:
    """Point spread function, by a Fourier transform of the pupil.

    Light fills the stop uniformly. The grid is uniform in direction cosines of image space, which
    depend linearly on points of the stop to first order; scalar diffraction.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    field, wavelength
        As for :func:`trace`.
    count : int, optional
        Number of rays across the pupil, 8 to 1024. Neighbouring rays must differ by less than half
        a wave.
    padding : int, optional
        Size of the transform in units of ``count``, 2 to 16: values per Airy radius grow with it.
    defocus : float, optional
        As for :func:`trace`.

    Returns
    -------
    Psf
        Values on (count · padding)² points.

    Raises
    ------
    GradError
        As for :func:`wavefront`.

    Examples
    --------
    >>> morgana.lens.psf(triplet, field=14.0).strehl
    """
    checks.whole(padding, "padding", 2, 16)
    pupil, step = _pupil(prescription, field, wavelength, count, defocus)
    at = prescription.wavelength(wavelength)
    size = count * padding
    padded = np.zeros((size, size), complex)
    padded[:count, :count] = pupil
    # A point of the pupil with the direction cosines p adds the phase k n p·x at x. The offset of the grid changes phases only.
    amplitude = np.fft.fftshift(np.fft.ifft2(padded)) * size**2
    n = optics(prescription, at).n_image
    spacing = at * 1e-9 / prescription.metres_per_unit / (n * step * size)
    return Psf(np.abs(amplitude) ** 2 / np.abs(pupil).sum() ** 2, float(spacing), at)


def mtf(
    prescription: Prescription,
    field: Any = 0.0,
    wavelength: Optional[float] = None,
    *,
    frequencies: Optional[ArrayLike] = None,
    diffraction: bool = True,
    count: int = 64,
    defocus: float = 0.0,
) -> Mtf:
    """Modulation transfer function of a field point.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    field, wavelength
        As for :func:`trace`.
    frequencies : array_like, (frequencies,), optional
        Spatial frequencies, in cycles per scene unit; by default 65 from 0 to the cutoff.
    diffraction : bool, optional
        ``True`` takes the autocorrelation of the pupil. ``False`` takes the Fourier transform of
        the spot, as for large aberrations.
    count : int, optional
        As for :func:`psf`.
    defocus : float, optional
        As for :func:`trace`.

    Returns
    -------
    Mtf
        Modulations along x and y.

    Raises
    ------
    GradError
        As for :func:`wavefront`, or frequencies that are not finite and ≥ 0.

    Examples
    --------
    >>> morgana.lens.mtf(triplet, field=14.0, frequencies=[10.0, 20.0, 40.0]).y
    """
    at = prescription.wavelength(wavelength)
    wanted = None if frequencies is None else np.atleast_1d(numbers(frequencies, "frequencies"))
    if wanted is not None and not (wanted.ndim == 1 and (np.isfinite(wanted) & (wanted >= 0)).all()):
        raise GradError("frequencies must be a list of finite numbers ≥ 0")
    if diffraction or wanted is None:
        pupil, step = _pupil(prescription, field, at, count, defocus)
        lag = step * optics(prescription, at).n_image * prescription.metres_per_unit / (at * 1e-9)
        cutoff = count * lag
        wanted = np.linspace(0, cutoff, 65) if wanted is None else wanted
    if not diffraction:
        bundle = trace(prescription, field, at, pupil="grid", count=count, defocus=defocus)
        points = bundle.points[np.isfinite(bundle.points).all(1)]
        x, y = (np.abs(np.exp(2j * np.pi * np.outer(wanted, line)).mean(1)) for line in points.T)
        return Mtf(wanted, x, y, math.inf)
    size = 2 * count
    correlation = np.fft.ifft2(np.abs(np.fft.fft2(pupil, (size, size))) ** 2)
    # Squares of the fractions of cells at the rim are too small at lag 0; products are right at lags of a cell and more.
    correlation[0, 0] = np.abs(pupil).sum()
    x, y = (np.abs(_cubic(wanted / lag, line[: count + 1] / correlation[0, 0])) for line in (correlation[0], correlation[:, 0]))
    return Mtf(wanted, x, y, float(cutoff))


def _pupil(prescription: Prescription, field: Any, wavelength: Optional[float], count: int, defocus: float) -> Tuple[NDArray[np.complex128], float]:
    """Returns amplitudes [y, x] on a square grid of direction cosines, and the spacing of the
    grid."""
    checks.whole(count, "count", 8, 1024)
    few = wavefront(prescription, field, wavelength, count=4, defocus=defocus)
    known = np.isfinite(few.waves)
    if known.sum() < 4:
        raise GradError(f"too few rays arrive to find the exit pupil: {few.bundle.failures}")
    basis = np.column_stack([few.pupil[known], np.ones(known.sum())])
    linear = np.linalg.lstsq(basis, few.cosines[known], rcond=None)[0][:2].T
    largest = float(np.linalg.svd(linear, compute_uv=False)[0])
    cell = 2 * largest / count
    line = (np.arange(count) - (count - 1) / 2) * cell
    x, y = np.meshgrid(line, line)
    inverse = np.linalg.inv(linear)
    points = inverse @ np.stack([x.ravel(), y.ravel()])
    inside = np.hypot(*points)
    # Fraction of each cell inside the pupil.
    shift = ((np.arange(SUBDIVISION) + 0.5) / SUBDIVISION - 0.5) * cell
    parts = inverse @ np.stack([part.ravel() for part in np.meshgrid(shift, shift)])
    weight = np.mean([np.hypot(points[0] + x, points[1] + y) <= 1 for x, y in parts.T], axis=0)
    used = weight > 0
    wave = wavefront(prescription, field, wavelength, pupil=(points / np.maximum(inside, 1.0)).T[used], defocus=defocus)
    amplitude = np.zeros(count * count, complex)
    amplitude[used] = weight[used] * np.where(np.isfinite(wave.waves), np.exp(-2j * np.pi * np.nan_to_num(wave.waves)), 0)
    return amplitude.reshape(count, count), float(cell)


def _cubic(at: Doubles, values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Interpolates values at 0, 1, 2, … by cubics through four neighbours; 0 behind the last
    value."""
    first = np.clip(np.floor(at).astype(int) - 1, 0, len(values) - 4)
    t = at - first
    found = np.zeros(len(at), complex)
    for i in range(4):
        others = [k for k in range(4) if k != i]
        found += values[first + i] * np.prod([(t - k) / (i - k) for k in others], axis=0)
    return np.where(at < len(values) - 1, found, 0)
