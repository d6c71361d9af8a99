"""Scatterers that move in a field of velocities: rates of optical lengths in records, and the
resulting correlation of light.

False alarms: 7e-6 for the comparison with the closed form of sheared flow, 2e-4 for means over
runs; other tests have none.
"""

import math

import morgana
import numpy as np
import pytest
from morgana import correlation

# Light leaves without refraction, so that it keeps the direction of its last flight.
pytestmark = pytest.mark.filterwarnings("ignore:warning.index_jump.. the boundary of 'haze' is declared index-matched:morgana.SceneWarning")

INDEX = 1.33
VELOCITY = np.array([0.3, -0.5, 2.0])


def measured(particles=2000, size=4.0, **interior):
    """Records of light that leaves a cube of haze, from a beam along z."""
    scene = {
        "type": "scene", "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 0.1, "power": 1.0, "to_world": [{"translate": [0, 0, -size]}]},
        "haze": {
            "type": "cube", "to_world": [{"scale": size / 2}], "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_t": 2.0, "albedo": 0.98, "phase": {"type": "hg", "g": 0.5}, "ior": INDEX, **interior},
            "exit": {"type": "irradiancemeter", "id": "exit", "records": True},
        },
    }  # fmt: skip
    records = morgana.render(morgana.load_dict(scene), particles=particles, seed=2).records["exit"]
    return records._replace(weight=records.weight * (records.side == 0)[:, None])


def grid(velocity, size=4.0):
    """Samples of a velocity at the corners of the cube, linear between them."""
    at = np.array([-size / 2, size / 2])
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    samples = np.stack(np.broadcast_arrays(*velocity(x, y, z)), axis=-1)
    place = [{"scale": size}, {"translate": [-size / 2] * 3}]
    return {"type": "gridvolume", "data": np.asarray(samples, np.float32), "placement": "nodes", "to_world": place}


def turned(records):
    """Returns the rates from the ends of paths in a uniform flow; everything between them cancels."""
    return INDEX * ((np.array([0, 0, 1.0]) - records.direction) @ VELOCITY) * (records.scatterings[:, -1] > 0)


def absolute(records, fields):
    """Returns |Σ w fields| without the contribution of noise to its square: the variance of a sum
    over particles."""
    weight = records.weight[:, 0]
    total = fields @ weight
    residual = np.zeros((len(fields), records.particles), complex)
    np.add.at(residual.T, records.particle, (weight * (fields - total[:, None] / weight.sum())).T)
    noise = (np.abs(residual) ** 2).sum(axis=1) * records.particles / (records.particles - 1)
    return np.sqrt(np.abs(total) ** 2 - noise)


def test_uniform_flow_shifts_by_the_ends_of_paths():
    for velocity in [VELOCITY.tolist(), grid(lambda x, y, z: (0 * x + VELOCITY[0], 0 * x + VELOCITY[1], 0 * x + VELOCITY[2]))]:
        records = measured(velocity=velocity)
        np.testing.assert_allclose(records.optical_length_rate, turned(records), atol=1e-6)
        delays = np.array([0, 1e-5, 1e-4])
        light = {"wavelength": 785e-6, "index": INDEX}
        found = correlation.correlate(records, delays, {}, flow=0.5, **light)
        k0 = 2 * math.pi / 785e-6
        np.testing.assert_allclose(found.mean[:, 0], absolute(records, np.exp(0.5j * k0 * np.outer(delays, turned(records)))), rtol=1e-5)
        assert found.normalized[0, 0] == pytest.approx(1) and found.normalized[2, 0] < 0.9
        # Diffusion causes an additional decay.
        both = correlation.correlate(records, delays, {records.regions[-1]: correlation.brownian(1e-7)}, **light)
        decay = 2 * (INDEX * k0) ** 2 * 1e-7 * records.momentum_transfer[:, -1]
        fields = np.exp(np.outer(delays, 1j * k0 * turned(records) - decay))
        np.testing.assert_allclose(both.mean[:, 0], absolute(records, fields), rtol=1e-5)


def test_linear_flow_is_shear():
    """Light that leaves after many scatterings has the variance of `shear`, except for the Doppler
    shifts at the ends of its paths: the beam and the detector are at rest, while the flow there is
    fast. Noise exceeds 4.5 standard errors in 7e-6."""
    rate, g, mu_s, size = 3.0, 0.5, 4.0, 12.0
    flow = grid(lambda x, y, z: (rate * z, 0 * y, 0 * z), size)
    records = measured(20_000, size, sigma_t=mu_s, albedo=1.0, velocity=flow)
    late = (records.path_length[:, -1] > 40.0) & (records.side == 0)
    # The beam enters along z, without a flow component. Light that leaves along ω has n ω·v of the
    # exit position.
    ends = INDEX * records.direction[:, 0] * rate * records.position[:, 2]
    square = (records.optical_length_rate + ends)[late] ** 2 / records.path_length[late, -1]
    transport = 1 / (mu_s * (1 - g))
    # Half the variance of the phase is ⅓ (nk₀)²⟨Δr²⟩ Y with Y = s/l*.
    per_length = 2 / 3 * INDEX**2 * correlation.shear(rate, transport, g)(1.0) / transport
    weight = records.weight[late, 0] / records.weight[late, 0].sum()
    mean = weight @ square
    error = math.sqrt(weight**2 @ (square - mean) ** 2)
    assert late.sum() > 2000 and error < 0.04 * per_length
    assert abs(mean - per_length) < 4.5 * error
    # The contribution of the ends is much larger here.
    shifts = records.optical_length_rate[late] ** 2 / records.path_length[late, -1]
    assert weight @ shifts > 1.5 * per_length


def vortex(rate, size=4.0, nodes=33):
    """Samples of a flow around the z axis whose direction rotates at the given rate."""
    at = np.linspace(-size / 2, size / 2, nodes)
    z, y, x = np.meshgrid([-size / 2, size / 2], at, at, indexing="ij")
    flow = grid(lambda x, y, z: (x, y, z), size)
    flow["data"] = np.stack([-rate * y, rate * x, 0 * z], axis=-1).astype(np.float32)
    return flow


def test_flows_that_change_are_told_of():
    """A warning follows if velocities change along the paths within delays over which light is
    still correlated."""
    straight = measured(velocity=grid(lambda x, y, z: (3 * z, 0 * y, 0 * z)))
    assert not straight.velocity_change.any()
    records = measured(velocity=vortex(50.0))
    assert records.velocity_change[-1] == pytest.approx(50, rel=0.02) and not records.velocity_change[:-1].any()
    # Regions keep their rate in a selection of records.
    assert np.array_equal(records[records.side == 0].velocity_change, records.velocity_change)
    light = {"wavelength": 785e-6, "index": INDEX}
    # At 1e-5 s the light is correlated and has changed little. At 1 s it has changed, but no
    # correlation is left.
    correlation.correlate(records, [1e-7, 1e-5, 1.0], {}, **light)
    # A flow slower by 1e-6 stays correlated for longer than it keeps its velocity.
    slow = records._replace(optical_length_rate=1e-6 * records.optical_length_rate)
    with pytest.warns(morgana.SceneWarning, match=r"what flows changes by up to 5\d% within 0.01 s, .* delays up to 0.002 s are safe"):
        correlation.correlate(slow, [1e-3, 1e-2], {}, **light)
    with pytest.warns(morgana.SceneWarning, match="taken to be constant"):
        correlation.speckle_contrast(slow, [1e-2], {}, **light)
    correlation.correlate(slow, [1e-2], {}, flow=0.01, **light)


def flowing(rate, weight=None, particles=None):
    """Records of light whose phases change at the given rates, at the wavelength 2π, each from its
    own particle."""
    n = len(rate)
    zero = np.zeros(n)
    return morgana.Records(
        np.arange(n), np.ones((n, 1)) if weight is None else weight[:, None], np.zeros((n, 3)), np.zeros((n, 3)), zero, zero.astype(int),
        np.zeros((n, 1)), np.zeros((n, 1), int), np.zeros((n, 1)), ["haze"], np.zeros((1, 1)), particles or n, "W",
        optical_length_rate=np.asarray(rate, float),
    )  # fmt: skip


LIGHT = {"wavelength": 2 * math.pi, "index": 1}


def test_errors_of_flow_are_those_among_particles():
    rng = np.random.default_rng(1)
    runs = [correlation.correlate(flowing(rng.normal(0.4, 1.0, 300)), [1.0], {}, **LIGHT) for _ in range(200)]
    for mean, error in [("mean", "error"), ("normalized", "normalized_error")]:
        values = np.array([getattr(run, mean)[0, 0] for run in runs])
        claimed = np.array([getattr(run, error)[0, 0] for run in runs])
        # The relative error of a standard deviation of 200 values is 5 %.
        assert 0.78 < values.std(ddof=1) / np.sqrt((claimed**2).mean()) < 1.22, mean


def test_noise_adds_nothing_to_squares():
    """Rates are normal, so that g₁ = exp(−τ²/2). Exposures are such that noise would contribute
    most of the contrast."""
    rng = np.random.default_rng(2)
    exposures, expected = np.array([10.0, 60.0]), math.sqrt(math.pi) / np.array([10.0, 60.0]) - 1 / np.array([10.0, 60.0]) ** 2
    runs, contrasts = [], []
    for _ in range(100):
        light = flowing(rng.normal(0.4, 1.0, 200), rng.exponential(1.0, 200), 300)
        runs.append(correlation.correlate(light, [1.0, 9.0], {}, **LIGHT))
        contrasts.append(correlation.speckle_contrast(light, exposures, {}, **LIGHT))
    g1 = np.array([run.normalized[:, 0] for run in runs])
    error = np.array([run.normalized_error[:, 0] for run in runs])
    k = np.array([run.mean[:, 0] for run in contrasts])
    k_error = np.array([run.error[:, 0] for run in contrasts])
    # The mean of 100 runs is accurate to a tenth of a reported error; it exceeds 4 of these tenths
    # in 2e-4. Roots of noisy values are low by a further tenth.
    z = np.array([g1[:, 0].mean() - math.exp(-0.5), *(k.mean(axis=0) - np.sqrt(expected))]) / [error[:, 0].mean(), *k_error.mean(axis=0)]
    assert np.abs(z).max() < 0.5, z
    # If the true value is zero, about half of the estimates are below zero; the others are at most
    # a few errors.
    assert 0.3 < (g1[:, 1] == 0).mean() < 0.9 and g1[:, 1].mean() < 0.7 * error[:, 1].mean()
    spread = k.std(axis=0, ddof=1) / np.sqrt((k_error**2).mean(axis=0))
    assert np.all((spread > 0.6) & (spread < 1.25)), spread


def test_contrast_of_beats_has_a_closed_form():
    """For light of a few frequencies the contrast is a sum of sinc² over pairs, up to hundreds of
    beats."""
    rate = np.array([0.0, 0.2, 1.0, 7.0, 7.3])
    exposures = np.array([1e-3, 1.0, 30.0, 300.0])
    between = np.sinc((rate[:, None] - rate) * exposures[:, None, None] / (2 * math.pi)) ** 2
    expected = (between.sum(axis=(1, 2)) - 5) / 20
    found = correlation.speckle_contrast(flowing(rate), exposures, {}, **LIGHT)
    np.testing.assert_allclose(found.mean[:, 0] ** 2, expected, rtol=1e-4)


def test_light_that_noise_hides_has_a_finite_error():
    rate = 2 * math.pi * np.arange(8) / 8
    found = correlation.correlate(flowing(rate), [1.0], {}, **LIGHT)
    assert found.normalized[0, 0] == found.mean[0, 0] == 0
    assert 0.1 < found.normalized_error[0, 0] < 0.5 and found.error[0, 0] == pytest.approx(8 * found.normalized_error[0, 0])
    dark = flowing(rate, np.zeros(8))
    assert correlation.correlate(dark, [1.0], {}, **LIGHT).mean[0, 0] == 0
    assert np.isnan(correlation.speckle_contrast(dark, [1.0], {}, **LIGHT).mean[0, 0])


def test_labels_flow_each_by_itself():
    def rates(first, second):
        labels = np.where(np.arange(8) < 4, 1, 2).astype(np.uint8).reshape(8, 1, 1)
        medium = {"type": "homogeneous", "sigma_t": 2.0, "albedo": 0.9}
        flows = [{"velocity": VELOCITY.tolist()} if flows else {} for flows in (first, second)]
        scene = {
            "type": "scene", "integrator": {"type": "particle"},
            "beam": {"type": "collimated", "radius": 0.1, "power": 1.0, "to_world": [{"translate": [0, 0, -3]}]},
            "tissue": {
                "type": "labels", "data": labels, "to_world": [{"scale": 4}, {"translate": [-2, -2, -2]}],
                "1": {**medium, **flows[0]}, "2": {**medium, **flows[1], "sigma_t": 3.0},
                "exit": {"type": "irradiancemeter", "id": "exit", "records": True},
            },
        }  # fmt: skip
        records = morgana.render(morgana.load_dict(scene), particles=500, seed=4).records["exit"]
        return records, records.optical_length_rate

    both, all_flows = rates(True, True)
    leaving = both.side == 0
    scattered = both.scatterings.sum(axis=1) > 0
    expected = ((np.array([0, 0, 1.0]) - both.direction) @ VELOCITY) * scattered
    np.testing.assert_allclose(all_flows[leaving], expected[leaving], atol=1e-6)
    (_, first), (_, second) = rates(True, False), rates(False, True)
    np.testing.assert_allclose(first + second, all_flows, atol=1e-9)
    assert np.abs(first).max() > 1 and np.abs(second).max() > 1


def test_what_is_wrong_is_said():
    scalar = {"type": "gridvolume", "data": np.zeros((2, 2, 2), np.float32)}
    for velocity, said in [(scalar, "three|3 channels"), ("fast", "velocity")]:
        with pytest.raises(morgana.SceneError, match=said):
            measured(velocity=velocity)
    still = measured(50)
    assert still.optical_length_rate is None
    light = {"wavelength": 785e-6, "index": INDEX}
    with pytest.raises(ValueError, match="nothing flows"):
        correlation.correlate(still, [0.0], {}, flow=2.0, **light)
    moving = measured(50, velocity=VELOCITY.tolist())
    with pytest.raises(TypeError, match="flow is nan but must be a finite number"):
        correlation.correlate(moving, [0.0], {}, flow=math.nan, **light)
    at_rest = correlation.correlate(moving, [0.0, 1.0], {}, flow=0, **light)
    np.testing.assert_allclose(at_rest.normalized, 1)
