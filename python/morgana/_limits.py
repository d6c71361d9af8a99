"""What is asked for of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, List, Optional, Tuple, TypedDict, Union

if TYPE_CHECKING:
    from ._morgana import Field


class Instead(TypedDict):
    """What takes the place of what a scene says."""

    integrator: Optional[str]
    sampler: Optional[str]
    adaptive: bool
    undisturbed: bool
    silence: List[str]
    """Names of checks that do not warn."""
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


class By(TypedDict):
    """What light is differentiated by, as the compiled part takes it."""

    parameters: List[str]
    integrator: Optional[str]
    """Instead of the scene's."""


class RayOptions(TypedDict):
    """Where rays go whose derivatives are taken, as the compiled part takes it."""

    region: Optional[Tuple[Tuple[float, float, float], Tuple[float, float, float]]]
    """Corners of the box; without, the field is everywhere."""
    ambient: float
    """Index around the box."""
    nodes: bool
    """Whether the outermost samples lie on the faces of the box."""
    plane: Optional[Tuple[Tuple[float, float, float], Tuple[float, float, float]]]
    """A point and a unit normal; without, rays end where they leave the box."""
    tolerance: float
    max_length: float
    """Scene units."""


class TraceOptions(TypedDict):
    """How rays are followed, as the compiled part takes it."""

    max_length: Optional[float]
    """Scene units; a field needs it."""
    reference_index: Union[None, float, Field]
    time: Optional[float]
    """Seconds."""
    paths: bool
    """Whether the points of each ray are kept."""
