"""Rendering and measuring."""

from __future__ import annotations

import warnings
from typing import Callable, Optional, Union

from . import _checks as checks
from . import _morgana
from ._errors import RenderError, SceneWarning
from ._limits import Limits
from ._morgana import Scene
from ._progress import Bar
from ._result import Result
from ._source import Description, loaded

Progress = Union[bool, Callable[[float], object]]


def render(
    scene: Description,
    *,
    spp: Optional[int] = None,
    particles: Optional[int] = None,
    seed: int = 0,
    integrator: Optional[str] = None,
    time: Optional[float] = None,
    target_error: Optional[float] = None,
    target: str = "image",
    threads: Optional[int] = None,
    device: str = "cpu",
    progress: Progress = False,
) -> Result:
    """Render a scene, or measure if it has meters instead of a camera.

    Other Python threads run during the render. Ctrl-C ends the render at the end of its pass, or
    aborts the pass if it takes more than 0.6 seconds longer. ``render`` then returns the samples so
    far, with ``stopped == "interrupted"``, and raises no ``KeyboardInterrupt``. (Python handles
    Ctrl-C only on its main thread.)

    Parameters
    ----------
    scene : Scene, path_like or mapping
        The scene to render; a scene file, as for :func:`load_file`; a dictionary, as for
        :func:`load_dict`; or a configuration of MCX, as for :func:`load_mcx`.
    spp : int, optional
        Samples per pixel, ≥ 1; by default the scene's number.
    particles : int, optional
        Number of particles, ≥ 1; by default the scene's number. For scenes with meters.
    seed : int, optional
        Seed of the random numbers, 0 to 2⁶⁴ − 1. The same seed gives the same numbers, bit for bit,
        for any number of threads.
    integrator : str, optional
        Integrator instead of the scene's: ``auto``, ``path``, ``particle``, ``bdpt``, ``vcm``,
        ``photon`` or ``sppm``. Parameters that all integrators have keep the scene's values.
    time : float, optional
        Seconds after which to stop, > 0; ``spp`` is then an upper bound.
    target_error : float, optional
        Measured error, relative to the image's mean, at which to stop, > 0; ``spp`` is then an
        upper bound. Stopping by measured errors biases the mean slightly.
    target : {"image", "pixel"}, optional
        Error that ``target_error`` limits: the standard error of the image's mean, or the root mean
        square of the standard errors of all pixels.
    threads : int, optional
        Number of threads, ≥ 1; by default the number of CPU cores.
    device : str, optional
        Device that walks the particles of meters: ``cpu``; ``gpu`` or ``gpu:1`` for a GPU of
        :func:`devices`; ``auto`` for a GPU where there is one that can run the scene. The package
        must be built with the feature ``gpu``.
    progress : bool or callable, optional
        ``True`` for a progress bar, drawn by tqdm if it is installed; or a function that is called
        on this thread with the completed fraction, 0 to 1.

    Returns
    -------
    Result
        The picture, or the readings of the meters.

    Raises
    ------
    RenderError
        An option that does not fit the scene, or is out of range.
    TypeError
        An argument of another type.
    SceneError
        A scene that cannot be read or used. An unknown integrator, or one that the scene cannot
        use.
    MemoryError
        The film or the meters do not fit into memory.

    Examples
    --------
    >>> result = morgana.render("scenes/luneburg_fog.xml", spp=16, seed=1, progress=True)
    >>> result.image.shape, result.mean, result.mean_error
    """
    scene = loaded(scene, {})
    checks.text(device, "device")
    wanted = limits(scene, spp, particles, seed, integrator, threads, time, target_error, target)
    with Bar(scene, wanted["samples"], time, progress) as tick:
        return Result(scene, _morgana.render(scene, wanted, integrator, device, tick))


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
    """Returns the checked limits of a run; see :func:`render`."""
    has_meters = bool(scene.meters)
    seed = checks.whole(seed, "seed", 0, 2**64 - 1)
    checks.text(integrator, "integrator")
    time = checks.optional_positive(time, "time")
    target_error = checks.optional_positive(target_error, "target_error")
    spp = checks.optional_whole(spp, "spp", 1)
    particles = checks.optional_whole(particles, "particles", 1)
    threads = checks.optional_whole(threads, "threads", 1, checks.MAX_THREADS)
    _check(has_meters, spp, particles, integrator, target_error, target)
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
    target_error: Optional[float],
    target: str,
) -> None:
    if has_meters:
        for name, value in [("spp", spp), ("integrator", integrator), ("target_error", target_error)]:
            if value is not None:
                raise RenderError(f"{name} is for pictures, but the scene has meters in place of a camera")
    elif particles is not None:
        raise RenderError("particles is for scenes with meters; for a camera it is spp")
    if target not in ("image", "pixel"):
        raise RenderError(f"target is {target!r} but must be 'image' or 'pixel'")
    if target != "image" and target_error is None:
        raise RenderError("target says what target_error is of: give target_error, too")


def _whole_periods(scene: Scene, wanted: int) -> int:
    samples = scene._whole_periods(wanted)
    if samples != wanted:
        message = f"{samples} samples are taken instead of {wanted}: a multiple of the sampler's phases"
        warnings.warn(message, SceneWarning, stacklevel=4)
    return samples
