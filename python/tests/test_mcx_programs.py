"""``morgana mcx`` as other programs call it: files read by jdata, an independent library, and a simulation of SIMPA."""

import json

import morgana
import numpy as np
import pytest
from conftest import PROGRAM

SIZE = (12, 8, 10)


def simpa_input(folder, photons):
    """Writes the input that SIMPA 1.0 writes for a slit over a layered volume, and returns the command line that SIMPA runs."""
    mua = np.full(SIZE, 0.02)
    mua[:, :, 5:] = 0.2
    mus = np.full(SIZE, 5.0)
    np.stack([mua, mus], axis=-1, dtype=np.float32).tofile(folder / "volume.bin")
    (folder / "volume.json").write_text(json.dumps({
        "Session": {"ID": str(folder / "volume_output"), "DoAutoThread": 1, "Photons": float(photons), "DoMismatch": 0, "RNGSeed": 471},
        "Forward": {"T0": 0, "T1": 5e-9, "Dt": 5e-9},
        "Optode": {"Source": {
            "Type": "slit", "Pos": [3.5, 4.5, 0.5], "Dir": [0.0, 0.0, 1.0], "Param1": [6.0, 0.0, 0.0, 0], "Param2": [0, 0, 0, 0],
        }},
        "Domain": {
            "OriginType": 0, "LengthUnit": 0.5, "MediaFormat": "muamus_float", "Dim": SIZE, "VolumeFile": str(folder / "volume.bin"),
            "Media": [{"mua": 0, "mus": 0, "g": 1, "n": 1}, {"mua": 1, "mus": 1, "g": 0.9, "n": 1}],
        },
    }))
    return ["mcx", "-f", folder / "volume.json", "-O", "F", "-a", "1", "-F", "jnii"], mua, mus


def test_the_files_of_simpa_are_read_by_jdata(tmp_path, program):
    jdata = pytest.importorskip("jdata")
    command, mua, mus = simpa_input(tmp_path, 2000)
    program(*command)
    fluence = jdata.load(str(tmp_path / "volume_output.jnii"))["NIFTIData"]
    assert fluence.dtype == np.float32
    fluence = fluence.reshape(*fluence.shape[:2], -1)                         # as in SIMPA
    assert fluence.shape == SIZE
    # The same run by the library: equal seeds give equal values.
    scene = morgana.load_mcx({
        "vol": np.stack([mua, mus]).astype(np.float32), "prop": [[0, 0, 1, 1], [1, 1, 0.9, 1]], "nphoton": 2000, "unitinmm": 0.5, "isreflect": 0,
        "srctype": "slit", "srcpos": [3.5, 4.5, 0.5], "srcdir": [0, 0, 1], "srcparam1": [6, 0, 0, 0], "srcparam2": [0, 0, 0, 0],
    })
    expected = morgana.render(scene, seed=471).meters["fluence"].mean.transpose(2, 1, 0)
    np.testing.assert_allclose(fluence, expected, rtol=1e-6)
    # Absorbed energy: at most all of it, and most of it in the layer that absorbs more.
    absorbed = fluence * mua * 0.5**3
    assert 0.05 < absorbed.sum() < 1


def test_detected_photons_are_read_by_jdata(tmp_path, program):
    jdata = pytest.importorskip("jdata")
    cube = {
        "Session": {"ID": "cube", "Photons": 3000, "RNGSeed": 3},
        "Forward": {"T0": 0, "T1": 5e-9, "Dt": 5e-9},
        "Optode": {"Source": {"Type": "pencil", "Pos": [5, 5, 0], "Dir": [0, 0, 1]}, "Detector": [{"Pos": [5, 5, 10], "R": 3}]},
        "Domain": {"OriginType": 1, "LengthUnit": 0.5, "Dim": [10, 10, 10], "Media": [[0, 0, 1, 1], [0.02, 1, 0.5, 1.37]]},
        "Shapes": [{"Grid": {"Tag": 1, "Size": [10, 10, 10]}}],
    }
    (tmp_path / "cube.json").write_text(json.dumps(cube))
    program("mcx", "-f", "cube.json", "-w", "DSPMXV", "-F", "jnii")
    data = jdata.load(str(tmp_path / "cube_detp.jdat"))["MCXData"]
    photons = data["PhotonData"]
    count = data["Info"]["SavedPhoton"]
    assert count > 100 and set(photons["detid"].ravel()) == {1}
    assert photons["p"].shape == photons["v"].shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(photons["v"], axis=1), 1, rtol=1e-5)
    np.testing.assert_allclose(photons["p"][:, 2], 10, rtol=1e-5)
    # Straight light has the length of the cube in voxels, and weight 1 less what the first face reflects.
    shortest = photons["ppath"].ravel().min()
    assert shortest == pytest.approx(10, rel=1e-4)
    program("mcx", "-f", "cube.json", "-w", "DSPMXV", "-F", "bnii")
    pytest.importorskip("bjdata")
    binary = jdata.load(str(tmp_path / "cube_detp.jdb"))["MCXData"]["PhotonData"]
    for name, values in photons.items():
        np.testing.assert_array_equal(binary[name], values)
    text, binary = (jdata.load(str(tmp_path / name))["NIFTIData"] for name in ("cube.jnii", "cube.bnii"))
    np.testing.assert_array_equal(text, binary)


def simpa_simulation(folder, adapter, **optical):
    """Runs SIMPA itself, unchanged, with a link to the program as the path of MCX: a slit over a homogeneous block."""
    sp = pytest.importorskip("simpa")
    tags = sp.Tags
    link = folder / "mcx"
    link.symlink_to(PROGRAM)
    settings = sp.Settings({
        tags.RANDOM_SEED: 471, tags.VOLUME_NAME: "volume", tags.SIMULATION_PATH: str(folder), tags.SPACING_MM: 1.0,
        tags.DIM_VOLUME_X_MM: 52, tags.DIM_VOLUME_Y_MM: 16, tags.DIM_VOLUME_Z_MM: 20, tags.WAVELENGTHS: [798],
        tags.GPU: False, tags.DO_FILE_COMPRESSION: True,
    })
    background = sp.Settings({tags.MOLECULE_COMPOSITION: sp.TISSUE_LIBRARY.constant(0.1, 100, 0.9), tags.STRUCTURE_TYPE: tags.BACKGROUND})
    settings.set_volume_creation_settings({tags.SIMULATE_DEFORMED_LAYERS: False, tags.STRUCTURES: sp.Settings({tags.BACKGROUND: background})})
    more = {getattr(tags, name): value for name, value in optical.items()}
    settings.set_optical_settings({tags.OPTICAL_MODEL_NUMBER_PHOTONS: 2e4, tags.OPTICAL_MODEL_BINARY_PATH: str(link), **more})
    device = sp.PhotoacousticDevice(device_position_mm=np.array([26, 8, 0]))
    device.set_detection_geometry(sp.LinearArrayDetectionGeometry())
    device.add_illumination_geometry(sp.SlitIlluminationGeometry(slit_vector_mm=[10, 0, 0], direction_vector_mm=[0, 0, 1]))
    sp.simulate([sp.ModelBasedAdapter(settings), getattr(sp, adapter)(settings)], settings, device)
    return lambda field: sp.load_data_field(str(folder / "volume.hdf5"), getattr(tags, field), 798)


def test_a_simulation_of_simpa(tmp_path):
    fluence = simpa_simulation(tmp_path, "MCXAdapter")("DATA_FIELD_FLUENCE")
    assert fluence.shape == (52, 16, 20)
    # Light enters in the middle and decays with depth.
    profile = fluence[21:31, 7:9].mean(axis=(0, 1))
    assert profile[2] > profile[8] > profile[18] > 0


def test_the_reflectance_of_simpa(tmp_path):
    """Reflectance in the voxels above the block, against a run of the block as a cube with meters at its faces, at a false-alarm rate of
    1e-3: |z| < 3.3. Also the places and directions of the light that leaves at the upper side in y."""
    read = simpa_simulation(tmp_path, "MCXReflectanceAdapter", COMPUTE_DIFFUSE_REFLECTANCE=True, COMPUTE_PHOTON_DIRECTION_AT_EXIT=True)
    block = morgana.load_dict({
        "type": "scene", "integrator": {"type": "particle"},
        "block": {
            "type": "cube", "to_world": [{"scale": [26, 8, 10]}, {"translate": [26, 8, 10]}], "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_a": 0.01, "sigma_s": 10, "phase": {"type": "hg", "g": 0.9}},
            "faces": {"type": "irradiancemeter", "parts": True},
        },
        "slit": {
            "type": "collimated", "profile": "rectangle", "width": 10, "height": 0.001, "power": 1, "to_world": [{"translate": [25.5, 7.5, -1]}],
        },
    })  # fmt: skip
    faces = morgana.render(block, particles=20_000, seed=6).meters["binned_power"].isel(side=0)
    top = faces.isel(part=4)
    # Voxels have an area of 1 mm². Both runs have equally many particles, and hence equal errors.
    reflectance = read("DATA_FIELD_DIFFUSE_REFLECTANCE").sum()
    assert abs(reflectance - float(top)) < 3.3 * np.sqrt(2) * float(top.error)
    assert set(read("DATA_FIELD_DIFFUSE_REFLECTANCE_POS")[:, 2]) == {0}
    place, direction = read("DATA_FIELD_PHOTON_EXIT_POS"), read("DATA_FIELD_PHOTON_EXIT_DIR")
    np.testing.assert_allclose(place[:, 1], 16, rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1, rtol=1e-5)
    assert (direction[:, 1] > 0).all() and len(place) > 1000
    absorbed = (read("DATA_FIELD_FLUENCE") / 100 * 0.01).sum()
    assert 0.15 < absorbed < 0.23
