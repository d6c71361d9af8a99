"""Distortion and chromatic shift of the focus: see :func:`morgana.lens.distortion`."""

from __future__ import annotations

import math
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._numbers import numbers
from ._prescription import Prescription
from ._pupil import optics, paraxial, trace
from ._system import GradError

Doubles = NDArray[np.float64]


def distortion(prescription: Prescription, field: Any, wavelength: Optional[float] = None) -> float:
    """Distortion of a field point: relative error of the image height of the chief ray.

    The reference is the paraxial chief ray in the image plane: f tan θ for a focused object at
    infinity.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    field : float or two of float
        Field point off the axis, as in :attr:`Prescription.fields`.
    wavelength : float, optional
        Wavelength in nanometres; the primary wavelength by default.

    Returns
    -------
    float
        (height − paraxial height)/paraxial height, < 0 for a barrel; along the direction of the
        paraxial image point.

    Raises
    ------
    GradError
        A field point on the axis, or a chief ray that does not arrive.

    Examples
    --------
    >>> morgana.lens.distortion(triplet, 20.0)
    """
    at = prescription.wavelength(wavelength)
    point = np.array(prescription.field_point(field))
    if not point.any():
        raise GradError("a field point on the axis has no distortion: give an angle or a height other than 0")
    lens = optics(prescription, at)
    a, b = lens.to_stop[0]
    if math.isinf(prescription.object_distance):
        slope = np.tan(np.radians(point))
        height = -b / a * slope
    else:
        slope = -a * point / (a * prescription.object_distance + b)
        height = point + slope * prescription.object_distance
    back = float(prescription.surfaces[-1].thickness)
    to_image = np.array([1.0, back]) @ lens.to_end
    expected = to_image[0] * height + to_image[1] * slope
    found = trace(prescription, field, at, pupil=[[0.0, 0.0]]).chief.positions[0, :2]
    return float((found - expected) @ expected / (expected @ expected))


def focus_shift(prescription: Prescription, wavelengths: Optional[ArrayLike] = None) -> Doubles:
    """Chromatic shift of the paraxial image, relative to the primary wavelength.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    wavelengths : array_like, (wavelengths,), optional
        Wavelengths in nanometres; by default those of the prescription.

    Returns
    -------
    numpy.ndarray
        Shifts along the axis, (wavelengths,), in scene units, > 0 if the image lies further from
        the lens.

    Raises
    ------
    GradError
        Materials without an index at a wavelength.

    Examples
    --------
    >>> morgana.lens.focus_shift(triplet, np.linspace(450, 650, 21))
    """
    wanted = np.atleast_1d(numbers(prescription.wavelengths if wavelengths is None else wavelengths, "wavelengths"))
    reference = paraxial(prescription).image
    return np.array([paraxial(prescription, float(one)).image - reference for one in wanted])
