"""Files of readings, as other libraries read them: pyvista, nibabel, scipy and h5py.

Positions and values are compared with the map of the scene and with the readings themselves, which the formats hold in
double precision. NIfTI holds positions in single precision: 1e-6 of the size of the grid is allowed."""

import json

import morgana
import numpy as np
import pytest
from morgana import _napari

SIZE = (3, 4, 5)
METRES = 1e-3
LIGHT = 299_792_458.0


def turned(mirror=1.0, shear=0.0):
    """A map of the unit cube: scaled, turned about an oblique axis, and moved."""
    axis, angle = np.array([1.0, 2.0, 3.0]) / np.sqrt(14), 0.7
    cross = np.cross(np.eye(3), axis)
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross) @ np.diag([3, 2 * mirror, 5])
    matrix[:3, 1] += shear * matrix[:3, 0]
    matrix[:3, 3] = [-1, 0.5, -2]
    return matrix


def scene(to_world, **more):
    return {
        "type": "scene",
        "integrator": {"type": "particle"},
        "tank": {
            "type": "fluencemeter", "nx": SIZE[0], "ny": SIZE[1], "nz": SIZE[2], "to_world": to_world,
            "film": {"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": "500, 600"},
            "max_bound": 12, "bin_width": 4, "metres_per_unit": METRES, "gruneisen": 0.2, **more,
        },
        "ball": {
            "type": "sphere", "radius": 6, "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "id": "fog", "sigma_s": 0.4, "sigma_a": {"type": "spectrum", "value": [[500, 0.1], [600, 0.3]]}},
        },
        "light": {"type": "point", "position": [0, 1, 0], "intensity": 1.0},
    }  # fmt: skip


@pytest.fixture(scope="module")
def measured():
    return morgana.render(scene(turned()), particles=2000, seed=3)


def centres(to_world):
    """Returns the centres of cells, (z, y, x, 3)."""
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) / n for n in SIZE[::-1]), indexing="ij")
    return np.stack([x, y, z], axis=-1) @ to_world[:3, :3].T + to_world[:3, 3]


def in_space(values):
    """Returns an array (opl, z, y, x, channel) as (x, y, z, opl, channel)."""
    return values.transpose(3, 2, 1, 0, 4)


def test_the_scene_has_light_everywhere(measured):
    fluence = measured.meters["fluence"]
    assert list(fluence.axes) == ["opl", "z", "y", "x", "channel"] and fluence.shape == (3, 5, 4, 3, 2)
    assert (fluence.mean[1] > 0).all() and fluence.metres_per_unit == METRES
    assert np.abs(fluence.mean[..., 0] - fluence.mean[..., 1]).max() > 0


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_pyvista_sees_cells_where_the_scene_has_them(measured, tmp_path, dtype):
    pyvista = pytest.importorskip("pyvista")
    measured.write(tmp_path / "tank.vti", dtype=dtype)
    mesh = pyvista.read(tmp_path / "tank.vti")
    np.testing.assert_allclose(mesh.cell_centers().points, centres(turned()).reshape(-1, 3), atol=1e-6)
    for name, reading in measured.meters.items():
        for of, values in [(name, reading.mean), (f"{name}_error", reading.error)]:
            cells = np.moveaxis(values, 0, 3).reshape(-1, 6)
            assert mesh.cell_data[of].dtype == dtype
            np.testing.assert_array_equal(mesh.cell_data[of], cells.astype(dtype))
    assert mesh.active_scalars_name == "fluence"
    array = mesh.GetCellData().GetAbstractArray("fluence")
    labels = [array.GetComponentName(i) for i in range(6)]
    assert labels[1] == f"time 0.0000e0 to {4 * METRES / LIGHT:.4e}, 600nm"
    np.testing.assert_allclose(mesh.field_data["time_edges"], np.array([0, 4, 8, 12]) * METRES / LIGHT, rtol=1e-12)
    np.testing.assert_array_equal(mesh.field_data["x_edges"], measured.meters["fluence"].axes["x"])
    about = json.loads(mesh.field_data["metadata"][0])
    assert about["arrays"]["fluence"]["unit"] == "J/unit^2" and about["metres_per_unit"] == METRES


@pytest.mark.parametrize("to_world", [turned(), turned(mirror=-1.0), turned(shear=0.3), np.diag([3.0, 2.0, 5.0, 1.0])], ids=["turned", "mirrored", "sheared", "upright"])
@pytest.mark.parametrize("metres", [1.0, 1e-3, 1e-6, 0.01])
def test_nibabel_sees_cells_where_the_scene_has_them(tmp_path, to_world, metres):
    nibabel = pytest.importorskip("nibabel")
    reading = morgana.render(scene(to_world, metres_per_unit=metres), particles=200, seed=3)
    reading.write(tmp_path / "tank.nii.gz")
    image = nibabel.load(tmp_path / "tank.nii.gz")
    unit, factor = {1.0: ("meter", 1), 1e-3: ("mm", 1), 1e-6: ("micron", 1), 0.01: ("mm", 10)}[metres]
    assert image.header.get_xyzt_units() == (unit, "sec")
    cells = np.stack(np.meshgrid(*map(np.arange, SIZE), indexing="ij"), axis=-1)
    found = nibabel.affines.apply_affine(image.affine, cells)
    np.testing.assert_allclose(found, factor * centres(to_world).transpose(2, 1, 0, 3), atol=1e-6 * 6 * factor)
    qform, code = image.header.get_qform(coded=True)
    if to_world[0, 0] and np.allclose(to_world[:3, 0] @ to_world[:3, 1], 0):
        np.testing.assert_allclose(qform, image.affine, atol=1e-6 * 6 * factor)
    else:
        assert code == 0


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("end", ["nii", "nii.gz"])
def test_nibabel_sees_the_values(measured, tmp_path, dtype, end):
    nibabel = pytest.importorskip("nibabel")
    measured.write(tmp_path / f"tank.{end}", dtype=dtype)
    fluence = measured.meters["fluence"]
    for name, values in [("tank", fluence.mean), ("tank_error", fluence.error)]:
        image = nibabel.load(tmp_path / f"{name}.{end}")
        assert image.get_data_dtype() == dtype
        np.testing.assert_array_equal(np.asarray(image.dataobj), in_space(values).astype(dtype))
    header = nibabel.load(tmp_path / f"tank.{end}").header
    assert header["descrip"].item().decode() == "fluence (J/unit^2)" and header["intent_name"].item().decode() == "fluence"
    np.testing.assert_allclose([header.get_zooms()[3], header["toffset"]], [4 * METRES / LIGHT, 2 * METRES / LIGHT], rtol=1e-6)
    about = json.loads(header.extensions[0].get_content().decode() if isinstance(header.extensions[0].get_content(), bytes) else header.extensions[0].get_content())
    np.testing.assert_allclose(about["edges"]["time"], np.array([0, 4, 8, 12]) * METRES / LIGHT)
    assert about["channels"] == "500nm 600nm"


def test_matlab_files(measured, tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    measured.write(tmp_path / "tank.mat", dtype="float32")
    found = scipy_io.loadmat(tmp_path / "tank.mat")
    fluence = measured.meters["fluence"]
    assert found["fluence"].dtype == np.float32 and found["x_edges"].dtype == np.float64
    np.testing.assert_array_equal(found["fluence"], in_space(fluence.mean).astype(np.float32))
    np.testing.assert_array_equal(found["p0_error"], in_space(measured.meters["p0"].error).astype(np.float32))
    np.testing.assert_allclose(found["to_world"], turned()[:3], rtol=1e-12)
    np.testing.assert_array_equal(found["opl_edges"], [[0, 4, 8, 12]])
    assert json.loads(found["metadata"][0])["arrays"]["fluence"] == {"unit": "J/unit^2", "axes": ["opl", "z", "y", "x", "channel"]}


@pytest.mark.parametrize("end", ["npz", "h5", "mat"])
def test_files_give_equal_readings_and_records(tmp_path, end):
    pytest.importorskip("scipy")
    several = scene(turned())
    several["ball"]["skin"] = {"type": "irradiancemeter", "id": "skin", "records": True}
    measured = morgana.render(several, particles=200, seed=3)
    measured.write(tmp_path / f"all.{end}")
    assert {name: morgana.Reading.load(tmp_path / f"all.{end}", name) for name in measured.meters} == dict(measured.meters)
    assert morgana.Records.load(tmp_path / f"all.{end}", "skin") == measured.records["skin"]


@pytest.mark.parametrize("end", ["npz", "h5", "mat"])
def test_files_of_one_reading_keep_the_power_and_the_origin(measured, tmp_path, end):
    pytest.importorskip("scipy")
    fluence = measured.meters["fluence"]
    # A point light of 1 W/sr, in two channels.
    np.testing.assert_allclose(fluence.emitted, [4 * np.pi, 4 * np.pi])
    np.testing.assert_allclose(fluence.sum("channel").emitted, [8 * np.pi])
    half = (2 * fluence).isel(x=slice(1, 3), channel=1)
    half.write(tmp_path / f"half.{end}", name="fluence")
    back = morgana.Reading.load(tmp_path / f"half.{end}", "fluence")
    np.testing.assert_allclose(back.axes_to_world, half.axes_to_world, rtol=1e-14)
    assert back._replace(axes_to_world=None) == half._replace(axes_to_world=None) and back.emitted.shape == (1,)
    with pytest.raises(ValueError, match="the run with the seed 3"):
        back - half
    other = morgana.render(scene(turned()), particles=200, seed=4).meters["fluence"]
    assert (fluence - other).emitted is not None
    assert (fluence - other._replace(emitted=2 * other.emitted)).emitted is None
    (fluence - other).write(tmp_path / f"change.{end}")
    with pytest.raises(ValueError, match="the run with the seed 3 and the run with the seed 4"):
        morgana.Reading.load(tmp_path / f"change.{end}", "reading") + (fluence - other)


def test_matlab_files_of_other_programs_are_no_readings(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "other.mat", {"emitted": np.ones(2), "fluence": np.ones((2, 2)), "fluence_error": np.ones((2, 2))})
    with pytest.raises(morgana.FileError, match="no text 'metadata' with the names of axes"):
        morgana.Reading.load(tmp_path / "other.mat", "fluence")
    about = {"arrays": {"fluence": {"axes": ["z", "y", "x"], "unit": "W"}}}
    scipy_io.savemat(tmp_path / "flat.mat", {"emitted": np.ones(2), "fluence": np.ones((2, 2)), "metadata": json.dumps(about)})
    with pytest.raises(morgana.FileError, match="'fluence' has 2 dimensions, but its metadata list the axes z, y, x"):
        morgana.Reading.load(tmp_path / "flat.mat", "fluence")


def test_hdf5_files(measured, tmp_path):
    h5py = pytest.importorskip("h5py")
    measured.write(tmp_path / "tank.h5", dtype="float32")
    with h5py.File(tmp_path / "tank.h5") as file:
        assert file["fluence"].dtype == np.float32 and file["to_world"].dtype == np.float64
        np.testing.assert_array_equal(file["fluence"], measured.meters["fluence"].mean.astype(np.float32))
        assert float(file.attrs["metres_per_unit"]) == METRES
    back = morgana.Reading.load(tmp_path / "tank.h5", "fluence")
    assert back.metres_per_unit == METRES and np.array_equal(back.axes_to_world, measured.meters["fluence"].axes_to_world)


def test_readings_are_written_like_results(measured, tmp_path):
    """Also after arithmetic and selection, with the place of the selected cells."""
    nibabel, pyvista = pytest.importorskip("nibabel"), pytest.importorskip("pyvista")
    fluence = measured.meters["fluence"]
    half = (2 * fluence).isel(x=slice(1, 3), z=slice(2, 5), opl=1, channel=0)
    half.write(tmp_path / "half.vti", name="fluence", dtype="float32")
    mesh = pyvista.read(tmp_path / "half.vti")
    np.testing.assert_allclose(mesh.cell_centers().points, centres(turned())[2:, :, 1:].reshape(-1, 3), atol=1e-6)
    np.testing.assert_array_equal(mesh.cell_data["fluence_error"], half.error.ravel().astype(np.float32))
    half.write(tmp_path / "half.nii.gz")
    image = nibabel.load(tmp_path / "half.nii.gz")
    np.testing.assert_array_equal(image.get_fdata(), half.mean.transpose(2, 1, 0))
    np.testing.assert_allclose(image.affine[:3, 3], centres(turned())[2, 0, 1], atol=1e-5)
    half.write(tmp_path / "half.npz", name="fluence")
    assert morgana.Reading.load(tmp_path / "half.npz", "fluence") == half


def test_formats_that_cannot_hold_a_reading_name_those_that_can(measured, tmp_path):
    fluence = measured.meters["fluence"]
    with pytest.raises(morgana.FileError, match=r"axes opl, y, x, channel, .*: write \.npz, \.h5 or \.mat"):
        fluence.isel(z=0).write(tmp_path / "a.vti")
    uneven = fluence._replace(axes={**fluence.axes, "x": np.array([0.0, 1.0, 1.5, 3.0])})
    for end in ("vti", "nii", "nii.gz", "nrrd"):
        with pytest.raises(morgana.FileError, match=r"unequal cells of 'reading' along x: write \.npz, \.h5 or \.mat"):
            uneven.write(tmp_path / f"a.{end}")
    uneven.write(tmp_path / "a.mat")
    rings = scene(np.eye(4), coordinates="cylindrical", nr=3)
    del rings["tank"]["nx"], rings["tank"]["ny"]
    with pytest.raises(morgana.FileError, match=r"axes opl, z, r, channel, .*: write \.npz, \.h5 or \.mat"):
        morgana.render(rings, particles=20).write(tmp_path / "a.nii.gz")
    with pytest.raises(ValueError, match="float32 or float64, not int8"):
        measured.write(tmp_path / "a.vti", dtype="int8")
    with pytest.raises(morgana.FileError, match="as a number of type float32"):
        (1e200 * fluence).write(tmp_path / "a.vti", dtype="float32")
    assert [path.name for path in tmp_path.iterdir()] == ["a.mat"]


def test_one_meter_of_several_is_chosen(tmp_path):
    several = scene(turned())
    several["ball"]["skin"] = {"type": "irradiancemeter"}
    measured = morgana.render(several, particles=200)
    with pytest.raises(morgana.FileError, match="choose a meter, or use .npz, .h5 or .mat"):
        measured.write(tmp_path / "a.vti")
    with pytest.raises(KeyError, match="no meter 'tnak'"):
        measured.write(tmp_path / "a.vti", meter="tnak")
    measured.write(tmp_path / "a.npz", meter="tank")
    assert morgana.Reading.load(tmp_path / "a.npz", "fluence") == measured.meters["tank.fluence"]
    measured.write(tmp_path / "all.mat")
    assert "tank_fluence" in pytest.importorskip("scipy.io").loadmat(tmp_path / "all.mat")


def test_napari_gets_layers_where_the_scene_has_them(measured, tmp_path):
    measured.write(tmp_path / "tank.npz")
    reader = _napari.get_reader(str(tmp_path / "tank.npz"))
    layers = {about["name"]: (data, about) for data, about, kind in reader(str(tmp_path / "tank.npz")) if kind == "image"}
    assert {f"fluence {channel}{what}" for channel in ("500nm", "600nm") for what in ("", " error")} < set(layers)
    assert [name for name, (_, about) in layers.items() if about["visible"]] == ["fluence 500nm"] and len(layers) == 12
    assert next(iter(layers)) == "fluence 500nm"
    low, high = layers["fluence 500nm"][1]["contrast_limits"]
    assert low == 0 and np.mean(layers["fluence 500nm"][0] <= high) == pytest.approx(0.99, abs=0.01)
    data, about = layers["fluence 600nm"]
    np.testing.assert_array_equal(data, measured.meters["fluence"].mean[..., 1])
    assert about["axis_labels"] == ("opl", "z", "y", "x") and about["units"] == ("s", "mm", "mm", "mm")
    found = np.array([about["affine"] @ [2, k, j, i, 1] for k, j, i in np.ndindex(*SIZE[::-1])])
    np.testing.assert_allclose(found[:, 0], 10 * METRES / LIGHT)
    np.testing.assert_allclose(found[:, [3, 2, 1]], centres(turned()).reshape(-1, 3), atol=1e-12)
    np.savez(tmp_path / "other.npz", a=np.ones(3))
    assert _napari.get_reader(str(tmp_path / "other.npz")) is None and _napari.get_reader(["a", "b"]) is None


def test_the_program_writes_equal_files(program, tmp_path):
    described = scene(turned().tolist())
    (tmp_path / "tank.json").write_text(json.dumps(described))
    told = program("render", "tank.json", "--particles", 2000, "--seed", 3, "--type", "float32", "-o", "a.vti", "-o", "a.nii.gz", "-o", "a.mat")
    assert "wrote a.vti, a.nii.gz, a_error.nii.gz, a.mat" in told
    measured = morgana.render(morgana.load_file(tmp_path / "tank.json"), particles=2000, seed=3)
    pyvista, nibabel = pytest.importorskip("pyvista"), pytest.importorskip("nibabel")
    fluence = measured.meters["fluence"]
    np.testing.assert_array_equal(pyvista.read(tmp_path / "a.vti").cell_data["fluence"], np.moveaxis(fluence.mean, 0, 3).reshape(-1, 6).astype(np.float32))
    np.testing.assert_array_equal(np.asarray(nibabel.load(tmp_path / "a_error.nii.gz").dataobj), in_space(fluence.error).astype(np.float32))
