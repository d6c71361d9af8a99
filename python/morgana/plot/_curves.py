"""Figures of values along a line."""

from __future__ import annotations

from typing import Any, Dict, Optional, Tuple, Union

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import StepPatch

from .._images import Image
from .._estimate import Estimate
from .._result import Result
from ._labels import along as label_along
from ._labels import axes, quantity
from ._table import Channel, Doubles, PlotError, Source, Table, binned, is_reading, table


def profile(
    source: Source,
    along: str,
    *,
    layer: str = "",
    channel: Channel = None,
    label: str = "",
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
    **at: float,
) -> Line2D:
    """Draw values along a line of pixels or cells.

    A band shows one standard error to either side, if errors are known.

    Circles mark values whose errors are unreliable (``few``).

    Parameters
    ----------
    source : Result, Image, Reading, Estimate or array_like
        A picture, with the axes ``row`` and ``column``, or a ``Reading`` or ``Estimate`` with its
        own axes.
    along : str
        Axis of the line.
    layer : str, optional
        As for :func:`plot.image` and :func:`plot.slice`.
    channel : str or int, optional
        As for :func:`plot.image` and :func:`plot.slice`.
    label : str, optional
        Name of the line in a legend.
    unit : str, optional
        Name of the scene's unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.
    **at : float
        Position on each other axis that has more than one bin: ``row=24``, or ``x=0, y=0``.

    Returns
    -------
    matplotlib.lines.Line2D
        The line.

    Raises
    ------
    PlotError
        No such axes, or values outside them.

    Examples
    --------
    >>> plot.profile(result, "column", row=24)
    >>> plot.profile(fluence, "z", x=0, y=0, unit="mm")
    """
    of = table(source, layer, channel).cut((along,), at)
    edges = of.edges(along)
    x = (edges[1:] + edges[:-1]) / 2
    ax = axes(ax)
    (line,) = ax.plot(x, of.mean, label=label or "_")
    if of.error is not None:
        ax.fill_between(x, of.mean - of.error, of.mean + of.error, color=line.get_color(), alpha=0.25, linewidth=0)
    _mark(ax, of, x, of.mean, line.get_color())
    ax.set_xlabel(label_along(along, unit))
    ax.set_ylabel(quantity(of.name, of.unit, unit))
    return line


def histogram(
    source: Union[Result, Image, Estimate],
    along: Optional[str] = None,
    *,
    channel: Channel = None,
    label: str = "",
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
    **at: float,
) -> StepPatch:
    """Draw light over bins of optical length, time or another axis, per unit of this axis.

    Bars show one standard error.

    The area under the steps is the light in all bins. Of tagged light, it is ``total``; of Stokes
    parameters, S0. Circles mark bins whose errors are unreliable (``few``).

    Parameters
    ----------
    source : Result, Image, Reading or Estimate
        A picture whose film has a ``decomposition``, or a ``Reading`` or ``Estimate`` whose values
        are sums over bins.
    along : str, optional
        The axis. A picture has one, ``length`` or ``time``; for a reading, the default is ``opl``.
    channel : str or int, optional
        As for :func:`profile`.
    label : str, optional
        As for :func:`profile`.
    unit : str, optional
        As for :func:`profile`.
    ax : matplotlib.axes.Axes, optional
        As for :func:`profile`.
    **at : float
        Of a picture, a pixel: ``row=20, column=30``. The default is the mean over the image,
        without error bars because pixels may share paths. Of a reading, a position on each other
        axis that has more than one bin: ``side=1``.

    Returns
    -------
    matplotlib.patches.StepPatch
        The steps.

    Raises
    ------
    PlotError
        No such bins, or values outside them.

    Examples
    --------
    >>> plot.histogram(result, row=20, column=30)
    >>> plot.histogram(result.meters["binned_power"], side=0)
    """
    if is_reading(source):
        along, of = along or "opl", table(source, "", channel)
    elif not isinstance(source, (Result, Image)):
        raise PlotError(f"expected a picture with layers or a reading, found {type(source).__name__}")
    else:
        of = binned(source, channel)
        along = along or next(iter(of.axes))
        of, at = (of, at) if at else _whole(of)
    of = of.cut((along,), at)
    edges = of.edges(along)
    width = np.diff(edges)
    ax, middle = axes(ax), (edges[1:] + edges[:-1]) / 2
    steps = ax.stairs(of.mean / width, edges, label=label or "_", color=ax.plot([], [])[0].get_color())
    if of.error is not None:
        ax.errorbar(middle, of.mean / width, of.error / width, fmt="none", ecolor=steps.get_edgecolor(), elinewidth=1)
    _mark(ax, of, middle, of.mean / width, steps.get_edgecolor())
    ax.set_xlabel(label_along(along, unit))
    ax.set_ylabel(_density(of, along, unit))
    return steps


def _mark(ax: Axes, of: Table, x: Doubles, y: Doubles, colour: Any) -> None:
    """Draws circles around values whose errors are unreliable."""
    if of.few is not None and of.few.any():
        ax.plot(x[of.few], y[of.few], "o", markerfacecolor="none", color=colour, markersize=4, label="_few")


def _whole(of: Table) -> Tuple[Table, Dict[str, float]]:
    """Returns the mean over pixels, and no cuts."""
    kept = {a: None if a in ("row", "column") else edges for a, edges in of.axes.items()}
    return Table(of.mean.mean((1, 2), keepdims=True), None, kept, of.name, of.unit), {}


def _density(of: Table, along: str, unit: Optional[str]) -> str:
    per = {"opl": unit or "unit", "length": unit or "unit of length", "time": "unit of time"}.get(along, along)
    return f"{quantity(of.name, of.unit, unit)} per {per}"
