"""Figures of lenses: layout, ray fans, and modulation."""

from __future__ import annotations

import math
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from .._morgana import Field
from .._prescription import AXIS, Prescription, Surface, layout, sag
from .._pupil import TOLERANCE, start_plane, trace
from .._system import Plane, System
from .._wavefront import mtf, wavefront
from ..grad import Rays
from ._labels import along, axes
from ._table import Doubles, PlotError

PROFILE = 61
"""Number of points of the drawn profile of a surface."""

CURVED = 24
"""Number of points of rays between two surfaces in a graded medium."""

NEWTON_STEPS = 6
"""Number of steps from the plane of a vertex to its surface. The drawing needs no more than 1e-4 of
the size of the lens."""

MARGIN = 1.05
"""Drawn rim relative to the outermost ray."""

MAX_AIR = 1.01
"""Largest index of media that are drawn as air."""


def lens(
    prescription: Prescription,
    *,
    count: int = 5,
    wavelength: Optional[float] = None,
    unit: Optional[str] = "mm",
    ax: Optional[Axes] = None,
) -> LineCollection:
    """Draw a lens in the plane of z and y, with rays of each field point.

    Surfaces reach to the outermost drawn ray, or to their ``aperture``. Media other than air are
    shaded. Bars mark the rim of the stop.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    count : int, optional
        Number of rays of each field point, ≥ 2, along y in the stop.
    wavelength : float, optional
        Wavelength in nanometres; the primary wavelength by default.
    unit : str, optional
        Name of the unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.

    Returns
    -------
    matplotlib.collections.LineCollection
        The rays.

    Raises
    ------
    GradError
        Chief rays that do not arrive.

    Examples
    --------
    >>> plot.lens(triplet)
    """
    ax = axes(ax)
    at = prescription.wavelength(wavelength)
    lines: List[Doubles] = []
    colours: List[str] = []
    rims = [surface.aperture or 0.0 for surface in prescription.surfaces]
    for number, field in enumerate(prescription.fields):
        bundle = trace(prescription, field, at, pupil="y", count=count)
        paths = _paths(prescription, bundle.origins, bundle.directions, at)
        for i, (surface, vertex) in enumerate(zip(prescription.surfaces, prescription.vertices)):
            if surface.aperture is None:
                # Points in graded media are not on surfaces: pick those on this surface.
                on = np.abs(paths[..., 2] - vertex - np.vectorize(lambda h, s=surface: sag(s, h))(np.hypot(paths[..., 0], paths[..., 1]))) < 1e-6
                rims[i] = max(rims[i], MARGIN * float(np.max(np.abs(paths[..., 1]), where=on, initial=0.0)))
        lines.extend(path[np.isfinite(path).all(1)][:, [2, 1]] for path in paths)
        colours.extend([f"C{number}"] * len(paths))
    solid = _solid(prescription, at)
    # Both faces of a piece of glass have one rim.
    for i in range(len(rims) - 1):
        if solid[i]:
            rims[i] = rims[i + 1] = max(rims[i], rims[i + 1])
    profiles = [_profile(*each) for each in zip(prescription.surfaces, prescription.vertices, rims)]
    for i, profile in enumerate(profiles):
        if solid[i] and i + 1 < len(profiles):
            outline = np.concatenate([profile, profiles[i + 1][::-1]])
            ax.fill(outline[:, 0], outline[:, 1], facecolor="0.88", edgecolor="0.35", linewidth=0.9, zorder=1)
        if i == prescription.stop:
            edge, rim = float(profile[-1, 0]), float(profile[-1, 1])
            for side in (rim, -rim):
                ax.plot([edge, edge], [side, 1.3 * side], color="black", linewidth=2, zorder=3)
    image = float(prescription.vertices[-1])
    tall = max((abs(line[-1, 1]) for line in lines if len(line)), default=1.0)
    ax.plot([image, image], [-1.1 * tall, 1.1 * tall], color="black", linewidth=1)
    artist = LineCollection(lines, colors=colours, linewidths=0.7, zorder=2)
    ax.add_collection(artist)
    ax.set_aspect("equal", adjustable="datalim")
    ax.autoscale_view()
    ax.set_xlabel(along("z", unit))
    ax.set_ylabel(along("y", unit))
    return artist


def fan(
    prescription: Prescription,
    field: Any = 0.0,
    *,
    waves: bool = False,
    axis: str = "y",
    count: int = 33,
    unit: Optional[str] = "mm",
    ax: Optional[Axes] = None,
) -> List[Line2D]:
    """Draw the aberrations of rays along a line of the stop, for each wavelength.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    field : float or two of float, optional
        Field point.
    waves : bool, optional
        ``True`` draws the wavefront in waves, ``False`` the position in the image plane relative to
        the chief ray of the primary wavelength.
    axis : str, optional
        Line of the stop, and coordinate of positions: ``"x"`` or ``"y"``.
    count : int, optional
        Number of rays, ≥ 2.
    unit : str, optional
        Name of the unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.

    Returns
    -------
    list of matplotlib.lines.Line2D
        A line for each wavelength.

    Raises
    ------
    PlotError
        Another axis.

    Examples
    --------
    >>> plot.fan(triplet, 14.0)
    """
    if axis not in ("x", "y"):
        raise PlotError(f"axis is {axis!r} but must be 'x' or 'y'")
    ax, column = axes(ax), "xy".index(axis)
    reference = trace(prescription, field, pupil=axis, count=2).chief.positions[0, column]
    drawn = []
    for wavelength in prescription.wavelengths:
        if waves:
            wave = wavefront(prescription, field, wavelength, pupil=axis, count=count)
            aims, values = wave.pupil[:, column], wave.waves
        else:
            bundle = trace(prescription, field, wavelength, pupil=axis, count=count)
            aims, values = bundle.pupil[:, column], bundle.ends.positions[:, column] - reference
        drawn.extend(ax.plot(aims, values, color=_colour(wavelength), label=f"{wavelength:.0f} nm"))
    ax.axhline(0, color="0.7", linewidth=0.7, zorder=0)
    ax.axvline(0, color="0.7", linewidth=0.7, zorder=0)
    ax.set_xlabel(f"pupil {axis}")
    ax.set_ylabel("wavefront (waves)" if waves else f"aberration {axis} ({unit or 'scene units'})")
    return drawn


def modulation(
    prescription: Prescription,
    fields: Optional[Sequence[Any]] = None,
    *,
    frequencies: Optional[Any] = None,
    diffraction: bool = True,
    count: int = 64,
    unit: Optional[str] = "mm",
    ax: Optional[Axes] = None,
) -> List[Line2D]:
    """Draw the modulation transfer function of field points, at the primary wavelength.

    Solid lines are stripes that vary along y (tangential for fields along y), dashed lines along x.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    fields : sequence, optional
        Field points; by default all of the prescription.
    frequencies, diffraction, count : optional
        As for :func:`morgana.lens.mtf`.
    unit : str, optional
        Name of the unit of length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; by default the current axes of pyplot.

    Returns
    -------
    list of matplotlib.lines.Line2D
        Two lines for each field point.

    Raises
    ------
    GradError
        As for :func:`morgana.lens.mtf`.

    Examples
    --------
    >>> plot.modulation(triplet)
    """
    ax = axes(ax)
    drawn = []
    name = "°" if math.isinf(prescription.object_distance) else f" {unit or 'scene units'}"
    for number, field in enumerate(prescription.fields if fields is None else fields):
        found = mtf(prescription, field, frequencies=frequencies, diffraction=diffraction, count=count)
        x, y = prescription.field_point(field)
        point = f"{y:g}{name}" if x == 0 else f"({x:g}, {y:g}){name}"
        for values, style, direction in ((found.y, "-", "y"), (found.x, "--", "x")):
            drawn.extend(ax.plot(found.frequencies, values, style, color=f"C{number}", label=f"{point}, {direction}"))
    ax.set_xlabel(f"spatial frequency (cycles per {unit or 'scene unit'})")
    ax.set_ylabel("modulation")
    ax.set_ylim(0, 1.02)
    ax.set_xlim(left=0)
    return drawn


def _paths(prescription: Prescription, origins: Doubles, directions: Doubles, wavelength: float) -> Doubles:
    """Returns points of rays before the lens, on each surface, in graded media, and in the image,
    (rays, points, 3). Points that rays do not reach are NaN."""
    before = start_plane(prescription)
    points = [origins + directions * ((before - origins[:, 2]) / directions[:, 2])[:, None]]
    vertices = prescription.vertices

    def ends(system: System, z: float) -> Tuple[Doubles, Doubles]:
        found = Rays(origins, directions, exit=Plane((0.0, 0.0, z), AXIS), tolerance=TOLERANCE).forward(system)
        return found.positions, found.directions

    for i, surface in enumerate(prescription.surfaces):
        positions, ways = ends(layout(prescription, wavelength, i).system, float(vertices[i]))
        for _ in range(NEWTON_STEPS):
            # Follow the straight ray from the plane of the vertex to the surface.
            depth = np.array([sag(surface, float(np.hypot(*at[:2]))) for at in positions])
            positions = positions + ways * ((vertices[i] + depth - positions[:, 2]) / ways[:, 2])[:, None]
        points.append(positions)
        behind = layout(prescription, wavelength, i + 1).system
        if isinstance(behind.media[-1], Field):
            points.extend(ends(behind, float(z))[0] for z in np.linspace(vertices[i], vertices[i + 1], CURVED + 2)[1:-1])
    points.append(ends(prescription.system(wavelength), float(vertices[-1]))[0])
    return np.stack(points, axis=1)


def _solid(prescription: Prescription, wavelength: float) -> List[bool]:
    """Returns for each surface whether the medium behind it is not air."""
    media = [layout(prescription, wavelength, i + 1).system.media[-1] for i in range(len(prescription.surfaces))]
    return [not (isinstance(medium, float) and medium < MAX_AIR) for medium in media]


def _profile(surface: Surface, vertex: float, rim: float) -> Doubles:
    """Returns points (z, y) of a surface up to its rim; where the surface ends before the rim, up to
    its end."""
    heights = np.linspace(-rim, rim, PROFILE)
    depths = np.array([sag(surface, float(height)) for height in heights])
    return np.asarray(np.column_stack([vertex + depths, heights])[np.isfinite(depths)])


def _colour(wavelength: float) -> Any:
    """Returns a colour for a wavelength in nanometres, from violet to red."""
    return colormaps["turbo"](float(np.clip((wavelength - 380) / 340, 0.05, 0.95)))
