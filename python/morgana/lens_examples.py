"""Lenses with published data: graded balls, a graded plate, and an eye.

    >>> eye = morgana.lens_examples.liou_brennan()
    >>> 1336 / morgana.lens.paraxial(eye).focal_length
    >>> morgana.lens.trace(morgana.lens_examples.luneburg(radius=10.0)).rms_radius

Each function returns a :class:`morgana.lens.Prescription`. Change it with ``_replace``.
"""

from __future__ import annotations

import math
from typing import Any, Mapping

from . import _checks as checks
from ._prescription import Prescription, Surface
from ._system import GradError

__all__ = ["half_fisheye", "liou_brennan", "luneburg", "maxwell_fisheye", "wood"]

EYE_WAVELENGTH = 555.0
"""Wavelength of the indices of :func:`liou_brennan`, in nanometres."""

GAP = 1e-6
"""Distance from a ball to the image on its surface, relative to the radius. Rays cannot meet the
surface and the image plane in one point."""


def luneburg(radius: float = 1.0) -> Prescription:
    """Luneburg lens: a ball in air that focuses parallel light on its surface.

    The index is n² = 2 − r²/R². The focal length is R, and the focus lies on the far side of the
    ball. R. K. Luneburg, Mathematical Theory of Optics, Brown University, Providence (1944), §29.

    Parameters
    ----------
    radius : float, optional
        Radius R of the ball, in scene units, > 0.

    Returns
    -------
    morgana.lens.Prescription
        The lens, with an entrance pupil of R and the image on the far side of the ball.

    Raises
    ------
    RenderError
        A radius that is not positive.

    Examples
    --------
    >>> morgana.lens.paraxial(morgana.lens_examples.luneburg(5.0)).focal_length
    """
    r = checks.positive(radius, "radius")
    return _ball({"type": "luneburg", "center": [0.0, 0.0, r], "radius": r}, r, "Luneburg lens")


def maxwell_fisheye(radius: float = 1.0) -> Prescription:
    """Maxwell's fisheye: a ball in air that images each point of its surface on the opposite point.

    The index is n = 2/(1 + r²/R²). Rays are arcs of circles. A ray of the height h along the axis
    leaves the ball at the height −h, with the angle −2 arcsin(h/R) to the axis: the focal length is
    R/2, and the back focal length −R/2. J. C. Maxwell, Solutions of problems, Cambridge and Dublin
    Mathematical Journal 8, 188–195 (1854).

    Parameters
    ----------
    radius : float, optional
        Radius R of the ball, in scene units, > 0.

    Returns
    -------
    morgana.lens.Prescription
        The lens, with an entrance pupil of R and the image on the far side of the ball.

    Raises
    ------
    RenderError
        A radius that is not positive.

    Examples
    --------
    >>> morgana.lens.paraxial(morgana.lens_examples.maxwell_fisheye(5.0)).focal_length
    """
    r = checks.positive(radius, "radius")
    return _ball({"type": "fisheye", "n0": 2.0, "center": [0.0, 0.0, r], "radius": r}, r, "Maxwell's fisheye")


def half_fisheye(radius: float = 1.0) -> Prescription:
    """Half of Maxwell's fisheye: a hemisphere that focuses parallel light on its pole.

    Light enters by the flat face. The index is n = 2/(1 + r²/R²) around the centre of this face.
    Rays are arcs of circles through the pole. The focal length is R/2.

    Parameters
    ----------
    radius : float, optional
        Radius R of the hemisphere, in scene units, > 0.

    Returns
    -------
    morgana.lens.Prescription
        The lens, with an entrance pupil of R and the image at the pole.

    Raises
    ------
    RenderError
        A radius that is not positive.

    Examples
    --------
    >>> morgana.lens.paraxial(morgana.lens_examples.half_fisheye(5.0)).focal_length
    """
    r = checks.positive(radius, "radius")
    rows = [Surface(thickness=r, material={"type": "fisheye", "n0": 2.0, "radius": r}), Surface(-r, GAP * r)]
    return Prescription(rows, entrance_pupil=r, name="half fisheye")


def wood(n0: float = 1.6, alpha: float = 0.2, thickness: float = 1.0) -> Prescription:
    """Wood lens: a plate with flat faces and an index that falls from the axis.

    The index is n² = n₀²(1 − α²r²). The focal length is 1/(n₀α sin(αd)) for the thickness d; thin
    plates have 1/(n₀α²d). R. W. Wood, Physical Optics, Macmillan, New York (1905), made such plates
    of gelatine.

    Parameters
    ----------
    n0 : float, optional
        Index on the axis, > 1.
    alpha : float, optional
        Strength α of the gradient, per scene unit, > 0.
    thickness : float, optional
        Thickness d of the plate, in scene units, below π/(2α): rays do not cross the axis inside.

    Returns
    -------
    morgana.lens.Prescription
        The lens, with an entrance pupil of 0.2/α and the image at the paraxial focus.

    Raises
    ------
    RenderError
        Numbers that are not positive.
    GradError
        An index of 1 or less, or a plate that is too thick.

    Examples
    --------
    >>> morgana.lens.paraxial(morgana.lens_examples.wood(1.6, 0.2, 1.0)).focal_length
    """
    n, strength, depth = checks.positive(n0, "n0"), checks.positive(alpha, "alpha"), checks.positive(thickness, "thickness")
    if n <= 1:
        raise GradError(f"n0 is {n0} but must be above 1")
    if strength * depth >= math.pi / 2:
        raise GradError(f"thickness is {thickness} but must be below π/(2 alpha) = {math.pi / (2 * strength):g}")
    back = 1 / (n * strength * math.tan(strength * depth))
    graded = {"type": "selfoc", "n0": n, "alpha": strength, "direction": [0, 0, 1]}
    return Prescription([Surface(thickness=depth, material=graded), Surface(thickness=back)], entrance_pupil=0.2 / strength, name="Wood lens")


def liou_brennan(entrance_pupil: float = 4.0) -> Prescription:
    """Schematic eye of Liou and Brennan, in millimetres, with a graded crystalline lens of two parts.

    The paper states a power of 60.35 dioptres and an axial length of 23.95 mm, at 555 nm. The last
    medium is the vitreous body, so that the power is 1336 divided by the focal length. The pupil is
    centred, and the visual axis is the optical axis; the paper shifts the pupil by 0.5 mm and
    inclines the visual axis by 5 degrees. H.-L. Liou and N. A. Brennan, Anatomically accurate,
    finite model eye for optical modeling, J. Opt. Soc. Am. A 14, 1684–1695 (1997).

    Parameters
    ----------
    entrance_pupil : float, optional
        Diameter of the entrance pupil, in millimetres, > 0.

    Returns
    -------
    morgana.lens.Prescription
        The eye, with fields at 0 and 5 degrees.

    Raises
    ------
    RenderError
        A diameter that is not positive.

    Examples
    --------
    >>> morgana.lens.wavefront(morgana.lens_examples.liou_brennan(), field=5.0).rms
    """
    front = {"type": "expression", "n": "1.368 + 0.049057*z - 0.015427*z^2 - 0.001978*(x^2 + y^2)"}
    back = {"type": "expression", "n": "1.407 - 0.006605*z^2 - 0.001978*(x^2 + y^2)"}
    rows = [
        Surface(7.77, 0.50, 1.376, conic=-0.18),
        Surface(6.40, 3.16, 1.336, conic=-0.60),
        Surface(12.40, 1.59, front, conic=-0.94, stop=True),
        Surface(thickness=2.43, material=back),
        Surface(-8.10, 16.27, 1.336, conic=0.96),
    ]
    diameter = checks.positive(entrance_pupil, "entrance_pupil")
    return Prescription(rows, entrance_pupil=diameter, fields=[0.0, 5.0], wavelengths=[EYE_WAVELENGTH], name="Liou–Brennan eye")


def _ball(index: Mapping[str, Any], radius: float, name: str) -> Prescription:
    """Returns a ball whose first vertex is the origin, with the image on its far side."""
    rows = [Surface(radius, 2 * radius, index), Surface(-radius, GAP * radius)]
    return Prescription(rows, entrance_pupil=radius, name=name)
