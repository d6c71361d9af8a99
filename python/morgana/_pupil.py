"""Rays through the stop of a lens, and its paraxial data: see :func:`morgana.lens.trace` and
:func:`morgana.lens.paraxial`."""

from __future__ import annotations

import math
from typing import Any, Dict, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._ends import Ends
from ._numbers import numbers
from ._prescription import AXIS, Prescription, layout, sag
from ._system import GradError, Plane, System
from ._values import comparable
from ._ray_bundle import Rays

Doubles = NDArray[np.float64]

TOLERANCE = 1e-11
"""Relative error of positions per length: 1e-11 of 100 mm is 2e-6 waves of green light."""

AIM = 1e-9
"""Largest distance from the aim in the stop, relative to the radius of the stop. Optical lengths
depend on the distance to second order only."""

MAX_STEPS = 30
"""Maximum number of steps to aim a ray. Rays through camera lenses need four to seven."""


@comparable
class Paraxial(NamedTuple):
    """Paraxial data of a lens at one wavelength: lengths in scene units, positions along the axis
    from the vertex of the first surface.

    Data that a lens does not have, such as the focal length without power, are infinite."""

    focal_length: float
    """Focal length in image space, −1 over the ray slope behind the lens for a ray of height 1."""
    back_focal_length: float
    """Distance from the last surface to the focus."""
    front_focal_length: float
    """Distance from the first surface to the front focus, < 0 if the focus lies before it."""
    f_number: float
    """Focal length divided by the diameter of the entrance pupil."""
    entrance_pupil: float
    """Position of the entrance pupil."""
    entrance_pupil_diameter: float
    """Diameter of the entrance pupil."""
    exit_pupil: float
    """Position of the exit pupil."""
    exit_pupil_diameter: float
    """Diameter of the exit pupil."""
    stop_radius: float
    """Radius of the stop."""
    image: float
    """Position of the paraxial image of the object."""
    magnification: float
    """Height of the image over height of the object; 0 for an object at infinity."""

    def __repr__(self) -> str:
        return f"<morgana.lens.Paraxial: focal length {self.focal_length:.6g}, f/{self.f_number:.4g}, image at {self.image:.6g}>"


class Optics(NamedTuple):
    """Ray matrices of a lens, by which aims start. A matrix takes (height, slope)."""

    to_stop: Doubles
    """From the first vertex to the stop, (2, 2)."""
    to_end: Doubles
    """From the first vertex to the last vertex, (2, 2)."""
    n_object: float
    """Index in object space."""
    n_image: float
    """Index in image space, on the axis."""
    radius: float
    """Radius of the stop."""


@comparable
class Bundle(NamedTuple):
    """Rays from one field point through the stop of a lens to its image plane.

    Row i of each array belongs to ray i. Rays without an end are NaN in the ends."""

    pupil: Doubles
    """Aims (x, y) in the stop, (rays, 2), relative to its radius."""
    origins: Doubles
    """Starts of the rays, (rays, 3), in scene units."""
    directions: Doubles
    """Directions at the starts, (rays, 3), with z = 1."""
    ends: Ends
    """Ends of the rays in the image plane."""
    chief: Ends
    """End of the ray through the centre of the stop."""
    optical_lengths: Doubles
    """Optical lengths from the object, or from a common wavefront of an object at infinity, (rays,),
    minus the optical length of the chief ray, in scene units."""
    weights: Doubles
    """Areas of the stop that the rays represent, (rays,), in any unit. Rays on the rim of a hexapolar
    sampling represent half the area of rays inside; other samplings have equal weights."""
    not_aimed: int
    """Number of rays for which no start was found that passes the stop at the aim."""
    wavelength: float
    """Wavelength in nanometres."""

    @property
    def points(self) -> Doubles:
        """Positions (x, y) in the image plane around the chief ray, (rays, 2), in scene units."""
        return np.asarray(self.ends.positions[:, :2] - self.chief.positions[0, :2])

    @property
    def centroid(self) -> Doubles:
        """Mean of ``points`` by ``weights``, (2,), in scene units; NaN without rays that arrive."""
        arrived = self._arrived
        return np.average(self.points[arrived], axis=0, weights=self.weights[arrived]) if arrived.any() else np.full(2, np.nan)

    @property
    def rms_radius(self) -> float:
        """Root mean square distance of ``points`` from ``centroid`` by ``weights``, in scene
        units."""
        return weighted_rms(self.points[self._arrived], self.weights[self._arrived])

    @property
    def geometric_radius(self) -> float:
        """Largest distance of ``points`` from ``centroid``, in scene units."""
        return float(self._distances.max()) if self._arrived.any() else math.nan

    @property
    def failures(self) -> Dict[str, int]:
        """Numbers of rays without an end, by the cause; empty if all rays arrive."""
        missed = {"could not be aimed": self.not_aimed} if self.not_aimed else {}
        return {**missed, **self.ends.failures}

    @property
    def _arrived(self) -> NDArray[np.bool_]:
        return np.asarray(np.isfinite(self.points).all(1))

    @property
    def _distances(self) -> Doubles:
        return np.asarray(np.linalg.norm(self.points[self._arrived] - self.centroid, axis=1))

    def __repr__(self) -> str:
        failed = [f"{count} {name}" for name, count in self.failures.items()]
        counts = ", ".join([f"{len(self.pupil)} rays", *failed])
        return f"<morgana.lens.Bundle: {counts}, {self.wavelength:g} nm, RMS radius {self.rms_radius:.6g}>"


def weighted_rms(points: Doubles, weights: Doubles) -> float:
    """Returns the root mean square distance of points, (points, 2), from their mean; NaN without
    points."""
    if not len(points):
        return math.nan
    middle = np.average(points, axis=0, weights=weights)
    return float(np.sqrt(np.average(np.sum((points - middle) ** 2, axis=1), weights=weights)))


def pupil_weights(sampling: Any, count: int, size: int) -> Doubles:
    """Returns relative areas of the stop that points represent, (size,)."""
    weights = np.ones(size)
    if isinstance(sampling, str) and sampling == "hexapolar":
        # Trapezoids along the radius: of 2π/6 ring spacings squared, the centre has π/4, and the rim half.
        weights[0] = 0.75
        weights[-6 * count :] = 0.5
    return weights


def pupil_points(sampling: str, count: int, *, seed: int = 0) -> Doubles:
    """Points in the unit disc.

    Parameters
    ----------
    sampling : str
        ``"hexapolar"``: the centre, and ``count`` rings with 6, 12, 18, … points. The last ring is
        the rim. ``"grid"``: the
        centres of ``count`` × ``count`` squares that lie in the disc. ``"x"`` or ``"y"``: ``count``
        points of a diameter with both ends. ``"random"``: ``count`` uniformly random points.
    count : int
        Number of rings or points, ≥ 1; of points of a line, ≥ 2.
    seed : int, optional
        Seed of random points.

    Returns
    -------
    numpy.ndarray
        Points (x, y), (points, 2).

    Raises
    ------
    GradError
        Unknown sampling.

    Examples
    --------
    >>> len(morgana.lens.pupil_points("hexapolar", 6))
    127
    """
    checks.whole(count, "count", 2 if sampling in ("x", "y") else 1)
    if sampling == "hexapolar":
        rings = np.repeat(np.arange(1, count + 1), 6 * np.arange(1, count + 1))
        turns = np.concatenate([np.arange(6 * ring) / (6 * ring) for ring in range(1, count + 1)])
        polar = rings / count * np.exp(2j * np.pi * turns)
        return np.concatenate([np.zeros((1, 2)), np.column_stack([polar.real, polar.imag])])
    if sampling == "grid":
        line = (np.arange(count) + 0.5) / count * 2 - 1
        x, y = np.meshgrid(line, line)
        return np.column_stack([x.ravel(), y.ravel()])[np.hypot(x, y).ravel() <= 1]
    if sampling in ("x", "y"):
        line, zero = np.linspace(-1, 1, count), np.zeros(count)
        return np.column_stack([line, zero] if sampling == "x" else [zero, line])
    if sampling == "random":
        rng = np.random.default_rng(seed)
        polar = np.sqrt(rng.random(count)) * np.exp(2j * np.pi * rng.random(count))
        return np.column_stack([polar.real, polar.imag])
    raise GradError(f"sampling is {sampling!r} but must be 'hexapolar', 'grid', 'x', 'y' or 'random'")


def paraxial(prescription: Prescription, wavelength: Optional[float] = None) -> Paraxial:
    """Focal lengths, pupils and image of a lens, by derivatives of the ray along the axis.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    wavelength : float, optional
        Wavelength in nanometres; the primary wavelength by default.

    Returns
    -------
    Paraxial
        The data.

    Raises
    ------
    GradError
        The ray along the axis does not pass, or the stop lies in a focus of an object at infinity.

    Examples
    --------
    >>> morgana.lens.paraxial(singlet).focal_length
    """
    return data_of(prescription, optics(prescription, wavelength))


def data_of(prescription: Prescription, at: Optics) -> Paraxial:
    """Returns paraxial data from ray matrices."""
    (a, b), (c, d) = at.to_end
    length = float(prescription.vertices[-2])
    stop_a, stop_b = at.to_stop[0]
    behind = at.to_end @ np.linalg.inv(at.to_stop)
    focal = _over(-1.0, c)
    diameter = 2 * at.radius / abs(stop_a) if stop_a else math.inf
    far = prescription.object_distance
    if math.isinf(far):
        image, magnification = length + _over(-a, c), 0.0
    else:
        image = length + _over(-(a * far + b), c * far + d)
        magnification = a + (image - length) * c if math.isfinite(image) else math.inf
    exit_at = _over(-behind[0, 1], behind[1, 1])
    exit_scale = behind[0, 0] + exit_at * behind[1, 0] if math.isfinite(exit_at) else math.inf
    return Paraxial(
        focal_length=focal,
        back_focal_length=_over(-a, c),
        front_focal_length=_over(d, c),
        f_number=float(abs(focal) / diameter),
        entrance_pupil=_over(stop_b, stop_a),
        entrance_pupil_diameter=float(diameter),
        exit_pupil=length + exit_at,
        exit_pupil_diameter=float(2 * at.radius * abs(exit_scale)),
        stop_radius=float(at.radius),
        image=image,
        magnification=float(magnification),
    )


def trace(
    prescription: Prescription,
    field: Any = 0.0,
    wavelength: Optional[float] = None,
    *,
    pupil: Union[str, ArrayLike] = "hexapolar",
    count: int = 6,
    seed: int = 0,
    aim: bool = True,
    defocus: float = 0.0,
) -> Bundle:
    """Trace rays from a field point through the stop to the image plane.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    field : float or two of float, optional
        Field point, as in :attr:`Prescription.fields`.
    wavelength : float, optional
        Wavelength in nanometres; the primary wavelength by default.
    pupil : str or array_like, (rays, 2), optional
        Sampling of :func:`pupil_points`, or aims (x, y) in the stop, relative to its radius.
    count, seed : int, optional
        As for :func:`pupil_points`.
    aim : bool, optional
        ``True`` finds starts of rays that pass the stop at the aims, to 1e-9 of the radius of the
        stop. ``False`` sends the rays through the paraxial entrance pupil.
    defocus : float, optional
        Shift of the image plane along the axis, in scene units.

    Returns
    -------
    Bundle
        The rays. :attr:`Bundle.failures` counts rays that do not arrive, by the cause.

    Raises
    ------
    GradError
        Unknown sampling, shapes that do not fit, or a chief ray that does not arrive.

    Examples
    --------
    >>> spot = morgana.lens.trace(singlet, field=5.0, count=10)
    >>> spot.rms_radius, spot.geometric_radius, spot.failures
    """
    points = pupil_points(pupil, count, seed=seed) if isinstance(pupil, str) else np.atleast_2d(numbers(pupil, "pupil"))
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise GradError(f"pupil has the shape {points.shape} but must be finite numbers of shape (rays, 2)")
    at = prescription.wavelength(wavelength)
    lens = optics(prescription, at)
    system = prescription.system(at)
    where = (0.0, 0.0, float(prescription.vertices[-1]) + float(checks.optional_finite(defocus, "defocus") or 0.0))
    origins, directions, aimed = _starts(prescription, lens, field, at, np.concatenate([np.zeros((1, 2)), points]), aim)
    ends = Rays(origins, directions, exit=Plane(where, AXIS), tolerance=TOLERANCE).forward(system)
    chief, rest = (
        Ends(ends.positions[rows], ends.directions[rows], ends.optical_lengths[rows], ends.codes[rows]) for rows in (slice(0, 1), slice(1, None))
    )
    if not chief.valid.all() or not aimed[0]:
        cause = next(iter(chief.failures), "could not be aimed at the centre of the stop")
        raise GradError(f"the chief ray of field {prescription.field_point(field)} at {at:g} nm {cause}")
    lost = ~aimed[1:]
    # Rays without an aim have no end: `not_aimed` counts them instead of the codes.
    rest.positions[lost], rest.directions[lost], rest.optical_lengths[lost], rest.codes[lost] = np.nan, np.nan, np.nan, 0
    lengths = rest.optical_lengths - chief.optical_lengths[0]
    if math.isinf(prescription.object_distance):
        # Starts lie in a plane; add the path from the wavefront through the start of the chief ray.
        along = directions[0] / np.linalg.norm(directions[0])
        lengths = lengths + lens.n_object * (origins[1:] - origins[0]) @ along
    return Bundle(points, origins[1:], directions[1:], rest, chief, lengths, pupil_weights(pupil, count, len(points)), int(lost.sum()), at)


def optics(prescription: Prescription, wavelength: Optional[float] = None) -> Optics:
    """Returns the ray matrices of a lens, and the radius of its stop."""
    at = prescription.wavelength(wavelength)
    stop = prescription.stop
    system = prescription.system(at)
    last = float(prescription.vertices[-2])
    to_end = _matrix(prescription, system, last)
    to_stop = _matrix(prescription, layout(prescription, at, stop).system, float(prescription.vertices[stop]))
    a = abs(to_stop[0, 0])
    opening = prescription.surfaces[stop].aperture
    if prescription.entrance_pupil is not None:
        radius = a * prescription.entrance_pupil / 2
    elif prescription.f_number is not None:
        radius = a * abs(_over(1.0, to_end[1, 0])) / prescription.f_number / 2
    else:
        radius = float(opening or 0.0)
    if not (radius > 0 and math.isfinite(radius)):
        raise GradError(f"the stop has the radius {radius:g}: give the aperture of the stop, surfaces[{stop}], instead of a pupil or f-number")
    behind = system.media[-1]
    n_image = float(behind) if isinstance(behind, (int, float)) else float(np.asarray(behind.n([0.0, 0.0, last])))  # type: ignore[union-attr]
    return Optics(to_stop, to_end, float(system.media[0]), n_image, radius)  # type: ignore[arg-type]


def start_plane(prescription: Prescription) -> float:
    """Returns a position along the axis before all points of the first surface that rays meet."""
    size = float(np.abs(prescription.vertices).max()) + (prescription.entrance_pupil or 0.0)
    first = prescription.surfaces[0]
    depth = 0.0 if math.isinf(first.radius) or first.radius > 0 else abs(first.radius)
    rim = sag(first, first.aperture) if first.aperture is not None else -min(depth, 2 * size)
    return min(0.0, rim) - 0.1 * max(size, 1e-3)


def _matrix(prescription: Prescription, system: System, z: float) -> Doubles:
    """Returns the ray matrix from the first vertex to the plane at ``z``, with slopes."""
    before = start_plane(prescription)
    # The exit lies behind the last surface: half a length further, and the matrix is moved back.
    beyond = z + (abs(before) if system.surfaces else 0.0)
    rays = Rays([[0.0, 0.0, before]], [0.0, 0.0, 1.0], exit=Plane((0.0, 0.0, beyond), AXIS), tolerance=TOLERANCE)
    failed = rays.forward(system).failures
    if failed:
        raise GradError(f"the ray along the axis {next(iter(failed))}")
    columns = []
    for change in (rays.jvp(system, origins=[[0.0, 1.0, 0.0]]), rays.jvp(system, directions=[[0.0, 1.0, 0.0]])):
        columns.append([change.positions[0, 1], change.directions[0, 1]])
    forward = np.array(columns).T
    return np.asarray(np.array([[1.0, z - beyond], [0.0, 1.0]]) @ forward @ np.array([[1.0, before], [0.0, 1.0]]))


def _starts(
    prescription: Prescription, lens: Optics, field: Any, wavelength: float, aims: Doubles, aim: bool
) -> Tuple[Doubles, Doubles, NDArray[np.bool_]]:
    """Returns origins, directions, and a mask of the rays that meet their aims."""
    point = np.array(prescription.field_point(field))
    at_infinity = math.isinf(prescription.object_distance)
    before = start_plane(prescription)
    (a, b), radius = lens.to_stop[0], lens.radius
    count = len(aims)
    if at_infinity:
        slopes = np.tan(np.radians(point))
        fixed = np.column_stack([np.tile(slopes, (count, 1)), np.ones(count)])
        if a == 0:
            raise GradError("the stop lies in the front focus of the lens: an object at infinity has no entrance pupil")
        unknown = (radius * aims - b * slopes) / a + before * slopes
    else:
        far = prescription.object_distance
        fixed = np.column_stack([np.tile(point, (count, 1)), np.full(count, -far)])
        unknown = (radius * aims - a * point) / (a * far + b)

    def starts(rows: NDArray[np.bool_]) -> Tuple[Doubles, Doubles]:
        free = np.column_stack([unknown[rows], np.full(np.count_nonzero(rows), before if at_infinity else 1.0)])
        return (free, fixed[rows]) if at_infinity else (fixed[rows], free)

    done = np.zeros(count, bool)
    everything = np.ones(count, bool)
    if not aim:
        return (*starts(everything), everything)
    stop = prescription.stop
    system = layout(prescription, wavelength, stop).system
    exit = Plane((0.0, 0.0, float(prescription.vertices[stop])), AXIS)
    inverse = np.tile(np.eye(2) / (a if at_infinity else a * prescription.object_distance + b), (count, 1, 1))
    best = unknown.copy()
    missed = np.full((count, 2), np.nan)
    for _ in range(MAX_STEPS):
        rows = np.flatnonzero(~done)
        if not rows.size:
            break
        ends = Rays(*starts(~done), exit=exit, tolerance=TOLERANCE).forward(system)
        off = ends.positions[:, :2] - radius * aims[rows]
        before_step, size = np.linalg.norm(missed[rows], axis=1), np.linalg.norm(off, axis=1)
        better = ends.valid & ~(size >= before_step)
        # Return half way to the best start, or to the chief ray, after a step to no end or further away.
        worse = rows[~better]
        fallback = np.where(np.isfinite(missed[worse]), best[worse], best[0])
        unknown[worse] = (unknown[worse] + fallback) / 2
        kept = rows[better]
        step, change = unknown[kept] - best[kept], off[better] - missed[kept]
        inverse[kept] = _broyden(inverse[kept], step, change)
        best[kept], missed[kept] = unknown[kept], off[better]
        met = size[better] <= AIM * radius
        done[kept[met]] = True
        moving = kept[~met]
        unknown[moving] -= np.einsum("rij,rj->ri", inverse[moving], missed[moving])
    return (*starts(everything), done)


def _broyden(inverse: Doubles, step: Doubles, change: Doubles) -> Doubles:
    """Returns inverse Jacobians, (rays, 2, 2), that agree with the last step and change of the aim;
    the given ones for rays without a last step."""
    predicted = np.einsum("rij,rj->ri", inverse, change)
    row = np.einsum("ri,rij->rj", step, inverse)
    scale = np.einsum("ri,ri->r", step, predicted)
    usable = np.isfinite(scale) & (np.abs(scale) > 0)
    update = (step - predicted)[:, :, None] * row[:, None, :] / np.where(usable, scale, 1.0)[:, None, None]
    return np.asarray(inverse + np.where(usable[:, None, None], update, 0.0))


def _over(a: float, b: float) -> float:
    return float(a / b) if abs(b) > 1e-14 * max(abs(a), 1e-300) else math.inf
