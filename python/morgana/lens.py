"""Lenses from tables of surfaces: rays by field and pupil, paraxial data, wavefronts and
modulation.

    >>> import morgana
    >>> front = morgana.lens.Surface(radius=50.0, thickness=5.0, material="N-BK7", stop=True)
    >>> back = morgana.lens.Surface(radius=-50.0, thickness=47.0)
    >>> singlet = morgana.lens.Prescription([front, back], entrance_pupil=10.0, fields=[0.0, 5.0])
    >>> morgana.lens.paraxial(singlet).focal_length
    >>> morgana.lens.trace(singlet, field=5.0).rms_radius

A :class:`Prescription` makes a :class:`morgana.grad.System`, which traces its rays and has
derivatives by all its parameters. See docs/guides/grin-design.md.
"""

from __future__ import annotations

from ._glass import Glass, glass
from ._image_errors import distortion, focus_shift
from ._materials import Dispersion, catalog_glass, read_glass
from ._prescription import Prescription, Surface
from ._pupil import Bundle, Paraxial, paraxial, pupil_points, trace
from ._tolerance import Tolerance, Tolerances, tolerances
from ._wavefront import Mtf, Psf, Wavefront, mtf, noll, psf, wavefront, zernike
from ._zmx import read_zmx

__all__ = [
    "Bundle",
    "Dispersion",
    "Glass",
    "Mtf",
    "Paraxial",
    "Prescription",
    "Psf",
    "Surface",
    "Tolerance",
    "Tolerances",
    "Wavefront",
    "catalog_glass",
    "distortion",
    "focus_shift",
    "glass",
    "mtf",
    "noll",
    "paraxial",
    "psf",
    "pupil_points",
    "read_glass",
    "read_zmx",
    "tolerances",
    "trace",
    "wavefront",
    "zernike",
]
