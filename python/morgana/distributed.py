"""Renders that many processes share, on one machine or on a cluster.

Any executor in the style of :mod:`concurrent.futures` will do, and a client of Dask:

    >>> import concurrent.futures, morgana.distributed
    >>> with concurrent.futures.ProcessPoolExecutor() as pool:
    ...     result = morgana.distributed.render("scenes/luneburg_fog.xml", pool, spp=64)

    >>> from dask.distributed import Client
    >>> result = morgana.distributed.render("/shared/fog.xml", Client("scheduler:8786"), spp=4096)

The result is that of :func:`morgana.render`, bit for bit, whoever computed which part and however often.
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
from ._scene import Define, load_dict, load_file

__all__ = ["render"]

SHARDS = 64
"""Parts of a run if their number is not given: enough to keep some tens of workers busy to the end."""

SMALL = 1 << 20
"""Bytes that are sent along with every task. More of them go by a file, or are scattered once."""

Description = Union[Scene, str, "os.PathLike[str]", Mapping[str, Any]]


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
    """Render a scene, or measure if it has meters, by the workers of an executor.

    The samples are divided into parts, which may be computed in any order, by any worker, and more than once. Ctrl-C returns
    what is complete so far, with ``stopped == "interrupted"``.

    Parameters
    ----------
    scene : Scene, path_like or mapping
        A scene, which workers make again; a scene file, which all workers must be able to read; or a dictionary, as for
        :func:`morgana.load_dict`. Its arrays travel once, not with every part: through Dask's memory, or for other executors
        through a file in ``folder``.
    executor
        Has ``submit`` as in :mod:`concurrent.futures`; or a client of ``dask.distributed``.
    parameters : mapping, optional
        Values for the scene's parameters, as the keywords of :func:`morgana.load_file`.
    spp : int, optional
        As for :func:`morgana.render`.
    particles : int, optional
        As for :func:`morgana.render`.
    seed : int, optional
        As for :func:`morgana.render`.
    integrator : str, optional
        As for :func:`morgana.render`.
    shards : int, optional
        Number of parts, ≥ 1; by default 64, or as many as there are samples. More of them are shared out more evenly, and cost
        more to send: each is as large as the image with its sums, some 140 bytes per pixel.
    threads : int, optional
        Threads for each part; 0 for as many as the worker has processors.
    retries : int, optional
        How often a part is tried again whose worker was lost or failed, ≥ 0.
    folder : path_like, optional
        Where workers can read a file that this process writes, for large dictionaries and executors other than Dask. By default
        a folder for temporary files, which does if all workers are on this machine.
    progress : bool or callable, optional
        As for :func:`morgana.render`.

    Returns
    -------
    Result
        What :func:`morgana.render` returns, bit for bit. ``stats["threads"]`` is ``None``.

    Raises
    ------
    RenderError
        What was asked for does not fit the scene; or a part failed more often than ``retries``.
    SceneError
        The scene cannot be used.

    Examples
    --------
    >>> with concurrent.futures.ProcessPoolExecutor() as pool:
    ...     result = morgana.distributed.render("scenes/luneburg_fog.xml", pool, spp=64)
    """
    started = time.monotonic()
    source = _Source.of(scene, dict(parameters or {}))
    loaded = source.load()
    shards = checks.optional_whole(shards, "shards", 1)
    threads = checks.whole(threads, "threads", 0, checks.MOST_THREADS)
    retries = checks.whole(retries, "retries", 0)
    if not hasattr(executor, "submit"):
        raise TypeError(f"expected an executor with a method submit, found {type(executor).__name__}")
    wanted = limits(loaded, spp, particles, seed, integrator, threads or None)
    total = wanted["samples"] or 0
    count = min(shards or SHARDS, total)
    parts = _morgana.Parts()
    with _shared(source, executor, retries, folder) as (submit, where):

        def start(shard: int) -> "concurrent.futures.Future[bytes]":
            future: "concurrent.futures.Future[bytes]" = submit(
                _part, loaded.hash, where, wanted, integrator, [shard, count]
            )
            return future

        with Bar(loaded, total, None, progress) as tick:
            interrupted = _gather(parts, _Tasks(start, count, retries), tick, loaded)
    run = parts.result(loaded, wanted, integrator, interrupted, time.monotonic() - started)
    return Result(loaded, run)


class _Source(NamedTuple):
    """How to make a scene."""

    scene: Any
    """A scene, the absolute path of one, or a dictionary."""
    parameters: Dict[str, Any]

    @classmethod
    def of(cls, scene: Description, parameters: Dict[str, Any]) -> "_Source":
        if isinstance(scene, Mapping):
            return cls(dict(scene), parameters)
        if isinstance(scene, Scene):
            if parameters:
                raise RenderError("a Scene has its parameters already: give them to load_file or load_dict")
            return cls(scene, parameters)
        return cls(os.path.abspath(scene), parameters)

    def load(self) -> Scene:
        if isinstance(self.scene, Scene):
            return self.scene
        if isinstance(self.scene, dict):
            return load_dict(self.scene, **self.parameters)
        return load_file(self.scene, **self.parameters)


class _Tasks:
    """Parts that are being computed, and those that have to be tried again."""

    def __init__(self, start: Any, count: int, retries: int) -> None:
        self._start = start
        self._left = {shard: retries for shard in range(count)}
        self.pending = {start(shard): shard for shard in range(count)}

    def result(self, future: "concurrent.futures.Future[bytes]") -> Optional[bytes]:
        """The part, or ``None`` if it is tried again."""
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
    """Adds up parts as they come; whether that was interrupted."""
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
    """How to submit tasks, and what tells them where the scene is."""
    data = pickle.dumps(source)
    if hasattr(executor, "get_executor"):
        # A client of Dask, whose executors know what was scattered.
        scattered = data if len(data) <= SMALL else executor.scatter(data, broadcast=True)
        yield executor.get_executor(retries=retries).submit, scattered
    elif len(data) <= SMALL:
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
"""The scene that this process rendered last, by its hash: workers load it once."""


def _part(
    key: str, where: Union[bytes, str], wanted: Limits, integrator: Optional[str], shard: List[int]
) -> bytes:
    """Takes a part of the samples; what workers do."""
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
