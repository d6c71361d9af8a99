"""Selection of bins: by position, and by coordinates of named axes."""

from __future__ import annotations

import operator
from typing import Any, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Which = Union[int, slice]


class Axis(NamedTuple):
    """Axis of an estimate, with the coordinates of its bins."""

    name: str
    size: int
    edges: Optional[Doubles] = None
    """Edges of the bins; ``None`` for named or numbered items."""
    names: Optional[List[Any]] = None
    """Names of the items, such as channels, or their coordinates, such as delays; ``None`` if they
    have neither."""

    @property
    def has_points(self) -> bool:
        """True if the items have numbers as coordinates instead of names or bins."""
        return bool(self.names) and not any(isinstance(name, str) for name in self.names or [])

    @property
    def coordinates(self) -> NDArray[Any]:
        """Centres of the bins, names of the items, or their numbers."""
        if self.edges is not None:
            return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))
        if self.names is None:
            return np.arange(self.size)
        return np.array(self.names) if self.has_points else np.array(self.names, dtype=np.str_)

    def taken(self, which: Which) -> Optional["Axis"]:
        """Returns the axis of some bins; ``None`` if a single bin is taken."""
        if not isinstance(which, slice):
            return None
        start, stop, _ = which.indices(self.size)
        stop = max(start, stop)
        edges = None if self.edges is None else self.edges[start : stop + 1]
        return Axis(self.name, stop - start, edges, None if self.names is None else self.names[start:stop])

    def place(self, wanted: Any) -> Which:
        """Returns the position of a coordinate, or of a range of coordinates."""
        if isinstance(wanted, slice):
            return self._range(wanted)
        if self.has_points:
            return self._point(_number(wanted, self.name))
        if self.names is not None:
            if str(wanted) not in self.names:
                raise KeyError(f"no {self.name} {wanted!r}: there are {', '.join(map(repr, self.names))}")
            return self.names.index(str(wanted))
        value = _number(wanted, self.name)
        if self.edges is None:
            if value != int(value) or not 0 <= value < self.size:
                raise IndexError(f"{self.name} is {wanted!r} but must be a whole number from 0 to {self.size - 1}")
            return int(value)
        low, high = float(np.min(self.edges)), float(np.max(self.edges))
        if not low <= value <= high:
            raise IndexError(f"{self.name} is {value:g} but the bins reach from {low:g} to {high:g}")
        if self.edges[0] > self.edges[-1]:
            return self.size - 1 - _bin(self.edges[::-1], value)
        return _bin(self.edges, value)

    def _point(self, value: float) -> int:
        """Returns the position of the item with a coordinate, up to rounding."""
        distances = np.abs(self.coordinates - value)
        nearest = int(np.argmin(distances))
        if distances[nearest] > 1e-9 * abs(value):
            listed = ", ".join(f"{point:g}" for point in self.coordinates[:8]) + ", …" * (self.size > 8)
            raise KeyError(f"no {self.name} {value:g}: there are {listed}")
        return nearest

    def _range(self, wanted: slice) -> slice:
        """Returns the positions of the bins whose centres are in a range that includes its
        ends."""
        if wanted.step is not None:
            raise ValueError(f"the range of {self.name} has a step: give its first and last value, {self.name}=slice(first, last)")
        if self.names is not None and not self.has_points:
            ends = [None if end is None else self.place(end) for end in (wanted.start, wanted.stop)]
            last = None if ends[1] is None else int(ends[1]) + 1  # type: ignore[arg-type]
            return slice(ends[0], last)
        first, last_ = (default if end is None else _number(end, self.name) for end, default in ((wanted.start, -np.inf), (wanted.stop, np.inf)))
        centres = self.coordinates
        inside = np.flatnonzero((centres >= first) & (centres <= last_))
        if not inside.size:
            reach = f"{centres.min():g} to {centres.max():g}" if self.size else "nowhere"
            raise IndexError(f"no bin of {self.name} has its centre from {first:g} to {last_:g}: the centres reach from {reach}")
        return slice(int(inside[0]), int(inside[-1]) + 1)


def _number(value: Any, name: str) -> float:
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {value!r} but must be a number, or a range such as slice(0, 10)") from None
    if np.isnan(number):
        raise ValueError(f"{name} is NaN")
    return number


def _bin(edges: Doubles, value: float) -> int:
    """Returns the bin that contains a value. Bins contain their lower edge; the last bin contains
    both edges."""
    return min(int(np.searchsorted(edges, value, side="right")), len(edges) - 1) - 1


def positions(axes: List[Axis], wanted: Any) -> List[Which]:
    """Returns the positions along each axis, from an index as in ``array[index]``: whole numbers,
    slices and ``...``."""
    index: Tuple[Any, ...] = wanted if isinstance(wanted, tuple) else (wanted,)
    dots = [i for i, each in enumerate(index) if each is Ellipsis]
    if len(dots) > 1:
        raise IndexError("an index can have only one '...'")
    left = len(axes) - (len(index) - len(dots))
    if left < 0:
        raise IndexError(f"too many indices: {len(index) - len(dots)} for the axes {', '.join(axis.name for axis in axes) or '(none)'}")
    at = dots[0] if dots else len(index)
    full: Tuple[Any, ...] = index[:at] + (slice(None),) * left + index[at + len(dots) :]
    return [position(axis, each) for axis, each in zip(axes, full)]


def position(axis: Axis, wanted: Any) -> Which:
    """Returns a checked position along an axis."""
    if isinstance(wanted, slice):
        if wanted.step not in (None, 1):
            raise IndexError(f"the slice of {axis.name} has the step {wanted.step}, which leaves gaps between bins: use 1, or index .mean and .error")
        return wanted
    try:
        i = operator.index(wanted)
    except TypeError:
        raise TypeError(
            f"the index of {axis.name} is {wanted!r:.60} but must be a whole number or a slice: use sel() for coordinates, and .mean[...] for arrays of indices"
        ) from None
    if isinstance(wanted, (bool, np.bool_)):
        raise TypeError(f"the index of {axis.name} is {wanted} but must be a whole number or a slice")
    if not -axis.size <= i < axis.size:
        raise IndexError(f"index {i} of {axis.name} is out of range: there are {axis.size}")
    return i % axis.size


def by_name(axes: List[Axis], wanted: Mapping[str, Any]) -> List[Tuple[Axis, Any]]:
    """Returns the wanted value for each axis, by default all of it."""
    known = [axis.name for axis in axes]
    for name in wanted:
        if name not in known:
            raise KeyError(f"no axis {name!r}: there are {', '.join(map(repr, known)) or 'none'}")
    return [(axis, wanted.get(axis.name, slice(None))) for axis in axes]
