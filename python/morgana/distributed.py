"""Distributed renders by many processes, on one machine or on a cluster.

Any executor in the style of :mod:`concurrent.futures` works, as does a Dask client:

    >>> import concurrent.futures, morgana.distributed
    >>> with concurrent.futures.ProcessPoolExecutor() as pool:
    ...     result = morgana.distributed.render("scenes/luneburg_fog.xml", pool, spp=64)

    >>> from dask.distributed import Client
    >>> result = morgana.distributed.render("/shared/fog.xml", Client("scheduler:8786"), spp=4096)

The result equals the result of :func:`morgana.render`, bit for bit. It does not depend on which
worker computes which part, and how often.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import os
import pickle
import tempfile
import threading
import time
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

from . import _checks as checks
from . import _morgana
from ._errors import Error, RenderError
from ._limits import Limits
from ._morgana import Scene
from ._progress import Bar
from ._render import Progress, limits
from ._result import Result
from ._scene import Define
from ._source import Description, loaded

__all__ = ["render"]

SHARDS = 64
"""Default number of parts of a run: enough to keep some tens of workers busy to the end."""

MAX_TASK_BYTES = 1 << 20
"""Maximum number of bytes that are sent with every task. More bytes travel in a file, or are
scattered once."""


def render(
    scene: Description,
    executor: Any,
    *,
    parameters: Optional[Mapping[str, Define]] = None,
    spp: Optional[int] = None,
    particles: Optional[int] = None,
    seed: int = 0,
    integrator: Optional[str] = None,
    shards: Optional[int] = None,
    threads: int = 1,
    retries: int = 3,
    folder: Union[None, str, "os.PathLike[str]"] = None,
    progress: Progress = False,
) -> Result:
    """Render a scene, or measure if it has meters, on the workers of an executor.

    The samples are divided into parts. Parts may be computed in any order, by any worker, and more
    than once. Ctrl-C returns the complete parts, with ``stopped == "interrupted"``.

    Parameters
    ----------
    scene : Scene, path_like or mapping
        A scene, which each worker loads again; a scene file, which all workers must be able to
        read; or a dictionary, as for :func:`morgana.load_dict`. Its arrays are sent once, not with
        every part: through Dask's memory, or for other executors through a file in ``folder``.
    executor
        Executor with ``submit`` as in :mod:`concurrent.futures`, or a client of
        ``dask.distributed``.
    parameters : mapping, optional
        Values of the scene's parameters, as the keywords of :func:`morgana.load_file`.
    spp : int, optional
        As for :func:`morgana.render`.
    particles : int, optional
        As for :func:`morgana.render`.
    seed : int, optional
        As for :func:`morgana.render`.
    integrator : str, optional
        As for :func:`morgana.render`.
    shards : int, optional
        Number of parts, ≥ 1; by default 64, or the number of samples if that is less. More parts
        distribute the work more evenly, and cost more to send: each is as large as the image with
        its sums, some 140 bytes per pixel.
    threads : int, optional
        Threads for each part; 0 for the number of CPU cores of the worker.
    retries : int, optional
        Number of retries, ≥ 0, of a part whose worker was lost or failed.
    folder : path_like, optional
        Folder in which this process writes a file that workers can read, for large dictionaries and
        executors other than Dask. By default a folder for temporary files, which suffices if all
        workers are on this machine.
    progress : bool or callable, optional
        As for :func:`morgana.render`.

    Returns
    -------
    Result
        Result of :func:`morgana.render`, bit for bit. ``stats["threads"]`` is ``None``.

    Raises
    ------
    RenderError
        The options do not fit the scene; or a part failed more often than ``retries``.
    SceneError
        The scene cannot be used.

    Examples
    --------
    >>> with concurrent.futures.ProcessPoolExecutor() as pool:
    ...     result = morgana.distributed.render("scenes/luneburg_fog.xml", pool, spp=64)
    """
    started = time.monotonic()
    source = _Source.of(scene, dict(parameters or {}))
    made = source.load()
    shards = checks.optional_whole(shards, "shards", 1)
    threads = checks.whole(threads, "threads", 0, checks.MAX_THREADS)
    retries = checks.whole(retries, "retries", 0)
    if not hasattr(executor, "submit"):
        raise TypeError(f"expected an executor with a method submit, found {type(executor).__name__}")
    wanted = limits(made, spp, particles, seed, integrator, threads or None)
    total = wanted["samples"] or 0
    count = min(shards or SHARDS, total)
    parts = _morgana.Parts()
    with _shared(source, executor, retries, folder) as (submit, where):

        def start(shard: int) -> "concurrent.futures.Future[bytes]":
            future: "concurrent.futures.Future[bytes]" = submit(
                _part, made.hash, where, wanted, integrator, [shard, count]
            )
            return future

        with Bar(made, total, None, progress) as tick:
            interrupted = _gather(parts, _Tasks(start, count, retries), tick, made)
    run = parts.result(made, wanted, integrator, interrupted, time.monotonic() - started)
    return Result(made, run)


class _Source(NamedTuple):
    """Source from which workers make a scene."""

    scene: Any
    """A scene, the absolute path of a scene file, or a dictionary."""
    parameters: Dict[str, Any]

    @classmethod
    def of(cls, scene: Description, parameters: Dict[str, Any]) -> "_Source":
        if isinstance(scene, Mapping):
            return cls(dict(scene), parameters)
        if isinstance(scene, Scene):
            if parameters:
                raise RenderError("a Scene has fixed parameters: give them to load_file or load_dict")
            return cls(scene, parameters)
        return cls(os.path.abspath(scene), parameters)

    def load(self) -> Scene:
        return loaded(self.scene, self.parameters)


class _Tasks:
    """Parts that are being computed, with their remaining retries."""

    def __init__(self, start: Any, count: int, retries: int) -> None:
        self._start = start
        self._left = {shard: retries for shard in range(count)}
        self.pending = {start(shard): shard for shard in range(count)}

    def result(self, future: "concurrent.futures.Future[bytes]") -> Optional[bytes]:
        """Returns the part, or ``None`` if it is tried again."""
        shard = self.pending.pop(future)
        try:
            return future.result()
        except (Error, TypeError):
            raise
        except Exception as error:
            if self._left[shard] == 0 or isinstance(error, concurrent.futures.BrokenExecutor):
                raise RenderError(f"part {shard} failed: {type(error).__name__}: {error}") from error
            self._left[shard] -= 1
            self.pending[self._start(shard)] = shard
            return None

    def cancel(self) -> None:
        for future in self.pending:
            future.cancel()


def _gather(parts: _morgana.Parts, tasks: _Tasks, tick: Any, scene: Scene) -> bool:
    """Adds up parts as they complete. Returns True after an interruption."""
    try:
        while tasks.pending:
            first = concurrent.futures.FIRST_COMPLETED
            for future in concurrent.futures.wait(tasks.pending, return_when=first).done:
                part = tasks.result(future)
                if part is not None:
                    parts.add(part)
                    if tick is not None:
                        tick(parts.done * scene._samples_per_spp)
    except KeyboardInterrupt:
        if parts.done == 0:
            raise
        return True
    finally:
        tasks.cancel()
    return False


@contextlib.contextmanager
def _shared(source: _Source, executor: Any, retries: int, folder: Any) -> Iterator[Tuple[Any, Any]]:
    """Yields the function that submits tasks, and the argument that tells tasks where the scene
    is."""
    data = pickle.dumps(source)
    if hasattr(executor, "get_executor"):
        # Use a Dask client's executor, which resolves scattered data.
        scattered = data if len(data) <= MAX_TASK_BYTES else executor.scatter(data, broadcast=True)
        yield executor.get_executor(retries=retries).submit, scattered
    elif len(data) <= MAX_TASK_BYTES:
        yield executor.submit, data
    else:
        file, path = tempfile.mkstemp(prefix="morgana-", suffix=".scene", dir=folder)
        try:
            with os.fdopen(file, "wb") as opened:
                opened.write(data)
            del data
            yield executor.submit, path
        finally:
            os.unlink(path)


_lock = threading.Lock()
_kept: List[Tuple[str, Scene]] = []
"""Scene of the last part that this process rendered, with its hash: workers load it once."""


def _part(
    key: str, where: Union[bytes, str], wanted: Limits, integrator: Optional[str], shard: List[int]
) -> bytes:
    """Takes the samples of a part, on a worker."""
    with _lock:
        if not _kept or _kept[0][0] != key:
            _kept.clear()
            _kept.append((key, _load(where)))
        scene = _kept[0][1]
    if scene.hash != key:
        raise RenderError("a worker reads another scene than was given: its files differ, or have changed")
    return _morgana.render_part(scene, wanted, integrator, shard)


def _load(where: Union[bytes, str]) -> Scene:
    if isinstance(where, str):
        with open(where, "rb") as file:
            where = file.read()
    source: _Source = pickle.loads(where)
    return source.load()
