"""Effect of manufacturing errors on spots: see :func:`morgana.lens.tolerances`."""

from __future__ import annotations

import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _checks as checks
from ._prescription import AXIS, Layout, Prescription, layout
from ._pupil import TOLERANCE, trace, weighted_rms
from ._system import Conic, GradError, Plane, System
from ._values import comparable
from ._ray_bundle import Rays

Doubles = NDArray[np.float64]

QUANTITIES = ("radius", "conic", "thickness", "index", "decenter_x", "decenter_y", "tilt_x", "tilt_y")


class Tolerance(NamedTuple):
    """Range of an error of a :class:`Prescription`.

    Examples
    --------
    >>> morgana.lens.Tolerance(surface=2, quantity="decenter_y", amount=0.02)
    """

    surface: int
    """Number of the surface, from 0."""
    quantity: str
    """``"radius"``, ``"conic"``, ``"thickness"`` or ``"index"`` (of the medium behind the surface);
    ``"decenter_x"`` and ``"decenter_y"``, shifts of the vertex; ``"tilt_x"`` and ``"tilt_y"``, slopes
    of the axis of the surface along x and y. A thickness moves all surfaces behind it, and the
    image plane."""
    amount: float
    """Largest error, > 0: the error is uniform from −amount to amount. In scene units for lengths,
    in radians for tilts."""


@comparable
class Tolerances(NamedTuple):
    """Spots of a lens with manufacturing errors."""

    tolerances: Tuple[Tolerance, ...]
    """The errors."""
    nominal: float
    """RMS radius of the spot without errors, in scene units."""
    sensitivities: Doubles
    """RMS radius with one error at its positive and at its negative end, (tolerances, 2), for rays
    that depend on the error linearly."""
    expected: float
    """Root of the mean squared RMS radius with all errors, for rays that depend on them
    linearly."""
    trials: Doubles
    """RMS radius of each random lens, (trials,), traced without approximation; NaN if no ray
    arrives."""
    lost: int
    """Number of rays without an end, in all trials. Radii leave them out."""

    @property
    def worst(self) -> Tolerance:
        """Error with the largest effect."""
        return self.tolerances[int(self.sensitivities.max(1).argmax())]

    def __repr__(self) -> str:
        return (
            f"<morgana.lens.Tolerances: {len(self.tolerances)} errors, RMS radius {self.nominal:.6g}, expected {self.expected:.6g}, "
            f"{len(self.trials)} trials>"
        )


def tolerances(
    prescription: Prescription,
    errors: Sequence[Tolerance],
    field: Any = 0.0,
    wavelength: Optional[float] = None,
    *,
    trials: int = 100,
    count: int = 8,
    seed: int = 0,
) -> Tolerances:
    """Spots of a lens with manufacturing errors, by derivatives and by random trials.

    Rays start as in the lens without errors. The derivatives need a trace for each error, the
    trials a trace for each lens.

    Parameters
    ----------
    prescription : Prescription
        The lens.
    errors : sequence of Tolerance
        Errors of the lens. They are independent.
    field, wavelength
        As for :func:`trace`.
    trials : int, optional
        Number of random lenses, ≥ 0.
    count : int, optional
        Rings of the hexapolar sampling of the stop.
    seed : int, optional
        Seed of the random lenses.

    Returns
    -------
    Tolerances
        Spots of single errors, and of all errors together.

    Raises
    ------
    GradError
        No errors, unknown quantities or surfaces, or an error that the lens cannot have.

    Examples
    --------
    >>> result = morgana.lens.tolerances(triplet, [morgana.lens.Tolerance(2, "decenter_y", 0.05)], field=14.0)
    >>> result.nominal, result.expected, np.percentile(result.trials, 90)
    """
    if not len(errors):
        raise GradError("there are no errors: give at least one morgana.lens.Tolerance")
    checks.whole(trials, "trials", 0)
    bundle = trace(prescription, field, wavelength, count=count)
    at = layout(prescription, bundle.wavelength)
    ends = bundle.ends.valid & np.isfinite(bundle.points).all(1)
    exit = prescription.image
    rays = Rays(bundle.origins[ends], bundle.directions[ends], exit=exit, tolerance=TOLERANCE)
    columns = []
    for error in errors:
        change, moved = _change(prescription, at, error)
        columns.append(rays.jvp(at.system, change, exit=Plane((0.0, 0.0, moved), (0.0, 0.0, 0.0))).positions[:, :2])
    nominal, weights = bundle.points[ends], bundle.weights[ends]
    jacobian = np.stack(columns)
    amounts = np.array([error.amount for error in errors])
    single = [[weighted_rms(nominal + sign * amount * column, weights) for sign in (1, -1)] for amount, column in zip(amounts, jacobian)]
    # Uniform errors have the variance amount²/3.
    mean_square = weighted_rms(nominal, weights) ** 2 + sum(amount**2 / 3 * weighted_rms(column, weights) ** 2 for amount, column in zip(amounts, jacobian))
    rng = np.random.default_rng(seed)
    found, lost = [], 0
    for _ in range(trials):
        draws = rng.uniform(-1, 1, len(errors)) * amounts
        system, shift = perturbed(prescription, at, errors, draws)
        z = float(prescription.vertices[-1]) + shift
        traced = Rays(bundle.origins[ends], bundle.directions[ends], exit=Plane((0.0, 0.0, z), AXIS), tolerance=TOLERANCE).forward(system)
        lost += int((~traced.valid).sum())
        found.append(weighted_rms(traced.positions[traced.valid, :2], weights[traced.valid]))
    return Tolerances(tuple(errors), weighted_rms(nominal, weights), np.array(single), math.sqrt(mean_square), np.array(found), lost)


def perturbed(prescription: Prescription, at: Layout, errors: Sequence[Tolerance], draws: Doubles) -> Tuple[System, float]:
    """Returns media and surfaces with errors, and the shift of the image plane."""
    surfaces: List[Any] = list(at.system.surfaces)
    media: List[Any] = list(at.system.media)
    total = 0.0
    for error, draw in zip(errors, draws):
        row = at.rows[error.surface]
        if error.quantity == "thickness":
            total += draw
            moving = [i for i, owner in enumerate(at.owners) if owner > error.surface]
            _move(surfaces, moving, draw * np.array(AXIS))
        elif error.quantity.startswith("decenter"):
            _move(surfaces, [i for i, owner in enumerate(at.owners) if owner == error.surface], draw * _step(error))
        elif error.quantity == "index" and row is not None:
            media[_medium_behind(at, row)] += draw
        elif row is not None:
            surface = surfaces[row]
            if error.quantity == "radius":
                surfaces[row] = surface._replace(curvature=1 / (prescription.surfaces[error.surface].radius + draw))
            elif error.quantity == "conic":
                surfaces[row] = surface._replace(conic=surface.conic + draw)
            else:
                surfaces[row] = surface._replace(axis=tuple(np.asarray(surface.axis) + draw * _step(error)))
    return System(media, surfaces), total


def _change(prescription: Prescription, at: Layout, error: Tolerance) -> Tuple[Dict[str, Any], float]:
    """Returns the changes of parameters per unit of an error, and the shift of the image plane."""
    if not isinstance(error, Tolerance) or error.quantity not in QUANTITIES:
        raise GradError(f"{checks.shown(error)} must be a morgana.lens.Tolerance of one of {', '.join(QUANTITIES)}")
    checks.whole(error.surface, "surface", 0, len(prescription.surfaces) - 1)
    checks.positive(error.amount, f"the amount of {error.quantity} of surfaces[{error.surface}]")
    row = at.rows[error.surface]
    if error.quantity == "thickness":
        conics = [i for i in at.rows[error.surface + 1 :] if i is not None]
        return {f"surfaces[{i}].vertex": np.array([0.0, 0.0, 1.0]) for i in conics}, 1.0
    if row is None:
        raise GradError(f"surfaces[{error.surface}] lies between equal media, so that its {error.quantity} has no effect: leave this error out")
    if error.quantity == "index":
        medium = _medium_behind(at, row)
        if not isinstance(at.system.media[medium], (int, float)):
            raise GradError(f"the medium behind surfaces[{error.surface}] is a field, not an index")
        return {f"media[{medium}]": 1.0}, 0.0
    if error.quantity == "radius":
        radius = prescription.surfaces[error.surface].radius
        if math.isinf(radius) or error.amount >= abs(radius):
            raise GradError(f"surfaces[{error.surface}] has the radius {radius:g}, which cannot change by {error.amount:g}")
        return {f"surfaces[{row}].curvature": -1 / radius**2}, 0.0
    if error.quantity == "conic":
        return {f"surfaces[{row}].conic": 1.0}, 0.0
    name = "vertex" if error.quantity.startswith("decenter") else "axis"
    return {f"surfaces[{row}].{name}": _step(error)}, 0.0


def _move(surfaces: List[Any], which: Sequence[int], by: Doubles) -> None:
    """Moves the vertices of conics and the centres of apertures."""
    for i in which:
        name = surfaces[i]._fields[0]
        surfaces[i] = surfaces[i]._replace(**{name: tuple(np.asarray(getattr(surfaces[i], name)) + by)})


def _step(error: Tolerance) -> Doubles:
    """Returns the direction in which a vertex or an axis moves."""
    return np.asarray(np.eye(3)["xy".index(error.quantity[-1])])


def _medium_behind(at: Layout, row: int) -> int:
    """Returns the number of the medium behind an element."""
    return sum(isinstance(surface, Conic) for surface in at.system.surfaces[: row + 1])
