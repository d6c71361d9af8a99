"""Tables of the surfaces of a lens: see :class:`morgana.lens.Prescription`."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Callable, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _checks as checks
from . import _morgana
from ._glass import Glass
from ._materials import Dispersion, known_glass
from ._morgana import Field
from ._scene import load_field
from ._system import Aperture, Conic, GradError, Medium, Plane, System, aspheric_coefficients
from ._system import Surface as SystemSurface
from ._values import Fields

Doubles = NDArray[np.float64]
Material = Union[float, str, Glass, Dispersion, Field, Mapping[str, Any], Callable[[float], float]]
AXIS = (0.0, 0.0, 1.0)

RIM_OFFSET = 1e-9
"""Distance of a rim before a plane surface, relative to its radius."""


class Surface(NamedTuple):
    """Row of a :class:`Prescription`: a conic surface or even asphere, and the medium behind it.

    Examples
    --------
    >>> morgana.lens.Surface(radius=50.0, thickness=4.0, material="N-BK7")
    """

    radius: float = math.inf
    """Radius of curvature at the vertex, in scene units, > 0 if the centre lies behind the vertex;
    infinite for a plane."""
    thickness: float = 0.0
    """Distance along the axis to the next surface, or to the image, in scene units."""
    material: Material = "air"
    """Medium behind the surface: ``"air"`` for 1, an index, the name of a glass of :func:`glass` or
    :func:`catalog_glass`, a :class:`Glass`, a :class:`Dispersion`, or a function from wavelengths in
    nanometres to indices. A dictionary is the index of a medium as for :func:`morgana.load_field`,
    placed with its origin at the vertex of this surface. A :class:`morgana.Field` stays where it is: the first vertex is the origin."""
    conic: float = 0.0
    """Conic constant: 0 for a sphere, −1 for a paraboloid."""
    aperture: Optional[float] = None
    """Radius of the clear opening, in scene units. Rays that pass outside have no end."""
    stop: bool = False
    """True for the aperture stop. One surface of a prescription is the stop; the first if none is
    marked."""
    aspheric: Sequence[float] = ()
    """Coefficients A₁, A₂, … of ρ², ρ⁴, …, up to 8, that an even asphere adds to the conic, of the
    unit 1/length^(2j − 1)."""


class Layout(NamedTuple):
    """Media and surfaces of a prescription, with the position of each row."""

    system: System
    rows: Tuple[Optional[int], ...]
    """Number in ``system.surfaces`` of each row of the prescription; ``None`` for rows between equal
    media, which do not refract."""
    owners: Tuple[int, ...]
    """Row of each surface in ``system.surfaces``, which may be the rim of the row."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Prescription(Fields):
    """Table of the surfaces of a rotationally symmetric lens, with its pupil, fields and
    wavelengths.

    The axis is z. Light travels towards positive z. The vertex of the first surface is the origin.
    The last thickness is the distance to the image plane.

    Examples
    --------
    >>> singlet = morgana.lens.Prescription(
    ...     [morgana.lens.Surface(50.0, 5.0, "N-BK7", stop=True), morgana.lens.Surface(-50.0, 47.0)], entrance_pupil=10.0, fields=[0.0, 5.0]
    ... )
    >>> morgana.lens.paraxial(singlet).focal_length
    """

    surfaces: Sequence[Surface]
    """Surfaces in the order in which light meets them."""
    entrance_pupil: Optional[float] = None
    """Diameter of the entrance pupil, in scene units. Without it and ``f_number``, the
    ``aperture`` of the stop determines the pupil."""
    f_number: Optional[float] = None
    """Focal length divided by the diameter of the entrance pupil, instead of
    ``entrance_pupil``."""
    fields: Sequence[Any] = (0.0,)
    """Field points (x, y), or y alone: angles in degrees for an object at infinity, heights in
    scene units otherwise. The chief ray of an angle has the slopes (tan x, tan y)."""
    wavelengths: Sequence[float] = (587.5618,)
    """Wavelengths in nanometres."""
    primary: int = 0
    """Number of the primary wavelength, from 0."""
    object_distance: float = math.inf
    """Distance from the object to the first surface, in scene units."""
    object_medium: Union[float, str, Glass, Dispersion] = "air"
    """Medium before the first surface, homogeneous."""
    metres_per_unit: float = 1e-3
    """Length of the scene unit in metres."""
    name: str = ""
    """Name of the lens."""

    def __post_init__(self) -> None:
        if not self.surfaces:
            raise GradError("a prescription needs at least one surface")
        for i, surface in enumerate(self.surfaces):
            if not isinstance(surface, Surface):
                raise GradError(f"surfaces[{i}] is {checks.shown(surface)} but must be a morgana.lens.Surface")
            _check(surface, f"surfaces[{i}]")
        marked = [i for i, surface in enumerate(self.surfaces) if surface.stop]
        if len(marked) > 1:
            raise GradError(f"surfaces {', '.join(map(str, marked))} are all marked as the stop: mark one")
        given = [name for name in ("entrance_pupil", "f_number") if getattr(self, name) is not None]
        for name in given:
            checks.positive(getattr(self, name), name)
        if len(given) == 2:
            raise GradError("entrance_pupil and f_number both set the pupil: give one of them")
        if not given and self.surfaces[self.stop].aperture is None:
            raise GradError(f"the pupil has no size: give entrance_pupil, f_number, or the aperture of the stop, surfaces[{self.stop}]")
        if not len(self.wavelengths):
            raise GradError("a prescription needs at least one wavelength")
        for i, wavelength in enumerate(self.wavelengths):
            checks.positive(wavelength, f"wavelengths[{i}]")
        checks.whole(self.primary, "primary", 0, len(self.wavelengths) - 1)
        if not len(self.fields):
            raise GradError("a prescription needs at least one field point")
        for field in self.fields:
            self.field_point(field)
        if not self.object_distance > 0:
            raise GradError(f"object_distance is {self.object_distance} but must be a positive number, or infinite")
        checks.positive(self.metres_per_unit, "metres_per_unit")

    @property
    def stop(self) -> int:
        """Number of the surface that is the aperture stop."""
        return next((i for i, surface in enumerate(self.surfaces) if surface.stop), 0)

    @property
    def vertices(self) -> Doubles:
        """Positions of the vertices along the axis, and of the image, (surfaces + 1,), in scene
        units."""
        return np.concatenate([[0.0], np.cumsum([float(surface.thickness) for surface in self.surfaces])])

    @property
    def image(self) -> Plane:
        """Image plane."""
        return Plane((0.0, 0.0, float(self.vertices[-1])), AXIS)

    def wavelength(self, wavelength: Optional[float] = None) -> float:
        """Returns a wavelength in nanometres: the primary wavelength by default.

        Parameters
        ----------
        wavelength : float, optional
            Wavelength in nanometres, > 0.

        Returns
        -------
        float
            The wavelength.

        Raises
        ------
        RenderError
            A wavelength that is not positive.

        Examples
        --------
        >>> singlet.wavelength()
        587.5618
        """
        return checks.positive(self.wavelengths[self.primary] if wavelength is None else wavelength, "wavelength")

    def field_point(self, field: Any) -> Tuple[float, float]:
        """Returns both coordinates of a field point.

        Parameters
        ----------
        field : float or two of float
            The height or angle y, or (x, y), as in ``fields``.

        Returns
        -------
        two of float
            (x, y).

        Raises
        ------
        GradError
            Numbers that are not finite, or angles of 90 degrees or more.

        Examples
        --------
        >>> singlet.field_point(5.0)
        (0.0, 5.0)
        """
        values = np.atleast_1d(np.asarray(field, dtype=float))
        if values.shape not in ((1,), (2,)) or not np.isfinite(values).all():
            raise GradError(f"field is {checks.shown(field)} but must be y, or (x, y), of finite numbers")
        if math.isinf(self.object_distance) and (np.abs(values) >= 90).any():
            raise GradError(f"field is {checks.shown(field)} but angles must be below 90 degrees")
        x, y = (0.0, float(values[0])) if len(values) == 1 else (float(values[0]), float(values[1]))
        return x, y

    def system(self, wavelength: Optional[float] = None) -> System:
        """Media and surfaces for rays and derivatives.

        Parameters
        ----------
        wavelength : float, optional
            Wavelength in nanometres; the primary wavelength by default.

        Returns
        -------
        morgana.grad.System
            A :class:`morgana.grad.Conic` for each surface between different media, and a :class:`morgana.grad.Aperture` at
            the rim of each surface with an ``aperture``.

        Raises
        ------
        GradError
            Unknown glasses, or materials without an index at the wavelength.

        Examples
        --------
        >>> morgana.grad.parameters(singlet.system())["surfaces[0].curvature"]
        """
        return layout(self, wavelength).system

    def __repr__(self) -> str:
        name = f" {self.name!r:.60}" if self.name else ""
        pupil = f"entrance pupil {self.entrance_pupil:g}" if self.entrance_pupil else f"f/{self.f_number:g}" if self.f_number else "pupil by the stop"
        return f"<morgana.lens.Prescription{name}: {len(self.surfaces)} surfaces, {pupil}, {len(self.fields)} fields, {len(self.wavelengths)} wavelengths>"


def layout(prescription: Prescription, wavelength: Optional[float] = None, count: Optional[int] = None) -> Layout:
    """Returns the media and the first ``count`` surfaces, by default all, with the position of
    each row."""
    at = prescription.wavelength(wavelength)
    media: List[Medium] = [_medium(prescription.object_medium, at, 0.0, "object_medium")]
    if isinstance(media[0], Field):
        raise GradError("object_medium is a field but must be homogeneous: put the field behind a plane surface")
    elements: List[SystemSurface] = []
    rows: List[Optional[int]] = []
    owners: List[int] = []
    for i, (surface, z) in enumerate(zip(prescription.surfaces[:count], prescription.vertices)):
        curvature = 0.0 if math.isinf(surface.radius) else 1 / surface.radius
        medium = _medium(surface.material, at, float(z), f"the material of surfaces[{i}]")
        if surface.aperture is not None:
            rim = float(surface.aperture)
            # A rim in the plane of the vertex stands before it, because rays cannot meet two surfaces in one point.
            depth = sag(surface, rim) or -RIM_OFFSET * rim
            opening = [Aperture((0.0, 0.0, float(z) + depth), AXIS, rim)]
        else:
            depth, opening = 0.0, []
        # The disc of the rim lies behind a surface that bulges towards the light, and before others.
        elements.extend(opening if depth < 0 else [])
        if medium is media[-1] or (isinstance(medium, float) and medium == media[-1]):
            rows.append(None)
        else:
            rows.append(len(elements))
            elements.append(Conic((0.0, 0.0, float(z)), AXIS, curvature, float(surface.conic), tuple(surface.aspheric)))
            media.append(medium)
        elements.extend(opening if depth > 0 else [])
        owners.extend([i] * (len(elements) - len(owners)))
    return Layout(System(media, elements), tuple(rows), tuple(owners))


def sag(surface: Surface, height: float) -> float:
    """Returns the position along the axis, from the vertex, of the surface at a distance from the
    axis."""
    c = 0.0 if math.isinf(surface.radius) else 1 / surface.radius
    square = height * height
    root = 1 - (1 + surface.conic) * c * c * square
    departure = sum(a * square**j for j, a in enumerate(surface.aspheric, 1))
    return c * square / (1 + math.sqrt(root)) + departure if root >= 0 else math.nan


def _check(surface: Surface, what: str) -> None:
    radius = checks.real(surface.radius, f"{what}.radius", "a number, infinite for a plane")
    if abs(radius) < 1e-300 or math.isnan(radius):
        raise GradError(f"{what}.radius is {surface.radius} but must be a number other than 0, infinite for a plane")
    for name in ("thickness", "conic"):
        value = checks.real(getattr(surface, name), f"{what}.{name}", "a finite number")
        if not math.isfinite(value):
            raise GradError(f"{what}.{name} is {value} but must be a finite number")
    aspheric_coefficients(surface.aspheric, f"{what}.aspheric")
    if surface.aperture is not None and math.isnan(sag(surface, checks.positive(surface.aperture, f"{what}.aperture"))):
        raise GradError(f"{what}.aperture is {surface.aperture:g}, but the surface of radius {radius:g} and conic {surface.conic:g} does not reach this far")


def _medium(material: Material, wavelength: float, z: float, what: str) -> Medium:
    """Returns the medium of a material at a wavelength; ``z`` is the position of its surface."""
    if isinstance(material, str):
        if material.strip().lower() in ("", "air", "vacuum"):
            return 1.0
        try:
            return float(known_glass(material).n(wavelength))
        except GradError as error:
            raise GradError(f"{what}: {error}") from None
    if isinstance(material, (Glass, Dispersion)):
        return float(material.n(wavelength))
    if isinstance(material, Field):
        return material
    if isinstance(material, Mapping):
        world = material.get("to_world", [])
        placed = [*(world if isinstance(world, (list, tuple)) else [world]), {"translate": [0.0, 0.0, z]}]
        return load_field({**material, "to_world": placed}, wavelength=wavelength)
    return checks.positive(material(wavelength) if callable(material) else material, what)
