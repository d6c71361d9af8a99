"""Tagged light: sidebands and correlation from records, compared with sums over instants, and the
required content of scenes.

Only the comparison of errors is statistical; its seeds are fixed.
"""

import morgana
import numpy as np
import pytest
from conftest import load
from morgana import _morgana, correlation

WAVELENGTH = 500e-6


def records(weight, phase, particle=None, particles=None):
    """Records of light with phasors."""
    n = len(weight)
    number = np.arange(n) if particle is None else np.asarray(particle)
    zero = np.zeros(n)
    modulation = np.asarray(phase, complex) * WAVELENGTH / (2 * np.pi)
    return morgana.Records(
        number, np.asarray(weight, float)[:, None], np.zeros((n, 3)), np.zeros((n, 3)), zero, zero.astype(int), np.zeros((n, 1)),
        np.zeros((n, 1), int), np.zeros((n, 1)), ["tissue"], np.zeros((1, 1)), particles or n, "W", 0.25 * modulation, 0.75 * modulation,
    )  # fmt: skip


def scene(amplitude=1e-5, sampler=None, **sound):
    """A ball of fog in sound, and a tagged meter around it."""
    index = {"type": "acoustic", "n0": 1.33, "amplitude": amplitude, "wave_number": 9.0, "elasto_optic": 0.32, **sound}
    phase = {"type": "hg", "g": 0.4}
    return {
        "type": "scene",
        "integrator": {"type": "particle"},
        "fog": {"type": "homogeneous", "sigma_t": 3.0, "albedo": 0.95, "phase": phase, "ior": {k: v for k, v in index.items() if v is not None}},
        "ball": {
            "type": "sphere",
            "bsdf": {"type": "dielectric"},
            "interior": {"type": "ref", "id": "fog"},
            "meter": {"type": "irradiancemeter", "records": True, "tagged": True, **({"sampler": sampler} if sampler else {})},
        },
        "light": {"type": "point", "position": [0.2, 0.1, -2], "intensity": 1.0},
    }


def measure(**changes):
    return morgana.render(load(scene(**changes)), particles=1280, seed=3).records["irradiancemeter"]


def test_bessel_functions():
    known = {(0, 1): 0.7651976865579666, (1, 1): 0.4400505857449335, (2, 3): 0.4860912605858911, (0, 10): -0.2459357644513483}
    for (order, z), value in {**known, (1, 50): -0.09751182812517514, (3, 0): 0.0}.items():
        assert _morgana.order_shares(np.array([[float(z)]]), order)[order, 0, 0] == pytest.approx(value**2, abs=1e-13)
    special = pytest.importorskip("scipy.special")
    z = np.concatenate([np.linspace(0, 300, 2001), 10.0 ** np.linspace(2, 7, 200)])
    for orders in (0, 1, 100):
        np.testing.assert_allclose(_morgana.order_shares(z, orders), special.jv(np.arange(orders + 1)[:, None], z) ** 2, atol=2e-13)
    np.testing.assert_allclose(_morgana.phase_correlation(z, 0.7), special.j0(2 * z * np.sin(0.7)), atol=2e-13)
    assert _morgana.order_shares(np.zeros(0), 3).shape == (4, 0)


def test_large_phases_take_no_longer():
    rng = np.random.default_rng(5)
    light = records(rng.random(2000), 1e9 * rng.random(2000))
    found = correlation.tagged(light, wavelength=WAVELENGTH, orders=2)
    # J_m² of large z is 1/(πz) on average.
    assert np.all(found.mean < 1e-6 * found.total)
    delayed = correlation.correlate_tagged(light, [0.0, 5e-7], wavelength=WAVELENGTH, frequency=1e6)
    assert delayed.normalized[0, 0] == pytest.approx(1) and abs(delayed.normalized[1, 0]) < 1e-3
    for wavelength in (1e-30, 5e-324):
        with pytest.raises(ValueError, match="phases by up to .* radians, which is too much to compute: give the wavelength in scene units"):
            correlation.tagged(light, wavelength=wavelength)


def test_sidebands_are_the_spectrum_of_phases_in_time():
    rng = np.random.default_rng(3)
    weight = rng.random(200)
    phase = rng.normal(size=200) * 1.5 * np.exp(2j * np.pi * rng.random(200))
    found = correlation.tagged(records(weight, phase), wavelength=WAVELENGTH, orders=30)
    time = np.exp(2j * np.pi * np.arange(64) / 64)
    spectrum = np.abs(np.fft.fft(np.exp(1j * np.real(phase[:, None] * time)), axis=1) / 64) ** 2
    powers = weight @ spectrum
    np.testing.assert_allclose(found.mean[:20, 0], powers[:20], atol=1e-12)
    np.testing.assert_allclose(powers[1:20], powers[:-20:-1], atol=1e-12)
    assert found.mean[0, 0] + 2 * found.mean[1:, 0].sum() == pytest.approx(found.total[0], rel=1e-12)
    assert found.total[0] == pytest.approx(weight.sum(), rel=1e-12)
    assert found.depth[0] == pytest.approx(powers[1] / powers[0], rel=1e-10)
    # Keep only some of the records.
    where = phase.real > 0
    some = correlation.tagged(records(weight, phase), wavelength=WAVELENGTH, where=where)
    np.testing.assert_allclose(some.mean[:, 0], weight[where] @ spectrum[where, :2], atol=1e-12)


def test_sidebands_compute_like_arrays():
    found = correlation.tagged(records([1.0, 2.0], [0.4, 1.0j]), wavelength=WAVELENGTH, orders=2)
    share = found.sel(order=1, channel=0) / 3
    assert share.mean == found.mean[1, 0] / 3 and share.error == found.error[1, 0] / 3 and share.unit == "W"
    assert found[0].shape == (1,) and list(found.coordinates["order"]) == [0, 1, 2]
    pytest.importorskip("xarray")
    table = found.to_xarray()
    assert table["power"].dims == ("order", "channel") and table["depth"].dims == ("channel",)
    np.testing.assert_array_equal(table["depth_error"], found.depth_error)
    edges = {"order": np.array([-0.5, 0.5, 1.5]), "z": np.array([0.0, 1.0, 2.0, 3.0])}
    reading = morgana.Reading(np.array([[4.0, 2, 1], [1, 1, 0]]), np.full((2, 3), 0.1), edges, "W/unit^2")
    depth = correlation.modulation_depth(reading)
    assert list(depth.coordinates) == ["z"] and depth.sel(z=1.5).mean == 0.5
    assert depth.to_xarray().dims == ("z",) and (1 - depth).mean[2] == 1


def test_correlation_is_the_mean_over_instants():
    rng = np.random.default_rng(4)
    weight = rng.random(100)
    phase = rng.normal(size=100) * np.exp(2j * np.pi * rng.random(100))
    delays = np.array([0, 1, 7, 16, 32]) / 64e6
    found = correlation.correlate_tagged(records(weight, phase), delays, wavelength=WAVELENGTH, frequency=1e6)
    time = np.arange(64) / 64e6
    at = [np.real(phase[:, None] * np.exp(2j * np.pi * 1e6 * (time + delay))) for delay in delays]
    brute = [(weight[:, None] * np.exp(1j * (later - at[0]))).sum(axis=0).mean() for later in at]
    np.testing.assert_allclose(found.mean[:, 0], np.real(brute), atol=1e-12)
    np.testing.assert_allclose(np.imag(brute), 0, atol=1e-12)
    np.testing.assert_allclose(found.normalized * weight.sum(), found.mean)


def test_errors_are_those_among_particles():
    rng = np.random.default_rng(1)
    n, seeds = 400, 300
    phase = rng.exponential(0.8, (seeds, n))
    seen = rng.random((seeds, n)) < 0.3
    light = [records(np.ones(n)[s], p[s], np.flatnonzero(s), n) for p, s in zip(phase, seen)]
    runs = [correlation.tagged(one, wavelength=WAVELENGTH) for one in light]
    for mean, error in [("mean", "error"), ("total", "total_error"), ("depth", "depth_error")]:
        values = np.array([np.ravel(getattr(run, mean))[-1] for run in runs])
        claimed = np.array([np.ravel(getattr(run, error))[-1] for run in runs])
        # The relative error of a standard deviation of 300 values is 4 %.
        assert 0.82 < values.std(ddof=1) / np.sqrt((claimed**2).mean()) < 1.18, mean


def test_sound_without_bending_changes_phases_alone():
    still = {"type": "independent", "bending": False}
    loud, faint = measure(sampler=still), measure(amplitude=1e-6, sampler=still)
    np.testing.assert_array_equal(loud.weight, faint.weight)
    np.testing.assert_array_equal(loud.position, faint.position)
    assert np.abs(loud.index_modulation).max() > 1e-6
    np.testing.assert_allclose(loud.index_modulation, 10 * faint.index_modulation, rtol=1e-9, atol=1e-17)
    np.testing.assert_allclose(loud.displacement_modulation, 10 * faint.displacement_modulation, rtol=1e-9, atol=1e-17)
    stiffer = measure(sampler=still, elasto_optic=0.64)
    np.testing.assert_allclose(stiffer.displacement_modulation, 0.5 * loud.displacement_modulation, rtol=1e-9, atol=1e-17)
    bent = measure(amplitude=2e-3)
    assert bent.weight.shape != loud.weight.shape or np.any(bent.position != loud.position)


def test_files_keep_modulations(tmp_path):
    measured = morgana.render(load(scene()), particles=640)
    measured.write(tmp_path / "tagged.npz")
    assert morgana.Records.load(tmp_path / "tagged.npz") == measured.records["irradiancemeter"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"elasto_optic": None}, "the displacement of scatterers by the sound in medium 'fog'"),
        ({"elasto_optic": -0.3}, "elasto_optic"),
        ({"sampler": {"type": "independent", "bending": False, "phases": 4}}, "leave out 'phases'"),
    ],
)
def test_scenes_must_say_what_sound_does(changes, message):
    with pytest.raises(morgana.SceneError, match=message):
        load(scene(**changes))


def tagged_cells(**changes):
    """The ball with a meter of fluence, four cells in a box inside it."""
    cells = {"type": "fluencemeter", "nx": 2, "ny": 2, "nz": 1, "tagged": True, "wavelength": WAVELENGTH, "orders": 1, "delays": 2, **changes}
    found = scene()
    del found["ball"]["meter"]
    return {**found, "cells": {**cells, "to_world": [{"scale": 0.8}, {"translate": [-0.4, -0.4, -0.4]}]}}


def test_readings_have_sidebands(tmp_path):
    measured = morgana.render(load(tagged_cells()), particles=1280, seed=3)
    sidebands, fluence = measured.meters["fluence_sidebands"], measured.meters["fluence"]
    assert list(sidebands.axes) == ["order", "z", "y", "x"]
    assert sidebands.mean.shape[:1] + fluence.mean.shape == sidebands.mean.shape == (2, 1, 2, 2)
    assert sidebands.unit == fluence.unit
    assert np.all(sidebands.mean[0] + 2 * sidebands.mean[1] <= fluence.mean)
    delays = measured.meters["fluence_correlation"].axes["delay"]
    np.testing.assert_allclose(0.5 * (delays[1:] + delays[:-1]), [0.25, 0.5])
    depth = correlation.modulation_depth(sidebands)
    np.testing.assert_allclose(depth.mean, sidebands.mean[1] / sidebands.mean[0])
    assert np.all(depth.error >= sidebands.error[1] / sidebands.mean[0])
    with pytest.raises(ValueError, match="has no sidebands up to the first"):
        correlation.modulation_depth(fluence)
    measured.write(tmp_path / "cells.npz")
    np.testing.assert_array_equal(correlation.modulation_depth(morgana.Reading.load(tmp_path / "cells.npz", "fluence_sidebands")), depth)
    with pytest.raises(ValueError, match="of files of meters give a morgana.Reading.load"):
        correlation.modulation_depth(dict(np.load(tmp_path / "cells.npz")))


def test_pictures_have_sidebands(tmp_path):
    pictured = scene()
    del pictured["ball"]["meter"]
    pictured["integrator"] = {"type": "tagged", "wavelength": WAVELENGTH, "orders": 30, "path": {"type": "path"}}
    film = {"type": "hdrfilm", "width": 8, "height": 6, "pixel_format": "luminance"}
    to_world = [{"lookat": {"origin": [0, 4, -1], "target": [0, 0, 0], "up": [0, 0, 1]}}]
    pictured["camera"] = {"type": "perspective", "fov": 20, "to_world": to_world, "film": film}
    result = morgana.render(load(pictured), spp=8, seed=2)
    layers = result.layers
    assert result.axes == [{"name": "tagged", "orders": 30, "delays": []}]
    powers = [layers["carrier"].mean, *(2 * layers[f"sideband.{m}"].mean for m in range(1, 31))]
    np.testing.assert_allclose(np.sum(powers, axis=0), layers["total"].mean, rtol=1e-5)
    depth = correlation.modulation_depth(layers)
    lit = layers["total"].mean > 0
    assert lit.any() and np.all(depth.mean[lit] > 0)
    result.write(tmp_path / "tagged.exr")
    kept = morgana.read(tmp_path / "tagged.exr").layers
    np.testing.assert_allclose(correlation.modulation_depth(kept), depth, rtol=1e-6)
    with pytest.raises(ValueError, match="the layer carrier has no variance"):
        correlation.modulation_depth({name: kept[name] for name in ("carrier", "sideband.1")})
    with pytest.raises(ValueError, match="no layers length.0001.carrier"):
        correlation.modulation_depth(layers, prefix="length.0001.")


def test_delays_are_trusted_as_the_light_of_which_they_are(tmp_path):
    pictured = scene()
    del pictured["ball"]["meter"]
    pictured["integrator"] = {"type": "tagged", "wavelength": WAVELENGTH, "delays": 2, "path": {"type": "path"}}
    film = {"type": "hdrfilm", "width": 8, "height": 6, "pixel_format": "luminance", "decomposition": "bounce", "max_bounces": 2}
    to_world = [{"lookat": {"origin": [0, 4, -1], "target": [0, 0, 0], "up": [0, 0, 1]}}]
    pictured["camera"] = {"type": "perspective", "fov": 20, "to_world": to_world, "film": film}
    result = morgana.render(load(pictured), spp=8, seed=2)
    flags = {name: layer.few for name, layer in result.layers.items()}
    assert flags["bounce.over.total"].any()
    for name in flags:
        if ".delay." in name:
            np.testing.assert_array_equal(flags[name], flags[name.rpartition(".delay")[0] + ".total"])
    plot = pytest.importorskip("morgana.plot")
    result.write(tmp_path / "tagged.exr")
    for picture in (result, morgana.read(tmp_path / "tagged.exr")):
        shown = plot.image(picture, layer="bounce.over.delay.2", show="few").get_array()
        np.testing.assert_array_equal(shown, flags["bounce.over.total"][:, :, 0])


def test_tagged_meters_need_sound_and_records():
    silent = scene()
    silent["fog"]["ior"] = 1.33
    with pytest.raises(morgana.SceneError, match="no medium has sound"):
        load(silent)
    without = scene()
    without["ball"]["meter"]["records"] = False
    with pytest.raises(morgana.SceneError, match="'records' set to true"):
        load(without)


def test_mistakes_are_named():
    light = records([1.0], [0.3])
    with pytest.raises(ValueError, match="wavelength must be finite and positive"):
        correlation.tagged(light, wavelength=-1.0)
    with pytest.raises(ValueError, match="orders"):
        correlation.tagged(light, wavelength=WAVELENGTH, orders=0)
    with pytest.raises(ValueError, match="set 'tagged'"):
        correlation.tagged(light._replace(index_modulation=None), wavelength=WAVELENGTH)
    with pytest.raises(ValueError, match="1 records is unknown"):
        correlation.tagged(light._replace(index_modulation=np.array([np.nan + 0j])), wavelength=WAVELENGTH)
    with pytest.raises(ValueError, match="'where'"):
        correlation.tagged(light, wavelength=WAVELENGTH, where=[True, False])
    with pytest.raises(ValueError, match="delays"):
        correlation.correlate_tagged(light, [-1.0], wavelength=WAVELENGTH, frequency=1e6)
    with pytest.raises(ValueError, match="frequency"):
        correlation.correlate_tagged(light, [1.0], wavelength=WAVELENGTH, frequency=0)
    for call, said in [
        (lambda: correlation.tagged(light, wavelength=WAVELENGTH, orders=2.5), "orders is 2.5 but must be a whole number"),
        (lambda: correlation.tagged(light, wavelength="532 nm"), "wavelength must be an array of real numbers"),
        (lambda: correlation.tagged([1.0], wavelength=WAVELENGTH), "expected Records, found list"),
        (lambda: correlation.correlate_tagged(light, ["soon"], wavelength=WAVELENGTH, frequency=1e6), "delays must be an array of real numbers"),
        (lambda: correlation.correlate_tagged(light, [0.0], wavelength=WAVELENGTH, frequency="1 MHz"), "frequency must be a number.* '1 MHz'"),
        (lambda: correlation.modulation_depth(light), "expected layers or a reading, found Records"),
    ]:
        with pytest.raises(TypeError, match=said):
            call()
