"""Low-coherence interferometry: mirrors and lenses whose optical lengths have closed forms.

False alarms: 1e-3 for the powers that a pane and a mirror reflect, and for the depths of a slab;
closed forms have none.
"""

import math
import tracemalloc

import morgana
import numpy as np
import pytest
from conftest import load
from morgana import coherence

WAVELENGTH, WIDTH = 1.3e-3, 0.1e-3
FWHM = 2 * math.log(2) / math.pi * WAVELENGTH**2 / WIDTH


def records(weight, length, particle=None, particles=None):
    n = len(weight)
    number = np.arange(n) if particle is None else np.asarray(particle)
    none = np.zeros((n, 0))
    return morgana.Records(
        number, np.asarray(weight, float)[:, None], np.zeros((n, 3)), np.zeros((n, 3)), np.asarray(length, float), np.zeros(n, int), none,
        none.astype(int), none, [], np.zeros((0, 1)), particles or n, "W",
    )  # fmt: skip


def test_coherence_is_the_spectrum_transformed():
    source = coherence.gaussian(WAVELENGTH, WIDTH)
    assert source.coherence_length == pytest.approx(FWHM)
    assert abs(source.degree(np.array([FWHM]))[0]) == pytest.approx(0.5)
    k0, dk = 2 * math.pi / WAVELENGTH, 2 * math.pi * WIDTH / WAVELENGTH**2
    nm = 2 * math.pi / np.linspace(k0 + 3 * dk, k0 - 3 * dk, 1501)
    bell = np.exp(-4 * math.log(2) * ((2 * math.pi / nm - k0) / dk) ** 2) / nm**2
    away = np.linspace(-4 * FWHM, 4 * FWHM, 201)
    table = coherence.tabulated(nm, bell)
    np.testing.assert_allclose(table.degree(away), source.degree(away), atol=1e-5)
    assert table.coherence_length == pytest.approx(FWHM, rel=1e-4)
    # For power that is even in wave number, |γ| is a sinc. It is exact at any distance, where
    # coarse sums would have aliases.
    nm = np.array([0.8, 0.85, 0.9])
    even = coherence.tabulated(nm, 1 / nm**2)
    span = 2 * math.pi * (1 / 0.8 - 1 / 0.9)
    far = np.linspace(0, 4000, 997)
    np.testing.assert_allclose(np.abs(even.degree(far)), np.abs(np.sinc(span * far / 2 / math.pi)), atol=1e-9)
    # A narrow peak of a wide table has a coherence length of about λ²/Δλ.
    peak = coherence.tabulated([0.4, 0.6999, 0.7, 0.7001, 1.2], [0, 0, 1, 0, 0])
    assert 0.4 < peak.coherence_length / (0.7**2 / 1e-4) < 0.5


def test_gates_let_through_what_fits():
    light = records([2.0, 1.0], [5.0, 5.0 + FWHM], particles=10)
    scan = coherence.a_scan(light, [5.0, 5.0 + FWHM, 9.0], coherence.gaussian(WAVELENGTH, WIDTH))
    np.testing.assert_allclose(scan.mean[:, 0], [2.25, 1.5, 0], atol=1e-9)
    # Two records of one particle are a single sample.
    twice = coherence.a_scan(records(np.ones(4), np.zeros(4), [0, 0, 1, 1], 9), [0.0], coherence.gaussian(1, 1))
    once = coherence.a_scan(records([2.0, 2.0], [0, 0], [0, 1], 9), [0.0], coherence.gaussian(1, 1))
    np.testing.assert_allclose([twice.mean, twice.error], [once.mean, once.error])
    empty = coherence.a_scan(records([], [], particles=9), [0.0], coherence.gaussian(1, 1))
    assert empty.mean.shape == (1, 1) and not empty.mean.any() and not empty.error.any()


def test_errors_are_those_among_particles():
    rng = np.random.default_rng(1)
    n, seeds, source = 400, 300, coherence.gaussian(1.0, 0.5)
    length, seen = rng.exponential(1.0, (seeds, n)), rng.random((seeds, n)) < 0.3
    runs = [coherence.a_scan(records(np.ones(s.sum()), y[s], np.flatnonzero(s), n), [0.7], source) for y, s in zip(length, seen)]
    values, claimed = (np.array([getattr(run, name)[0, 0] for run in runs]) for name in ("mean", "error"))
    # The relative error of a standard deviation of 300 values is 4 %.
    assert 0.82 < values.std(ddof=1) / np.sqrt((claimed**2).mean()) < 1.18


def test_a_pane_and_a_mirror_are_where_their_optical_lengths_say():
    """A beam from z = −1 meets a pane of index 1.5 from 0 to 1, and a mirror at 1.5. The meter at
    −½ records the returning light."""
    scene = morgana.load_dict({
        "type": "scene",
        "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 1e-3, "power": 1, "to_world": [{"translate": [0, 0, -1]}]},
        "plane": {
            "type": "rectangle", "bsdf": {"type": "null"}, "to_world": [{"translate": [0, 0, -0.5]}],
            "meter": {"type": "irradiancemeter", "id": "detector", "records": True},
        },
        "pane": {
            "type": "cube", "to_world": [{"scale": [2, 2, 0.5]}, {"translate": [0, 0, 0.5]}],
            "bsdf": {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0},
        },
        "mirror": {
            "type": "rectangle", "to_world": [{"scale": 2}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 1.5]}],
            "bsdf": {"type": "conductor", "material": "none"},
        },
    })  # fmt: skip
    found = morgana.render(scene, particles=20_000, seed=7).records["detector"]
    back = found._replace(weight=found.weight * (found.direction[:, 2] < 0)[:, None])
    r = 0.2**2
    expected = {1.5: r, 4.5: (1 - r) ** 2 * r, 5.5: (1 - r) ** 4, 3.5: 0.0, 5.0: 0.0}
    scan = coherence.a_scan(back, list(expected), coherence.gaussian(0.01, 0.001))
    for i, (length, power) in enumerate(expected.items()):
        # Three comparisons: noise exceeds 3.6 standard errors in 1 of 1000 families.
        assert abs(scan.mean[i, 0] - power) <= 3.6 * scan.error[i, 0] + 1e-9, (length, power, scan.mean[i], scan.error[i])
    assert scan.error[0, 0] < 0.05 * r
    # Peaks lie there to a hundredth of the gate.
    near = 4.5 + np.linspace(-0.05, 0.05, 1001)
    peak = coherence.a_scan(back, near, coherence.gaussian(0.01, 0.001)).mean[:, 0].argmax()
    assert near[peak] == pytest.approx(4.5, abs=5e-4)


def test_a_luneburg_lens_is_as_long_for_every_ray():
    """All rays have the length (1 + π/2) R, from a plane that touches the ball to the focus on its
    other side."""
    scene = morgana.load_dict({
        "type": "scene",
        "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 0.8, "power": 1, "to_world": [{"translate": [0, 0, -2]}]},
        "ball": {
            "type": "sphere", "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_t": 0, "ior": {"type": "luneburg"}},
        },
        "wall": {
            "type": "rectangle", "bsdf": {"type": "null"}, "to_world": [{"scale": 2}, {"translate": [0, 0, 1.001]}],
            "meter": {"type": "irradiancemeter", "id": "screen", "records": True},
        },
    })  # fmt: skip
    found = morgana.render(scene, particles=2000, seed=7).records["screen"]
    ell = 1 + 1 + math.pi / 2 + 0.001
    scan = coherence.a_scan(found, [ell, 3.001, ell + 0.1], coherence.gaussian(0.01, 0.001))
    assert scan.mean[0, 0] == pytest.approx(1, abs=0.01)
    assert scan.mean[1, 0] < 1e-6 and scan.mean[2, 0] < 0.01


SLAB = {"sigma_t": 2.0, "albedo": 0.8}


def slab(decomposition, polarised=False, **film):
    """A slab from z = 0 to 1 that scatters once, seen from z = −1 along the beam that lights it; if
    polarised, from z = −3 through a polariser in front of the sensor."""
    path = {"type": "path", "max_depth": 2}
    filters = {"filter": {"type": "rectangle", "to_world": [{"translate": [0, 0, -2]}], "bsdf": {"type": "polarizer"}}}
    return load({
        "type": "scene",
        "integrator": {"type": "stokes", "light": path} if polarised else path,
        **(filters if polarised else {}),
        "sensor": {
            "type": "orthographic", "to_world": [{"scale": [0.1, 0.1, 1]}, {"translate": [0, 0, -3 if polarised else -1]}],
            "film": {"type": "hdrfilm", "width": 2, "height": 1, "pixel_format": "luminance", "rfilter": {"type": "box"},
                     "decomposition": decomposition, **film},
            # Errors of evenly distributed samples are too large: bins of length are correlated.
            "sampler": {"type": "independent"},
        },
        "beam": {"type": "collimated", "radius": 1.0, "power": math.pi, "to_world": [{"translate": [0, 0, -1]}]},
        "slab": {
            "type": "cube", "bsdf": {"type": "null"}, "to_world": [{"scale": [3, 3, 0.5]}, {"translate": [0, 0, 0.5]}],
            "interior": {"type": "homogeneous", **SLAB},
        },
    })  # fmt: skip


def single_scattering(lengths, source):
    """Returns ∫ σ_s/(4π) e^{−2σ_t z} |γ(L − 2 − 2z)|² dz for an irradiance of 1."""
    z = (np.arange(4000) + 0.5) / 4000
    gate = np.abs(source.degree(np.asarray(lengths)[:, None] - 2 - 2 * z)) ** 2
    mu_t, albedo = SLAB["sigma_t"], SLAB["albedo"]
    return (gate * mu_t * albedo / (4 * math.pi) * np.exp(-2 * mu_t * z)).mean(axis=1)


def test_films_give_scans_of_their_pixels():
    source = coherence.gaussian(0.1, 0.05)
    bins = {"min_bound": 1.0, "max_bound": 5.0, "bin_width": 0.04}
    lengths = np.array([1.0, 2.0, 2.1, 2.5, 3.0, 3.9])
    result = morgana.render(slab("length", **bins), spp=40_000, seed=3)
    scan = coherence.a_scan(result, lengths, source)
    assert scan.mean.shape == scan.error.shape == (6, 1, 2, 1)
    expected = single_scattering(lengths, source)
    # Ten comparisons: noise exceeds 4 standard errors in 6e-4. Bins of a fifth of the coherence
    # length displace light within them: 0.1 %.
    difference = np.abs(scan.mean[:, 0, :, 0] - expected[:, None])
    assert np.all(difference <= 4 * scan.error[:, 0, :, 0] + 1e-3 * expected.max())
    assert np.all(scan.error[1:, 0, :, 0] < 0.05 * expected[1:, None]) and scan.mean[0].max() < 1e-6
    # Bins of time, also with bins of bounces, contain equal light.
    speed = 2.0
    times = {"min_bound": 0.5, "max_bound": 2.5, "bin_width": 0.02, "speed_of_light": speed, "max_bounces": 3}
    other = coherence.a_scan(morgana.render(slab("time,bounce", **times), spp=40_000, seed=3), lengths, source)
    np.testing.assert_allclose(other.mean, scan.mean, rtol=1e-5, atol=1e-9)


def test_files_and_stokes_parameters_are_scanned_as_pictures(tmp_path):
    """Half of the slab's light passes a polariser in front of the sensor, with its own S1."""
    source = coherence.gaussian(0.1, 0.05)
    for polarised in (False, True):
        lengths = np.array([2.0, 2.5]) + 2 * polarised
        bins = {"min_bound": lengths[0] - 1, "max_bound": lengths[0] + 3, "bin_width": 0.04, "speed_of_light": 1.0}
        result = morgana.render(slab("time,bounce", max_bounces=3, polarised=polarised, **bins), spp=2000, seed=3)
        scan = coherence.a_scan(result, lengths, source)
        result.write(tmp_path / "slab.exr")
        file = morgana.read(tmp_path / "slab.exr")
        kept = coherence.a_scan(file, lengths, source)
        np.testing.assert_allclose(kept.mean, scan.mean, rtol=1e-5)
        np.testing.assert_allclose(kept.error, scan.error, rtol=1e-5)
        expected = single_scattering(lengths - 2 * polarised, source) * (0.5 if polarised else 1)
        # Eight comparisons: noise exceeds 4 standard errors in 5e-4.
        assert np.all(np.abs(scan.mean[:, 0, :, 0] - expected[:, None]) <= 4 * scan.error[:, 0, :, 0] + 1e-3 * expected.max())
        assert np.all(scan.error[:, 0, :, 0] < 0.2 * expected[:, None])
        assert coherence.a_scan(file, [], source).mean.shape == (0, 1, 2, 1)
    assert "S3" in {name.rpartition(".")[2] for name in result.layers}
    without = file._replace(layers={name: values for name, values in file.layers.items() if not name.startswith("variance")})
    with pytest.raises(ValueError, match="has no variance: give all layers of an EXR file"):
        coherence.a_scan(without, lengths, source)
    for bare in (file._replace(layers={"": file.image}), file._replace(attributes={})):
        with pytest.raises(ValueError, match="layers .*length.* EXR file"):
            coherence.a_scan(bare, lengths, source)


def test_films_of_tagged_light_are_scanned_as_a_whole():
    sound = {"type": "acoustic", "n0": 1.0, "amplitude": 1e-4, "wave_number": 9.0, "elasto_optic": 0.32}
    bins = {"decomposition": "length", "min_bound": 2.0, "max_bound": 6.0, "bin_width": 0.1}
    camera = {
        "type": "perspective",
        "to_world": [{"lookat": {"origin": [0, 0, -3], "target": [0, 0, 0], "up": [0, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 4, "height": 4, "pixel_format": "luminance", **bins},
    }
    scans = []
    for integrator in [{"type": "path"}, {"type": "tagged", "wavelength": 5e-4, "delays": 2, "path": {"type": "path"}}]:
        scene = {
            "type": "scene",
            "integrator": integrator,
            "camera": camera,
            "ball": {"type": "sphere", "bsdf": {"type": "null"}, "interior": {"type": "homogeneous", "sigma_t": 1.0, "ior": sound}},
            "light": {"type": "point", "position": [0, 2, -1], "intensity": 1.0},
        }
        picture = morgana.render(load(scene), spp=16, seed=3)
        scans.append(coherence.a_scan(picture, [4.0, 5.0], coherence.gaussian(0.4, 0.16)))
    plain, tagged = scans
    assert plain.mean.max() > 0
    np.testing.assert_allclose(tagged.mean, plain.mean, rtol=1e-5)
    np.testing.assert_allclose(tagged.error, plain.error, rtol=1e-5)


def test_errors_of_films_are_those_among_samples():
    source = coherence.gaussian(0.1, 0.05)
    scene = slab("length", min_bound=1.0, max_bound=5.0, bin_width=0.04)
    runs = [coherence.a_scan(morgana.render(scene, spp=64, seed=seed), [2.4], source) for seed in range(100)]
    values, claimed = (np.array([getattr(run, name).ravel() for run in runs]) for name in ("mean", "error"))
    # The relative error of a standard deviation of 200 values is 5 %.
    assert 0.8 < values.std(ddof=1) / np.sqrt((claimed**2).mean()) < 1.2
    once = coherence.a_scan(morgana.render(scene, spp=1, seed=1), [2.4], source)
    assert np.isinf(once.error).all() and np.isfinite(once.mean).all()


def test_fringes_are_as_far_apart_as_waves():
    source = coherence.gaussian(WAVELENGTH, WIDTH)
    lengths = 5 + WAVELENGTH * np.array([0, 0.25, 0.5, 200])
    found = coherence.interferogram(lengths, [5.0], 0.04, source)
    half = abs(source.degree(np.array([WAVELENGTH / 2]))[0])
    np.testing.assert_allclose(found, [1.2**2, 1.04, 1.04 - 0.4 * half, 1.04], atol=1e-9)
    # Paths of equal length add up as fields, others as powers.
    assert coherence.interferogram([0.0], [5.0, 5.0, 9.0], 1.0, source)[0] == pytest.approx(1 + 4 + 1)


def test_fringes_of_many_ways_need_little_memory(monkeypatch):
    rng, count = np.random.default_rng(4), 2000
    lengths, ways, power = rng.uniform(5, 5 + 40 * WAVELENGTH, 600), rng.uniform(5, 5 + 40 * WAVELENGTH, count), rng.uniform(0, 1, count)
    source = coherence.gaussian(WAVELENGTH, WIDTH)
    amplitude = np.sqrt(power)
    among = amplitude @ source.degree(ways[:, None] - ways).real @ amplitude
    expected = 0.5 + among + 2 * np.sqrt(0.5) * source.degree(lengths[:, None] - ways).real @ amplitude
    monkeypatch.setattr(coherence, "BLOCK", 1 << 15)
    tracemalloc.start()
    found = coherence.interferogram(lengths, ways, power, source, reference=0.5)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # The limit is twenty arrays of a block; all differences of paths at once would take 32 MB each.
    assert most < 20 * 8 * (1 << 15)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert coherence.interferogram([], ways, power, source).shape == (0,)
    np.testing.assert_array_equal(coherence.interferogram(lengths, [], [], source), 1)


def test_what_is_wrong_is_said():
    light, source = records([1.0], [1.0]), coherence.gaussian(1, 1)
    wide = {"min_bound": 0, "max_bound": 5, "bin_width": 0.5}

    def picture(decomposition, **film):
        return morgana.render(slab(decomposition, **film), spp=1)

    for call, said in [
        (lambda: coherence.gaussian(0, 1), "wavelength must be finite and positive, not 0"),
        (lambda: coherence.gaussian(1, math.nan), "width must be finite and positive"),
        (lambda: coherence.gaussian(1, 3), "the spectrum is 3 wide, more than its wavelength of 1"),
        (lambda: coherence.interferogram([1.0], [1.0], 1.0, source, reference=-1), "reference must be finite and not negative"),
        (lambda: coherence.tabulated([2, 1], [1, 1]), "positive and ascending"),
        (lambda: coherence.tabulated([1, 2], [1, -1]), "power must be finite, not negative"),
        (lambda: coherence.a_scan(light, [[1.0]], source), "lengths must be finite numbers in one row"),
        (lambda: coherence.interferogram([1.0], [1.0], -1.0, source), "powers must be finite and not negative"),
        (lambda: coherence.a_scan(picture("bounce", max_bounces=1), [1.0], source), "give its film the decomposition 'length' or 'time'"),
        (lambda: coherence.a_scan(picture("length", **wide), [1.0], coherence.gaussian(1, 1)), "take a smaller bin_width"),
        (lambda: coherence.a_scan(picture("length", **wide), [1.0, 5.1], coherence.gaussian(9, 9)), "light of the lengths 0 to 5 only"),
        (lambda: coherence.interferogram([1.0], [1.0, 2.0], [1.0, 2.0, 3.0], source), "one for each of 2 paths"),
    ]:
        with pytest.raises(ValueError, match=said):
            call()
    for call, said in [
        (lambda: coherence.a_scan([1.0], [1.0], source), "expected Records, a Result or an Image, found list: give"),
        (lambda: coherence.a_scan(light, ["far"], source), "lengths must be an array of real numbers"),
        (lambda: coherence.interferogram([1.0], [1.0], 1.0, source, reference="a"), "reference must be a number, finite and not negative, not 'a'"),
        (lambda: coherence.gaussian("red", 1), "wavelength must be a number"),
        (lambda: coherence.a_scan(light, [1.0], 1.3), "source must be a Source, found float: make one by coherence.gaussian"),
        (lambda: coherence.interferogram([1.0], [1.0], 1.0, None), "source must be a Source, found NoneType"),
    ]:
        with pytest.raises(TypeError, match=said):
            call()
