"""Tables of values over named axes, to which all sources of figures are converted."""

from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._bins import bins_of
from .._errors import Error
from .._images import Image, _names
from .._numbers import numbers
from .._estimate import Data, Estimate
from .._layer import UNITS, Layer, undelayed
from .._reading import Reading
from .._result import Result

Doubles = NDArray[np.float64]
Bools = NDArray[np.bool_]
Source = Union[Result, Image, Reading, Estimate, Layer, ArrayLike]
"""A picture (``Result``, ``Image``, ``Layer`` or an array of shape (height, width) or (height,
width, channels)), a ``Reading`` of a meter, or an ``Estimate`` computed from any of them."""
PICTURE = ("row", "column", "channel")
"""Axes of a picture."""
Channel = Union[str, int, None]


class PlotError(Error, ValueError):
    """A figure that cannot be drawn as requested."""


class Table(NamedTuple):
    """Values over named axes, with their errors."""

    mean: Doubles
    error: Optional[Doubles]
    """Standard errors, of the shape of ``mean``; ``None`` if unknown."""
    axes: Dict[str, Optional[Doubles]]
    """Edges of bins by axis, the slowest axis first; ``None`` for axes with numbered items."""
    name: str
    """Name of the quantity; may be empty."""
    unit: str
    """Unit of the quantity, in which ``unit`` stands for the unit of length; may be empty."""
    few: Optional[Bools] = None
    """Mask of the unreliable errors, of the shape of ``mean``; ``None`` if unknown."""

    def edges(self, axis: str) -> Doubles:
        """Returns the edges of an axis, or raises an error that lists the axes with edges."""
        edges = self.axes.get(axis)
        if edges is None:
            known = ", ".join(repr(name) for name, edges in self.axes.items() if edges is not None)
            raise PlotError(f"no axis {axis!r} with bins; there are {known or 'none'}")
        return edges

    def cut(self, keep: Tuple[str, ...], at: Mapping[str, float]) -> Table:
        """Returns the table over the axes ``keep``, in this order. Each other axis is cut at its
        value in ``at``, or at its only bin."""
        for axis in keep:
            self.edges(axis)
        for axis in at:
            if axis not in self.axes or axis in keep:
                raise PlotError(f"{axis!r} cannot be chosen; there are {', '.join(a for a in self.axes if a not in keep) or 'none'}")
        index = tuple(slice(None) if a in keep else self._bin(a, at.get(a)) for a in self.axes)
        left = [a for a in self.axes if a in keep]
        order = [left.index(a) for a in keep]
        error = None if self.error is None else self.error[index].transpose(order)
        few = None if self.few is None else self.few[index].transpose(order)
        axes = {a: self.axes[a] for a in keep}
        return self._replace(mean=self.mean[index].transpose(order), error=error, few=few, axes=axes)

    def where(self, at: Mapping[str, float]) -> str:
        """Describes the bins that ``at`` selects."""
        return ", ".join(self._place(axis, value) for axis, value in at.items())

    def _bin(self, axis: str, value: Optional[float]) -> int:
        count, edges = self.mean.shape[list(self.axes).index(axis)], self.axes[axis]
        low, high = (0.0, float(count - 1)) if edges is None else (float(edges[0]), float(edges[-1]))
        if value is None:
            if count == 1:
                return 0
            raise PlotError(f"axis {axis!r} has {count} bins: choose one by {axis}=, from {low:g} to {high:g}")
        if not low <= value <= high:
            raise PlotError(f"{axis} is {value:g} but must be from {low:g} to {high:g}")
        if edges is None:
            return int(value)
        return int(min(np.searchsorted(edges, value, side="right"), count)) - 1

    def _place(self, axis: str, value: float) -> str:
        edges = self.axes[axis]
        if edges is None or axis in ("row", "column"):
            return f"{axis} {value:g}"
        i = self._bin(axis, value)
        return f"{axis} from {edges[i]:.3g} to {edges[i + 1]:.3g}"


def table(source: Source, layer: str = "", channel: Channel = None) -> Table:
    """Returns a picture over ``row`` and ``column``, or a reading over its own axes. Without a
    channel, takes the mean over channels."""
    if isinstance(source, Data) and is_reading(source):
        if layer:
            raise PlotError("readings of meters have no layers")
        return _of_reading(source._estimate(), channel)
    if isinstance(source, (str, os.PathLike)):
        raise PlotError(f"a file is not a picture: give morgana.read({os.fspath(source)!r})")
    mean, variance, few, names = _layer(source, layer)
    # Omit errors from single samples, whose variance is infinite.
    error = np.sqrt(variance) if variance is not None and np.isfinite(variance).all() else None
    axes: Dict[str, Optional[Doubles]] = {"row": _pixels(mean.shape[0]), "column": _pixels(mean.shape[1])}
    is_light = channel is None or channel in ("R", "G", "B", "Y") or str(channel).endswith("nm")
    name = layer or ("radiance" if is_light else str(channel))
    return _flat(Table(mean, error, axes, name, UNITS.get(layer, ""), few), names, channel)


def is_reading(source: Any) -> bool:
    """Returns true for readings, and other estimates that are no pictures."""
    return isinstance(source, Data) and not isinstance(source, (Result, Image)) and tuple(source._estimate().axes) != PICTURE


def _of_reading(reading: Estimate, channel: Channel) -> Table:
    """Returns a reading over its own axes, without the axis of channels."""
    error = reading.error if np.isfinite(reading.error).all() else None
    names = None
    if "channel" in reading.axes:
        names = reading.names.get("channel", [str(i) for i in range(reading.mean.shape[-1])])
        if isinstance(channel, int):
            channel = names[channel] if 0 <= channel < len(names) else str(channel)
    sizes = dict(zip(reading.axes, reading.mean.shape))
    axes = {axis: _pixels(sizes[axis]) if axis in PICTURE else edges for axis, edges in reading.axes.items() if axis != "channel"}
    return _flat(Table(reading.mean, error, axes, "", reading.unit, reading.few), names, channel)


def _pixels(count: int) -> Doubles:
    """Returns the edges of pixels, whose centres have whole numbers."""
    return np.arange(count + 1, dtype=float) - 0.5


def channels_of(picture: Source, layer: str) -> Tuple[Doubles, List[str]]:
    """Returns the values of a picture, (height, width, channels), and the names of its channels."""
    mean, _, _, names = _layer(picture, layer)
    return mean, names


def binned(picture: Union[Result, Image], channel: Channel) -> Table:
    """Returns the light of a picture over optical length or time, row and column."""
    bins = bins_of(picture)
    if bins is None:
        raise PlotError("the picture has no bins of length or time: give its film a 'decomposition'")
    tables = [_sum(picture, names, channel) for names in bins.layers]
    errors = [t.error for t in tables if t.error is not None]
    error = np.stack(errors) if len(errors) == len(tables) else None
    axes = {bins.axis: bins.edges, **tables[0].axes}
    flags = [t.few for t in tables if t.few is not None]
    few = np.stack(flags) if len(flags) == len(tables) else None
    return Table(np.stack([t.mean for t in tables]), error, axes, "radiance", "", few)


def _sum(picture: Union[Result, Image], names: List[str], channel: Channel) -> Table:
    """Adds up layers. They share paths, so that the sum of their errors is an upper bound."""
    if not names:
        raise PlotError("the picture has no layers for some of its bins of length or time")
    tables = [table(picture, name, channel) for name in names]
    mean = np.sum([t.mean for t in tables], axis=0)
    errors = [t.error for t in tables if t.error is not None]
    error = np.sum(errors, axis=0) if len(errors) == len(tables) else None
    flags = [t.few for t in tables if t.few is not None]
    return tables[0]._replace(mean=mean, error=error, few=np.any(flags, axis=0) if flags else None)


def _layer(picture: Any, layer: str) -> Tuple[Doubles, Optional[Doubles], Optional[Bools], List[str]]:
    """Returns means, variances, the mask of unreliable variances (height, width, channels), and
    names of the channels."""
    if isinstance(picture, Result):
        if layer and layer not in picture.layers:
            raise _unknown(layer, picture.layers)
        whole = Layer(picture.image, picture.variance, picture.few, picture.channels)
        of = picture.layers[layer] if layer else whole
        return of.mean.astype(float), of.variance.astype(float), of.few, of.channels
    if isinstance(picture, Image):
        if layer not in picture.layers:
            raise _unknown(layer, picture.layers)
        beside = {"variance": layer, "few": undelayed(layer)}
        squares, flags = (picture.layers.get(f"{name}.{of}" if of else name) for name, of in beside.items())
        known = None if squares is None else squares.astype(float)
        return picture.layers[layer].astype(float), known, None if flags is None else flags != 0, picture.channels[layer]
    if isinstance(picture, Data) and not layer:
        estimate = picture._estimate()
        if tuple(estimate.axes) == PICTURE:
            mean = estimate.mean.astype(float)
            return mean, estimate.error.astype(float) ** 2, estimate.few, estimate.names.get("channel", _names(mean.shape[2]))
    values = numbers(picture, "the picture")
    values = values[:, :, None] if values.ndim == 2 else values
    if layer or values.ndim != 3:
        raise PlotError(f"expected an image of shape (height, width, channels) without layers, found {np.shape(picture)}")
    return values, None, None, _names(values.shape[2])


def _unknown(layer: str, layers: Mapping[str, Any]) -> PlotError:
    return PlotError(f"no layer {layer!r}; there are {', '.join(name for name in layers if name) or 'none'}")


def _flat(full: Table, names: Optional[List[str]], channel: Channel) -> Table:
    """Removes the last axis, of channels, if there is one. Channels share paths, so that the mean
    of their errors is an upper bound of the error of their mean."""
    if names is None:
        if channel is not None:
            raise PlotError("there is but one channel: leave channel out")
        return full
    if channel is None:
        error = None if full.error is None else full.error.mean(-1)
        few = None if full.few is None else np.asarray(np.any(full.few, axis=-1))
        return full._replace(mean=full.mean.mean(-1), error=error, few=few)
    if str(channel) not in names:
        raise PlotError(f"no channel {str(channel)!r}; there are {', '.join(names)}")
    i = names.index(str(channel))
    error = None if full.error is None else full.error[..., i]
    return full._replace(mean=full.mean[..., i], error=error, few=None if full.few is None else full.few[..., i])
