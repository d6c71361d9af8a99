"""What is asked for of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Tuple, TypedDict, Union

if TYPE_CHECKING:
    from ._morgana import Field


class Instead(TypedDict):
    """What takes the place of what a scene says."""

    integrator: Optional[str]
    sampler: Optional[str]
    adaptive: bool
    undisturbed: bool
    memory: Optional[int]
    """Bytes that each data file may take."""


class Limits(TypedDict):
    """As the compiled part takes it."""

    seed: int
    samples: Optional[int]
    """Samples per pixel, or particles; without a number, something else ends the run."""
    time: Optional[float]
    """Seconds."""
    target_error: Optional[Tuple[float, bool]]
    """Relative error at which to stop, and whether it is that of pixels."""
    threads: int
    """0 for as many as there are processors."""


class TraceOptions(TypedDict):
    """How rays are followed, as the compiled part takes it."""

    max_length: Optional[float]
    """Scene units; a field needs it."""
    reference_index: Union[None, float, Field]
    time: Optional[float]
    """Seconds."""
    paths: bool
    """Whether the points of each ray are kept."""
