"""Amplitude and phase of modulated light, by meters and by records (docs/meters.md#modulated-light)."""

import numpy as np
import pytest

import morgana

FREQUENCIES = [100e6, 400e6]
MU_A, MU_S = 0.02, 1.0


def scene(more=None, **meter):
    """Light that leaves a block through its faces, in scene units of mm."""
    faces = {"type": "irradiancemeter", "id": "faces", "parts": True, "records": True, "metres_per_unit": 1e-3, "modulation_frequencies": FREQUENCIES}
    return morgana.load_dict({
        "type": "scene",
        "integrator": {"type": "particle"},
        "block": {
            "type": "cube", "to_world": [{"scale": [10, 10, 5]}, {"translate": [0, 0, 5]}], "bsdf": {"type": "dielectric"},
            "interior": {"type": "homogeneous", "sigma_a": MU_A, "sigma_s": MU_S, "ior": 1.4, "phase": {"type": "hg", "g": 0.3}},
            "faces": {**faces, **meter},
        },
        "source": {"type": "collimated", "radius": 0.1, "power": 2.0, "to_world": [{"translate": [0, 0, -1]}]},
        **(more or {}),
    })


@pytest.fixture(scope="module")
def measured():
    return morgana.render(scene(), particles=4_000, seed=3)


def test_records_and_meters_are_the_same_light(measured):
    records, amplitude, phase = measured.records["faces"], measured.meters["power_amplitude"], measured.meters["power_phase"]
    assert amplitude.unit == "W" and phase.unit == "rad"
    top = np.isclose(records.position[:, 2], 10)
    found = records.modulated(FREQUENCIES, metres_per_unit=1e-3, where=top & (records.side == 0))
    of_meter = {"side": 0, "part": 5}
    for mine, theirs in ((found.amplitude, amplitude), (found.phase, phase)):
        theirs = theirs.sel(**of_meter)
        assert np.allclose(mine.mean[:, 0], theirs.mean, rtol=1e-9)
        assert np.allclose(mine.error[:, 0], theirs.error, rtol=1e-6)
    assert found.amplitude.unit == "W" and found.phase.names["frequency"] == FREQUENCIES
    assert not found.phase.few.any()
    # Light lags behind, farther at the higher frequency, and is modulated less.
    assert 0 < found.phase.mean[0, 0] < found.phase.mean[1, 0]
    assert found.amplitude.mean[0, 0] > found.amplitude.mean[1, 0]


def test_readings_have_frequencies(measured, tmp_path):
    phase = measured.meters["power_phase"]
    assert phase.names["frequency"] == FREQUENCIES and list(phase.axes)[0] == "frequency"
    high = phase.sel(frequency=400e6, side=0, part=5)
    assert high.mean == phase.mean[1, 0, 5]
    for name in ("a.npz", "a.h5"):
        measured.write(tmp_path / name)
        again = morgana.Reading.load(tmp_path / name, "power_phase")
        assert np.array_equal(again.mean, phase.mean) and again.names == phase.names
    phase.write(tmp_path / "b.npz", name="lag")
    assert morgana.Reading.load(tmp_path / "b.npz", "lag").names["frequency"] == FREQUENCIES


def test_readings_per_watt_keep_phases():
    per_watt, absolute = (morgana.render(scene(normalization=of), particles=500, seed=1).meters for of in ("per_watt", "absolute"))
    assert np.allclose(2 * per_watt["power_amplitude"].mean, absolute["power_amplitude"].mean)
    assert np.array_equal(per_watt["power_phase"].mean, absolute["power_phase"].mean)
    assert per_watt["power_amplitude"].unit == "1" and per_watt["power_phase"].unit == "rad"


def test_derivatives_of_records_are_differences(measured):
    records = measured.records["faces"]
    name, step = "homogeneous", 1e-4
    region = records.regions.index(name)
    where = records.side == 0
    rows = records.modulated_jacobian(FREQUENCIES, metres_per_unit=1e-3, mu_s={name: MU_S}, where=where)
    length, number = records.path_length[:, region], records.scatterings[:, region]

    def at(by_mu_a, by_mu_s):
        factor = np.exp(-(by_mu_a + by_mu_s) * length) * (1 + by_mu_s / MU_S) ** number
        light = records._replace(weight=records.weight * factor[:, None]).modulated(FREQUENCIES, metres_per_unit=1e-3, where=where)
        return np.log(light.amplitude.mean), light.phase.mean

    for coefficient, direction in (("mu_a", (1, 0)), ("mu_s", (0, 1))):
        up, down = (at(*(sign * step * np.array(direction))) for sign in (1, -1))
        for of, plus, minus in ((rows.log_amplitude, up[0], down[0]), (rows.phase, up[1], down[1])):
            found = of.sel(coefficient=coefficient, region=name)
            assert np.allclose(found.mean, (plus - minus) / (2 * step), rtol=1e-4)
            assert (found.error > 0).all()


def test_errors_of_derivatives_are_their_spread():
    """The standard deviation of 40 normal numbers deviates from 1 by more than 0.45 once in 10⁴."""
    runs = [morgana.render(scene(), particles=640, seed=seed).records["faces"] for seed in range(40)]
    name = "homogeneous"
    rows = [of.modulated_jacobian(FREQUENCIES, metres_per_unit=1e-3, mu_s={name: MU_S}, where=of.side == 0) for of in runs]
    for of in ("log_amplitude", "phase"):
        found = [getattr(row, of).sel(region=name) for row in rows]
        spread = np.std([one.mean for one in found], axis=0, ddof=1)
        stated = np.sqrt(np.mean([one.error**2 for one in found], axis=0))
        assert (np.abs(spread / stated - 1) < 0.45).all(), (of, spread / stated)


def test_jacobians_agree_with_records():
    """Two estimators of derivatives by the absorption; |z| of 4 values exceeds 3.9 once in 2500."""
    region = "homogeneous"
    records = morgana.render(scene(parts=False), particles=20_000, seed=5).records["faces"]
    rows = records.modulated_jacobian(FREQUENCIES, metres_per_unit=1e-3, where=records.side == 0)
    light = records.modulated(FREQUENCIES, metres_per_unit=1e-3, where=records.side == 0)
    name, plain = f"{region}.sigma_a", scene(parts=False)
    for reading, expected, scale in (("power_phase", rows.phase, 1), ("power_amplitude", rows.log_amplitude, light.amplitude.mean[:, 0])):
        found = morgana.jacobian(plain, [name], reading, particles=20_000, seed=6)[name]
        assert found.names["frequency"] == FREQUENCIES
        mine, theirs = found.value[:, 0].reshape(2), expected.sel(coefficient="mu_a", region=region).mean[:, 0] * scale
        error = np.hypot(found.error[:, 0].reshape(2), expected.sel(coefficient="mu_a", region=region).error[:, 0] * scale)
        assert (np.abs(mine - theirs) < 3.9 * error).all(), (mine, theirs, error)


def test_mistakes(measured):
    records = measured.records["faces"]
    for frequencies in ([], [-1.0], [np.inf], [[1e8]]):
        with pytest.raises(ValueError, match="frequencies"):
            records.modulated(frequencies, metres_per_unit=1e-3)
    with pytest.raises(ValueError, match="metres_per_unit"):
        records.modulated([1e8], metres_per_unit=0)
    with pytest.raises(morgana.SceneError, match="metres_per_unit"):
        morgana.load_dict({"type": "scene", "meter": {"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1, "modulation_frequencies": [1e8]}})
