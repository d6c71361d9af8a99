"""Pulses, compared with closed forms and with random start times, and results in bins compared with
records."""

import math

import morgana
import numpy as np
import pytest

DEVIATION = 30 / math.sqrt(8 * math.log(2))


def normal(x):
    return np.array([0.5 * (1 + math.erf(v / math.sqrt(2))) for v in np.ravel(x)])


def test_shapes():
    x = np.linspace(-60, 90, 31)
    gaussian = morgana.Pulse.gaussian(fwhm=30, center=10)
    np.testing.assert_allclose(gaussian.emitted(x), normal((x - 10) / DEVIATION), atol=1e-6)
    # The profile is half of the peak at half of the width.
    np.testing.assert_allclose(np.interp([-5, 25], gaussian.times, gaussian.values), gaussian.values.max() / 2, rtol=1e-4)
    rectangle = morgana.Pulse.rectangle(40, center=20)
    np.testing.assert_allclose(rectangle.emitted(x), np.clip(x / 40, 0, 1), atol=1e-14)
    triangle = morgana.Pulse.table([0, 10, 40], [0, 3, 0])
    rising, falling = np.clip(x, 0, 10) ** 2 / 400, (40 - np.clip(x, 10, 40)) ** 2 / 1200
    np.testing.assert_allclose(triangle.emitted(x), np.where(x < 10, rising, 1 - falling), atol=1e-14)
    assert triangle.range == (0.0, 40.0)
    assert repr(triangle) == "<morgana.Pulse from 0 to 40>"


@pytest.mark.parametrize("pulse", [morgana.Pulse.gaussian(30), morgana.Pulse.rectangle(40, 20), morgana.Pulse.table([0, 10, 40], [0, 3, 0])])
def test_kernels_average_over_bins(pulse):
    edges = np.array([-100.0, -40, 0, 25, 30, 70, 200])
    kernel = pulse.kernel(edges)
    for j, (low, high) in enumerate(zip(edges, edges[1:])):
        starts = low + (high - low) * (np.arange(4000) + 0.5) / 4000
        expected = np.diff(pulse.emitted(edges[:, None] - starts), axis=0).mean(axis=1)
        np.testing.assert_allclose(kernel[:, j], expected, atol=1e-6)


@pytest.fixture(scope="module")
def measured():
    """Returns light that leaves a scattering block, in fine bins and as single records."""
    bins = {"min_bound": 0, "max_bound": 200, "bin_width": 0.25}
    block = {
        "type": "cube", "to_world": [{"scale": 5}], "bsdf": {"type": "null"},
        "interior": {"type": "homogeneous", "sigma_s": 1.0, "sigma_a": 0.01},
        "faces": {"type": "irradiancemeter", "id": "faces", "records": True, **bins},
    }
    beam = {"type": "collimated", "radius": 0.5, "power": 2.0, "to_world": [{"translate": [0, 0, -9]}]}
    return morgana.render(morgana.load_dict({"type": "scene", "integrator": {"type": "particle"}, "block": block, "beam": beam}), particles=4000, seed=3)


def test_without_a_pulse_gates_are_bins(measured):
    power, records = measured.meters["binned_power"], measured.records["faces"]
    edges = power.axes["opl"]
    out = records._replace(weight=records.weight * (records.side == 0)[:, None]).gated(edges)
    found = power.mean.take(0, list(power.axes).index("side"))
    np.testing.assert_allclose(out.mean[:, 0], found, rtol=1e-6, atol=1e-12)


def test_a_pulse_is_what_random_starts_give(measured):
    records = measured.records["faces"]
    edges, pulse = np.arange(-40.0, 161, 20), morgana.Pulse.table([0, 10, 40], [0, 3, 0])
    found = records.gated(edges, pulse)
    # Draw starts by inversion: each light occurs many times, with different starts.
    rng = np.random.default_rng(1)
    repeats = 400
    u = rng.random((repeats, len(records.weight)))
    starts = np.where(u < 0.25, np.sqrt(400 * u), 40 - np.sqrt(1200 * (1 - u)))
    direct = np.array([np.histogram(records.optical_length + s, edges, weights=records.weight[:, 0])[0] for s in starts])
    error = direct.std(axis=0) / math.sqrt(repeats)
    assert np.all(np.abs(direct.mean(axis=0) - found.mean[:, 0]) <= 5 * error + 1e-12)
    assert error.max() < 2e-3 * found.mean.max()
    # All records of a particle are a single sample; most particles have two, of light that enters
    # and leaves.
    in_gate = np.diff(pulse.emitted(edges[3:5] - records.optical_length[:, None]), axis=1)[:, 0]
    totals = np.bincount(records.particle, records.weight[:, 0] * in_gate, records.particles)
    assert found.error[3, 0] == pytest.approx(totals.std(ddof=1) * math.sqrt(records.particles), rel=1e-9)
    # All emitted power arrives at some time.
    np.testing.assert_allclose(records.gated([-1e3, 1e4], pulse).mean[0], records.power().mean, rtol=1e-12)
    np.testing.assert_allclose(records.gated([-1e3, 1e4], pulse).error[0], records.power().error, rtol=1e-9)


def test_bins_with_a_pulse_agree_with_records(measured):
    reading, records = measured.meters["binned_power"], measured.records["faces"]
    pulse = morgana.Pulse.gaussian(fwhm=30, center=60)
    later = reading.convolved(pulse)
    assert (later.unit, list(later.axes)) == (reading.unit, list(reading.axes))
    axis = list(reading.axes).index("side")
    # Compare leaving light: entering light arrives at a single instant, not distributed over its
    # bin.
    exact = records._replace(weight=records.weight * (records.side == 0)[:, None]).gated(reading.axes["opl"], pulse)
    # The error is of second order in the width of bins over the width of the pulse; it comes from
    # the position of light within its bin.
    np.testing.assert_allclose(later.mean.take(0, axis), exact.mean[:, 0], atol=2e-3 * exact.mean.max())
    assert np.all(later.error.take(0, axis) >= 0.99 * exact.error[:, 0] - 1e-9)


def test_bins_with_a_pulse_are_trusted_as_what_they_are_made_of():
    """Values may have either sign, as in an autocorrelation."""
    edges, few = np.arange(21.0), np.zeros(20, bool)
    few[3] = True
    mean = np.where(np.arange(20) < 10, 1.0, -1.0)
    pulse = morgana.Pulse.rectangle(2.0, center=1.0)
    for sign in (1, -1):
        found = morgana.Reading(sign * mean, np.ones(20), {"opl": edges}, "W", few=few).convolved(pulse)
        assert found.mean[8] * sign > 0.9 and found.mean[15] * sign < -0.9
        # The pulse is two bins long, so that light of a bin reaches three.
        np.testing.assert_array_equal(np.flatnonzero(found.few), [3, 4, 5])


def test_light_across_empty_space():
    """Light that travels straight for 9 units arrives with the pulse, delayed by 9."""
    disk = {"type": "disk", "to_world": [{"scale": 3}], "bsdf": {"type": "null"}, "end": {"type": "irradiancemeter", "id": "end", "records": True}}
    beam = {"type": "collimated", "radius": 0.5, "power": 2.0, "to_world": [{"translate": [0, 0, -9]}]}
    scene = morgana.load_dict({"type": "scene", "integrator": {"type": "particle"}, "disk": disk, "beam": beam})
    records = morgana.render(scene, particles=500, seed=3).records["end"]
    edges = np.linspace(-60, 90, 16)
    found = records.gated(edges, morgana.Pulse.gaussian(fwhm=30))
    np.testing.assert_allclose(found.mean[:, 0], 2 * np.diff(normal((edges - 9) / DEVIATION)), atol=1e-5)


def test_mistakes(measured):
    for make in [
        lambda: morgana.Pulse.gaussian(0), lambda: morgana.Pulse.rectangle(-1), lambda: morgana.Pulse.gaussian(float("nan")),
        lambda: morgana.Pulse.table([0, 0], [1, 1]), lambda: morgana.Pulse.table([0], [1]), lambda: morgana.Pulse.table([0, 1], [1, -1]),
        lambda: morgana.Pulse.table([0, 1], [0, 0]), lambda: morgana.Pulse.table([0, 1], [0, 1, 2]),
    ]:
        with pytest.raises(ValueError):
            make()
    with pytest.raises(ValueError, match="ascending"):
        measured.records["faces"].gated([1, 0])
    with pytest.raises(ValueError, match="no bins of the optical path length"):
        measured.meters["power"]._replace(axes={"side": None}).convolved(morgana.Pulse.gaussian(1))
