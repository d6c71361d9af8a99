"""Manufacturing errors of lenses: derivatives against traces of lenses with errors.

The false-alarm rate is below 1e-6: means of random lenses are compared at five standard errors.
"""

import math

import morgana
import numpy as np
import pytest
from morgana import lens
from morgana.lens import Surface, Tolerance
from test_lens import TRIPLET, triplet

FIELD = 14.0
ERRORS = [
    Tolerance(0, "radius", 0.02),
    Tolerance(5, "conic", 0.05),
    Tolerance(1, "thickness", 0.02),
    Tolerance(2, "index", 1e-3),
    Tolerance(2, "decenter_x", 0.02),
    Tolerance(3, "decenter_y", 0.02),
    Tolerance(4, "tilt_x", 1e-3),
    Tolerance(5, "tilt_y", 1e-3),
]


def changed(error, draw):
    """The triplet with an error, as another table; ``None`` for errors that tables do not have."""
    rows = list(triplet().surfaces)
    row = rows[error.surface]
    if error.quantity == "index":
        row = row._replace(material=float(lens.glass(row.material).n(587.5618)) + draw)
    elif error.quantity in ("radius", "conic", "thickness"):
        row = row._replace(**{error.quantity: getattr(row, error.quantity) + draw})
    else:
        return None
    rows[error.surface] = row
    return triplet()._replace(surfaces=rows)


def radius_of(points, weights):
    middle = np.average(points, axis=0, weights=weights)
    return math.sqrt(np.average(np.sum((points - middle) ** 2, 1), weights=weights))


@pytest.mark.parametrize("error", [error for error in ERRORS if "_" not in error.quantity], ids=lambda error: error.quantity)
def test_errors_of_tables(error):
    """Traces other tables from the starts of the nominal rays; the linear spot differs in second
    order."""
    bundle = lens.trace(triplet(), FIELD, count=8)
    found = lens.tolerances(triplet(), [error], FIELD, trials=0)
    for sign, predicted in zip((1, -1), found.sensitivities[0]):
        other = changed(error, sign * error.amount)
        ends = morgana.grad.Rays(bundle.origins, bundle.directions, exit=other.image).forward(other.system())
        # Second-order terms are at most a twentieth of the change of the radius, or 1e-6.
        exact = radius_of(ends.positions[:, :2], bundle.weights)
        assert predicted == pytest.approx(exact, abs=max(0.05 * abs(exact - found.nominal), 1e-6))
        assert abs(predicted - found.nominal) > 2e-5


def test_decentres_and_tilts():
    """A tilt of a sphere by a slope is a shift of its centre by radius times slope, to second order."""
    radius = TRIPLET[4].radius
    tilt = lens.tolerances(triplet(), [Tolerance(4, "tilt_y", 1e-3)], FIELD, trials=0).sensitivities
    shift = lens.tolerances(triplet(), [Tolerance(4, "decenter_y", 1e-3 * radius)], FIELD, trials=0)
    np.testing.assert_allclose(tilt, shift.sensitivities, rtol=1e-9)
    assert np.abs(shift.sensitivities - shift.nominal).max() > 1e-4
    # A field on the axis has equal spots for errors along x and y, of both signs.
    along = [lens.tolerances(triplet(), [Tolerance(2, f"decenter_{axis}", 0.05)], trials=0).sensitivities for axis in "xy"]
    np.testing.assert_allclose(along[0], along[1], rtol=1e-9)
    np.testing.assert_allclose(along[0][0, 0], along[0][0, 1], rtol=1e-9)


def test_random_lenses_have_the_expected_mean_square():
    found = lens.tolerances(triplet(), ERRORS, FIELD, trials=120, count=3, seed=1)
    squares = found.trials**2
    error = squares.std() / math.sqrt(len(squares))
    # Second-order terms are a few percent of the effect of the errors.
    assert abs(squares.mean() - found.expected**2) < 5 * error + 0.05 * (found.expected**2 - found.nominal**2)
    assert found.expected > 1.01 * found.nominal and found.trials.std() > 1e-4 and found.lost == 0
    again = lens.tolerances(triplet(), ERRORS, FIELD, trials=2, count=3, seed=1)
    np.testing.assert_array_equal(again.trials, found.trials[:2])
    single = [lens.tolerances(triplet(), [one], FIELD, trials=0, count=3) for one in ERRORS[:2]]
    np.testing.assert_allclose([one.sensitivities[0] for one in single], found.sensitivities[:2], rtol=1e-12)
    assert found.worst in ERRORS


def test_a_shift_on_the_axis_adds_its_variance():
    """On the axis of a lens, a shift δ adds δ² V to the squared radius. Uniform shifts up to a have the
    mean square a²/3, with the standard deviation 0.298 a² of δ²."""
    amount, count = 0.1, 200
    found = lens.tolerances(triplet(), [Tolerance(2, "decenter_y", amount)], trials=count, count=2, seed=4)
    added = (found.sensitivities[0] ** 2).mean() - found.nominal**2
    assert found.expected**2 - found.nominal**2 == pytest.approx(added / 3, rel=1e-9)
    # Five standard errors, and 2 % for orders above the second.
    assert (found.trials**2).mean() - found.nominal**2 == pytest.approx(added / 3, abs=added * (5 * 0.298 / math.sqrt(count) + 0.02))


def test_rims_move_with_their_surfaces():
    """A thickness moves the rim behind it, a shift of a surface moves its rim."""
    rows = [Surface(30.0, 4.0, "N-BK7", aperture=6.0), Surface(-50.0, 30.0, aperture=6.0)]
    single = lens.Prescription(rows, entrance_pupil=8.0)
    from morgana._prescription import layout
    from morgana._tolerance import perturbed

    at = layout(single)
    system, moved = perturbed(single, at, [Tolerance(0, "thickness", 1.0), Tolerance(0, "decenter_y", 1.0)], np.array([0.5, 0.25]))
    assert moved == 0.5 and at.owners == (0, 0, 1, 1)
    before = [np.asarray(surface[0]) for surface in at.system.surfaces]
    shifts = [np.asarray(surface[0]) - old for surface, old in zip(system.surfaces, before)]
    np.testing.assert_allclose(shifts, [[0, 0.25, 0]] * 2 + [[0, 0, 0.5]] * 2, atol=1e-12)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ([], "there are no errors"),
        ([Tolerance(0, "weight", 1.0)], "must be a morgana.lens.Tolerance of one of radius"),
        ([Tolerance(6, "radius", 1.0)], "surface is 6 but must be at most 5"),
        ([Tolerance(0, "radius", 30.0)], "cannot change by 30"),
        ([Tolerance(0, "tilt_x", -1.0)], r"the amount of tilt_x of surfaces\[0\] is -1.0"),
    ],
)
def test_mistakes_are_told(errors, message):
    with pytest.raises((morgana.grad.GradError, morgana.RenderError), match=message):
        lens.tolerances(triplet(), errors)


def test_errors_without_an_effect_are_refused():
    dummy = triplet()._replace(surfaces=[Surface(thickness=5.0), *TRIPLET])
    with pytest.raises(morgana.grad.GradError, match=r"surfaces\[0\] lies between equal media"):
        lens.tolerances(dummy, [Tolerance(0, "tilt_x", 0.1)])
