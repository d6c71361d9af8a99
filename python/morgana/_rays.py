"""Tracing and connection of single rays."""

from __future__ import annotations

import functools
import operator
from typing import Any, Dict, List, Literal, NamedTuple, Optional, Tuple, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _morgana
from ._errors import RenderError
from ._morgana import Field, Ray, Scene
from ._numbers import numbers, vectors
from ._pictures import MAX_LINES, caption, polylines
from ._values import alike, comparable

Doubles = NDArray[np.float64]
Objects = NDArray[np.object_]


class RayEnds:
    """Ends of the rays that :func:`trace` followed: row i of each array belongs to ray i.

    Lengths are in scene units. All numbers of a ray that was not followed are NaN.
    """

    end_points: Doubles
    """Positions where the rays ended, (rays, 3), in scene units."""
    end_tangents: Doubles
    """Unit directions in which the rays ended, (rays, 3)."""
    end_n: Doubles
    """Refractive index where the rays ended, (rays,)."""
    total_arc_length: Doubles
    """Lengths from start to end, (rays,), in scene units."""
    total_optical_length: Doubles
    """Optical path lengths ∫ n ds from start to end, (rays,), in scene units."""
    total_optical_path_difference: Doubles
    """Optical path lengths minus the lengths of rays in the ``reference_index`` of
    :func:`trace`, (rays,), in scene units.

    The rays of the reference connect the start, the points of reflection and the end. The
    differences are in double precision, accurate to 1e-7 of the largest contrast times the length.
    Divide by the wavelength in vacuum for waves. NaN if no ray of the reference connects these
    points.
    """
    stopped: Optional[str]
    """Reason why some rays were not followed: ``"interrupted"``, ``"time"``, or ``None`` if all
    were."""

    def __init__(self, ends: _morgana.Ends, stopped: Optional[str]) -> None:
        self.end_points = ends.points
        self.end_tangents = ends.tangents
        self.end_n = ends.n
        self.total_arc_length = ends.arc_length
        self.total_optical_length = ends.optical_length
        self.total_optical_path_difference = ends.optical_path_difference
        self.stopped = stopped
        self._endings, self._ending_names = ends.endings, ends.ending_names
        self._surfaces, self._surface_names = ends.surfaces, ends.surface_names

    @property
    def end(self) -> Objects:
        """Cause of the end of each ray, (rays,), texts.

        Values are ``"surface"``, ``"left the scene"``, ``"maximum length"``, ``"lost"`` if the ray
        left the field of its medium or took too many steps, and ``"not followed"`` if the time was
        over. For a mask, compare: ``rays.end == "surface"``.
        """
        return np.array(self._ending_names, object)[self._endings]

    @property
    def surface(self) -> Objects:
        """Name of the object on which each ray ended, (rays,), texts; ``None`` for other ends."""
        return np.array([*self._surface_names, None], object)[self._surfaces]

    def __getstate__(self) -> Dict[str, Any]:
        return self.__dict__

    def __setstate__(self, state: Dict[str, Any]) -> None:
        self.__dict__.update(state)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return alike(self.__getstate__(), other.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    def __len__(self) -> int:
        return len(self.end_points)

    def __repr__(self) -> str:
        return f"<morgana.RayEnds: {self._summary()}>"

    def _summary(self) -> str:
        counts = np.bincount(self._endings, minlength=len(self._ending_names))
        how = [f"{count} {name}" for name, count in zip(self._ending_names, counts) if count]
        return f"{len(self)} rays ({', '.join(how)})" if how else "0 rays"


OF_POINTS = ("offsets", "points", "tangents", "arc_length", "optical_length", "optical_path_difference", "n")
"""Names of the properties of points, which are computed on first access."""


class Rays(RayEnds):
    """Rays that :func:`trace` followed, with their points. Item i is ray i, as a :class:`Polyline`.

    The points of all rays lie in shared arrays, ray after ray. Ray i has the points from
    ``offsets[i]`` to ``offsets[i + 1]``. A ray that was not followed has no points.
    """

    def __init__(self, ends: _morgana.Ends, traced: _morgana.Traced, stopped: Optional[str]) -> None:
        super().__init__(ends, stopped)
        self._traced = traced

    def __getstate__(self) -> Dict[str, Any]:
        known = {name: value for name, value in self.__dict__.items() if name != "_traced"}
        return {**known, **{name: getattr(self, name) for name in OF_POINTS}}

    @functools.cached_property
    def offsets(self) -> NDArray[np.int64]:
        """Index of the first point of each ray, and the number of all points, (rays + 1,)."""
        return self._traced.offsets()

    @functools.cached_property
    def points(self) -> Doubles:
        """Positions, (points, 3), in scene units.

        There is a point after each turn of a ray by 0.03 rad, and at each surface."""
        return self._traced.positions()

    @functools.cached_property
    def tangents(self) -> Doubles:
        """Unit directions at the points, (points, 3).

        They are directions of departure where a ray changes its direction."""
        return self._traced.directions()

    @functools.cached_property
    def arc_length(self) -> Doubles:
        """Lengths from the start, (points,), in scene units."""
        return self._traced.arc_lengths()

    @functools.cached_property
    def optical_length(self) -> Doubles:
        """Optical path lengths ∫ n ds from the start, (points,), in scene units."""
        return self._traced.optical_lengths()

    @functools.cached_property
    def optical_path_difference(self) -> Doubles:
        """Optical path differences from the start, (points,), in scene units.

        See ``total_optical_path_difference``. Differences to a field are known only at the ends of
        rays, and NaN before.
        """
        return self._traced.path_differences()

    @functools.cached_property
    def n(self) -> Doubles:
        """Refractive index at the points, (points,)."""
        return self._traced.indices()

    def __getitem__(self, i: int) -> "Polyline":
        i = operator.index(i)
        if not -len(self) <= i < len(self):
            raise IndexError(f"there is no ray {i}: there are {len(self)} rays")
        i %= len(self)
        at = slice(self.offsets[i], self.offsets[i + 1])
        surface = self._surfaces[i]
        return Polyline(
            points=self.points[at],
            tangents=self.tangents[at],
            arc_length=self.arc_length[at],
            optical_length=self.optical_length[at],
            optical_path_difference=self.optical_path_difference[at],
            n=self.n[at],
            end=self._ending_names[self._endings[i]],
            surface=None if surface < 0 else self._surface_names[surface],
        )

    def __repr__(self) -> str:
        return f"<morgana.Rays: {self._summary()}, {len(self.points)} points>"

    def _repr_html_(self) -> str:
        """Returns a picture of at most 200 rays, projected on the plane of their largest
        extent."""
        some = range(0, len(self), max(1, -(-len(self) // MAX_LINES)))
        picture, plane = polylines([self[i].points for i in some if self.offsets[i] < self.offsets[i + 1]])
        return picture + caption(repr(self).strip("<>") + (f": {plane}" if plane else ""))


@comparable
class Polyline(NamedTuple):
    """A single ray. Arrays have an item for each of its points; lengths are in scene units."""

    points: Doubles
    """Positions, (points, 3)."""
    tangents: Doubles
    """Unit directions, (points, 3)."""
    arc_length: Doubles
    """Lengths from the start, (points,)."""
    optical_length: Doubles
    """Optical path lengths from the start, (points,)."""
    optical_path_difference: Doubles
    """Optical path differences, (points,): see :attr:`Rays.optical_path_difference`."""
    n: Doubles
    """Refractive index, (points,)."""
    end: str
    """Cause of the end of the ray: see :attr:`RayEnds.end`."""
    surface: Optional[str]
    """Name of the object on which the ray ended; ``None`` for other ends."""

    def __repr__(self) -> str:
        if not len(self.points):
            return f"<morgana.Polyline: {self.end}>"
        lengths = f"length {self.arc_length[-1]:.6g}, optical length {self.optical_length[-1]:.6g}"
        where = "" if self.surface is None else f" '{self.surface}'"
        return f"<morgana.Polyline: {len(self.points)} points, {lengths}, {self.end}{where}>"


class Connections(NamedTuple):
    """Rays between two points: the result of :func:`connect`."""

    rays: List[Ray]
    """The rays, the primary ray first; see :class:`Ray`."""
    failure: Optional[str]
    """Reason why there is no primary ray, or ``None`` if there is one."""
    unique: bool
    """True if it is certain that there is at most one ray."""

    def __repr__(self) -> str:
        count = "1 ray" if len(self.rays) == 1 else f"{len(self.rays)} rays"
        unique = ", certainly unique" if self.unique else ""
        failure = "" if self.failure is None else f", no primary ray: {self.failure}"
        return f"<morgana.Connections: {count}{unique}{failure}>"


Through = Union[Scene, Field]
Reference = Union[None, float, Field]


@overload
def trace(
    through: Through,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    paths: Literal[True] = ...,
    max_length: Optional[float] = ...,
    reference_index: Reference = ...,
    time: Optional[float] = ...,
) -> Rays: ...
@overload
def trace(
    through: Through,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    paths: bool,
    max_length: Optional[float] = ...,
    reference_index: Reference = ...,
    time: Optional[float] = ...,
) -> RayEnds: ...
def trace(
    through: Through,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    paths: bool = True,
    max_length: Optional[float] = None,
    reference_index: Reference = None,
    time: Optional[float] = None,
) -> RayEnds:
    """Follow rays without scattering.

    Surfaces of a scene refract the rays, or end them; mirrors reflect them. The rays are
    distributed over all CPU cores. Ctrl-C returns the rays followed so far, with ``stopped ==
    "interrupted"``, as :func:`render` does.

    Parameters
    ----------
    through : Scene or Field
        The scene or field to trace. A field has no surfaces and no end.
    origins : array_like, (rays, 3) or (..., 3)
        Starts, in scene units.
    directions : array_like, of the same shape
        Directions, of any nonzero length. A single start or direction can be combined with any
        number of the other.
    paths : bool, optional
        Keep the points of each ray. ``False`` keeps only the ends, in 85 bytes per ray, with the
        same values.
    max_length : float, optional
        Length at which a ray ends, > 0, in scene units. The default suffices for all rays that
        leave the scene; a field needs a value.
    reference_index : float or Field, optional
        Reference index for optical path differences: a number > 0, with straight rays, or a field,
        for which differences are known only at the ends of rays. By default the ``reference_index``
        of a scene's ``aov``, or else the index of the scene's surroundings; for a field, the index
        at the start of each ray.
    time : float, optional
        Seconds after which to stop, > 0. Remaining rays are ``"not followed"``.

    Returns
    -------
    Rays or RayEnds
        The rays in the order of the starts; with ``paths=False``, their ends.

    Raises
    ------
    TypeError
        ``through`` is neither a scene nor a field.
    ValueError
        Shapes that do not match, starts that are not finite, directions of length zero, or a field
        without ``max_length``.
    RenderError
        A length, an index or a time that is not positive.

    Examples
    --------
    >>> field = morgana.load_field({"type": "luneburg"})
    >>> morgana.trace(field, [[0, h, -0.5] for h in (0, 0.2, 0.4)], [0, 0, 1], max_length=1, paths=False)
    <morgana.RayEnds: 3 rays (3 maximum length)>
    """
    if not isinstance(through, (Scene, Field)):
        raise TypeError(f"expected a Scene or a Field to trace through, found {type(through).__name__}")
    x, d = vectors(origins, "origins"), vectors(directions, "directions")
    try:
        x, d = np.broadcast_arrays(x, d)
    except ValueError:
        message = f"origins have shape {x.shape} but directions {d.shape}: give as many of each, or a single one of either"
        raise ValueError(message) from None
    max_length = checks.optional_positive(max_length, "max_length")
    time = checks.optional_positive(time, "time")
    if not isinstance(reference_index, Field):
        reference_index = checks.optional_positive(reference_index, "reference_index")
    if max_length is None and isinstance(through, Field):
        raise ValueError("a field has no end: give max_length, the length of the rays in scene units")
    ends, traced, stopped = _morgana.trace(
        through,
        x.reshape(-1, 3),
        d.reshape(-1, 3),
        {"max_length": max_length, "reference_index": reference_index, "time": time, "paths": checks.truth(paths, "paths")},
    )
    return RayEnds(ends, stopped) if traced is None else Rays(ends, traced, stopped)


def connect(
    scene: Scene,
    a: ArrayLike,
    b: ArrayLike,
    *,
    all: bool = False,
    reflections: int = 0,
) -> Connections:
    """Find the primary ray between two points, or all rays.

    Parameters
    ----------
    scene : Scene
        The scene.
    a, b : array_like, (3,)
        The two points, in scene units.
    all : bool, optional
        Search for all rays (branches), as renders do, instead of only the primary ray, which is
        found from a fixed start.
    reflections : int, optional
        With ``all``, also search for rays with up to this number of reflections where refraction is
        possible, 0 to 28.

    Returns
    -------
    Connections
        The rays, and the reason if there is none.

    Raises
    ------
    RenderError
        Points that are not three finite numbers each, or ``reflections`` without ``all``.

    Examples
    --------
    >>> found = morgana.connect(scene, [-0.5, 0.2, 0], [0.7, 0, 0.1], all=True)
    >>> [ray.optical_length for ray in found.rays]
    """
    checks.scene(scene)
    reflections = checks.whole(reflections, "reflections", 0, 28)
    if reflections and not all:
        raise RenderError("reflections is for all=True: the primary ray has none")
    x, y = numbers(a, "a"), numbers(b, "b")
    for name, point in (("a", x), ("b", y)):
        if point.shape != (3,) or not np.isfinite(point).all():
            raise RenderError(f"connect takes two points of three finite numbers each, but {name} is {point.tolist()!r:.80}")
    return Connections(*_morgana.connect(scene, x, y, reflections if all else None))
