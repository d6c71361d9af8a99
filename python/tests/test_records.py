"""Records of detected light: they agree with meters, also in files, and predict other absorption."""

import zipfile

import morgana
import numpy as np
import pytest
from morgana import coherence, correlation

PARTICLES = 4000


def scene(**more):
    tissue = {
        "type": "labels", "data": np.array([1, 1, 2, 2], np.uint8).reshape(4, 1, 1), "to_world": [{"scale": [4, 4, 4]}],
        "properties": np.array([[0, 0, 1, 1], [0.1, 1, 0.5, 1.4], [0.3, 2, 0.8, 1.4]]),
        "skin": {"type": "irradiancemeter", "id": "skin", "records": True, **more},
    }
    beam = {"type": "collimated", "radius": 0.5, "power": 2.0, "to_world": [{"translate": [2, 2, -1]}]}
    return morgana.load_dict({"type": "scene", "integrator": {"type": "particle"}, "tissue": tissue, "beam": beam})


@pytest.fixture(scope="module")
def measured():
    return morgana.render(scene(), particles=PARTICLES, seed=4)


def test_records_say_what_the_meter_says(measured):
    records = measured.records["skin"]
    power = measured.meters["power"]
    assert (records.unit, records.particles) == ("W", measured.stats["particles"])
    for side in (0, 1):
        part = records.power(records.side == side)
        np.testing.assert_allclose(part.mean, power.mean[side], rtol=1e-12)
        np.testing.assert_allclose(part.error, power.error[side], rtol=1e-3, atol=1e-6)
        np.testing.assert_allclose(part.effective, power.effective[side], rtol=1e-9)
        assert part.few[0] == power.few[side]
    assert records.regions[-2:] == ["tissue: label 1", "tissue: label 2"]
    np.testing.assert_allclose(records.mu_a[-2:, 0], [0.1, 0.3])
    assert "passages of" in repr(records)


def test_other_absorption(measured):
    records = measured.records["skin"]
    same = records.rescaled({"tissue: label 2": 0.3})
    np.testing.assert_allclose(same.weight, records.weight)
    clear = records.rescaled({"tissue: label 1": 0, "tissue: label 2": 0})
    lengths = records.path_length[:, -2:]
    np.testing.assert_allclose(clear.weight[:, 0], records.weight[:, 0] * np.exp(lengths @ [0.1, 0.3]))
    # Without absorption all entering light leaves: within 4 standard errors (6e-5).
    out, into = (clear.power(clear.side == side) for side in (0, 1))
    assert abs(out.mean[0] - into.mean[0]) < 4 * out.error[0]
    assert out.error[0] < 0.1
    with pytest.raises(ValueError, match="no region 'label 3': the records have .*'tissue: label 2'"):
        records.rescaled({"label 3": 0})
    with pytest.raises(ValueError, match="must be finite and not negative"):
        records.rescaled({"tissue: label 1": -1})


def test_averages_over_the_light(measured):
    records = measured.records["skin"]
    out = records.side == 0
    lengths = records.average("path_length", out)
    assert lengths.shape == (3, 1) and lengths.names["region"] == records.regions and lengths.unit == "unit"
    # The derivative by μa is minus the power times the mean length.
    power, rows = records.power(out), records.jacobian(where=out)
    np.testing.assert_allclose(lengths.mean, -rows.mu_a / power.mean, rtol=1e-12)
    label = lengths.sel(region="tissue: label 2", channel=0)
    column = records.path_length[:, 2]
    assert float(label) == pytest.approx(float(records.average(column, out).mean[0])) and label.shape == ()
    # The factor by which the power falls with the absorption.
    factor = records.average(np.exp(-0.2 * column), out)
    darker = records.rescaled({"tissue: label 2": 0.5}).power(out)
    np.testing.assert_allclose(factor.mean * power.mean, darker.mean, rtol=1e-12)
    # A constant has no error, and no light has no mean.
    constant = records.average(np.full(len(records), 3.0))
    np.testing.assert_allclose([constant.mean[0], constant.error[0]], [3, 0], atol=1e-12)
    assert np.isnan(records.average("optical_length", np.zeros(len(records), bool)).mean).all()
    assert records.average("direction").coordinates["xyz"].tolist() == ["x", "y", "z"]
    with pytest.raises(KeyError, match="no column 'length': there are 'optical_length'"):
        records.average("length")
    with pytest.raises(ValueError, match=r"the values have the shape \(2,\) but must be one or more for each of the"):
        records.average([1.0, 2.0])


def test_errors_of_averages(measured):
    """The scatter of 20 groups of particles estimates the error to 16 %: χ² with 19 degrees of freedom leaves 0.51 to 1.55
    with a probability of 1e-3."""
    records = measured.records["skin"]
    groups = 20
    means = [records[records.particle % groups == i].average("path_length").mean[1, 0] for i in range(groups)]
    expected = np.std(means, ddof=1) / np.sqrt(groups)
    assert 0.51 < expected / records.average("path_length").error[1, 0] < 1.55


def test_where_is_a_mask(measured):
    records = measured.records["skin"]
    some = records.optical_length > 5
    assert records.power(some.tolist()) == records.power(some)
    for call in (records.power, lambda where: records.jacobian(where=where)):
        with pytest.raises(ValueError, match="'where' must be an array of True and False, one for each record, not of type int64"):
            call(np.argsort(records.optical_length))
        with pytest.raises(ValueError, match=r"for each of \d+ records, but has the shape \(3,\)"):
            call([True, False, True])


def test_all_that_is_made_of_records_takes_a_mask(measured):
    records = measured.records["skin"]
    leaving = records.side == 0
    n = len(leaving)
    tagged = records._replace(index_modulation=np.linspace(0, 1e-4, n) + 0j, displacement_modulation=np.zeros(n, complex))
    light = {"wavelength": 785e-6, "index": 1.4}
    motion = {"tissue: label 2": correlation.brownian(1e-7)}
    for call in (
        lambda of, **some: correlation.correlate(of, [1e-5], motion, **light, **some),
        lambda of, **some: correlation.speckle_contrast(of, [1e-3], motion, **light, **some),
        lambda of, **some: correlation.tagged(of, wavelength=785e-6, **some),
        lambda of, **some: correlation.correlate_tagged(of, [1e-7], wavelength=785e-6, frequency=1e6, **some),
        lambda of, **some: coherence.a_scan(of, [6.0, 8.0], coherence.gaussian(0.5, 0.1), **some),
    ):
        found, zeroed = call(tagged, where=leaving), call(tagged._replace(weight=records.weight * leaving[:, None]))
        assert found != call(tagged)
        for ours, theirs in zip(found, zeroed):
            np.testing.assert_allclose(ours, theirs, rtol=1e-9)
        with pytest.raises(ValueError, match=r"for each of \d+ records"):
            call(tagged, where=leaving[1:])
    film = morgana.Image({"": np.ones((1, 1, 1), np.float32)}, {"": ["Y"]}, {})
    with pytest.raises(ValueError, match="'where' selects records"):
        coherence.a_scan(film, [6.0], coherence.gaussian(0.5, 0.1), where=leaving)


def test_wavelengths_of_other_units_are_doubted(measured):
    """Light travels about half a millimetre between scatterings."""
    records = measured.records["skin"]
    n = len(records.particle)
    tagged = records._replace(index_modulation=np.linspace(0, 1e-4, n) + 0j, displacement_modulation=np.zeros(n, complex))
    motion = {"tissue: label 2": correlation.brownian(1e-7)}
    for call in (
        lambda wavelength: correlation.correlate(tagged, [1e-5], motion, wavelength=wavelength, index=1.4),
        lambda wavelength: correlation.speckle_contrast(tagged, [1e-3], motion, wavelength=wavelength, index=1.4),
        lambda wavelength: correlation.tagged(tagged, wavelength=wavelength),
        lambda wavelength: correlation.correlate_tagged(tagged, [1e-7], wavelength=wavelength, frequency=1e6),
    ):
        for wavelength in (785e-6, [785e-6], 0.1):
            call(wavelength)
        for wavelength in (785.0, [785.0]):
            with pytest.warns(morgana.SceneWarning, match="wavelength of 785 is longer than light goes between scatterings.* in scene units") as caught:
                call(wavelength)
            assert caught[0].filename == __file__


@pytest.mark.parametrize("particles", [0, 1])
def test_too_few_particles_have_no_error(measured, particles):
    kept = measured.records["skin"]
    columns = {name: getattr(kept, name)[:particles] for name in kept._fields if isinstance(getattr(kept, name), np.ndarray) and name != "mu_a"}
    records = kept._replace(**columns, particles=particles)
    for power in (records.power(), records.gated([0, 10, 1000])):
        assert np.all(np.isinf(power.error)) and np.all(power.few)
        np.testing.assert_allclose(power.mean.sum(axis=0), records.weight.sum())
    assert np.isinf(records.jacobian().mu_a_error).all()
    found = correlation.correlate(records, [0.0], {}, wavelength=785e-6, index=1.4)
    assert np.isinf(found.error).all() and found.mean[0, 0] == records.weight.sum()


@pytest.mark.parametrize("end", ["npz", "h5"])
def test_files_keep_records(measured, tmp_path, end):
    path = tmp_path / f"skin.{end}"
    measured.write(path)
    assert morgana.Records.load(path) == measured.records["skin"]
    with pytest.raises(morgana.FileError, match=r"no records of 'hair': the file has records of \['skin'\]"):
        morgana.Records.load(path, "hair")


def test_files_keep_readings(measured, tmp_path):
    for end in ("h5", "npz"):
        measured.write(tmp_path / f"skin.{end}")
        for name, reading in measured.meters.items():
            assert morgana.Reading.load(tmp_path / f"skin.{end}", name) == reading
    with pytest.raises(morgana.FileError, match="skin.npz: no reading 'fluence': the file has irradiance, optical_moment, power"):
        morgana.Reading.load(tmp_path / "skin.npz", "fluence")
    two = scene(min_bound=0, max_bound=40, bin_width=10), scene(records=False)
    measured = [morgana.render(of, particles=64, seed=4) for of in two]
    measured[0].write(tmp_path / "gates.npz")
    assert morgana.Reading.load(tmp_path / "gates.npz", "binned_power") == measured[0].meters["binned_power"]
    measured[1].write(tmp_path / "none.npz")
    with pytest.raises(morgana.FileError, match="the file has no records: set 'records' of an irradiancemeter"):
        morgana.Records.load(tmp_path / "none.npz")


def test_other_files_say_what_to_do(measured, tmp_path):
    measured.write(tmp_path / "whole.npz")
    whole = (tmp_path / "whole.npz").read_bytes()
    (tmp_path / "half.npz").write_bytes(whole[: len(whole) // 2])
    middle = whole.index(b"\x93NUMPY")
    (tmp_path / "damaged.npz").write_bytes(whole[:middle] + b"\0" + whole[middle + 1 :])
    np.save(tmp_path / "array.npy", np.zeros(3))
    np.savez(tmp_path / "other.npz", a=1)
    np.savez(tmp_path / "metadata.npz", metadata="[]")
    (tmp_path / "text.npz").write_text("no archive")
    for name, said in [
        ("array.npy", "not a readings file: read all readings of one render, which morgana render wrote to an .npz or .h5 file"),
        ("damaged.npz", "the array 'emitted': "),
        ("half.npz", "it is not a readable archive"),
        ("metadata.npz", "files without arrays of numbers"),
        ("missing.npz", "cannot read"),
        ("other.npz", "not a readings file"),
        ("text.npz", "it is not a readable archive"),
    ]:
        for load in (morgana.Records.load, lambda path: morgana.Reading.load(path, "power")):
            with pytest.raises(morgana.FileError, match=f"{name}: .*{said}"):
                load(tmp_path / name)


@pytest.mark.parametrize("compressed", [False, True])
def test_damaged_archives_are_refused(tmp_path, compressed):
    measured = morgana.render(scene(), particles=64, seed=1)
    morgana.write(tmp_path / "whole.npz", measured)
    whole = dict(np.load(tmp_path / "whole.npz"))
    (np.savez_compressed if compressed else np.savez)(tmp_path / "own.npz", **whole)
    with zipfile.ZipFile(tmp_path / "own.npz") as archive:
        member = archive.getinfo("record_weight.npy")
    data = bytearray((tmp_path / "own.npz").read_bytes())
    middle = member.header_offset + 30 + len(member.filename) + 20 + (30 + member.compress_size) // 2
    data[middle] ^= 1
    (tmp_path / "damaged.npz").write_bytes(data)
    with pytest.raises(morgana.FileError, match="record_weight"):
        morgana.Records.load(tmp_path / "damaged.npz")


def test_statistics_have_the_shape_of_their_values(tmp_path):
    morgana.write(tmp_path / "whole.npz", morgana.render(scene(), particles=64, seed=1))
    arrays = dict(np.load(tmp_path / "whole.npz"))
    arrays["power_error"] = arrays["power_error"][:1]
    # Metadata lists the axes of each array.
    del arrays["metadata"]
    np.savez(tmp_path / "cut.npz", **arrays)
    with pytest.raises(morgana.FileError, match="'power_error' has the shape"):
        morgana.Reading.load(tmp_path / "cut.npz", "power")


def test_no_more_than_asked_for():
    measured = morgana.render(scene(max_records=500), particles=PARTICLES, seed=4)
    records = measured.records["skin"]
    assert 100 < len(records.particle) <= 500
    assert records.particles < measured.stats["particles"] / 4
    assert measured.stats["meters"][0]["records"] == {"count": len(records.particle), "particles": records.particles}
    few, all_ = records.power(records.side == 0), measured.meters["power"]
    assert abs(few.mean[0] - all_.mean[0]) < 4 * few.error[0]


def test_no_records_without_a_wish():
    assert morgana.render(scene(records=False), particles=64, seed=4).records == {}


def test_detectors_of_mcx():
    cfg = {
        "vol": np.ones((10, 10, 10), np.uint8), "prop": [[0, 0, 1, 1], [0.01, 1.0, 0.5, 1.37]], "srcpos": [5, 5, 0], "srcdir": [0, 0, 1],
        "issrcfrom0": 1, "nphoton": 2000, "detpos": [[5, 7, 0, 1]], "maxdetphoton": 1000,
    }
    measured = morgana.render(morgana.load_mcx(cfg), seed=1)
    records = measured.records["detector1"]
    assert 0 < len(records.particle) <= 1000
    assert np.all(np.linalg.norm(records.position - [5, 7, 0], axis=1) <= 1)
    np.testing.assert_allclose(records.power().mean, measured.meters["detector1.power"].mean.sum())
    assert measured.meters["cells.fluence"].mean.shape == (10, 10, 10)


def test_stokes_parameters_of_records_and_readings_agree():
    measured = morgana.render(scene(stokes=True), particles=PARTICLES, seed=4)
    records, stokes = measured.records["skin"], measured.meters["power_stokes"]
    assert records.stokes.shape == (len(records.particle), 4, 1)
    assert list(stokes.axes)[:2] == ["stokes", "side"]
    for side in (0, 1):
        of_side = records.stokes[records.side == side].sum(axis=0)[:, 0]
        np.testing.assert_allclose(of_side, stokes.mean[:, side].ravel(), rtol=1e-9, atol=1e-12)
    # Fresnel's equations polarise light at the faces; Henyey-Greenstein's scattering does not.
    assert 0 < np.hypot(records.stokes[:, 1], records.stokes[:, 2]).sum() < records.stokes[:, 0].sum()
    clear = records.rescaled({"tissue: label 2": 0.4})
    np.testing.assert_allclose(clear.stokes, records.stokes * (clear.weight / records.weight)[:, None, :])


def test_only_meters_with_stokes_have_stokes_parameters(measured):
    assert measured.records["skin"].stokes is None
