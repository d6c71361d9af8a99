"""Progress of a run."""

from __future__ import annotations

import importlib
import sys
import time as clock
from types import TracebackType
from typing import Any, Callable, Optional, Type, Union

from ._morgana import Scene


class Bar:
    """Shows numbers of samples as a progress bar, or passes them to a function."""

    def __init__(
        self,
        scene: Scene,
        samples: Optional[int],
        seconds: Optional[float],
        progress: Union[bool, Callable[[float], object]],
    ) -> None:
        self._total = None if samples is None else samples * scene._samples_per_spp
        self._seconds = seconds
        self._started = clock.monotonic()
        self._show: Optional[Callable[[float], object]] = None
        self._shown: Any = None
        if callable(progress):
            self._show = progress
        elif progress not in (True, False):
            raise TypeError(f"progress is {progress!r} but must be True, False or a function")
        elif progress:
            self._shown = _bar()
            self._show = self._shown.show

    def __enter__(self) -> Optional[Callable[[int], None]]:
        return None if self._show is None else self._tick

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        value: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        if self._show is not None and kind is None:
            self._show(1.0)
        if self._shown is not None:
            self._shown.close()

    def _tick(self, samples: int) -> None:
        share = 0.0
        if self._total:
            share = samples / self._total
        if self._seconds is not None:
            share = max(share, (clock.monotonic() - self._started) / self._seconds)
        if self._show is not None:
            self._show(min(share, 1.0))


def _bar() -> Any:
    try:
        return _Tqdm(importlib.import_module("tqdm.auto").tqdm)
    except ImportError:
        return _Plain()


class _Tqdm:
    def __init__(self, tqdm: Any) -> None:
        self._bar = tqdm(total=1.0, bar_format="{l_bar}{bar}| {elapsed}<{remaining}")

    def show(self, share: float) -> None:
        self._bar.update(share - self._bar.n)

    def close(self) -> None:
        self._bar.close()


class _Plain:
    """A text line that is overwritten in place."""

    WIDTH = 30

    def show(self, share: float) -> None:
        done = round(share * self.WIDTH)
        bar = "━" * done + "─" * (self.WIDTH - done)
        sys.stderr.write(f"\r{bar} {100 * share:3.0f}%")
        sys.stderr.flush()

    def close(self) -> None:
        sys.stderr.write("\n")
