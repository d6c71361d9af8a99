"""Diffuse correlation from records, compared with closed forms, and with a tally that shares no
code with morgana.

False alarms: 1e-3 for all comparisons with the tally together, which are correlated; closed forms
have none.
"""

import math

import morgana
import numpy as np
import pytest
from morgana import correlation

WAVELENGTH = 785e-6
INDEX = 1.0
LAYERS = [(1.5, 1.0, 0.02, 0.6), (6.0, 2.0, 0.05, 0.8)]
"""Thickness, scattering and absorption coefficients and mean cosine of two layers."""
DIFFUSION = [2e-6, 2e-5]
DELAYS = np.array([0.0, 3e-6, 3e-5, 3e-4])


def records(weight, transfer, particle=None, particles=None):
    """Records of light in one region."""
    n = len(weight)
    number = np.arange(n) if particle is None else np.asarray(particle)
    zero = np.zeros(n)
    return morgana.Records(
        number, np.asarray(weight, float)[:, None], np.zeros((n, 3)), np.zeros((n, 3)), zero, zero.astype(int), np.zeros((n, 1)),
        np.zeros((n, 1), int), np.asarray(transfer, float)[:, None], ["tissue"], np.zeros((1, 1)), particles or n, "W",
    )  # fmt: skip


def of(transfer, delays, diffusion=1e-7):
    """Returns G₁ of light with one momentum transfer and weight 1."""
    k = 2 * math.pi * INDEX / WAVELENGTH
    return np.exp(-2 * k**2 * diffusion * np.asarray(delays) * transfer)


def correlate(found, delays=DELAYS, motions=None):
    motions = {"tissue": correlation.brownian(1e-7)} if motions is None else motions
    return correlation.correlate(found, delays, motions, wavelength=WAVELENGTH, index=INDEX)


def test_each_record_decays_by_its_momentum_transfer():
    found = correlate(records([2.0, 1.0], [0.5, 3.0]))
    np.testing.assert_allclose(found.mean[:, 0], 2 * of(0.5, DELAYS) + of(3.0, DELAYS), rtol=1e-12)
    np.testing.assert_allclose(found.normalized, found.mean / 3)
    still = correlate(records([2.0, 1.0], [0.5, 3.0]), motions={})
    np.testing.assert_allclose(still.mean, 3)
    share = correlate(records([1.0], [1.0]), motions={"tissue": correlation.brownian(4e-7, moving=0.25)})
    np.testing.assert_allclose(share.mean[:, 0], of(1.0, DELAYS))
    flying = correlate(records([1.0], [1.0]), motions={"tissue": correlation.ballistic(2e-3)})
    k = 2 * math.pi / WAVELENGTH
    np.testing.assert_allclose(flying.mean[:, 0], np.exp(-(k**2) / 3 * (2e-3 * DELAYS) ** 2))


def test_correlations_and_contrasts_compute_like_arrays():
    light = records([2.0, 1.0], [0.5, 3.0])
    found = correlate(light)
    later = 2 * found.sel(delay=3e-5, channel=0)
    assert later.mean == 2 * found.mean[2, 0] and later.error == 2 * found.error[2, 0] and later.unit == "W"
    np.testing.assert_array_equal(np.asarray(found), found.mean)
    assert found.shape == (4, 1) and list(found.coordinates) == ["delay", "channel"]
    with pytest.raises(KeyError, match="no delay 1e-05: there are 0, 3e-06, 3e-05, 0.0003"):
        found.sel(delay=1e-5)
    contrast = correlation.speckle_contrast(light, [1e-3, 5e-3], {"tissue": correlation.brownian(1e-7)}, wavelength=WAVELENGTH, index=INDEX)
    flow = 1 / contrast.sel(exposure=5e-3, channel=0) ** 2
    assert flow.mean == pytest.approx(contrast.mean[1, 0] ** -2) and flow.error == pytest.approx(2 * contrast.error[1, 0] / contrast.mean[1, 0] ** 3)
    with pytest.raises(ValueError, match="correlated"):
        found[0] + found[1]
    assert "<svg" in found._repr_html_() and "2 exposures" in contrast._repr_html_()
    pytest.importorskip("xarray")
    table = found.to_xarray()
    assert table["normalized"].dims == ("delay", "channel") and table["delay"].attrs == {"units": "s"}
    np.testing.assert_array_equal(table["delay"], DELAYS)
    np.testing.assert_array_equal(table["normalized_error"], found.normalized_error)
    np.testing.assert_array_equal(contrast.to_xarray()["exposure"], [1e-3, 5e-3])


def test_channels_have_wavelengths_and_indices_of_their_own():
    rng = np.random.default_rng(2)
    light = records(np.ones(50), rng.exponential(2.0, 50))
    both = light._replace(weight=rng.random((50, 2)))
    move, times = {"tissue": correlation.brownian(1e-7)}, [1e-5, 1e-3]
    waves, indices = [WAVELENGTH, 2 * WAVELENGTH], [1.3, 1.4]
    for index in (indices, {"tissue": indices}):
        found = correlation.correlate(both, DELAYS, move, wavelength=waves, index=index)
        blurred = correlation.speckle_contrast(both, times, move, wavelength=waves, index=index)
        for c in (0, 1):
            alone = both._replace(weight=both.weight[:, [c]])
            given = {"wavelength": waves[c], "index": indices[c]}
            one, contrast = correlation.correlate(alone, DELAYS, move, **given), correlation.speckle_contrast(alone, times, move, **given)
            for name in ("mean", "error", "normalized", "normalized_error"):
                np.testing.assert_array_equal(getattr(found, name)[:, c], getattr(one, name)[:, 0])
            np.testing.assert_array_equal(blurred.mean[:, c], contrast.mean[:, 0])
            np.testing.assert_array_equal(blurred.error[:, c], contrast.error[:, 0])
    # Phases are proportional to the index over the wavelength.
    same = correlation.correlate(both, DELAYS, move, wavelength=waves, index=[1.0, 2.0])
    np.testing.assert_allclose(same.mean, correlate(both).mean)
    with pytest.raises(ValueError, match="wavelength must be finite and positive: one number, or one for each of 2 channels"):
        correlation.correlate(both, DELAYS, move, wavelength=[1.0, 1.0, 1.0], index=1)
    with pytest.raises(ValueError, match="the index of 'tissue' must be finite and positive"):
        correlation.speckle_contrast(both, times, move, wavelength=1, index={"tissue": [1.0, -1.0]})
    assert correlation.speckle_contrast(both, [], move, wavelength=waves, index=1).mean.shape == (0, 2)


def test_errors_are_those_among_particles():
    rng = np.random.default_rng(1)
    n, seeds = 400, 300
    transfer = rng.exponential(2.0, (seeds, n))
    seen = rng.random((seeds, n)) < 0.3
    runs = [correlate(records(np.ones(n)[s], y[s], np.flatnonzero(s), n)) for y, s in zip(transfer, seen)]
    for mean, error in [("mean", "error"), ("normalized", "normalized_error")]:
        values = np.array([getattr(run, mean)[2, 0] for run in runs])
        claimed = np.array([getattr(run, error)[2, 0] for run in runs])
        # The relative error of a standard deviation of 300 values is 4 %.
        assert 0.82 < values.std(ddof=1) / np.sqrt((claimed**2).mean()) < 1.18, mean
    # Two records of one particle are a single sample.
    twice = correlate(records(np.ones(4), np.zeros(4), [0, 0, 1, 1], 4))
    once = correlate(records(2 * np.ones(2), np.zeros(2), [0, 1], 4))
    np.testing.assert_allclose(twice.error, once.error)
    assert once.normalized_error[0, 0] == 0


def sheared(g, delay, walks=20_000, steps=120, mu_s=2.0, rate=3.0, k=1.0, seed=1):
    """Returns phases from the flow v = Γ z x̂ along walks in an infinite medium, and their mean
    length: Δφ = k Σ u·v(ℓ u) τ over flights."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(walks, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    phase, length = np.zeros((2, walks))
    for _ in range(steps):
        flight = rng.exponential(1 / mu_s, walks)
        # Scatterers at the ends of a flight separate by Γ ℓ u_z τ along x.
        phase += k * rate * delay * flight * u[:, 2] * u[:, 0]
        length += flight
        xi = rng.random(walks)
        cos = (1 + g**2 - ((1 - g**2) / (1 - g + 2 * g * xi)) ** 2) / (2 * g) if g else 2 * xi - 1
        across = np.cross(u, rng.normal(size=(walks, 3)))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        u = cos[:, None] * u + np.sqrt(1 - cos**2)[:, None] * across
    return phase, length


@pytest.mark.parametrize("g", [0.0, 0.8])
def test_shear_is_what_walks_find(g):
    """The variance of phases of walks agrees with the closed form; noise exceeds 4.5 standard
    errors in 7e-6."""
    delay, mu_s, rate = 0.05, 2.0, 3.0
    phase, length = sheared(g, delay)
    transport = 1 / (mu_s * (1 - g))
    # Half the variance is the exponent of g₁: ⅓ k² ⟨Δr²⟩ s/l*. The first flights, which still
    # depend on the start, are about 2 % of 120.
    expected = 2 / 3 * correlation.shear(rate, transport, g)(delay) * length.mean() / transport
    square = phase**2
    error = square.std(ddof=1) / math.sqrt(len(square))
    start = 1 / (1 - g**2) / 120
    assert abs(square.mean() - expected) < 4.5 * error + start * expected
    assert error < 0.015 * expected and start < 0.03
    # Check that the transport length alone, as for isotropic scattering, would be far off.
    if g:
        assert abs(square.mean() - expected * (1 + g)) > 20 * error
    # The field of the light decays accordingly.
    field = np.cos(phase)
    assert abs(field.mean() - math.exp(-expected / 2)) < 4.5 * field.std() / math.sqrt(len(field)) + start * expected


def test_shear_decays_with_the_square_of_the_delay():
    # A path of length s = Y l*: exp(−(k Γ l* τ)² s/(15 l*)).
    found = correlate(records([1.0], [7.0]), motions={"tissue": correlation.shear(50.0, 0.4)})
    k = 2 * math.pi * INDEX / WAVELENGTH
    np.testing.assert_allclose(found.mean[:, 0], np.exp(-((k * 50.0 * 0.4 * DELAYS) ** 2) * 7 / 15))


def test_contrast_of_one_decay_has_a_closed_form():
    exposures = np.array([1e-6, 1e-4, 1e-2])
    light = records([1.0, 1.0], [1.0, 1.0])
    found = correlation.speckle_contrast(
        light, exposures, {"tissue": correlation.brownian(1e-7)}, wavelength=WAVELENGTH, index=INDEX, beta=0.5
    )
    x = exposures * -np.log(of(1.0, 1.0))
    expected = np.sqrt(0.5 * (np.exp(-2 * x) - 1 + 2 * x) / (2 * x**2))
    np.testing.assert_allclose(found.mean[:, 0], expected, rtol=1e-4)
    np.testing.assert_allclose(found.mean[0, 0] ** 2, 0.5, rtol=1e-3)


def exponential(x):
    """Returns K² of g₁ = exp(−τ/τ_c) by x = T/τ_c (Bandyopadhyay, Gittings, Suh, Dixon and Durian
    2005)."""
    return np.where(x < 1e-4, 1 - 2 * x / 3, (np.expm1(-2 * x) + 2 * x) / (2 * x**2))


def bell(x):
    """Returns K² of g₁ = exp(−(τ/τ_c)²)."""
    a = math.sqrt(2) * x
    return math.sqrt(math.pi) * np.array([math.erf(value) for value in a]) / a + np.expm1(-(a**2)) / a**2


@pytest.mark.parametrize("kind", ["brownian", "ballistic"])
def test_contrast_of_short_and_long_exposures(kind):
    """Exposures range from a ten-thousandth of the correlation time to a million times it, for
    light with one momentum transfer."""
    k = 2 * math.pi * INDEX / WAVELENGTH
    motion, time, expected = {
        "brownian": (correlation.brownian(1e-7), 1 / (2 * k**2 * 1e-7), exponential),
        "ballistic": (correlation.ballistic(5.0), math.sqrt(3) / (k * 5.0), bell),
    }[kind]
    x = 10.0 ** np.arange(-4, 6.5, 0.5)
    found = correlation.speckle_contrast(records([1.0, 1.0], [1.0, 1.0]), x * time, {"tissue": motion}, wavelength=WAVELENGTH, index=INDEX)
    np.testing.assert_allclose(found.mean[:, 0], np.sqrt(expected(x)), rtol=1e-6)
    # K √T tends to a constant.
    np.testing.assert_allclose(found.mean[-1] / found.mean[-5], 0.1, rtol=1e-3)


def layered(particles, size=40.0):
    """Returns records of light that two layers reflect."""
    thickness = np.array([layer[0] for layer in LAYERS])
    # Layers are half a unit thick; the volume is so wide that little light reaches its sides.
    labels = np.repeat([1, 2], (thickness / 0.5).astype(int)).astype(np.uint8)
    properties = [[0, 0, 1, INDEX], *([mu_a, mu_s, g, INDEX] for _, mu_s, mu_a, g in LAYERS)]
    tissue = {
        "type": "labels", "data": labels.reshape(-1, 1, 1), "properties": np.array(properties),
        "to_world": [{"scale": [size, size, float(thickness.sum())]}, {"translate": [-size / 2, -size / 2, 0]}],
        "faces": {"type": "irradiancemeter", "id": "faces", "records": True},
    }
    beam = {"type": "collimated", "radius": 1e-6, "power": 1, "to_world": [{"translate": [0, 0, -1]}]}
    scene = morgana.load_dict({"type": "scene", "integrator": {"type": "particle"}, "tissue": tissue, "beam": beam})
    found = morgana.render(scene, particles=particles, seed=3).records["faces"]
    back = (found.position[:, 2] < 1e-3) & (found.side == 0)
    return found._replace(weight=found.weight * back[:, None])


def tally(particles, seed):
    """Returns samples of the reflected light's G₁, (particles, delays), by a walk in two infinitely
    wide layers."""
    rng = np.random.default_rng(seed)
    edges = np.cumsum([0.0] + [layer[0] for layer in LAYERS])
    mu_s, mu_a, g = (np.array([layer[i] for layer in LAYERS]) for i in (1, 2, 3))
    k = 2 * math.pi * INDEX / WAVELENGTH
    rate = 2 * k**2 * np.array(DIFFUSION)
    z, u, layer = np.zeros(particles), np.ones(particles), np.zeros(particles, int)
    weight, decay = np.ones(particles), np.zeros(particles)
    result = np.zeros((particles, len(DELAYS)))
    alive = np.arange(particles)
    depth = rng.exponential(size=particles)
    while len(alive):
        a, down = alive, u[alive] > 0
        wall = np.where(down, edges[layer[a] + 1], edges[layer[a]])
        to_wall = np.divide(wall - z[a], u[a], out=np.full(len(a), np.inf), where=u[a] != 0)
        free = depth[a] / mu_s[layer[a]]
        crosses = to_wall < free
        way = np.minimum(to_wall, free)
        weight[a] *= np.exp(-mu_a[layer[a]] * way)
        depth[a] -= mu_s[layer[a]] * way
        z[a] = np.where(crosses, wall, z[a] + u[a] * way)
        c = a[crosses]
        layer[c] += np.where(u[c] > 0, 1, -1)
        out = c[layer[c] < 0]
        result[out] = weight[out, None] * np.exp(-np.outer(decay[out], DELAYS))
        s = a[~crosses]
        depth[s] = rng.exponential(size=len(s))
        hg, xi = g[layer[s]], rng.random(len(s))
        cos = (1 + hg**2 - ((1 - hg**2) / (1 - hg + 2 * hg * xi)) ** 2) / (2 * hg)
        decay[s] += rate[layer[s]] * (1 - cos)
        around = np.cos(2 * math.pi * rng.random(len(s)))
        u[s] = u[s] * cos + np.sqrt(np.clip((1 - u[s] ** 2) * (1 - cos**2), 0, None)) * around
        gone = (layer[a] < 0) | (layer[a] >= len(LAYERS)) | (weight[a] < 1e-7)
        alive = a[~gone]
        layer[a[gone]] = 0
    return result


def test_two_layers_agree_with_an_independent_tally():
    found = layered(40_000)
    names = [name for name in found.regions if "label" in name]
    motions = {name: correlation.brownian(d) for name, d in zip(names, DIFFUSION)}
    ours = correlate(found, motions=motions)
    other = tally(200_000, seed=5)
    mean, error = other.mean(axis=0), other.std(axis=0, ddof=1) / math.sqrt(len(other))
    z = (ours.mean[:, 0] - mean) / np.hypot(ours.error[:, 0], error)
    # Four comparisons: noise exceeds 3.7 standard errors in 1 of 1000 families.
    assert np.abs(z).max() < 3.7, (z, ours.mean[:, 0], mean)
    # Check the power of the test: exchanged layers are detected.
    wrong = correlate(found, motions=dict(zip(names, reversed(motions.values()))))
    assert np.abs((wrong.mean[:, 0] - mean) / np.hypot(wrong.error[:, 0], error)).max() > 8


def test_a_half_space_is_that_of_correlation_diffusion():
    """Light far from the source agrees with Green's function of correlation diffusion with an
    extrapolated boundary (Boas and Yodh 1997)."""
    mu_a, mu_s, g, size = 0.01, 2.0, 0.5, [80.0, 80.0, 40.0]
    tissue = {
        "type": "labels", "data": np.ones((1, 1, 1), np.uint8), "properties": np.array([[0, 0, 1, 1], [mu_a, mu_s, g, 1]]),
        "to_world": [{"scale": size}, {"translate": [-size[0] / 2, -size[1] / 2, 0]}],
        "faces": {"type": "irradiancemeter", "id": "faces", "records": True},
    }
    beam = {"type": "collimated", "radius": 1e-6, "power": 1, "to_world": [{"translate": [0, 0, -1]}]}
    scene = morgana.load_dict({"type": "scene", "integrator": {"type": "particle"}, "tissue": tissue, "beam": beam})
    found = morgana.render(scene, particles=40_000, seed=3).records["faces"]
    radius = np.hypot(found.position[:, 0], found.position[:, 1])
    ring = (found.position[:, 2] < 1e-3) & (found.side == 0) & (radius > 6) & (radius < 12)
    (name,) = (name for name in found.regions if "label" in name)
    delays = np.array([3e-6, 3e-5, 5e-4])
    ours = correlate(found._replace(weight=found.weight * ring[:, None]), delays, {name: correlation.brownian(1e-6)})

    reduced, k0 = mu_s * (1 - g), 2 * math.pi / WAVELENGTH
    near, far = 1 / reduced, 1 / reduced + 4 / (3 * reduced)
    rho = np.linspace(6, 12, 400)

    def green(delay):
        k = math.sqrt(3 * mu_a * reduced + reduced**2 * k0**2 * 6 * 1e-6 * delay)
        r = [np.hypot(rho, z) for z in (near, far)]
        return np.sum(rho * (np.exp(-k * r[0]) / r[0] - np.exp(-k * r[1]) / r[1]))

    expected = [green(delay) / green(0.0) for delay in delays]
    # Diffusion itself is accurate to a few hundredths here, and the statistical errors are about
    # one.
    np.testing.assert_allclose(ours.normalized[:, 0], expected, atol=0.03)
    assert expected[0] > 0.8 and expected[-1] < 0.3


def test_what_is_wrong_is_said():
    light = records([1.0], [1.0])
    move = {"tissue": correlation.brownian(1e-7)}
    for call, said in [
        (lambda: correlate(light, [-1.0]), "delays are finite"),
        (lambda: correlate(light, motions={"bone": correlation.brownian(1)}), "no region 'bone': the records have 'tissue'"),
        (lambda: correlation.correlate(light, [0.0], move, wavelength=0, index=1), "wavelength must be finite and positive"),
        (lambda: correlation.correlate(light, [0.0], move, wavelength=1, index={}), "'tissue' moves, but has no index"),
        (lambda: correlate(light, motions={"tissue": lambda t: -t - 1}), "mean square displacement for each delay"),
        (lambda: correlate(light, motions={"tissue": np.zeros((4, 4, 4, 3))}), "give the medium a 'velocity'"),
        (lambda: correlation.shear(-1, 1), "rate must be finite and not negative"),
        (lambda: correlation.shear(1, 0), "transport_length must be finite and positive"),
        (lambda: correlation.shear(1, 1, g=1), "g must be between -1 and 1"),
        (lambda: correlation.ballistic(1e200), "speed is 1e.200, but mean square displacements must be finite"),
        (lambda: correlation.shear(1e100, 1e100), "rate times transport_length is 1e.200, but mean"),
        (lambda: correlation.brownian(1e308), "diffusion is 1e.308, but mean"),
        (lambda: correlation.brownian(-1), "diffusion must be finite and not negative"),
        (lambda: correlation.brownian(1, moving=2), "between 0 and 1"),
        (lambda: correlation.speckle_contrast(light, [0.0], move, wavelength=1, index=1), "exposures are finite"),
        (lambda: correlation.speckle_contrast(light, [1.0], move, wavelength=1, index=1, beta=2), "beta must be above 0"),
    ]:
        with pytest.raises(ValueError, match=said):
            call()
    for call, said in [
        (lambda: correlate(light, ["soon"]), "delays must be an array of real numbers"),
        (lambda: correlation.correlate(light, [0.0], correlation.brownian(1), wavelength=1, index=1), "motions by region as a dictionary"),
        (lambda: correlation.correlate([1.0], [0.0], move, wavelength=1, index=1), "expected Records, found list"),
        (lambda: correlation.correlate(light, [0.0], move, wavelength=1, index=1, flow="fast"), "flow is 'fast' but must be a finite number"),
        (lambda: correlation.speckle_contrast(light, None, move, wavelength=1, index=1), "exposures is None"),
        (lambda: correlation.brownian("1"), "diffusion must be a number"),
    ]:
        with pytest.raises(TypeError, match=said):
            call()
