"""Calls of the compiled part for rays with several exit planes, and for means over groups of rays."""

from __future__ import annotations

from typing import Any, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _morgana
from ._limits import RayOptions
from ._system import GradError, Vector

Doubles = NDArray[np.float64]
Rows = Union[slice, NDArray[np.int64]]
Through = Tuple[List[Any], Optional[List[Any]]]
Losses = Tuple[Optional[Doubles], Optional[Doubles], Optional[Doubles]]
"""Numbers by positions, directions and optical lengths; ``None`` for zeros."""
Derivatives = Tuple[List[Doubles], Doubles, List[float]]
"""Derivatives by media, surfaces and the exit."""


class Exits(NamedTuple):
    """Exit planes of rays, and numbers of rays that share an end."""

    options: RayOptions
    """Options of the rays. Its plane belongs to all rays unless there are ``planes``."""
    planes: Tuple[Tuple[Vector, Vector], ...] = ()
    """Point and unit normal of each exit, if the rays have several."""
    which: Optional[NDArray[np.int64]] = None
    """Number of the exit in ``planes`` for each end, (ends,)."""
    per_end: int = 1
    """Number of consecutive rays whose mean is one end."""

    def select(self, rows: NDArray[Any]) -> "Exits":
        """Returns the exits of some of the ends."""
        return self if self.which is None else self._replace(which=self.which[rows])

    def rays_of(self, ends: NDArray[Any], count: int) -> NDArray[Any]:
        """Returns the rows of the rays of some of ``count`` ends, given by numbers or a mask."""
        numbers = np.arange(count)[ends]
        return np.asarray((numbers[:, None] * self.per_end + np.arange(self.per_end)).ravel())

    def follow(self, through: Through, origins: Doubles, directions: Doubles) -> Tuple[Doubles, Doubles, Doubles, NDArray[np.uint8]]:
        """Returns positions, directions, optical lengths and failure codes of the ends."""
        parts = [(rows, _morgana.follow_rays(through, origins[rows], directions[rows], options)) for rows, options in self._calls(len(origins))]
        positions, ways, lengths, codes = self._gathered(parts, len(origins))
        return self._mean(positions), self._mean(ways), self._mean(lengths), np.asarray(codes.reshape(-1, self.per_end).max(axis=1))

    def push(
        self, through: Through, origins: Doubles, directions: Doubles, change: Tuple[List[Doubles], Doubles, Tuple[float, ...]], starts: Sequence[Doubles]
    ) -> Tuple[Doubles, Doubles, Doubles]:
        """Returns changes of positions, directions and optical lengths of the ends."""
        parts = []
        for rows, options in self._calls(len(origins)):
            moved = [start[rows] for start in starts]
            parts.append((rows, _morgana.push_forward(through, origins[rows], directions[rows], options, change, *moved)[:3]))
        positions, ways, lengths = self._gathered(parts, len(origins))
        return self._mean(positions), self._mean(ways), self._mean(lengths)

    def pull(self, through: Through, origins: Doubles, directions: Doubles, by: Losses) -> Tuple[Derivatives, Doubles, Doubles, int]:
        """Returns derivatives by the index, origins and directions, and the number of rays without
        an end that have a loss."""
        whole = [None if one is None else self._shared(one) for one in by]
        found: List[Derivatives] = []
        parts, failed = [], 0
        for rows, options in self._calls(len(origins)):
            here: Losses = tuple(None if one is None else one[rows] for one in whole)  # type: ignore[assignment]
            derivatives, *starts, lost = _morgana.pull_back(through, origins[rows], directions[rows], options, here)
            found.append(derivatives)
            parts.append((rows, starts))
            failed += lost
        by_origins, by_directions = self._gathered(parts, len(origins))
        return _total(found), by_origins, by_directions, failed

    def squares(self, through: Through, origins: Doubles, directions: Doubles, measured: Losses, noise: Vector) -> Tuple[float, Derivatives, int]:
        """Returns the sum of squares of (end − measured)/noise, its derivatives by the index, and
        the number of measured rays without an end. Each end must have one ray."""
        value, found, lost = 0.0, [], 0
        for rows, options in self._calls(len(origins)):
            here: Losses = tuple(None if one is None else one[rows] for one in measured)  # type: ignore[assignment]
            squares, derivatives, missing = _morgana.sum_of_squares(through, origins[rows], directions[rows], options, here, noise)
            value, lost = value + squares, lost + missing
            found.append(derivatives)
        return value, _total(found), lost

    def _calls(self, count: int) -> Iterator[Tuple[Rows, RayOptions]]:
        """Yields the rows of rays that share an exit, and their options."""
        if self.which is None:
            yield slice(None), self.options
            return
        for number, plane in enumerate(self.planes):
            options: RayOptions = {**self.options, "plane": plane}
            rows = self.rays_of(self.which == number, len(self.which))
            if rows.size:
                yield rows, options

    def _gathered(self, parts: Sequence[Tuple[Rows, Sequence[NDArray[Any]]]], count: int) -> List[NDArray[Any]]:
        """Returns arrays of all ``count`` rays from arrays of parts."""
        if self.which is None:
            return list(parts[0][1])
        whole = [np.zeros((count, *one.shape[1:]), one.dtype) for one in (parts[0][1] if parts else ())]
        for rows, arrays in parts:
            for total, one in zip(whole, arrays):
                total[rows] = one
        return whole

    def _mean(self, values: NDArray[Any]) -> Doubles:
        """Returns means over the rays of each end."""
        return values if self.per_end == 1 else np.asarray(values.reshape(-1, self.per_end, *values.shape[1:]).mean(axis=1))

    def _shared(self, by: Doubles) -> Doubles:
        """Returns derivatives by the rays of each end from derivatives by the ends."""
        return by if self.per_end == 1 else np.ascontiguousarray(np.repeat(by / self.per_end, self.per_end, axis=0))


def joined(exits: Sequence[Exits], counts: Sequence[int]) -> Exits:
    """Returns the exits of several bundles, with ``counts`` ends each."""
    first = exits[0]
    for number, other in enumerate(exits[1:], 2):
        for name in ("region", "ambient", "nodes", "tolerance"):
            if other.options[name] != first.options[name]:
                word = {"region": "box", "nodes": "placement"}.get(name, name)
                raise GradError(f"bundles 1 and {number} differ in {word}: joined rays need one {word}")
        if other.per_end != first.per_end:
            raise GradError(f"an end of bundle 1 is a mean over {first.per_end} rays, but an end of bundle {number} over {other.per_end}: give all as many")
        if (other.options["plane"] is None) != (first.options["plane"] is None):
            raise GradError(f"bundles 1 and {number} must both have an exit, or none")
    options: RayOptions = {**first.options, "max_length": max(one.options["max_length"] for one in exits)}
    planes: List[Any] = []
    which = []
    for one, count in zip(exits, counts):
        own = one.planes or (one.options["plane"],)
        for plane in own:
            if plane not in planes:
                planes.append(plane)
        numbers = np.array([planes.index(plane) for plane in own])
        which.append(numbers[one.which] if one.which is not None else np.full(count, numbers[0]))
    if len(planes) == 1:
        return Exits({**options, "plane": planes[0]}, per_end=first.per_end)
    return Exits(options, tuple(planes), np.concatenate(which), first.per_end)


def _total(found: Sequence[Derivatives]) -> Derivatives:
    """Returns the sum of derivatives. Derivatives by the exit exist only for a single exit."""
    media, surfaces, exit = found[0]
    for more, others, _ in found[1:]:
        media = [a + b for a, b in zip(media, more)]
        surfaces = surfaces + others
    return media, surfaces, exit
