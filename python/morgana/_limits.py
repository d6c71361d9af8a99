"""Options of runs, for the compiled part."""

from __future__ import annotations

from typing import TYPE_CHECKING, List, Optional, Tuple, TypedDict, Union

if TYPE_CHECKING:
    from ._morgana import Field


class Overrides(TypedDict):
    """Settings that replace settings of a scene."""

    integrator: Optional[str]
    sampler: Optional[str]
    adaptive: bool
    undisturbed: bool
    silence: List[str]
    """Names of checks that do not warn."""
    memory: Optional[int]
    """Maximum number of bytes of each data file."""


class Limits(TypedDict):
    """Limits of a run."""

    seed: int
    samples: Optional[int]
    """Samples per pixel, or particles; ``None`` if another limit ends the run."""
    time: Optional[float]
    """Time limit in seconds."""
    target_error: Optional[Tuple[float, bool]]
    """Relative error at which to stop, and True if it is the error of pixels."""
    threads: int
    """Number of threads; 0 for the number of CPU cores."""


class By(TypedDict):
    """Parameters of the derivatives of light."""

    parameters: List[str]
    integrator: Optional[str]
    """Integrator instead of the scene's."""


class RayOptions(TypedDict):
    """Region, exit and accuracy of rays with derivatives."""

    region: Optional[Tuple[Tuple[float, float, float], Tuple[float, float, float]]]
    """Corners of the box; ``None`` for a field without bounds."""
    ambient: float
    """Index around the box."""
    nodes: bool
    """True if the outermost samples lie on the faces of the box."""
    plane: Optional[Tuple[Tuple[float, float, float], Tuple[float, float, float]]]
    """Point and unit normal of the exit; ``None`` if rays end where they leave the box."""
    tolerance: float
    max_length: float
    """Maximum length of rays, in scene units."""


class TraceOptions(TypedDict):
    """Options of ray tracing."""

    max_length: Optional[float]
    """Maximum length of rays, in scene units; required for a field."""
    reference_index: Union[None, float, Field]
    time: Optional[float]
    """Time limit in seconds."""
    paths: bool
    """True to keep the points of each ray."""
