"""Runs of one scene for many values of its parameters."""

from __future__ import annotations

import itertools
import math
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import RenderError
from ._render import render
from ._result import Result
from ._scene import Define, load_dict, load_file

Doubles = NDArray[np.float64]
Source = Union[str, Dict[str, Any]]


class Sweep(NamedTuple):
    """What :func:`sweep` gives. All arrays begin with one axis for each parameter that was varied, in their order."""

    parameters: Dict[str, NDArray[Any]]
    """The values of each parameter that was varied."""
    mean: Dict[str, Doubles]
    """Means by the names of quantities: ``image`` of a picture, those of ``Result.meters`` if the scene has meters."""
    error: Dict[str, Doubles]
    """Standard errors of the means, of the same shapes."""
    few: Dict[str, NDArray[np.bool_]]
    """Where the errors cannot be trusted, of the same shapes: see ``Result.few``."""
    axes: Dict[str, Dict[str, Optional[Doubles]]]
    """For each quantity the axes after those of the parameters, with the edges of their bins if they have such."""
    stats: NDArray[np.object_]
    """What happened in each run: see ``Result.stats``."""

    def to_xarray(self) -> Any:
        """The same as an ``xarray.Dataset``: a variable for each quantity, and one with ``_error`` after its name, whose
        coordinates are the parameters and the middles of bins.

        Raises:
            ImportError: xarray is not installed.
        """
        import xarray

        variables, coordinates = {}, dict(self.parameters)
        for name, axes in self.axes.items():
            dimensions = [*self.parameters, *axes]
            variables[name] = (dimensions, self.mean[name])
            variables[f"{name}_error"] = (dimensions, self.error[name])
            edges = {axis: values for axis, values in axes.items() if values is not None}
            coordinates.update({axis: 0.5 * (values[1:] + values[:-1]) for axis, values in edges.items()})
        return xarray.Dataset(variables, coordinates)


class _Point(NamedTuple):
    """What one run brings back."""

    mean: Dict[str, Doubles]
    error: Dict[str, Doubles]
    few: Dict[str, NDArray[np.bool_]]
    axes: Dict[str, Dict[str, Optional[Doubles]]]
    stats: Dict[str, Any]

    @classmethod
    def of(cls, result: Result) -> "_Point":
        if not result.scene.meters:
            axes: Dict[str, Optional[Doubles]] = {"row": None, "column": None, "channel": None}
            mean, error = result.image.astype(float), result.error.astype(float)
            return cls({"image": mean}, {"image": error}, {"image": result.few}, {"image": axes}, result.stats)
        readings = result.meters.items()
        return cls(
            {name: reading.mean for name, reading in readings},
            {name: reading.error for name, reading in readings},
            {name: reading.few for name, reading in readings if reading.few is not None},
            {name: reading.axes for name, reading in readings},
            result.stats,
        )


def sweep(
    scene: Union[str, "os.PathLike[str]", Mapping[str, Any]],
    parameters: Mapping[str, Sequence[Define]],
    *,
    executor: Any = None,
    fixed: Optional[Mapping[str, Define]] = None,
    **options: Any,
) -> Sweep:
    """Render a scene, or measure if it has meters, for all combinations of values of its parameters.

        >>> found = morgana.sweep("scenes/acoustic_waveguide.xml", {"amplitude": [0, 1e-4, 2e-4]}, spp=16)
        >>> found.mean["image"].shape
        (3, 208, 320, 3)

    All runs have the same seed, so that their noise is alike and differences between them are known better than their errors
    say.

    Args:
        scene: The path of a scene file, or a dictionary as for :func:`morgana.load_dict`.
        parameters: For each parameter that is varied (``<default>`` or ``"parameters"``), its values.
        executor: With ``submit`` as in :mod:`concurrent.futures`, whose workers take the runs; without one, they are taken
            here, one after another.
        fixed: Values for other parameters of the scene.
        **options: As for :func:`morgana.render`: ``spp``, ``particles``, ``seed``, ``integrator``, ``time``, ``threads``.

    Raises:
        RenderError: Nothing to vary, or runs whose results have different shapes.
        KeyboardInterrupt: Ctrl-C; runs that were complete are lost.
        SceneError: A scene that cannot be used with some of the values.
    """
    names, values = list(parameters), [list(parameters[name]) for name in parameters]
    shape = tuple(len(list_) for list_ in values)
    if math.prod(shape) == 0 or not shape:
        raise RenderError("sweep needs a parameter with at least one value")
    source: Source = dict(scene) if isinstance(scene, Mapping) else os.path.abspath(scene)
    runs = [{**(fixed or {}), **dict(zip(names, point))} for point in itertools.product(*values)]
    points = _here(source, runs, options) if executor is None else _by_workers(executor, source, runs, options)
    return _joined(points, shape, dict(zip(names, map(np.asarray, values))))


def _here(source: Source, runs: List[Dict[str, Define]], options: Dict[str, Any]) -> List[_Point]:
    return [_run(source, run, options) for run in runs]


def _by_workers(executor: Any, source: Source, runs: List[Dict[str, Define]], options: Dict[str, Any]) -> List[_Point]:
    futures = [executor.submit(_run, source, run, options) for run in runs]
    try:
        return [future.result() for future in futures]
    finally:
        for future in futures:
            future.cancel()


def _run(source: Source, parameters: Dict[str, Define], options: Dict[str, Any]) -> _Point:
    """One run; what workers do."""
    load: Any = load_dict if isinstance(source, dict) else load_file
    result = render(load(source, **parameters), **options)
    if result.stopped == "interrupted":
        raise KeyboardInterrupt
    return _Point.of(result)


def _joined(points: List[_Point], shape: Tuple[int, ...], parameters: Dict[str, NDArray[Any]]) -> Sweep:
    stats = np.empty(len(points), object)
    stats[:] = [point.stats for point in points]

    def stacked(field: str) -> Dict[str, Any]:
        return {name: stack([getattr(point, field)[name] for point in points], name) for name in points[0].mean}

    def stack(arrays: List[NDArray[Any]], name: str) -> NDArray[Any]:
        if len({array.shape for array in arrays}) > 1:
            raise RenderError(f"'{name}' has another shape in some of the runs: vary only what leaves it as it is")
        return np.stack(arrays).reshape(shape + arrays[0].shape)

    if any(point.mean.keys() != points[0].mean.keys() for point in points):
        raise RenderError("the runs do not measure the same quantities")
    return Sweep(
        parameters, stacked("mean"), stacked("error"), stacked("few"), points[0].axes, stats.reshape(shape)
    )
