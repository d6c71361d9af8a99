"""Phases of ultrasound arrays: the sum of elements compared with whole arrays, derivatives with
differences, and an optimised focus with time reversal."""

import morgana
import numpy as np
import pytest
from morgana import grad

ARRAY = {
    "type": "transducer",
    "aperture": "linear_array",
    "elements": 8,
    "pitch": 1.0,
    "height": 4.0,
    "frequency": 1.0,
    "sound_speed": 1.5,
    "pressure": 2e5,
    "n0": 1.333,
    "dn_dp": 1.4e-10,
    "min": [-4, -1, 6],
    "max": [4, 1, 10],
    "spacing": 0.5,
}


@pytest.fixture(scope="module")
def array():
    return grad.ElementArray({**ARRAY, "focus": [0, 0, 8]})


def amplitude(volume):
    found = grad.parameters(morgana.load_field(volume))["amplitude"]
    return found[..., 0] + 1j * found[..., 1]


def test_the_array_is_the_sum_of_its_elements(array):
    phases, factors = np.linspace(0, 2, 8), np.linspace(1, 0.5, 8)
    omega = 2 * np.pi * ARRAY["frequency"]
    expected = amplitude({**ARRAY, "delays": (-phases / omega).tolist(), "apodization": factors.tolist()})
    weights = factors * np.exp(1j * phases)
    np.testing.assert_allclose(array.amplitude(weights), expected, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(amplitude(array.volume(weights)), expected, atol=1e-6 * np.abs(expected).max())
    assert array.positions.shape == (*expected.shape, 3)
    np.testing.assert_array_equal(array.positions[[0, -1], [0, -1], [0, -1]], [ARRAY["min"], ARRAY["max"]])


def test_phases_for_a_focus_are_those_of_time_reversal(array):
    """The largest intensity at a point occurs if all elements are in phase there: the phases of a
    time-reversed pulse from that point."""
    optimize = pytest.importorskip("scipy.optimize")
    at = tuple(np.argwhere(np.all(np.abs(array.positions - [1.0, 0.0, 8.0]) < 1e-9, axis=-1))[0])

    def loss(phases):
        weights = np.exp(1j * phases)
        found = array.amplitude(weights)
        by = np.zeros_like(found)
        by[at] = -2 * found[at] / scale
        return -(np.abs(found[at]) ** 2) / scale, array.by_phases(weights, by)

    scale = np.sum(np.abs(array.amplitudes[(slice(None), *at)])) ** 2
    start = np.random.default_rng(1).uniform(-1, 1, 8)
    assert optimize.check_grad(lambda p: loss(p)[0], lambda p: loss(p)[1], start) < 1e-6
    found = optimize.minimize(loss, start, jac=True, method="BFGS", options={"gtol": 1e-8})
    assert found.fun == pytest.approx(-1, abs=1e-10)
    reversed_ = -np.angle(array.amplitudes[(slice(None), *at)])
    apart = np.exp(1j * (found.x - reversed_))
    np.testing.assert_allclose(apart / apart[0], 1, atol=1e-4)
    # They nearly equal the geometric delays: elements are small compared with their distance, but
    # not compared with the wavelength.
    of_geometry = amplitude({**ARRAY, "focus": [1.0, 0.0, 8.0]})[at]
    assert abs(of_geometry) ** 2 / scale > 0.95


def test_losses_of_rays_by_phases(array):
    origins = np.stack([*np.meshgrid(np.linspace(-2, 2, 4), [-1.0], np.linspace(7, 9, 3))], axis=-1).reshape(-1, 3)
    rays = grad.Rays(origins, [0.05, 1, 0.02], exit=grad.Plane((0, 1, 0), (0, 1, 0)), tolerance=1e-9)
    by_ends = np.random.default_rng(2).normal(size=(len(origins), 3))
    start = np.random.default_rng(3).uniform(-1, 1, 8)
    value = lambda phases: np.sum(by_ends * rays.forward(array.field(np.exp(1j * phases))).directions)  # noqa: E731
    by = rays.vjp(array.field(np.exp(1j * start)), directions=by_ends).parameters["amplitude"]
    found = array.by_phases(np.exp(1j * start), by)
    # Samples are f32: an index of 1.333 is rounded to 1e-7, with amplitudes of 3e-5.
    for i in range(8):
        step = 0.2 * np.eye(8)[i]
        expected = (8 * (value(start + step) - value(start - step)) - (value(start + 2 * step) - value(start - 2 * step))) / 2.4
        assert abs(found[i] - expected) < 5e-3 * np.abs(found).max()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda array: grad.ElementArray({"type": "gaussian"}), "type 'transducer'"),
        (lambda array: grad.ElementArray({**ARRAY, "aperture": "bowl"}), "linear_array, ring_array"),
        (lambda array: grad.ElementArray({**ARRAY, "to_world": [{"scale": 2}]}), "no to_world"),
        (lambda array: array.amplitude(np.ones(7)), r"shape \(7,\) but must be finite numbers of shape \(8,\)"),
        (lambda array: array.field(np.full(8, np.nan)), "must be finite"),
        (lambda array: array.by_weights(np.ones(3)), "derivatives by amplitudes have the shape"),
    ],
)
def test_mistakes_are_told(array, call, message):
    with pytest.raises(grad.GradError, match=message):
        call(array)
