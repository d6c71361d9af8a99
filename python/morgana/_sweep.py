"""Runs of one scene for many values of its parameters."""

from __future__ import annotations

import itertools
import math
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._checks import mapping
from ._errors import RenderError
from ._morgana import Scene
from ._render import render
from ._result import Layer, Result
from ._scene import Define, load_dict, load_file
from ._values import comparable

Doubles = NDArray[np.float64]
Source = Union[str, Dict[str, Any]]


@comparable
class Sweep(NamedTuple):
    """What :func:`sweep` returns. All arrays begin with one axis for each parameter that was varied, in their order."""

    parameters: Dict[str, NDArray[Any]]
    """The values of each parameter that was varied."""
    mean: Dict[str, Doubles]
    """Means by the names of quantities: ``image`` of a picture and the names of its ``Result.layers``, or those of ``Result.meters`` if the scene
    has meters."""
    error: Dict[str, Doubles]
    """Standard errors of the means, of the same shapes."""
    few: Dict[str, NDArray[np.bool_]]
    """Where the errors cannot be trusted, of the same shapes: see ``Result.few``."""
    axes: Dict[str, Dict[str, Optional[Doubles]]]
    """For each quantity the axes after those of the parameters, with the edges of their bins if they have such."""
    stats: NDArray[np.object_]
    """What happened in each run: see ``Result.stats``."""

    def __repr__(self) -> str:
        varied = ", ".join(f"{len(values)} values of {name}" for name, values in self.parameters.items())
        return f"<morgana.Sweep over {varied}: {', '.join(self.mean)}>"

    def to_xarray(self) -> Any:
        """Make an ``xarray.Dataset`` of the same.

        Returns
        -------
        xarray.Dataset
            A variable for each quantity, and one with ``_error`` after its name. The coordinates are the parameters and the
            middles of bins.

        Raises
        ------
        ImportError
            xarray is not installed: ``pip install "morgana-render[sweep]"``.
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
            layers = {"image": Layer(result.image, result.variance, result.few, result.channels), **result.layers}
            return cls(
                {name: layer.mean.astype(float) for name, layer in layers.items()},
                {name: layer.error.astype(float) for name, layer in layers.items()},
                {name: layer.few for name, layer in layers.items()},
                {name: _axes(name, layer, result.channels) for name, layer in layers.items()},
                result.stats,
            )
        readings = result.meters.items()
        return cls(
            {name: reading.mean for name, reading in readings},
            {name: reading.error for name, reading in readings},
            {name: reading.few for name, reading in readings if reading.few is not None},
            {name: reading.axes for name, reading in readings},
            result.stats,
        )


def _axes(name: str, layer: Layer, channels: List[str]) -> Dict[str, Optional[Doubles]]:
    """Axes of a layer, whose channels are those of the picture or its own."""
    return {"row": None, "column": None, "channel" if layer.channels == channels else f"{name}.channel": None}


def sweep(
    scene: Union[str, "os.PathLike[str]", Mapping[str, Any]],
    parameters: Mapping[str, Sequence[Define]],
    *,
    executor: Any = None,
    fixed: Optional[Mapping[str, Define]] = None,
    **options: Any,
) -> Sweep:
    """Render a scene, or measure if it has meters, for all combinations of values of its parameters.

    All runs have the same seed, so that their noise is alike and differences between them are known better than their errors
    say.

    Parameters
    ----------
    scene : path_like or mapping
        A scene file, or a dictionary as for :func:`morgana.load_dict`.
    parameters : mapping of str to sequence
        For each parameter that is varied (``<default>`` or ``"parameters"``), its values, at least one.
    executor : optional
        Has ``submit`` as in :mod:`concurrent.futures`; its workers take the runs. Without one, they are taken here, one after
        another.
    fixed : mapping, optional
        Values for other parameters of the scene.
    **options
        As for :func:`morgana.render`: ``spp``, ``particles``, ``seed``, ``integrator``, ``time``, ``threads``.

    Returns
    -------
    Sweep
        Means and errors, whose first axes are the parameters.

    Raises
    ------
    RenderError
        Nothing to vary, or runs whose results have different shapes.
    SceneError
        A scene that cannot be used with some of the values.
    KeyboardInterrupt
        Ctrl-C; runs that were complete are lost.

    Examples
    --------
    >>> found = morgana.sweep("scenes/acoustic_waveguide.xml", {"amplitude": [0, 1e-4, 2e-4]}, spp=16)
    >>> found.mean["image"].shape
    (3, 208, 320, 3)
    """
    varied = mapping(parameters, "parameters")
    names, values = list(varied), [_values(name, varied[name]) for name in varied]
    both = set(names) & set(fixed or {})
    if both:
        raise RenderError(f"{', '.join(sorted(both))} cannot be both varied and fixed")
    shape = tuple(len(list_) for list_ in values)
    if math.prod(shape) == 0 or not shape:
        raise RenderError("sweep needs a parameter with at least one value")
    if isinstance(scene, Scene):
        raise TypeError("a Scene has its parameters already: sweep takes a file or a dictionary")
    source: Source = dict(scene) if isinstance(scene, Mapping) else os.path.abspath(scene)
    runs = [{**(fixed or {}), **dict(zip(names, point))} for point in itertools.product(*values)]
    points = _here(source, runs, options) if executor is None else _by_workers(executor, source, runs, options)
    return _joined(points, shape, dict(zip(names, map(np.asarray, values))))


def _values(name: str, values: Any) -> List[Define]:
    if isinstance(values, (str, bytes)) or not hasattr(values, "__iter__"):
        raise TypeError(f"the values of {name!r} are {values!r}: give a list of them")
    return list(values)


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
