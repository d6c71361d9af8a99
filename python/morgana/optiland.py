"""Graded media for Optiland: ``pip install ".[optiland]"`` in a clone of morgana.

    >>> import morgana.optiland
    >>> lens = optiland.optic.Optic()  # With surfaces, fields and wavelengths as usual.
    >>> morgana.optiland.grade(lens, 1, {"type": "selfoc", "n0": 1.6, "alpha": 0.3, "direction": [0, 0, 1]})

Optiland has no propagation in media of varying index. :func:`grade` gives it one: rays of Optiland
follow morgana's curved rays from one surface to the next.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _checks as checks
from ._extras import advice as _advice
from ._scene import load_field
from ._system import Conic, GradError, Plane, System
from .grad import Rays

try:
    import optiland.backend as be
    from optiland.interactions.refractive_reflective_model import RefractiveReflectiveModel
    from optiland.materials.base import BaseMaterial
    from optiland.propagation.base import BasePropagationModel
    from optiland.raytrace.paraxial_ray_tracer import ParaxialRayTracer
except ImportError as missing:
    raise ImportError(f"morgana.optiland needs Optiland: {_advice('optiland')}") from missing

if TYPE_CHECKING:
    from ._morgana import Field

__all__ = ["GradedMaterial", "grade"]

Doubles = NDArray[np.float64]

BEHIND = 2.0
"""Index behind the exit surface relative to the index on the axis, from which the intersection is
computed. Twice the index excludes total reflection."""


class Frame(NamedTuple):
    """Position of one surface in the frame of another."""

    turn: Doubles
    """Rotation, (3, 3)."""
    vertex: Doubles
    """Vertex, (3,)."""

    def inside(self, points: Doubles) -> Doubles:
        """Converts points of the surface to the other frame, (rays, 3)."""
        return np.asarray(points @ self.turn.T + self.vertex)

    def outside(self, points: Doubles) -> Doubles:
        """Converts points of the other frame to the frame of the surface, (rays, 3)."""
        return np.asarray((points - self.vertex) @ self.turn)


class GradedMaterial(BaseMaterial):
    """Medium of varying index between two surfaces of an Optiland lens: see :func:`grade`.

    :meth:`n` is the index at the vertex of the front surface, for paraxial data of Optiland."""

    def __init__(self, index: "Union[Mapping[str, Any], Field]", front: Any, back: Any, tolerance: float) -> None:
        super().__init__(GradedPropagation(self))
        self.index, self.front, self.back, self.tolerance = index, front, back, tolerance

    def field(self, wavelength: float) -> "Field":
        """Index at a wavelength, as a field.

        Parameters
        ----------
        wavelength : float
            Wavelength in micrometres.

        Returns
        -------
        morgana.Field
            The field, in the frame of the front surface.

        Examples
        --------
        >>> lens.surfaces[1].material_post.field(0.55).n([0, 0, 0])
        """
        if isinstance(self.index, Mapping):
            return load_field(self.index, wavelength=1e3 * wavelength)
        return self.index

    def at(self, rays: Any, surface: Any) -> Doubles:
        """Returns the index at rays that are in the frame of a surface, (rays,)."""
        points = frame(surface, self.front).inside(_points(rays))
        found = np.empty(len(points))
        for wavelength, rows in _wavelengths(rays):
            found[rows] = self.field(wavelength).n(points[rows])
        return found

    def on_axis(self, wavelength: float, surface: Any) -> float:
        """Returns the index at the vertex of a surface."""
        return float(np.asarray(self.field(wavelength).n(frame(surface, self.front).vertex)))

    def _calculate_n(self, wavelength: Any, **kwargs: Any) -> Any:
        given = np.asarray(be.to_numpy(wavelength), dtype=float)
        values = [float(np.asarray(self.field(float(w)).n([0.0, 0.0, 0.0]))) for w in np.unique(given)]
        return be.asarray(np.array(values)[np.unique(given, return_inverse=True)[1]].reshape(given.shape))

    def _calculate_k(self, wavelength: Any, **kwargs: Any) -> Any:
        return be.zeros_like(be.asarray(wavelength))


class GradedPropagation(BasePropagationModel):
    """Curved rays from the front to the back surface of a :class:`GradedMaterial`."""

    def __init__(self, material: GradedMaterial) -> None:
        self.material = material

    def propagate(self, rays: Any, t: Any) -> None:
        """Moves rays, which are in the frame of the back surface, onto this surface."""
        place = frame(self.material.back, self.material.front)
        starts, directions = place.inside(_points(rays)), np.stack([rays.L, rays.M, rays.N], 1) @ place.turn.T
        ends, ways, lengths = (np.full(shape, np.nan) for shape in (starts.shape, starts.shape, len(starts)))
        for wavelength, rows in _wavelengths(rays):
            ends[rows], ways[rows], lengths[rows] = self._curved(wavelength, starts[rows], directions[rows], place)
        # Optiland adds t n for a straight ray of the length t behind this method.
        rays.opd = rays.opd + lengths - t * self.material.n(rays.w)
        lost = ~np.isfinite(rays.opd)
        ends[lost], ways[lost] = np.nan, np.nan
        rays.x, rays.y, rays.z = place.outside(ends).T.copy()
        rays.L, rays.M, rays.N = (ways @ place.turn).T.copy()

    def _curved(self, wavelength: float, starts: Doubles, directions: Doubles, place: Frame) -> Tuple[Doubles, Doubles, Doubles]:
        """Returns positions and directions on the back surface, in the frame of the front surface,
        and optical lengths."""
        field = self.material.field(wavelength)
        n_behind = BEHIND * float(np.asarray(field.n(place.vertex)))
        conic = _conic(self.material.back, place)
        axis = place.turn[:, 2]
        beyond = Plane(place.vertex + axis * _depth(self.material.back, starts - place.vertex, axis), axis)
        rays = Rays(starts, directions, exit=beyond, tolerance=self.material.tolerance)
        ends = rays.forward(System([field, n_behind], [conic]))
        local, ways = place.outside(ends.positions), ends.directions @ place.turn
        back = _back(local, ways, conic)
        met = local - back[:, None] * ways
        inside = np.full(len(met), np.nan)
        inside[ends.valid] = field.n(place.inside(met[ends.valid]))
        return place.inside(met), _unrefracted(met, ways, n_behind / inside, conic) @ place.turn.T, ends.optical_lengths - n_behind * back

    def to_dict(self) -> Any:
        raise NotImplementedError("graded media cannot be written by Optiland: call morgana.optiland.grade after reading the lens")

    @classmethod
    def from_dict(cls, d: Any, material: Any = None) -> Any:
        raise NotImplementedError("graded media cannot be read by Optiland: call morgana.optiland.grade after reading the lens")


class GradedRefraction(RefractiveReflectiveModel):
    """Refraction by Snell's law with the local indices of graded media."""

    def interact_real_rays(self, rays: Any) -> Any:
        """Refracts rays, which are in the frame of the surface."""
        normals = self.geometry.surface_normal(rays)
        n1, n2 = (_local(material, rays, self.parent_surface) for material in (self.material_pre, self.material_post))
        rays.refract(*normals, n1, n2)
        return self._apply_coating_and_bsdf(rays, *normals)


class GradedParaxialTracer(ParaxialRayTracer):
    """Paraxial rays through a lens with graded media, by derivatives of the ray along the axis."""

    def trace_generic(self, y: Any, u: Any, z: Any, wavelength: float, reverse: bool = False, skip: int = 0, path: Any = None) -> Tuple[Any, Any]:
        """Traces paraxial rays as :meth:`ParaxialRayTracer.trace_generic` does."""
        given = self.prepare_scalar_sequence(wavelength, path=path, reverse=reverse, operation="paraxial ray tracing")
        positions, radii = (np.ravel(be.to_numpy(values)) for values in (given.positions, given.radii))
        surfaces = list(self.optic.surfaces)
        gaps, powers = _transfers(surfaces, float(wavelength))
        y, u, at = (np.atleast_1d(np.asarray(be.to_numpy(be.asarray(value)), dtype=float)) for value in (y, u, z))
        heights, slopes = [], []
        last = len(surfaces) - 1
        for k in range(skip, last + 1):
            own = last - k if reverse else k
            if own > 0:
                gap = gaps[own + 1 if reverse else own] if 0 < k and (not reverse or own < last) else None
                if gap is None or np.any(at != positions[k - 1]):
                    y = y + (positions[k] - at) * u
                else:
                    (a, b), (c, d) = np.diag([1.0, -1.0]) @ np.linalg.inv(gap) @ np.diag([1.0, -1.0]) if reverse else gap
                    y, u = a * y + b * u, c * y + d * u
                at = np.full_like(at, positions[k])
                before, behind = powers[own][::-1] if reverse else powers[own]
                u = (before * u - y * (0.0 if np.isinf(radii[k]) else (behind - before) / radii[k])) / behind
            heights.append(y.copy())
            slopes.append(u.copy())
        return be.array(np.array(heights)).reshape(-1, 1), be.array(np.array(slopes)).reshape(-1, 1)


def grade(optic: Any, surface: int, index: "Union[Mapping[str, Any], Field]", *, tolerance: float = 1e-11) -> GradedMaterial:
    """Puts a medium of varying index behind a surface of an Optiland lens.

    Rays are morgana's up to the next surface. Both surfaces refract with the local index. Optical
    path differences are ∫n ds. Paraxial data of the lens (``optic.paraxial``) include the gradient,
    except ``f2_range``. A ray has no end if the straight line along its direction at the front
    surface misses the next surface. The media of a lens that Optiland writes are not graded: call
    this function again after reading it.

    Parameters
    ----------
    optic : optiland.optic.Optic
        The lens, on the NumPy backend. Both surfaces are spheres, conics or planes that refract.
    surface : int
        Number of the surface in front of the medium, from 1.
    index : mapping or morgana.Field
        Index of the medium as for :func:`morgana.load_field`, with its origin at the vertex of the
        surface, and z along its axis. A dictionary may depend on the wavelength.
    tolerance : float, optional
        Relative error of positions per length, as for :class:`morgana.grad.Rays`.

    Returns
    -------
    GradedMaterial
        The medium, which is now the material behind the surface.

    Raises
    ------
    GradError
        Surfaces that do not exist or are not conics that refract.

    Examples
    --------
    >>> morgana.optiland.grade(lens, 1, {"type": "selfoc", "n0": 1.6, "alpha": 0.3, "direction": [0, 0, 1]})
    """
    if be.get_backend() != "numpy":
        raise GradError("graded media need Optiland's NumPy backend: call optiland.backend.set_backend('numpy')")
    number = checks.whole(surface, "surface", 1, len(optic.surfaces) - 2)
    front, back = optic.surfaces[number], optic.surfaces[number + 1]
    is_image = number + 1 == len(optic.surfaces) - 1
    for one, label in ((front, number), (back, number + 1)):
        if not hasattr(one.geometry, "radius") or type(one.geometry).__name__ not in ("StandardGeometry", "Plane"):
            raise GradError(f"surface {label} is {one.geometry} but must be a sphere, a conic or a plane")
        if type(one.interaction_model) not in (RefractiveReflectiveModel, GradedRefraction) or one.interaction_model.is_reflective:
            raise GradError(f"surface {label} does not only refract: graded media need refracting surfaces")
    material = GradedMaterial(index, front, back, tolerance)
    front.material_post = material
    for one in (front,) if is_image else (front, back):
        old = one.interaction_model
        one.interaction_model = GradedRefraction(one, False, old.coating, old.bsdf)
    optic.paraxial._ray_tracer = GradedParaxialTracer(optic)
    return material


def frame(surface: Any, other: Any) -> Frame:
    """Returns the position of a surface in the frame of another."""
    (at, turn), (origin, turned) = ([np.asarray(be.to_numpy(part), dtype=float) for part in one.geometry.cs.get_effective_transform()] for one in (surface, other))
    return Frame(turned.T @ turn, turned.T @ (at - origin))


def _points(rays: Any) -> Doubles:
    return np.stack([rays.x, rays.y, rays.z], 1)


def _wavelengths(rays: Any) -> List[Tuple[float, NDArray[np.intp]]]:
    """Returns each wavelength in micrometres with the rows of its rays; rays without an end have
    none."""
    known = np.isfinite(_points(rays)).all(1) & np.isfinite(rays.L)
    return [(float(w), np.flatnonzero(known & (rays.w == w))) for w in np.unique(rays.w) if (known & (rays.w == w)).any()]


def _local(material: Any, rays: Any, surface: Any) -> Any:
    """Returns the index of a medium at rays in the frame of a surface."""
    return material.at(rays, surface) if isinstance(material, GradedMaterial) else material.n(rays.w)


def _conic(surface: Any, place: Frame) -> Conic:
    """Returns a surface in the frame of another."""
    radius, k = float(surface.geometry.radius), float(getattr(surface.geometry, "k", 0.0))
    return Conic(tuple(place.vertex), tuple(place.turn[:, 2]), 0.0 if np.isinf(radius) else 1 / radius, k)


def _depth(surface: Any, offsets: Doubles, axis: Doubles) -> float:
    """Returns a position along the axis behind all points of a surface that rays meet, > 0."""
    radius = float(surface.geometry.radius)
    size = float(np.abs(offsets).max())
    return size if np.isinf(radius) else size + min(abs(radius), 2 * size)


def _back(points: Doubles, ways: Doubles, conic: Conic) -> Doubles:
    """Returns the distances along rays from a conic to points behind it, (rays,), in the frame of
    the conic."""
    c, k = float(conic.curvature), 1 + float(conic.conic)
    stretch = np.array([1.0, 1.0, k])
    # c (x² + y² + k z²) − 2 z = 0 at points − distance · ways.
    square = c * np.sum(stretch * ways**2, 1)
    half = ways[:, 2] - c * np.sum(stretch * points * ways, 1)
    value = c * np.sum(stretch * points**2, 1) - 2 * points[:, 2]
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(half**2 - square * value)
        # The ray goes from the front to the back at this root; two forms avoid cancellation.
        return np.asarray(np.where(half < 0, (root - half) / square, -value / (half + root)))


def _unrefracted(points: Doubles, ways: Doubles, ratio: Doubles, conic: Conic) -> Doubles:
    """Returns directions in front of a conic, (rays, 3), of rays with the directions ``ways`` behind
    it, where the index is ``ratio`` times higher, (rays,)."""
    c, k = float(conic.curvature), 1 + float(conic.conic)
    normals = np.column_stack([-c * points[:, 0], -c * points[:, 1], 1 - c * k * points[:, 2]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    across = ways - np.sum(ways * normals, 1, keepdims=True) * normals
    tangential = ratio[:, None] * across
    with np.errstate(invalid="ignore"):
        along = np.sqrt(1 - np.sum(tangential**2, 1))
    return np.asarray(tangential + np.sign(np.sum(ways * normals, 1))[:, None] * along[:, None] * normals)


def _transfers(surfaces: List[Any], wavelength: float) -> Tuple[List[Optional[Doubles]], List[Tuple[float, float]]]:
    """Returns the ray matrix with slopes from the surface before to each surface, ``None`` in
    homogeneous media, and the indices on the axis before and behind each surface."""

    def on_axis(material: Any, surface: Any) -> float:
        return material.on_axis(wavelength, surface) if isinstance(material, GradedMaterial) else float(np.ravel(be.to_numpy(material.n(wavelength)))[0])

    gaps: List[Optional[Doubles]] = [None]
    indices = [(on_axis(surfaces[0].material_post, surfaces[0]),) * 2]
    for surface in surfaces[1:]:
        before = surface.material_pre
        gaps.append(_gap(before, wavelength) if isinstance(before, GradedMaterial) else None)
        indices.append((on_axis(before, surface), on_axis(surface.material_post, surface)))
    return gaps, indices


def _gap(material: GradedMaterial, wavelength: float) -> Doubles:
    """Returns the ray matrix with slopes through a graded medium, from vertex to vertex."""
    end = frame(material.back, material.front).vertex
    rays = Rays([[0.0, 0.0, 0.0]], [0.0, 0.0, 1.0], exit=Plane(tuple(end), (0.0, 0.0, 1.0)), tolerance=material.tolerance)
    field = material.field(wavelength)
    changes = (rays.jvp(field, origins=[[0.0, 1.0, 0.0]]), rays.jvp(field, directions=[[0.0, 1.0, 0.0]]))
    return np.array([[change.positions[0, 1], change.directions[0, 1]] for change in changes]).T
