"""Figures of rays, and of the points where they arrive."""

from __future__ import annotations

from typing import Dict, Optional, Sequence, Tuple, Union

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from numpy.typing import ArrayLike

from .._numbers import numbers
from .._rays import Polyline, RayEnds, Rays
from ._labels import along, axes
from ._table import Doubles, PlotError


def rays(
    lines: Union[Rays, Sequence[Union[Polyline, ArrayLike]]],
    plane: str,
    *,
    color: str = "black",
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
) -> LineCollection:
    """Draw rays, projected along the axis across a plane.

    Parameters
    ----------
    lines : Rays or sequence of array_like
        Rays from :func:`morgana.trace`, or arrays of points (points, 3).
    plane : str
        Axes to the right and upwards: two of ``x``, ``y``, ``z``.
    color : str, optional
        Colour of all rays.
    unit : str, optional
        Name of the scene's unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in, such as the axes of a :func:`field`, whose limits are kept; by default the
        current axes of pyplot.

    Returns
    -------
    matplotlib.collections.LineCollection
        The rays.

    Raises
    ------
    PlotError
        No such plane.

    Examples
    --------
    >>> plot.rays(morgana.trace(scene, starts, [0, 0, 1]), "zx", unit="mm")
    """
    right, up = _columns(plane)
    if isinstance(lines, RayEnds) and not isinstance(lines, Rays):
        raise PlotError("these rays have no paths to draw: trace them without paths=False, or draw their spots")
    if not hasattr(lines, "__len__"):
        raise PlotError(f"expected rays or a list of them, found {type(lines).__name__}")
    each = [_points(lines[i])[:, [right, up]] for i in range(len(lines))]
    ax = axes(ax)
    filled = ax.has_data()
    artist = LineCollection(each, colors=color, linewidths=0.8)
    ax.add_collection(artist, autolim=not filled)
    if not filled:
        ax.autoscale_view()
    ax.set_xlabel(along(plane[0], unit))
    ax.set_ylabel(along(plane[1], unit))
    return artist


def spots(
    arrivals: Union[RayEnds, ArrayLike],
    plane: str = "xy",
    *,
    label: str = "",
    unit: Optional[str] = None,
    ax: Optional[Axes] = None,
    **at: float,
) -> PathCollection:
    """Draw a spot diagram of the points where rays arrive, around their mean.

    The title gives the root mean square radius.

    Parameters
    ----------
    arrivals : RayEnds or array_like
        Rays from :func:`morgana.trace`, also with ``paths=False``, or points (rays, 3). Lost rays
        are left out.
    plane : str, optional
        Axes to the right and upwards: two of ``x``, ``y``, ``z``.
    label : str, optional
        Name of the spots in a legend.
    unit : str, optional
        Name of the scene's unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.
    **at : float
        Value of the third axis, such as ``z=30``. The rays are extended straight along their last
        directions to this value. By default, spots are the ends of the rays.

    Returns
    -------
    matplotlib.collections.PathCollection
        The spots.

    Raises
    ------
    PlotError
        No such plane, no rays, rays along the plane, or ``at`` for points instead of rays.

    Examples
    --------
    >>> plot.spots(rays, "xy", z=30, unit="mm")
    """
    points = _arrivals(arrivals, plane, at)[:, list(_columns(plane))]
    if not len(points):
        raise PlotError("there are no rays that have arrived")
    points = points - points.mean(0)
    ax = axes(ax)
    artist = ax.scatter(points[:, 0], points[:, 1], s=6, linewidths=0, label=label or "_")
    radius = np.sqrt((points**2).sum(1).mean())
    ax.set_title(f"RMS radius {radius:.3g} {unit or ''}".rstrip())
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(along(plane[0], unit))
    ax.set_ylabel(along(plane[1], unit))
    return artist


def _points(line: Union[Polyline, ArrayLike]) -> Doubles:
    points = numbers(line.points if isinstance(line, Polyline) else line, "points")
    if points.ndim != 2 or points.shape[1] != 3:
        raise PlotError(f"expected rays as points of shape (points, 3), found {points.shape}")
    return points


def _arrivals(arrivals: Union[RayEnds, ArrayLike], plane: str, at: Dict[str, float]) -> Doubles:
    third = _third(plane)
    if set(at) - {third}:
        raise PlotError(f"{', '.join(at)} cannot be chosen: only {third}, across the plane")
    if not isinstance(arrivals, RayEnds):
        if at:
            raise PlotError(f"points cannot be moved to {third}: give rays")
        return _points(arrivals)
    arrived = np.isfinite(arrivals.end_points).all(1) & (arrivals.end != "lost")
    points: Doubles = arrivals.end_points[arrived]
    tangents: Doubles = arrivals.end_tangents[arrived]
    if not at:
        return points
    axis = "xyz".index(third)
    if (tangents[:, axis] == 0).any():
        raise PlotError(f"rays run along the plane: they have no place at {third} = {at[third]:g}")
    way: Doubles = (at[third] - points[:, axis]) / tangents[:, axis]
    return points + tangents * way[:, None]


def _columns(plane: str) -> Tuple[int, int]:
    if len(plane) != 2 or plane[0] == plane[1] or set(plane) - set("xyz"):
        raise PlotError(f"plane is {plane!r} but must name two of x, y, z, such as 'zx'")
    return "xyz".index(plane[0]), "xyz".index(plane[1])


def _third(plane: str) -> str:
    _columns(plane)
    return ({"x", "y", "z"} - set(plane)).pop()
