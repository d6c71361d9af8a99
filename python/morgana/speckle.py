"""Speckle patterns: coherent sums of recorded laser light.

A lens images the surface through which light leaves a sample. Light from different paths interferes
there: :func:`pattern` sums the paths in :class:`morgana.Records` with the phases of their optical
lengths. For moving speckle, see :mod:`morgana.correlation`.

Theory: docs/theory.md#speckle-patterns.

    >>> seen = speckle.pattern(records, (64, 64), 1e-3, wavelength=633e-6, numerical_aperture=0.1)
    >>> plt.imshow(seen.intensity, origin="lower")
"""

from __future__ import annotations

import operator
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._numbers import vectors
from ._records import Records
from ._sums import positive, recorded
from ._values import comparable

__all__ = ["Pattern", "pattern"]

Doubles = NDArray[np.float64]
Complexes = NDArray[np.complex128]
AT_ONCE = 4096
"""Number of records whose waves are summed in one matrix product."""
FOCUS = 0.05
"""Height above the plane, in units of λ/NA², up to which light is in focus: it changes phases of
marginal rays by less than a sixth of a radian."""


@comparable
class Pattern(NamedTuple):
    """Speckle pattern.

    A pattern is one sample of a random intensity: it has statistics, but no errors."""

    intensity: Doubles
    """Power per area of the surface, (rows, columns), at the centres of pixels. The sum over
    pixels, times their area, is about ``power``."""
    x: Doubles
    """Positions of the columns, along ``right`` from the centre, ascending."""
    y: Doubles
    """Positions of the rows, along ``up`` from the centre, ascending."""
    power: float
    """Power of the summed paths: those that pass within the pattern, in directions that the lens
    accepts."""
    paths_per_speckle: float
    """Effective number of paths per coherence area, λ²/(π NA²). A finite number of paths changes
    the contrast by a fraction of about 1/(2 ``paths_per_speckle``)."""

    @property
    def contrast(self) -> float:
        """Standard deviation of the intensity over its mean.

        It is 1 for random phases and uniform illumination."""
        return float(self.intensity.std() / self.intensity.mean())

    def __repr__(self) -> str:
        rows, columns = self.intensity.shape
        return f"<morgana.speckle.Pattern of {rows} × {columns}, contrast {self.contrast:.3g}, {self.paths_per_speckle:.3g} paths per speckle>"


def pattern(
    records: Records,
    shape: Tuple[int, int],
    pixel: float,
    *,
    wavelength: float,
    numerical_aperture: float,
    center: ArrayLike = (0, 0, 0),
    right: ArrayLike = (1, 0, 0),
    up: ArrayLike = (0, 1, 0),
    index: float = 1.0,
    channel: int = 0,
) -> Pattern:
    """Speckle pattern that a lens images from a surface.

    Each path is a coherent source at its position on the surface. Its amplitude is the root of its
    weight, and its phase is 2π/λ times its optical length. The lens limits the spatial frequencies
    of the field to NA/λ. The pattern is periodic: light that the lens spreads beyond an edge
    reappears at the opposite edge. Light has one polarisation.

    Parameters
    ----------
    records : Records
        Records of light through a plane surface. Their ``optical_length`` must be accurate to a
        fraction of the wavelength: check the tolerance of rays where the index varies.
    shape : (int, int)
        Numbers of rows and columns.
    pixel : float
        Width of a pixel on the surface in scene units, at most λ/(4 NA), so that pixels resolve
        speckles.
    wavelength : float
        Wavelength λ in vacuum, > 0, in scene units.
    numerical_aperture : float
        Numerical aperture NA of the lens, > 0 and ≤ ``index``: it accepts directions at angles ϑ to
        the normal with ``index`` · sin ϑ ≤ NA.
    center : array_like
        Centre of the pattern, in the plane.
    right, up : array_like
        Directions of rows and columns in the plane, at right angles. The lens is on the side to
        which right × up points.
    index : float
        Index of the medium beyond the surface.
    channel : int
        Channel of the weights.

    Returns
    -------
    Pattern
        Intensity, and the number of paths that contribute.

    Raises
    ------
    ValueError
        A number out of range. Axes that are not at right angles. No light that the lens accepts.
        Light that does not pass in the plane through ``center``.

    Examples
    --------
    >>> speckle.pattern(records, (64, 64), 1e-3, wavelength=633e-6, numerical_aperture=0.1).contrast
    """
    recorded(records)
    shape = _shape(shape)
    numbers = {"numerical_aperture": numerical_aperture, "wavelength": wavelength, "pixel": pixel, "index": index}
    for name, value in numbers.items():
        positive(value, name, least=np.nextafter(0, 1))
    if numerical_aperture > index:
        raise ValueError(f"the numerical aperture must be at most the index, {index}, not {numerical_aperture}")
    if pixel > wavelength / (4 * numerical_aperture):
        raise ValueError(f"pixel must be at most λ/(4 NA), which is {wavelength / (4 * numerical_aperture):.6g}, not {pixel}")
    if checks.whole(channel, "channel", 0) >= records.weight.shape[1]:
        raise ValueError(f"channel is {channel} but must be below {records.weight.shape[1]}, the number of channels")
    axes = _axes(right, up)
    origin = vectors(center, "center")
    if origin.shape != (3,) or not np.all(np.isfinite(origin)):
        raise ValueError(f"center must be a point of three finite numbers, not {center!r}")
    x, y, off_plane = ((records.position - origin) @ axes.T).T
    toward = records.direction @ axes[2]
    height, width = pixel * shape[0], pixel * shape[1]
    accepted = (toward > 0) & (index**2 * (1 - toward**2) <= numerical_aperture**2) & (np.abs(x) <= width / 2) & (np.abs(y) <= height / 2)
    weight = records.weight[accepted, channel]
    if not weight.sum() > 0:
        raise ValueError(f"none of {len(records.particle)} records passes the pattern in a direction that the lens accepts: check center, shape and numerical_aperture")
    _check_plane(off_plane[accepted][weight > 0], FOCUS * wavelength / numerical_aperture**2)
    amplitude = np.sqrt(weight) * np.exp(2j * np.pi / wavelength * records.optical_length[accepted])
    field = _imaged(amplitude, x[accepted], y[accepted], shape, pixel, numerical_aperture / wavelength)
    coherent = wavelength**2 / (np.pi * numerical_aperture**2)
    effective = weight.sum() ** 2 / (weight**2).sum()
    return Pattern(np.abs(field) ** 2, _centers(shape[1], pixel), _centers(shape[0], pixel), float(weight.sum()), float(effective * coherent / (width * height)))


def _shape(shape: Any) -> Tuple[int, int]:
    """Returns the numbers of rows and columns."""
    try:
        rows, columns = (operator.index(count) for count in shape)
    except (TypeError, ValueError):
        raise ValueError(f"shape must be two whole numbers, rows and columns, not {shape!r}") from None
    if min(rows, columns) < 1:
        raise ValueError(f"shape must have at least one row and one column, not {shape}")
    return rows, columns


def _check_plane(height: Doubles, most: float) -> None:
    """Raises an error if light passes outside the plane of the pattern."""
    if np.ptp(height) > 2 * most:
        raise ValueError(
            f"records must be of light through a plane, but those within the pattern pass at heights from {height.min():.6g} to {height.max():.6g} "
            "above the center, along right × up: take a flat meter, or choose its records"
        )
    if np.abs(height).max() > most:
        raise ValueError(f"center must be in the plane of the records, but is {abs(height[0]):.6g} away from it, along right × up")


def _axes(right: ArrayLike, up: ArrayLike) -> Doubles:
    """Returns unit vectors along rows and columns, and towards the lens."""
    a, b = vectors(right, "right"), vectors(up, "up")
    if a.shape != (3,) or b.shape != (3,) or not (np.linalg.norm(a) > 0 and np.linalg.norm(b) > 0):
        raise ValueError("right and up must be vectors of three numbers, not zero")
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    if not abs(a @ b) < 1e-6:
        raise ValueError(f"right and up must be at right angles, but their cosine is {a @ b:.3g}")
    return np.array([a, b, np.cross(a, b)])


def _centers(count: int, pixel: float) -> Doubles:
    return np.asarray(pixel * (np.arange(count) - (count - 1) / 2), np.float64)


def _imaged(amplitude: Complexes, x: Doubles, y: Doubles, shape: Tuple[int, int], pixel: float, cutoff: float) -> Complexes:
    """Returns the field of point sources at the centres of pixels, (rows, columns), for spatial
    frequencies up to `cutoff`.

    The integral of |field|² is 1 for one source of amplitude 1."""
    rows, columns = (np.fft.fftfreq(count, pixel) for count in shape)
    row, column = (np.flatnonzero(np.abs(frequencies) <= cutoff) for frequencies in (rows, columns))
    in_pupil = np.hypot(rows[row, None], columns[column]) <= cutoff
    passed = np.zeros(in_pupil.shape, complex)
    for first in range(0, len(amplitude), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        # Measure positions from the centre of the first pixel, where the discrete transform begins.
        along = np.exp(-2j * np.pi * np.outer(columns[column], x[part] - _centers(shape[1], pixel)[0]))
        across = np.exp(-2j * np.pi * np.outer(rows[row], y[part] - _centers(shape[0], pixel)[0]))
        passed += (across * amplitude[part]) @ along.T
    spectrum = np.zeros(shape, complex)
    spectrum[np.ix_(row, column)] = np.where(in_pupil, passed, 0)
    area = pixel**2 * shape[0] * shape[1]
    scale = shape[0] * shape[1] / np.sqrt(area * np.count_nonzero(in_pupil))
    return np.asarray(scale * np.fft.ifft2(spectrum))
