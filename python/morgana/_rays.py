"""Single rays."""

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
from ._values import alike, comparable

Doubles = NDArray[np.float64]
Objects = NDArray[np.object_]


class RayEnds:
    """Where rays ended that :func:`trace` has followed: row i of each array belongs to ray i.

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
    """Optical path lengths less those of rays in the ``reference_index`` of :func:`trace`, (rays,), in scene units.

    The rays of the reference join the start, the points of reflection and the end. The differences are in double precision,
    good to 1e-7 of the largest contrast times the length. Divide by the wavelength in vacuum for waves. NaN where no ray of
    the reference joins the ends.
    """
    stopped: Optional[str]
    """Why some rays were not followed: ``"interrupted"``, ``"time"``, or ``None`` if all were."""

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
        """How each ray ended, (rays,), texts.

        ``"surface"``, ``"left the scene"``, ``"maximum length"``, ``"lost"`` if the ray left the field of its medium or took
        too many steps, or ``"not followed"`` if the time was over. For a mask, compare: ``rays.end == "surface"``.
        """
        return np.array(self._ending_names, object)[self._endings]

    @property
    def surface(self) -> Objects:
        """Name of the object that each ray ended on, (rays,), texts; ``None`` for other ends."""
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
"""What is known of points, and asked for when it is first needed."""


class Rays(RayEnds):
    """Rays that :func:`trace` has followed, with the points on their way. Item i is ray i, as a :class:`Polyline`.

    The points of all rays lie in shared arrays, ray after ray: those of ray i from ``offsets[i]`` to ``offsets[i + 1]``. A
    ray that was not followed has none.
    """

    def __init__(self, ends: _morgana.Ends, traced: _morgana.Traced, stopped: Optional[str]) -> None:
        super().__init__(ends, stopped)
        self._traced = traced

    def __getstate__(self) -> Dict[str, Any]:
        known = {name: value for name, value in self.__dict__.items() if name != "_traced"}
        return {**known, **{name: getattr(self, name) for name in OF_POINTS}}

    @functools.cached_property
    def offsets(self) -> NDArray[np.int64]:
        """Where each ray begins among the points, and the number of all points, (rays + 1,)."""
        return self._traced.offsets()

    @functools.cached_property
    def points(self) -> Doubles:
        """Positions, (points, 3), in scene units: wherever a ray has turned by 0.03 rad, and at surfaces."""
        return self._traced.positions()

    @functools.cached_property
    def tangents(self) -> Doubles:
        """Unit directions at the points, (points, 3); those of departure where a ray changes its direction."""
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
        """Optical path differences from the start, (points,), in scene units: see ``total_optical_path_difference``.

        Against a field they are known at the ends of rays only, and NaN before.
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


@comparable
class Polyline(NamedTuple):
    """One ray. Arrays have an item for each of its points; lengths are in scene units."""

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
    """How it ended: see :attr:`RayEnds.end`."""
    surface: Optional[str]
    """Name of the object that it ended on, if it ended on one."""

    def __repr__(self) -> str:
        if not len(self.points):
            return f"<morgana.Polyline: {self.end}>"
        lengths = f"length {self.arc_length[-1]:.6g}, optical length {self.optical_length[-1]:.6g}"
        where = "" if self.surface is None else f" '{self.surface}'"
        return f"<morgana.Polyline: {len(self.points)} points, {lengths}, {self.end}{where}>"


class Connections(NamedTuple):
    """The rays between two points that :func:`connect` has found."""

    rays: List[Ray]
    """The rays, the primary one first; see :class:`Ray`."""
    failure: Optional[str]
    """Why there is no primary ray, or ``None`` if there is one."""
    unique: bool
    """Whether it is certain that there is at most one ray."""

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
    """Follow rays without scattering: at surfaces of a scene they are refracted, reflected by mirrors, or end.

    All processors share the rays. Ctrl-C returns what there is, with ``stopped == "interrupted"``, as :func:`render` does.

    Parameters
    ----------
    through : Scene or Field
        What the rays go through. A field has no surfaces and no end.
    origins : array_like, (rays, 3) or (..., 3)
        Starts, in scene units.
    directions : array_like, of the same shape
        Directions, of any length but zero. A single start or direction goes with any number of the other.
    paths : bool, optional
        Whether to keep the points on the way of each ray. ``False`` keeps the ends only, in 85 bytes per ray, with the same
        values.
    max_length : float, optional
        Length after which a ray ends, > 0, in scene units. Long enough by default for anything that leaves the scene; a field
        needs it.
    reference_index : float or Field, optional
        Index against which optical path differences are taken: a number > 0, whose rays are straight, or a field, against
        which they are known at the ends of rays only. By default the ``reference_index`` of a scene's ``aov``, or else the
        index of the scene's surroundings; for a field, the index where each ray starts.
    time : float, optional
        Seconds after which to stop, > 0. Rays that are left then are ``"not followed"``.

    Returns
    -------
    Rays or RayEnds
        The rays in the order of the starts; with ``paths=False`` their ends.

    Raises
    ------
    TypeError
        ``through`` is neither a scene nor a field.
    ValueError
        Shapes that do not fit, starts that are not finite, directions of no length, or a field without ``max_length``.
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
    """Find the ray between two points, or every ray.

    Parameters
    ----------
    scene : Scene
        Where.
    a, b : array_like, (3,)
        The two points, in scene units.
    all : bool, optional
        Whether to look for all rays (branches), as renders do, instead of the primary one, which is found from a fixed start.
    reflections : int, optional
        With ``all``, also look for rays that are reflected up to so many times where they could have been refracted, 0 to 28.

    Returns
    -------
    Connections
        The rays, and why there is none.

    Raises
    ------
    RenderError
        Something else than two points of three finite numbers, or ``reflections`` without ``all``.

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
