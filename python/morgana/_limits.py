"""What is asked for of a run."""

from typing import Optional, Tuple, TypedDict


class Instead(TypedDict):
    """What takes the place of what a scene says."""

    integrator: Optional[str]
    sampler: Optional[str]
    adaptive: bool
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
