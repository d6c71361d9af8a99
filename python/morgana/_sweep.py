"""Runs of one scene for many values of its parameters."""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._checks import mapping
from ._errors import RenderError
from ._estimate import Estimate, own_origin, run_with
from ._morgana import Scene
from ._pictures import caption, curve, thumbnail
from ._render import render
from ._layer import Layer
from ._result import Result
from ._selection import Axis
from ._source import Description, loaded
from ._values import Fields, alike, unknown
from ._xarray import coordinates_of, module, shared_dimensions

Doubles = NDArray[np.float64]
Source = Union[str, Scene, Dict[str, Any]]

SHOWN = 6
"""Maximum number of runs, and of values of a parameter, that a notebook shows."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Sweep(Fields, Mapping[str, Estimate]):
    """Result of :func:`sweep`: a mapping from names of quantities to estimates.

    All arrays begin with one axis per varied parameter, in their order. ``found["fluence"]`` is an
    :class:`Estimate` over the parameters and the axes of the quantity, which computes like a NumPy
    array, with its errors.

    Examples
    --------
    >>> found["fluence"].sel(amplitude=1e-4).isel(z=0)
    >>> 1e3 * found["fluence"]
    """

    parameters: Dict[str, NDArray[Any]]
    """Values of each varied parameter."""
    mean: Dict[str, Doubles]
    """Means by the names of quantities: ``image`` of a picture and the names of its
    ``Result.layers``, or the names of ``Result.meters`` if the scene has meters."""
    error: Dict[str, Doubles]
    """Standard errors of the means, of the same shapes."""
    few: Dict[str, NDArray[np.bool_]]
    """Mask of the unreliable errors, of the same shapes: see ``Result.few``."""
    axes: Dict[str, Dict[str, Optional[Doubles]]]
    """Axes of each quantity after the parameter axes, with the edges of their bins. ``None``
    without edges, or if the edges differ between runs."""
    stats: NDArray[np.object_]
    """Statistics of each run: see ``Result.stats``."""
    units: Dict[str, str]
    """Unit of each reading of a meter, as ``Reading.unit``; empty for pictures."""
    channels: Dict[str, List[str]]
    """Names of the channels of each quantity, as ``Result.channels`` and ``Layer.channels``; empty
    if runs differ in them."""

    def __getitem__(self, name: str) -> Estimate:
        if name not in self.mean:
            raise unknown("quantity", name, self.mean)
        axes = [*self._varied(name), *self._axes(name)]
        few = self.few.get(name)
        made: Estimate = Estimate(
            self.mean[name],
            self.error[name],
            {axis.name: axis.edges for axis in axes},
            self.units.get(name, ""),
            few=few,
            names={axis.name: axis.names for axis in axes if axis.names is not None},
        )
        runs: List[Any] = self.stats.ravel().tolist()
        origin = frozenset[str]().union(*(run_with(run["seed"]) for run in runs if isinstance(run, Mapping)))
        return made._from(origin or own_origin())  # type: ignore[no-any-return]

    def __iter__(self) -> Iterator[str]:
        return iter(self.mean)

    def __len__(self) -> int:
        return len(self.mean)

    def _varied(self, name: str) -> List[Axis]:
        """Returns the axes of the parameters. A parameter with the name of an axis of a quantity
        has the prefix ``parameters.``. Values that are arrays have no coordinates."""
        taken = self.axes[name]
        values = {f"parameters.{key}" if key in taken else key: of for key, of in self.parameters.items()}
        return [Axis(key, len(of), None, None if of.dtype == object else of.tolist()) for key, of in values.items()]

    def __repr__(self) -> str:
        varied = ", ".join(f"{len(values)} values of {name}" for name, values in self.parameters.items())
        return f"<morgana.Sweep over {varied}: {', '.join(self.mean)}>"

    def _repr_html_(self) -> str:
        """Returns pictures of the first runs, or a curve of the first reading over the first
        parameter."""
        name = next(iter(self.mean), "")
        first = len(self.parameters)
        varied = "; ".join(f"{key} = {', '.join(map(str, values[:SHOWN]))}{', …' * (len(values) > SHOWN)}" for key, values in self.parameters.items())
        picture, text = "", repr(self).strip("<>")
        if name and list(self.axes[name]) == ["row", "column", "channel"]:
            runs = self.mean[name].reshape(-1, *self.mean[name].shape[first:])
            picture = "".join(thumbnail(image.astype(np.float32), self.channels[name] or ["Y"] * image.shape[2]) for image in runs[:SHOWN])
        elif name:
            values = next(iter(self.parameters.values()))
            others = tuple(range(1, self.mean[name].ndim))
            x = values.astype(float) if values.ndim == 1 and values.dtype.kind in "iuf" else np.arange(len(values), dtype=float)
            picture = curve(x, self.mean[name].mean(axis=others))
            text += f": {name} {self.units.get(name, '')} over {next(iter(self.parameters))}, averaged over all other axes"
        return picture + caption(text) + caption(varied)

    def to_xarray(self) -> Any:
        """Convert to an ``xarray.Dataset``.

        Returns
        -------
        xarray.Dataset
            A variable for each quantity, and one with the suffix ``_error``; ``attrs["units"]`` is
            the unit of a reading. The coordinates are the parameters, the centres of bins with
            their edges (``z_lower``, ``z_upper``), and the names of channels. An axis has the name of its meter or quantity as prefix, as in
            ``near.z``, if its bins or channels differ between quantities, or if a parameter has its
            name. A parameter with the name of a quantity becomes ``parameters.NAME``.

        Raises
        ------
        ImportError
            xarray is not installed: run ``pip install ".[sweep]"`` in a clone of morgana.
        """
        xarray = module()
        quantities = {*self.mean, *(f"{name}_error" for name in self.mean)}
        parameters = {f"parameters.{name}" if name in quantities else name: values for name, values in self.parameters.items()}
        dimensions, axes = shared_dimensions({name: self._axes(name) for name in self.mean}, {*quantities, *parameters})
        variables = {}
        for name in self.mean:
            of = [*parameters, *dimensions[name]]
            attributes = {"units": self.units[name]} if name in self.units else {}
            variables[name] = (of, self.mean[name], attributes)
            variables[f"{name}_error"] = (of, self.error[name], attributes)
        # Values that are arrays have no coordinates, only numbers.
        plain = {name: values for name, values in parameters.items() if values.dtype != object}
        return xarray.Dataset(variables, {**plain, **coordinates_of(axes)})

    def _axes(self, name: str) -> List[Axis]:
        """Returns the axes of a quantity after the axes of parameters."""
        shape = self.mean[name].shape[len(self.parameters) :]
        return [Axis(axis, size, edges, self._names(name, axis, size)) for (axis, edges), size in zip(self.axes[name].items(), shape)]

    def _names(self, name: str, axis: str, size: int) -> Optional[List[str]]:
        channels = self.channels[name] if axis.rpartition(".")[2] == "channel" else []
        return channels if len(channels) == size else None


class _Point(NamedTuple):
    """Results of one run."""

    mean: Dict[str, Doubles]
    error: Dict[str, Doubles]
    few: Dict[str, NDArray[np.bool_]]
    axes: Dict[str, Dict[str, Optional[Doubles]]]
    stats: Dict[str, Any]
    units: Dict[str, str]
    channels: Dict[str, List[str]]

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
                {},
                {name: layer.channels for name, layer in layers.items()},
            )
        readings = result.meters.items()
        return cls(
            {name: reading.mean for name, reading in readings},
            {name: reading.error for name, reading in readings},
            {name: reading.few for name, reading in readings if reading.few is not None},
            {name: reading.axes for name, reading in readings},
            result.stats,
            {name: reading.unit for name, reading in readings},
            {name: result.channels for name, _ in readings},
        )


def _axes(name: str, layer: Layer, channels: List[str]) -> Dict[str, Optional[Doubles]]:
    """Returns the axes of a layer. It has the channels of the picture, or its own."""
    return {"row": None, "column": None, "channel" if layer.channels == channels else f"{name}.channel": None}


def sweep(
    scene: Description,
    parameters: Mapping[str, Sequence[Any]],
    *,
    executor: Any = None,
    fixed: Optional[Mapping[str, Any]] = None,
    **options: Any,
) -> Sweep:
    """Render a scene, or measure if it has meters, for all combinations of parameter values.

    All runs have the same seed, so that their noise is correlated: differences between runs are
    more accurate than their errors suggest.

    Parameters
    ----------
    scene : Scene, path_like or mapping
        A scene file; a dictionary, as for :func:`morgana.load_dict`; a loaded scene; or a
        configuration of MCX, as for :func:`morgana.load_mcx`.
    parameters : mapping of str to sequence
        Values, at least one, of each varied parameter. Parameters of a file or dictionary are its
        ``<default>`` or ``"parameters"``. Parameters of a loaded scene have the names of
        ``Scene.parameters()``, such as ``"fog.sigma_t"``. Parameters of a configuration of MCX are
        its keys, such as ``"srcpos"``, or names of ``Scene.parameters()`` that contain a dot.
    executor : optional
        Executor with ``submit`` as in :mod:`concurrent.futures`, which distributes the runs.
        Without one, the runs take place here, in sequence.
    fixed : mapping, optional
        Values of other parameters of the scene.
    **options
        Options of :func:`morgana.render`: ``spp``, ``particles``, ``seed``, ``integrator``,
        ``time``, ``threads``.

    Returns
    -------
    Sweep
        Means and errors, with the parameters as first axes.

    Raises
    ------
    RenderError
        No parameter to vary, or runs whose results have different shapes.
    SceneError
        A scene that cannot be used with some of the values.
    KeyboardInterrupt
        Ctrl-C. Results of complete runs are lost.

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
    source: Source = dict(scene) if isinstance(scene, Mapping) else scene if isinstance(scene, Scene) else os.path.abspath(scene)
    runs = [{**(fixed or {}), **dict(zip(names, point))} for point in itertools.product(*values)]
    points = _here(source, runs, options) if executor is None else _by_workers(executor, source, runs, options)
    return _joined(points, shape, dict(zip(names, map(_row, values))))


def _row(values: List[Any]) -> NDArray[Any]:
    """Returns values as an array of one axis; of objects, if the values are arrays."""
    plain = all(isinstance(value, (str, int, float, np.bool_, np.number)) for value in values)
    if plain:
        return np.asarray(values)
    row = np.empty(len(values), object)
    for i, value in enumerate(values):
        row[i] = value.tolist() if isinstance(value, np.ndarray) else value
    return row


def _values(name: str, values: Any) -> List[Any]:
    if isinstance(values, (str, bytes)) or not hasattr(values, "__iter__"):
        raise TypeError(f"the values of {name!r} are {values!r}: give a list of them")
    return list(values)


def _here(source: Source, runs: List[Dict[str, Any]], options: Dict[str, Any]) -> List[_Point]:
    return [_run(source, run, options) for run in runs]


def _by_workers(executor: Any, source: Source, runs: List[Dict[str, Any]], options: Dict[str, Any]) -> List[_Point]:
    futures = [executor.submit(_run, source, run, options) for run in runs]
    try:
        return [future.result() for future in futures]
    finally:
        for future in futures:
            future.cancel()


def _run(source: Source, parameters: Dict[str, Any], options: Dict[str, Any]) -> _Point:
    """Performs one run, on a worker."""
    result = render(loaded(source, parameters), **options)
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

    first = points[0]
    if any(point.mean.keys() != first.mean.keys() or point.units != first.units for point in points):
        raise RenderError("the runs do not measure the same quantities")
    means, errors, flags = (stacked(field) for field in ("mean", "error", "few"))
    axes = {
        name: {axis: edges if all(alike(point.axes[name][axis], edges) for point in points) else None for axis, edges in of.items()}
        for name, of in first.axes.items()
    }
    channels = {name: of if all(point.channels[name] == of for point in points) else [] for name, of in first.channels.items()}
    return Sweep(parameters, means, errors, flags, axes, stats.reshape(shape), first.units, channels)
