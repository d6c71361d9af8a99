"""Media and surfaces in sequence, and the names of their parameters: see
:class:`morgana.grad.System`."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._errors import Error
from ._morgana import Field
from ._numbers import grid_samples, numbers
from ._values import comparable

Doubles = NDArray[np.float64]
Vector = Tuple[float, float, float]
Element = Tuple[Vector, Vector, Tuple[float, float, float, float], Tuple[float, ...], Optional[float]]
"""Surface for the compiled part: a point, a unit axis, a form (α, β, γ, δ) of α|d|² + βz² + γz + δ
= 0, the coefficients of its departure along the axis, and the radius of an opening."""

DEPARTURES = 8
"""Largest number of coefficients of an asphere."""

ROWS = 10 + DEPARTURES
"""Numbers of a surface in derivatives of the compiled part: point, axis, form, departure."""

QUADRIC = DEPARTURES * (0.0,)
"""Departure of a surface that is no asphere."""


class GradError(Error, ValueError):
    """Rays or derivatives that cannot be computed as requested."""


@comparable
class Plane(NamedTuple):
    """Plane: a surface of a :class:`System`, or the exit of rays.

    Rays may arrive from either side."""

    point: ArrayLike
    """A point of the plane, (3,), in scene units."""
    normal: ArrayLike
    """Normal of the plane, (3,), of any nonzero length."""


@comparable
class Sphere(NamedTuple):
    """Sphere. A ray meets a sphere at the first intersection: on the near side for a ray from
    outside, on the far side for a ray from inside."""

    center: ArrayLike
    """Centre of the sphere, (3,), in scene units."""
    radius: float
    """Radius, in scene units, > 0."""


@comparable
class Cylinder(NamedTuple):
    """Infinite circular cylinder. A ray meets it at the first intersection."""

    point: ArrayLike
    """A point of the axis, (3,), in scene units."""
    axis: ArrayLike
    """Direction of the axis, (3,), of any nonzero length."""
    radius: float
    """Radius, in scene units, > 0."""


@comparable
class Conic(NamedTuple):
    """Conic surface or even asphere of a lens, z = cρ²/(1 + √(1 − (1 + k)c²ρ²)) + A₁ρ² + A₂ρ⁴ + ….

    z is the position along the axis from the vertex, and ρ the distance from the axis."""

    vertex: ArrayLike
    """Intersection of the surface with its axis, (3,), in scene units."""
    axis: ArrayLike
    """Direction of the axis, (3,), of any nonzero length."""
    curvature: float
    """Curvature c, per scene unit: one over the radius, > 0 if the centre lies along the axis; 0
    for a plane."""
    conic: float = 0.0
    """Conic constant k: 0 for a sphere, −1 for a paraboloid."""
    aspheric: ArrayLike = ()
    """Coefficients A₁, A₂, … of ρ², ρ⁴, …, up to 8, of the unit 1/length^(2j − 1). The surface ends at
    the rim of the conic."""


@comparable
class Aperture(NamedTuple):
    """Opening in an opaque plane, within one medium.

    Rays that meet the plane outside the opening have no end. An aperture has no parameters, because
    the set of rays that pass changes discontinuously."""

    center: ArrayLike
    """Centre of the opening, (3,), in scene units."""
    normal: ArrayLike
    """Normal of the plane, (3,), of any nonzero length."""
    radius: float
    """Radius of the opening, in scene units, > 0."""


Surface = Union[Plane, Sphere, Cylinder, Conic, Aperture]
Medium = Union[float, Field, ArrayLike]


@comparable
class System(NamedTuple):
    """Media between surfaces that rays meet in sequence, as in a lens.

    Rays start in the first medium and meet all surfaces in the order of the list. They refract
    there by Snell's law, and end on the ``exit`` behind the last surface. A ball is two equal
    spheres in the list: one for entering rays, one for leaving rays.

    Examples
    --------
    >>> glass = morgana.load_field({"type": "selfoc", "n0": 1.6, "alpha": 0.2})
    >>> front = morgana.grad.Conic(vertex=(0, 0, 0), axis=(0, 0, 1), curvature=0.2)
    >>> back = morgana.grad.Plane(point=(0, 0, 2), normal=(0, 0, 1))
    >>> lens = morgana.grad.System(media=[1.0, glass, 1.0], surfaces=[front, back])
    >>> rays.vjp(lens, positions=residual).parameters["surfaces[0].curvature"]
    """

    media: Sequence[Medium]
    """Media before, between and behind the surfaces: one more than there are surfaces, not counting
    apertures. Each is an index, a :class:`morgana.Field`, or samples of n [z, y, x], which fill the
    ``box`` of the rays."""
    surfaces: Sequence[Surface]
    """Surfaces: :class:`Plane`, :class:`Sphere`, :class:`Cylinder`, :class:`Conic`,
    :class:`Aperture`."""


class Layout:
    """Checked media and surfaces, with the names of their parameters, and the positions of the
    parameters in one vector."""

    def __init__(self, index: Union[Medium, System], has_box: bool) -> None:
        self.of_system = isinstance(index, System)
        if isinstance(index, System):
            self.surfaces = list(index.surfaces)
            self.media = [_medium(medium, f"media[{i}]", has_box) for i, medium in enumerate(index.media)]
            refracting = sum(not isinstance(surface, Aperture) for surface in self.surfaces)
            if len(self.media) != refracting + 1:
                raise GradError(
                    f"{len(self.media)} media and {refracting} refracting surfaces do not fit: give one medium more than surfaces, "
                    "before, between and behind them"
                )
        else:
            self.surfaces, self.media = [], [_medium(index, "the index", has_box)]
        parts = [_quadric(surface, f"surfaces[{i}]") for i, surface in enumerate(self.surfaces)]
        self.elements = [element for element, _ in parts] if self.of_system else None
        self.jacobians = [jacobian for _, jacobian in parts]

    @property
    def through(self) -> Tuple[List[Any], Optional[List[Element]]]:
        """Media and surfaces for the compiled part."""
        return self.media, self.elements

    @property
    def shape(self) -> Tuple[int, ...]:
        """Shape of derivatives: the shape of the samples, or (parameters,)."""
        alone = None if self.of_system else self.media[0]
        return alone.shape if isinstance(alone, np.ndarray) else (sum(value.size for value in self.parameters().values()),)

    def parameters(self) -> Dict[str, Doubles]:
        """Returns the names and values of the parameters, in order."""
        found = {}
        for i, medium in enumerate(self.media):
            prefix = f"media[{i}]" if self.of_system else ""
            if isinstance(medium, Field):
                found.update({f"{prefix}.{name}".lstrip("."): value for name, value in medium._parameters()})
            else:
                found[prefix or "samples"] = np.asarray(medium, dtype=float)
        for i, (surface, jacobian) in enumerate(zip(self.surfaces, self.jacobians)):
            found.update({f"surfaces[{i}].{name}": np.asarray(getattr(surface, name), dtype=float) for name in jacobian})
        return found

    def named(self, vector: Doubles) -> Dict[str, Doubles]:
        """Splits a vector of numbers for all parameters by their names, in their shapes."""
        values = self.parameters()
        ends = np.cumsum([value.size for value in values.values()])
        parts = np.split(vector.ravel(), ends[:-1]) if values else []
        return {name: part.reshape(value.shape) for (name, value), part in zip(values.items(), parts)}

    def gathered(self, media: Sequence[Doubles], surfaces: Doubles) -> Doubles:
        """Converts derivatives of the compiled part to derivatives by all parameters, in order."""
        parts = [by.ravel() for by in media]
        for jacobian, by in zip(self.jacobians, surfaces):
            parts.extend(matrix.T @ by for matrix in jacobian.values())
        return np.concatenate(parts).reshape(self.shape) if parts else np.zeros(self.shape)

    def change(self, of: Union[None, ArrayLike, Mapping[str, ArrayLike]]) -> Tuple[List[Doubles], Doubles]:
        """Converts a change of parameters for the compiled part: changes of each medium, and of
        each surface."""
        vector = self._vector(of)
        values = self.named(vector)
        sizes = [sum(value.size for _, value in m._parameters()) if isinstance(m, Field) else np.asarray(m).size for m in self.media]
        media = np.split(vector, np.cumsum(sizes))[: len(sizes)]
        surfaces = np.zeros((len(self.surfaces), ROWS))
        for i, jacobian in enumerate(self.jacobians):
            for name, matrix in jacobian.items():
                surfaces[i] += matrix @ values[f"surfaces[{i}].{name}"].ravel()
        return [np.ascontiguousarray(part) for part in media], surfaces

    def _vector(self, of: Union[None, ArrayLike, Mapping[str, ArrayLike]]) -> Doubles:
        if of is None:
            return np.zeros(int(np.prod(self.shape)))
        if isinstance(of, Mapping):
            values = {name: np.zeros_like(value) for name, value in self.parameters().items()}
            for name, part in of.items():
                if name not in values:
                    raise GradError(f"no parameter {name!r}: the system has {', '.join(values) or 'none'}")
                given = grid_samples(part, name)
                if given.shape != values[name].shape:
                    raise GradError(f"a change of {name} has the shape {given.shape} but must have {values[name].shape}")
                values[name] = given
            given = np.concatenate([part.ravel() for part in values.values()])
        else:
            given = grid_samples(of, "a change of the index")
            if given.shape != self.shape:
                raise GradError(f"a change of the index has the shape {given.shape} but must have {self.shape}")
        if not np.isfinite(given).all():
            raise GradError("a change of the index is not finite")
        return np.ascontiguousarray(given.ravel(), dtype=float)


def unit(vector: ArrayLike, what: str) -> Tuple[Doubles, Doubles]:
    """Returns a unit vector, and its derivatives by the given vector, (3, 3)."""
    given = finite(vector, what)
    length = float(np.linalg.norm(given))
    if length == 0:
        raise GradError(f"{what} is {given.tolist()} but must not be zero")
    direction = given / length
    return direction, (np.eye(3) - np.outer(direction, direction)) / length


def finite(vector: ArrayLike, what: str) -> Doubles:
    """Returns three finite numbers, or raises an error."""
    given = numbers(vector, what)
    if given.shape != (3,) or not np.isfinite(given).all():
        raise GradError(f"{what} is {given.tolist()} but must be three finite numbers")
    return given


def check_starts(origins: Tuple[int, ...], directions: Tuple[int, ...]) -> None:
    """Raises an error if the shapes of origins and directions of rays do not match."""
    if len(origins) != 2 or origins[1] != 3 or directions not in (origins, (3,)):
        raise GradError(f"origins have the shape {origins} and directions {directions}: give (rays, 3) of both, or one direction of shape (3,)")


def check_samples(shape: Tuple[int, ...], what: str, has_box: bool) -> None:
    """Raises an error if samples of an index have a wrong shape or no box."""
    if len(shape) != 3:
        raise GradError(f"{what} must be a Field or an array [z, y, x] of samples, but has the shape {shape}")
    if not has_box:
        raise GradError("samples need a box: give Rays the box that they fill")


def triple(vector: Doubles) -> Vector:
    """Converts a vector for the compiled part."""
    x, y, z = (float(v) for v in vector)
    return x, y, z


def _medium(medium: Any, what: str, has_box: bool) -> Union[float, Field, Doubles]:
    if isinstance(medium, Field):
        return medium
    if isinstance(medium, System):
        raise GradError(f"{what} is a System, which only whole rays can pass: give a Field")
    if what != "the index" and np.ndim(medium) == 0:
        return checks.positive(medium, what)
    samples = np.ascontiguousarray(grid_samples(medium, what))
    check_samples(samples.shape, what, has_box)
    bad = ~(np.isfinite(samples) & (samples > 0))
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0])
        raise GradError(f"{np.count_nonzero(bad)} samples are not refractive indices > 0: the first is {samples[first]} at {list(first)}")
    return samples


def aspheric_coefficients(values: ArrayLike, what: str) -> Doubles:
    """Returns the checked coefficients of an asphere."""
    found = np.asarray(values, dtype=float)
    if found.ndim != 1 or len(found) > DEPARTURES or not np.isfinite(found).all():
        raise GradError(f"{what} is {checks.shown(values)} but must be up to {DEPARTURES} finite numbers, of ρ², ρ⁴, …")
    return found


def _quadric(surface: Any, what: str) -> Tuple[Element, Dict[str, Doubles]]:
    """Converts a surface for the compiled part, and returns the derivatives of its numbers by each
    parameter, (ROWS, numbers)."""

    def of_rows(first: int, matrix: Doubles) -> Doubles:
        rows = np.zeros((ROWS, matrix.shape[1]))
        rows[first : first + len(matrix)] = matrix
        return rows

    def of_point(matrix: Doubles) -> Doubles:
        return of_rows(0, matrix)

    def of_axis(matrix: Doubles) -> Doubles:
        return of_rows(3, matrix)

    def of_form(*form: float) -> Doubles:
        return of_rows(6, np.array(form)[:, None])

    if isinstance(surface, Sphere):
        r = checks.positive(surface.radius, f"{what}.radius")
        element = (triple(finite(surface.center, f"{what}.center")), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0, -r * r), QUADRIC, None)
        return element, {"center": of_point(np.eye(3)), "radius": of_form(0, 0, 0, -2 * r)}
    if isinstance(surface, Plane):
        axis, turned = unit(surface.normal, f"{what}.normal")
        element = (triple(finite(surface.point, f"{what}.point")), triple(axis), (0.0, 0.0, 1.0, 0.0), QUADRIC, None)
        return element, {"point": of_point(np.eye(3)), "normal": of_axis(turned)}
    if isinstance(surface, Cylinder):
        axis, turned = unit(surface.axis, f"{what}.axis")
        r = checks.positive(surface.radius, f"{what}.radius")
        element = (triple(finite(surface.point, f"{what}.point")), triple(axis), (1.0, -1.0, 0.0, -r * r), QUADRIC, None)
        return element, {"point": of_point(np.eye(3)), "axis": of_axis(turned), "radius": of_form(0, 0, 0, -2 * r)}
    if isinstance(surface, Conic):
        axis, turned = unit(surface.axis, f"{what}.axis")
        c, k = (_finite(value, f"{what}.{name}") for name, value in (("curvature", surface.curvature), ("conic", surface.conic)))
        aspheric = aspheric_coefficients(surface.aspheric, f"{what}.aspheric")
        departure = tuple([*aspheric, *(DEPARTURES - len(aspheric)) * [0.0]])
        element = (triple(finite(surface.vertex, f"{what}.vertex")), triple(axis), (c, c * k, -2.0, 0.0), departure, None)
        columns = {"curvature": of_form(1, k, 0, 0), "conic": of_form(0, c, 0, 0)}
        if len(aspheric):
            columns["aspheric"] = of_rows(10, np.eye(len(aspheric)))
        return element, {"vertex": of_point(np.eye(3)), "axis": of_axis(turned), **columns}
    if isinstance(surface, Aperture):
        axis, _ = unit(surface.normal, f"{what}.normal")
        r = checks.positive(surface.radius, f"{what}.radius")
        return (triple(finite(surface.center, f"{what}.center")), triple(axis), (0.0, 0.0, 1.0, 0.0), QUADRIC, r), {}
    raise GradError(f"{what} is {surface!r} but must be a Plane, Sphere, Cylinder, Conic or Aperture")


def _finite(value: Any, what: str) -> float:
    found = checks.optional_finite(value, what)
    if found is None:
        raise GradError(f"{what} is None but must be a finite number")
    return found
