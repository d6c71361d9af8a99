"""Derivatives of rays, compared with differences, closed forms and their own transposes; and
messages for invalid arguments."""

import os
import subprocess
import sys

import morgana
import numpy as np
import pytest
from morgana import grad

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
BEHIND = grad.Plane((0, 0, 3), (0, 0, 1))
SHAPE = (9, 10, 8)
RNG = np.random.default_rng(3)


def samples():
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in SHAPE), indexing="ij")
    return 1.35 + 0.03 * np.sin(2 * x + y) * np.cos(1.5 * z - 0.5 * y)


def starts(count=200):
    rng = np.random.default_rng(1)
    origins = np.column_stack([rng.uniform(-0.8, 0.8, (count, 2)), np.full(count, -2.0)])
    return origins, rng.uniform(-0.15, 0.15, (count, 3)) + [0, 0, 1]


def bundle(origins, directions, **options):
    return grad.Rays(origins, directions, **{"box": BOX, "exit": BEHIND, "ambient": 1.3, "tolerance": 1e-10, **options})


WEIGHTS = {"positions": RNG.normal(size=(200, 3)), "directions": RNG.normal(size=(200, 3)), "optical_lengths": RNG.normal(size=200)}


def loss(ends):
    return sum(float(np.sum(weights * getattr(ends, name))) for name, weights in WEIGHTS.items())


def slope(f, h):
    """Returns f′(0) by central differences, extrapolated once."""
    central = lambda h: (f(h) - f(-h)) / (2 * h)  # noqa: E731
    return (4 * central(h / 2) - central(h)) / 3


def test_gradients_are_those_of_differences():
    # Coefficients are f32: differences over 4e-3 are accurate to about 1e-5.
    index, (origins, directions) = samples(), starts()
    gradient = bundle(origins, directions).vjp(index, **WEIGHTS)
    assert gradient.field.shape == SHAPE
    for by, change, moved in [
        (gradient.field, RNG.normal(size=SHAPE), lambda h, d: bundle(origins, directions).forward(index + h * d)),
        (gradient.origins, RNG.normal(size=(200, 3)), lambda h, d: bundle(origins + h * d, directions).forward(index)),
        (gradient.directions, RNG.normal(size=(200, 3)), lambda h, d: bundle(origins, directions + h * d).forward(index)),
    ]:
        expected = slope(lambda h: loss(moved(h, change)), 2e-3)
        assert abs(np.sum(by * change) - expected) < 3e-5 * np.linalg.norm(by)


def test_least_squares_are_those_of_the_ends():
    index, (origins, directions) = samples(), starts()
    rays = bundle(origins, directions)
    ends = rays.forward(index)
    noise = {"positions": 0.3, "directions": 0.02, "optical_lengths": 0.1}
    measured = {name: getattr(ends, name) + RNG.normal(size=getattr(ends, name).shape) for name in noise}
    for name in noise:
        measured[name][::5] = np.nan
    found = rays.least_squares(index, **measured, position_noise=0.3, direction_noise=0.02, optical_length_noise=0.1)
    residuals = {name: np.nan_to_num((getattr(ends, name) - measured[name]) / noise[name]) for name in noise}
    assert found.lost == 0
    assert found.value == pytest.approx(0.5 * sum(np.sum(r**2) for r in residuals.values()), rel=1e-12)
    by = rays.vjp(index, **{name: r / noise[name] for name, r in residuals.items()}).field
    np.testing.assert_allclose(found.gradient, by, rtol=1e-9, atol=1e-9 * np.abs(by).max())


def test_least_squares_leave_rays_without_an_end_out():
    rays = grad.Rays([[0, 0, -2], [0, 0, 2]], [0, 0, 1], box=BOX)
    found = rays.least_squares(np.full((4, 4, 4), 1.2), optical_lengths=[3.0, 3.0], optical_length_noise=0.1)
    assert found.lost == 1 and found.value == pytest.approx(0.5 * (0.4 / 0.1) ** 2)


def test_rays_from_elsewhere():
    origins, directions = starts()
    moved = bundle(origins, directions).with_starts(origins + [0.01, 0, 0], directions)
    assert moved == bundle(origins + [0.01, 0, 0], directions, max_length=moved._exits.options["max_length"])
    np.testing.assert_array_equal(moved.starts[0], origins + [0.01, 0, 0])


def test_parameters_of_a_field():
    # A weak bump deflects rays by −√(2π) Δ (b/w) exp(−b²/2w²).
    b, w = 0.4, 0.5
    field = morgana.load_field({"type": "gaussian", "n0": 1.0, "delta": 1e-7, "width": w})
    rays = grad.Rays([[b, 0, -5]], [0, 0, 1], exit=grad.Plane((0, 0, 5), (0, 0, 2)), tolerance=1e-10)
    by = rays.vjp(field, directions=[[1, 0, 0]]).field
    assert by.shape == (6,)
    assert by[1] == pytest.approx(-np.sqrt(2 * np.pi) * b / w * np.exp(-0.5 * (b / w) ** 2), rel=1e-5)


def test_samples_are_those_of_a_field():
    index, count = samples(), 50
    origins, directions = starts(count)
    origins[:, 2] = -0.9
    field = morgana.load_field({"type": "bspline", "data": index, "placement": "nodes", "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]})
    exit = grad.Plane((0, 0, 0.7), (0, 0, 1))
    of_field = grad.Rays(origins, directions, exit=exit).forward(field)
    inside = grad.Rays(origins, directions, box=BOX, exit=exit).forward(index)
    keep = inside.valid & (np.abs(inside.positions[:, :2]).max(axis=1) < 0.9)
    assert keep.sum() > 20
    np.testing.assert_allclose(inside.positions[keep], of_field.positions[keep], atol=1e-6)


def test_results_do_not_depend_on_threads():
    code = (
        "import numpy as np, sys; sys.path.insert(0, sys.argv[1]); import test_grad as t;"
        "o, d = t.starts(5000); rays = t.bundle(o, d, tolerance=1e-5);"
        "g = rays.vjp(t.samples(), positions=np.cos(o)); import hashlib;"
        "print(hashlib.sha256(g.field.tobytes() + g.origins.tobytes()).hexdigest())"
    )
    found = set()
    for threads in ("1", "2", "3"):
        run = [sys.executable, "-c", code, os.path.dirname(__file__)]
        found.add(subprocess.run(run, env={**os.environ, "RAYON_NUM_THREADS": threads}, capture_output=True, text=True, check=True).stdout)
    assert len(found) == 1


def test_rays_without_an_end_are_counted():
    rays = grad.Rays([[0, 0, -2], [0, 0, 2]], [0, 0, 1], box=BOX)
    index = np.full((4, 4, 4), 1.2)
    ends = rays.forward(index)
    assert ends.failures == {"did not reach the exit": 1} and list(ends.valid) == [True, False]
    assert np.isnan(ends.positions[1]).all() and ends.optical_lengths[0] == pytest.approx(1 + 2 * 1.2)
    assert rays.vjp(index, optical_lengths=[1, 0]).field.sum() == pytest.approx(2.0)
    with pytest.raises(grad.GradError, match="1 rays that have no end"):
        rays.vjp(index, optical_lengths=[1, 1])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 1]), "give an exit plane, or a box"),
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 0], box=BOX), "of no length"),
        (lambda rays: grad.Rays([[0, 0, 0]], [[0, 0, 1]] * 2, box=BOX), "one direction of shape"),
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 1], box=(1, 2)), "its lower and its upper corner"),
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 1], box=BOX, exit=((0, 0, 0), (0, 0, 0))), "normal of the exit .* must not be zero"),
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 1], box=BOX, placement="faces"), "'nodes' or 'centers'"),
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 1], box=BOX, tolerance=1), "between 1e-12 and 1e-2"),
        (lambda rays: rays.forward(np.ones((3, 3))), r"\[z, y, x\]"),
        (lambda rays: rays.forward(np.zeros((3, 3, 3))), "not refractive indices"),
        (lambda rays: grad.Rays([[0, 0, 0]], [0, 0, 1], exit=BEHIND).forward(np.ones((3, 3, 3))), "give Rays the box"),
        (lambda rays: rays.vjp(np.ones((3, 3, 3)), positions=np.ones((2, 3))), "must have"),
        (lambda rays: rays.least_squares(np.ones((3, 3, 3)), optical_lengths=np.ones(2)), "optical_lengths have the shape"),
        (lambda rays: rays.with_starts([[0, 0, 0]], [0, 0, 0]), "of no length"),
        (lambda rays: rays.vjp(np.ones((3, 3, 3)), positions=[[np.nan, 0, 0]]), "not finite"),
    ],
)
def test_mistakes_are_told(call, message):
    with pytest.raises(grad.GradError, match=message):
        call(grad.Rays([[0, 0, -2]], [0, 0, 1], box=BOX))


def test_some_of_the_rays():
    rays = bundle(*starts())
    ends, some = rays.forward(samples()), rays.select(np.arange(0, 200, 3)).forward(samples())
    assert len(some.codes) == 67
    np.testing.assert_array_equal(some.positions, ends.positions[::3])
