"""Figures of values in a plane, in colours."""

from __future__ import annotations

from typing import Dict, Literal, Optional, Tuple, Union

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.image import AxesImage

from .._checks import optional_finite
from .._estimate import Estimate
from .._images import exposure as default_exposure
from .._morgana import Field
from ._labels import along, axes, colour_bar, colours, quantity
from ._table import Channel, Doubles, PlotError, Source, Table, channels_of, is_reading, table

Where = Union[float, Tuple[float, float]]
Limits = Optional[Tuple[float, float]]
Shown = Literal["mean", "error", "relative error", "few"]

DARK_PERCENTILE = 1.0
"""Percentile of the positive values at which a logarithmic scale begins, in percent: single values
near zero would otherwise stretch the scale."""
SIGNED = 0.02
"""Smallest ratio of the ends of signed values. Filters of films with negative lobes make a few
values of unsigned quantities slightly negative."""


def image(
    picture: Source,
    *,
    layer: str = "",
    channel: Channel = None,
    show: Shown = "mean",
    log: bool = False,
    limits: Limits = None,
    exposure: Optional[float] = None,
    label: Optional[str] = None,
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
) -> AxesImage:
    """Show a picture, row 0 at the top.

    Light with the channels R, G and B appears as on a screen, as in a ``.png`` file of
    :func:`morgana.write`. Other values appear in false colours with a colour bar, and so does light
    if you give ``channel``, ``show``, ``log``, ``limits`` or ``label``. Signed quantities, such as
    deflections, have a diverging colour map that is white at zero.

    Parameters
    ----------
    picture : Result, Image, Layer, Estimate or array_like
        A ``Result``, an ``Image``, a ``Layer``, an ``Estimate`` computed from them, or an array of shape (height, width) or (height, width,
        channels).
    layer : str, optional
        Name of a layer of light, or of a file; by default the main layer.
    channel : str or int, optional
        Name of a channel; false colours show by default the mean over channels.
    show : {"mean", "error", "relative error", "few"}, optional
        Values (``"mean"``), standard errors (``"error"``), or errors relative to values
        (``"relative error"``); ``"few"``: 1 where errors are unreliable, else 0.
    log : bool, optional
        Use a logarithmic scale of colours. The scale begins at the first percentile of the positive
        values; values that are not positive are grey.
    limits : (float, float), optional
        Values of the first and last colour.
    exposure : float, optional
        Stops by which a picture without false colours is brightened; by default the result of
        :func:`morgana.exposure`.
    label : str, optional
        Name of the quantity, with its unit.
    unit : str, optional
        Name of the scene's unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.

    Returns
    -------
    matplotlib.image.AxesImage
        The picture.

    Raises
    ------
    PlotError
        No such layer, channel or error, no positive value for a logarithmic scale, or an exposure
        of false colours.

    Examples
    --------
    >>> plot.image(result)
    >>> plot.image(result, channel="G", log=True, label="radiance (W m⁻² sr⁻¹)")
    """
    of = table(picture, layer, channel).cut(("row", "column"), {})
    stops = optional_finite(exposure, "exposure")
    has_default_colours = channel is None and show == "mean" and not log and limits is None and label is None
    light = _light(picture, layer) if has_default_colours else None
    if light is None and stops is not None:
        raise PlotError("exposure is for light with the channels R, G and B, without channel, show, log, limits and label")
    ax = axes(ax)
    ax.set_xlabel(along("column", None))
    ax.set_ylabel(along("row", None))
    if light is not None:
        return ax.imshow(_on_screen(light, stops), interpolation="nearest")
    values = _shown(of, show)
    norm, cmap = _scale(values, log, limits)
    artist = ax.imshow(_masked(values, log), norm=norm, cmap=colours(cmap), interpolation="nearest")
    name = of.name if channel in (None, of.name) else f"{of.name}, {channel}"
    colour_bar(artist, ax, _title(label, "", unit, show) if label else _title(name, of.unit, unit, show))
    return artist


def slice(
    reading: Estimate,
    plane: str,
    *,
    channel: Channel = None,
    show: Shown = "mean",
    log: bool = False,
    limits: Limits = None,
    label: str = "",
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
    **at: float,
) -> QuadMesh:
    """Show a meter's reading in a plane, with axes in scene units.

    Parameters
    ----------
    reading : Reading or Estimate
        Reading of ``Result.meters``, or an estimate computed from it.
    plane : str
        Axes to the right and upwards, such as ``"xz"`` or ``"zr"``.
    channel : int, optional
        Number of a channel; by default the mean over channels.
    show : {"mean", "error", "relative error", "few"}, optional
        As for :func:`image`.
    log : bool, optional
        As for :func:`image`.
    limits : (float, float), optional
        As for :func:`image`.
    label : str, optional
        Name of the quantity; its unit is the unit of the reading.
    unit : str, optional
        Name of the scene's unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.
    **at : float
        Position on each other axis that has more than one bin, such as ``y=0``; the bin there is
        shown.

    Returns
    -------
    matplotlib.collections.QuadMesh
        The cells.

    Raises
    ------
    PlotError
        No such axes, values outside them, or no positive value for a logarithmic scale.

    Examples
    --------
    >>> plot.slice(result.meters["p0"], "xz", y=0, log=True, label="initial pressure", unit="mm")
    """
    full = table(reading, "", channel)
    right, up = _plane(plane)
    of = full.cut((up, right), at)
    ax = axes(ax)
    mesh = _mesh(ax, (of.edges(right), of.edges(up)), _shown(of, show), log, limits)
    _frame(ax, plane, unit, full.where(at))
    colour_bar(mesh, ax, _title(label, of.unit, unit, show))
    return mesh


def field(
    index: Field,
    plane: str,
    *,
    reference: Optional[float] = None,
    resolution: int = 200,
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
    **where: Where,
) -> QuadMesh:
    """Show a refractive index in a plane; :func:`rays` can draw rays on top.

    Parameters
    ----------
    index : Field
        Field of ``Scene.fields`` or :func:`morgana.load_field`.
    plane : str
        Axes to the right and upwards: two of ``x``, ``y``, ``z``.
    reference : float, optional
        Show Δn = n − reference instead of n, with white at zero.
    resolution : int, optional
        Number of samples along each axis.
    unit : str, optional
        Name of the scene's unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.
    **where : float or (float, float)
        Limits of both axes, and the position on the third axis (0 by default): ``x=(-1, 1), z=(0,
        5), y=0.2``.

    Returns
    -------
    matplotlib.collections.QuadMesh
        The cells.

    Raises
    ------
    PlotError
        Limits are missing, or there are no such axes.

    Examples
    --------
    >>> plot.rays(rays, "zx", ax=plot.field(index, "zx", z=(0, 30), x=(-2, 2), reference=1.33).axes)
    """
    if not isinstance(index, Field):
        raise PlotError(f"expected a Field, found {type(index).__name__}: give a field of Scene.fields")
    if resolution < 1:
        raise PlotError(f"resolution is {resolution} but must be at least 1")
    right, up = _plane(plane)
    edges = (_limits(right, where, resolution), _limits(up, where, resolution))
    values = index.n(_points(right, up, edges, where))
    ax = axes(ax)
    if reference is None:
        mesh = _mesh(ax, edges, values, False, None)
    else:
        values = values - reference
        most = float(np.nanmax(np.abs(values))) or 1.0
        mesh = _mesh(ax, edges, values, False, (-most, most), signed=True)
    _frame(ax, plane, unit, "")
    colour_bar(mesh, ax, "n" if reference is None else f"n − {reference:g}")
    return mesh


def _plane(plane: str) -> Tuple[str, str]:
    if len(plane) != 2 or plane[0] == plane[1]:
        raise PlotError(f"plane is {plane!r} but must name two axes by a letter each, such as 'xz'")
    return plane[0], plane[1]


def _shown(of: Table, show: str) -> Doubles:
    if show == "mean":
        return of.mean
    if show not in ("error", "relative error", "few"):
        raise PlotError(f"show is {show!r} but must be 'mean', 'error', 'relative error' or 'few'")
    if show == "few":
        if of.few is None:
            raise PlotError("the data do not state which errors are unreliable: give a picture or a reading by morgana")
        return of.few.astype(float)
    if of.error is None:
        raise PlotError("the errors are unknown: use more samples, or a picture with its variance")
    if show == "error":
        return of.error
    # Set the relative error to NaN where no light arrived.
    relative: Doubles = np.divide(of.error, of.mean, out=np.full(of.mean.shape, np.nan), where=of.mean != 0)
    return relative


def _title(name: str, of_unit: str, unit: Optional[str], show: str) -> str:
    if show == "relative error":
        return f"relative error, {name}" if name else show
    if show == "few":
        return f"error cannot be trusted, {name}" if name else "error cannot be trusted"
    return quantity(name if show == "mean" else f"error, {name}" if name else show, of_unit, unit)


def _light(picture: Source, layer: str) -> Optional[Doubles]:
    """Returns the light of a picture with the channels R, G and B; ``None`` for other values."""
    if is_reading(picture) or layer.split(".")[-1] in ("few", "samples") or layer.startswith("variance"):
        return None
    values, names = channels_of(picture, layer)
    if not {"R", "G", "B"} <= set(names):
        return None
    light: Doubles = values[:, :, [names.index(name) for name in "RGB"]]
    return None if _is_signed(light) else light


def _on_screen(light: Doubles, stops: Optional[float]) -> Doubles:
    """Returns the colours of linear values, from 0 to 1, in sRGB."""
    if stops is None:
        stops = default_exposure(light)
    linear = np.clip(np.nan_to_num(light) * 2.0**stops, 0, 1)
    screen: Doubles = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return screen


def _is_signed(values: Doubles) -> bool:
    """Returns true if values are on both sides of zero."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return False
    low, high = -float(finite.min()), float(finite.max())
    return min(low, high) > SIGNED * max(low, high)


def _scale(values: Doubles, log: bool, limits: Limits, signed: Optional[bool] = None) -> Tuple[Normalize, str]:
    """Returns the scale of colours, and the name of the colour map. ``signed`` is by default true
    if values are on both sides of zero."""
    if signed is None:
        signed = not log and _is_signed(values)
    cmap = "RdBu_r" if signed else "viridis"
    if limits is not None:
        if np.shape(limits) != (2,):
            raise PlotError(f"limits is {limits!r} but must be two values, for the first and the last colour")
        if log:
            return LogNorm(*limits), cmap
        if signed and limits[0] < 0 < limits[1]:
            return TwoSlopeNorm(0, *limits), cmap
        return Normalize(*limits), "viridis"
    finite = values[np.isfinite(values) & (values > 0)] if log else values[np.isfinite(values)]
    if not finite.size:
        raise PlotError("no values to show on a logarithmic scale" if log else "no values to show")
    low, high = float(finite.min()), float(finite.max())
    if log:
        return LogNorm(float(np.percentile(finite, DARK_PERCENTILE, method="lower")), high), cmap
    if signed:
        return Normalize(-max(-low, high), max(-low, high)), cmap
    return Normalize(low, high), cmap


def _masked(values: Doubles, log: bool) -> Doubles:
    hidden = ~np.isfinite(values)
    if log:
        hidden |= ~(values > 0)
    masked: Doubles = np.ma.masked_where(hidden, values)
    return masked


def _mesh(
    ax: Axes, edges: Tuple[Doubles, Doubles], values: Doubles, log: bool, limits: Limits, signed: Optional[bool] = None
) -> QuadMesh:
    norm, cmap = _scale(values, log, limits, signed)
    return ax.pcolormesh(*edges, _masked(values, log), norm=norm, cmap=colours(cmap), rasterized=True)


def _frame(ax: Axes, plane: str, unit: Optional[str], title: str) -> None:
    ax.set_xlabel(along(plane[0], unit))
    ax.set_ylabel(along(plane[1], unit))
    if title:
        ax.set_title(title)


def _limits(axis: str, where: Dict[str, Where], resolution: int) -> Doubles:
    limits = where.get(axis)
    if not isinstance(limits, tuple):
        raise PlotError(f"give the limits of {axis}: {axis}=(from, to)")
    return np.linspace(*limits, resolution + 1)


def _points(right: str, up: str, edges: Tuple[Doubles, Doubles], where: Dict[str, Where]) -> Doubles:
    """Returns the centres of cells, (up, right, 3)."""
    for axis in (*where, right, up):
        if axis not in ("x", "y", "z"):
            raise PlotError(f"axis is {axis!r} but must be x, y or z")
    across, upwards = ((e[1:] + e[:-1]) / 2 for e in edges)
    third = where.get(({"x", "y", "z"} - {right, up}).pop(), 0.0)
    if isinstance(third, tuple):
        raise PlotError("the axis across the plane takes one value")
    points = np.full((len(upwards), len(across), 3), float(third))
    points[..., "xyz".index(right)] = across[None, :]
    points[..., "xyz".index(up)] = upwards[:, None]
    return points
