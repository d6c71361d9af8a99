"""Single rays."""

from __future__ import annotations

import functools
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana
from ._morgana import Field, Ray, Scene
from ._numbers import numbers

Doubles = NDArray[np.float64]


ARRAYS = ("offsets", "points", "tangents", "arc_length", "optical_length", "optical_path_difference", "n")
"""What is known of rays."""


class Rays:
    """Rays that :func:`trace` has followed. Item i is ray i, as a :class:`Polyline`.

    The points of all rays lie in shared arrays, ray after ray: those of ray i from ``offsets[i]`` to ``offsets[i + 1]``.
    """

    def __init__(self, traced: _morgana.Traced) -> None:
        self._traced = traced

    def __getstate__(self) -> Dict[str, Any]:
        return {name: getattr(self, name) for name in (*ARRAYS, "_endings")}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        self.__dict__.update(state)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rays):
            return NotImplemented
        pairs = ((getattr(self, name), getattr(other, name)) for name in ARRAYS)
        return self._endings == other._endings and all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)

    __hash__ = None  # type: ignore[assignment]

    @functools.cached_property
    def offsets(self) -> NDArray[np.int64]:
        """Where each ray begins among the points, and the number of all points: (rays + 1,)."""
        return self._traced.offsets()

    @functools.cached_property
    def points(self) -> Doubles:
        """Positions, (points, 3), in scene units: wherever a ray has turned by 0.03, and at surfaces."""
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
        """Optical path lengths from the start less those of straight rays in the reference index of :func:`trace`, (points,),
        in scene units. The straight rays join the start, the points where the ray was reflected, and the point. In double
        precision, to 1e-7 of the largest contrast times the length. In waves: divided by the wavelength in vacuum."""
        return self._traced.path_differences()

    @functools.cached_property
    def n(self) -> Doubles:
        """Refractive index at the points, (points,)."""
        return self._traced.indices()

    @functools.cached_property
    def _endings(self) -> List[Tuple[str, Optional[str]]]:
        return self._traced.endings()

    @property
    def end(self) -> List[str]:
        """How each ray ended: ``"surface"``, ``"left the scene"``, ``"maximum length"``, or ``"lost"`` if it left the
        field of its medium or took too many steps."""
        return [end for end, _ in self._endings]

    @property
    def surface(self) -> List[Optional[str]]:
        """Name of the object that each ray ended on."""
        return [surface for _, surface in self._endings]

    @property
    def _last(self) -> NDArray[np.int64]:
        return self.offsets[1:] - 1

    @property
    def end_points(self) -> Doubles:
        """Positions where the rays ended, (rays, 3)."""
        return self.points[self._last]

    @property
    def end_tangents(self) -> Doubles:
        """Unit directions in which they ended, (rays, 3)."""
        return self.tangents[self._last]

    @property
    def total_optical_length(self) -> Doubles:
        """Optical path lengths from start to end, (rays,)."""
        return self.optical_length[self._last]

    @property
    def total_optical_path_difference(self) -> Doubles:
        """Optical path differences from start to end, (rays,)."""
        return self.optical_path_difference[self._last]

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, i: int) -> "Polyline":
        if not -len(self) <= i < len(self):
            raise IndexError(f"there are {len(self)} rays")
        i %= len(self)
        at = slice(self.offsets[i], self.offsets[i + 1])
        end, surface = self._endings[i]
        return Polyline(
            points=self.points[at],
            tangents=self.tangents[at],
            arc_length=self.arc_length[at],
            optical_length=self.optical_length[at],
            optical_path_difference=self.optical_path_difference[at],
            n=self.n[at],
            end=end,
            surface=surface,
        )

    def __repr__(self) -> str:
        return f"<morgana.Rays: {len(self)} rays, {len(self.points)} points>"


class Polyline(NamedTuple):
    """One ray. Arrays have an item for each of its points."""

    points: Doubles
    """Positions, (points, 3)."""
    tangents: Doubles
    """Unit directions, (points, 3)."""
    arc_length: Doubles
    """Lengths from the start."""
    optical_length: Doubles
    """Optical path lengths from the start."""
    optical_path_difference: Doubles
    """Optical path differences: see :attr:`Rays.optical_path_difference`."""
    n: Doubles
    """Refractive index."""
    end: str
    """How it ended: see :attr:`Rays.end`."""
    surface: Optional[str]
    """Name of the object that it ended on."""


class Connections(NamedTuple):
    """The rays between two points."""

    rays: List[Ray]
    """Rays that were found; see :class:`Ray`."""
    failure: Optional[str]
    """Why there is no primary ray."""
    unique: bool
    """Whether it is certain that there is at most one ray."""


def trace(
    through: Union[Scene, Field],
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    max_length: Optional[float] = None,
    reference_index: Union[None, float, Field] = None,
) -> Rays:
    """Follow rays without scattering: at surfaces of a scene they are refracted, reflected by mirrors, or end.

    Args:
        through: A scene, or a field, which has no surfaces and no end.
        origins: Starts, (rays, 3) or (..., 3), in scene units.
        directions: Directions, of the same shape; they need not have unit length. A single start or direction goes with
            any number of the other.
        max_length: Length after which a ray ends, in scene units; by default long enough for anything that leaves the
            scene. Through a field it must be given.
        reference_index: Index of which optical path differences are taken: a number, whose rays are straight, or a field,
            against which they are known at the ends of rays only (NaN before, and where no ray of that field joins the
            ends). By default the ``reference_index`` of a scene's ``aov``, or else the index of the scene's surroundings;
            of a field that where each ray starts.

    Raises:
        ValueError: Shapes that do not fit, starts that are not finite, directions of no length, a length or an index that is
            not positive.
    """
    x, d = np.broadcast_arrays(numbers(origins, "origins"), numbers(directions, "directions"))
    for name, value in (("max_length", max_length), ("reference_index", reference_index)):
        if value is not None and not isinstance(value, Field) and not (value > 0 and np.isfinite(value)):
            raise ValueError(f"{name} is {value} but must be a positive number")
    if isinstance(through, Scene):
        return Rays(_morgana.trace(through, x, d, max_length, reference_index))
    if max_length is None:
        raise ValueError("a field has no end: give max_length")
    return Rays(_morgana.trace_field(through, x, d, max_length, reference_index))


def connect(
    scene: Scene,
    a: ArrayLike,
    b: ArrayLike,
    *,
    all: bool = False,
    reflections: int = 0,
) -> Connections:
    """Find the ray between two points, or every ray.

    Args:
        scene: Where.
        a: First point, (3,), in scene units.
        b: Second point, (3,).
        all: Whether to look for all rays (branches), as renders do, instead of the primary one.
        reflections: With ``all``, look also for rays that are reflected up to so many times where they could have been
            refracted.

    Raises:
        RenderError: Something else than two points.
    """
    return Connections(*_morgana.connect(scene, numbers(a, "a"), numbers(b, "b"), reflections if all else None))
