"""Rendering and measuring."""

from __future__ import annotations

import math
import warnings
from typing import Callable, Optional, Union

from . import _morgana
from ._errors import RenderError, SceneWarning
from ._limits import Limits
from ._morgana import Scene
from ._progress import Bar
from ._result import Result

Progress = Union[bool, Callable[[float], object]]


def render(
    scene: Scene,
    *,
    spp: Optional[int] = None,
    particles: Optional[int] = None,
    seed: int = 0,
    integrator: Optional[str] = None,
    time: Optional[float] = None,
    target_error: Optional[float] = None,
    target: str = "image",
    threads: Optional[int] = None,
    progress: Progress = False,
) -> Result:
    """Render a scene, or measure if it has meters in place of a camera.

    Other Python threads run meanwhile. Ctrl-C ends the render at the end of its pass, or gives the pass up if it
    takes longer than 0.6 seconds more; what there is then is returned, with ``stopped == "interrupted"``. No
    ``KeyboardInterrupt`` is raised. (Python tells of Ctrl-C on its main thread only.)

    Args:
        scene: What to render.
        spp: Samples per pixel, instead of the scene's number.
        particles: Particles to follow if the scene has meters, instead of the scene's number.
        seed: Seed of the random numbers, 0 to 2⁶⁴ − 1. The same seed gives the same numbers, bit by bit, for any number
            of threads.
        integrator: Estimator instead of the scene's: ``path``, ``particle``, ``bdpt``, ``photon`` or ``sppm``. Parameters
            that all have in common stay those of the scene.
        time: Seconds after which to stop; ``spp`` is an upper bound then.
        target_error: Stop when the measured error is down to this part of the image's mean; ``spp`` is an upper bound
            then. Stopping by measured errors biases the mean slightly.
        target: What ``target_error`` is of: ``image``, the standard error of the image's mean, or ``pixel``, the root
            mean square of those of all pixels.
        threads: Number of threads; as many as there are processors by default.
        progress: ``True`` for a bar, drawn by tqdm if it is installed; or a function that is called on this thread with
            the share of the work that is done, 0 to 1.

    Returns:
        The picture, or the readings of the meters.

    Raises:
        RenderError: What was asked for does not fit the scene, or is out of range.
        SceneError: An unknown integrator.
        MemoryError: The film or the meters do not fit into memory.
    """
    wanted = limits(scene, spp, particles, seed, integrator, threads, time, target_error, target)
    with Bar(scene, wanted["samples"], time, progress) as tick:
        if scene.meters:
            return Result(scene, _morgana.measure(scene, wanted, tick))
        return Result(scene, _morgana.render(scene, wanted, integrator, tick))


def limits(
    scene: Scene,
    spp: Optional[int],
    particles: Optional[int],
    seed: int,
    integrator: Optional[str],
    threads: Optional[int],
    time: Optional[float] = None,
    target_error: Optional[float] = None,
    target: str = "image",
) -> Limits:
    """What is asked for of a run, once it has been found to make sense; see :func:`render`."""
    has_meters = bool(scene.meters)
    if not 0 <= seed < 2**64:
        raise RenderError(f"seed is {seed} but must be from 0 to 2⁶⁴ − 1")
    _check(has_meters, spp, particles, integrator, time, target_error, target, threads)
    wanted = particles if has_meters else spp
    if wanted is None and time is None and target_error is None:
        wanted = scene.spp
    if integrator is not None:
        for doubt in scene._doubts(integrator):
            warnings.warn(str(doubt), SceneWarning, stacklevel=3)
    return {
        "seed": seed,
        "samples": None if wanted is None else _whole_periods(scene, wanted),
        "time": time,
        "target_error": None if target_error is None else (target_error, target == "pixel"),
        "threads": threads or 0,
    }


def _check(
    has_meters: bool,
    spp: Optional[int],
    particles: Optional[int],
    integrator: Optional[str],
    time: Optional[float],
    target_error: Optional[float],
    target: str,
    threads: Optional[int],
) -> None:
    if has_meters:
        for name, value in [("spp", spp), ("integrator", integrator), ("target_error", target_error)]:
            if value is not None:
                raise RenderError(f"{name} is for pictures, but the scene has meters in place of a camera")
    elif particles is not None:
        raise RenderError("particles is for scenes with meters; for a camera it is spp")
    for name, number in [("spp", spp), ("particles", particles), ("threads", threads)]:
        if number is not None and number < 1:
            raise RenderError(f"{name} is {number} but must be at least 1")
    for name, limit in [("time", time), ("target_error", target_error)]:
        if limit is not None and not (limit > 0 and math.isfinite(limit)):
            raise RenderError(f"{name} is {limit} but must be a positive number")
    if target not in ("image", "pixel"):
        raise RenderError(f"target is {target!r} but must be 'image' or 'pixel'")


def _whole_periods(scene: Scene, wanted: int) -> int:
    samples = scene._whole_periods(wanted)
    if samples != wanted:
        message = f"{samples} samples are taken instead of {wanted}: a multiple of the sampler's phases"
        warnings.warn(message, SceneWarning, stacklevel=4)
    return samples
