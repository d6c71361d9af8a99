"""Files from which an interrupted reconstruction continues."""

from __future__ import annotations

import contextlib
import hashlib
import os
from typing import TYPE_CHECKING, Any, Iterator, List, Optional, Sequence, Tuple, Type, Union

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .reconstruct import _Problem

Doubles = NDArray[np.float64]
Told = Tuple[Tuple[int, int, int], int, float, int]
"""Fields of an iteration: see :class:`morgana.reconstruct.Iteration`."""
Saved = Tuple[Doubles, List[Told], str]


class Checkpoint:
    """File of one reconstruction: samples, all iterations, and the reason for the end of the
    search. The reason is empty until the search ends."""

    def __init__(self, path: Union[str, "os.PathLike[str]"], problem: "_Problem", error: Type[Exception]) -> None:
        self.path, self.key, self.error = os.fspath(path), _key(problem), error
        self.beside = f"{self.path}.part"
        self.saved: Optional[Saved] = self._read() if os.path.exists(self.path) else None

    def _read(self) -> Saved:
        try:
            # Open the file here: NumPy does not close damaged files that it opened itself.
            with open(self.path, "rb") as opened, np.load(opened, allow_pickle=False) as file:
                key, samples, stopped = str(file["key"]), file["samples"], str(file["stopped"])
                history = [((int(z), int(y), int(x)), int(number), float(value), int(rays)) for z, y, x, number, value, rays in file["history"]]
        except Exception as problem:
            # Catch all exceptions: damaged archives raise BadZipFile, zlib.error,
            # NotImplementedError, RuntimeError, MemoryError and others.
            raise self.error(f"{self.path} is not a checkpoint of a reconstruction: {problem}") from None
        if key != self.key:
            raise self.error(f"{self.path} belongs to other rays, data or options: delete it, or give another file")
        return samples, history, stopped

    def save(self, samples: Doubles, history: Sequence[Told], stopped: str) -> None:
        """Replaces the file atomically: after any interruption, it contains one iteration or the
        next."""
        rows = np.array([(*shape, number, value, rays) for shape, number, value, rays in history], float).reshape(-1, 6)
        with self._writing():
            with open(self.beside, "wb") as file:
                np.savez(file, key=self.key, samples=samples, history=rows, stopped=stopped)
            os.replace(self.beside, self.path)

    def refuse_unwritable(self) -> None:
        """Raises an error, before long iterations, if the file cannot be written."""
        with self._writing():
            open(self.beside, "wb").close()
            os.remove(self.beside)

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as problem:
            raise self.error(f"the checkpoint {self.path} cannot be written: {problem.strerror or problem}") from None


def _key(problem: "_Problem") -> str:
    """Returns a hash of everything that determines the result, except the number of iterations."""
    digest = hashlib.sha256()
    misfit, limits = problem.misfit, problem.limits
    values: List[Any] = [*misfit.rays.starts, problem.start, *(kind.values for kind in misfit.measured)]
    values += [kind.noise for kind in misfit.measured if not isinstance(kind.noise, float)]
    values += [part for part in (limits.known, misfit.rays._exits.which) if part is not None]
    for array in values:
        digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
    names = [(kind.name, kind.noise if isinstance(kind.noise, float) else "") for kind in misfit.measured]
    exits = misfit.rays._exits
    options = (exits.options, exits.planes, exits.per_end, type(misfit.loss).__name__)
    digest.update(repr((options, names, tuple(misfit.weights), limits.lower, limits.upper, problem.grids)).encode() + (b"straight" if problem.straight else b""))
    return digest.hexdigest()
