"""Sweeps: runs for many values of parameters."""

import concurrent.futures
import multiprocessing

import numpy as np
import pytest

import morgana
import morgana._sweep
from conftest import meters, small


def scene(of=small):
    described = of()
    described["parameters"] = {"density": 0.5, "slope": 0.1, "width": 12}
    described["ball"]["interior"].update(sigma_t="$density", ior={"type": "linear", "n0": 1.3, "slope": [0, "$slope", 0]})
    return described


@pytest.fixture(autouse=True)
def doubts(recwarn):
    import warnings

    warnings.simplefilter("ignore", morgana.SceneWarning)


def test_each_combination_is_the_render_of_its_values():
    found = morgana.sweep(scene(), {"density": [0.25, 0.5, 1.0], "slope": [0.0, 0.1]}, spp=4, seed=3)
    assert found.mean["image"].shape == (3, 2, 8, 12, 3) == found.error["image"].shape == found.few["image"].shape
    assert found.stats.shape == (3, 2) and found.stats[1, 1]["spp"] == 4
    assert list(found.parameters["density"]) == [0.25, 0.5, 1.0]
    one = morgana.render(morgana.load_dict(scene(), density=1.0, slope=0.1), spp=4, seed=3)
    assert np.array_equal(found.mean["image"][2, 1], one.image)
    assert np.array_equal(found.error["image"][2, 1], one.error)


def test_workers_find_the_same(tmp_path):
    wanted = {"density": [0.25, 0.5]}
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = morgana.sweep(scene(), wanted, executor=pool, spp=2)
    assert np.array_equal(found.mean["image"], morgana.sweep(scene(), wanted, spp=2).mean["image"])


def test_meters_and_xarray():
    xarray = pytest.importorskip("xarray")
    found = morgana.sweep(scene(meters), {"density": [0.1, 0.2]}, fixed={"slope": 0.05}, particles=640)
    assert found.mean["fluence"].shape == (2, 2, 3, 4)
    table = found.to_xarray()
    assert isinstance(table, xarray.Dataset)
    assert table["fluence"].dims == ("density", "z", "y", "x")
    assert float(table["absorbed"].sel(density=0.2).sum()) > float(table["absorbed"].sel(density=0.1).sum())
    assert np.allclose(table["x"], [-0.75, -0.25, 0.25, 0.75])
    assert table["fluence_error"].shape == table["fluence"].shape


def test_quantities_of_a_sweep_are_estimates():
    found = morgana.sweep(scene(meters), {"density": [0.1, 0.2], "slope": [0.0, 0.05]}, particles=640)
    assert list(found) == list(found.mean) and len(found) == len(found.mean) and "fluence" in found and "flux" not in found
    fluence = found["fluence"]
    assert list(fluence.axes) == ["density", "slope", "z", "y", "x"] and fluence.unit == found.units["fluence"]
    chosen = 2 * fluence.sel(density=0.2, slope=0.05)
    np.testing.assert_array_equal(chosen.mean, 2 * found.mean["fluence"][1, 1])
    np.testing.assert_array_equal(chosen.error, 2 * found.error["fluence"][1, 1])
    np.testing.assert_array_equal(fluence.sel(density=slice(0.15, None)).coordinates["density"], [0.2])
    with pytest.raises(KeyError, match="no density 0.3: there are 0.1, 0.2"):
        fluence.sel(density=0.3)
    with pytest.raises(ValueError, match="correlated"):
        fluence.isel(density=0) - fluence.isel(density=1)
    with pytest.raises(KeyError, match="no quantity 'flux': there are"):
        found["flux"]
    words = morgana.sweep(scene(), {"width": [4], "density": [0.25]}, spp=2)["image"]
    assert list(words.axes) == ["width", "density", "row", "column", "channel"]


def two_meters(deep=2, gate=40.0, **film):
    """Two meters of one beam, with different cells and gates."""

    def cells(count, depth, last):
        where = [{"scale": [1, 1, 2]}, {"translate": [0, 0, depth]}]
        gates = {"min_bound": 0, "max_bound": last, "bin_width": last / 2}
        return {"type": "fluencemeter", "nx": 1, "ny": 1, "nz": count, "to_world": where, **gates}

    return {
        "type": "scene",
        "parameters": {"mua": 0.1, "z": 1.0, "shift": 0.0, "power": 1.0},
        "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 0.5, "power": "$power", "to_world": [{"translate": [0, 0, -1]}]},
        "tissue": {
            "type": "cube", "to_world": [{"scale": 5}, {"translate": ["$shift", 0, 5]}], "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_s": "$z", "sigma_a": "$mua", "ior": 1.0},
            "faces": {"type": "irradiancemeter", "id": "faces"},
        },
        "near": {**cells(2, 0, 20.0), **({"film": {"type": "hdrfilm", **film}} if film else {})},
        "deep": cells(deep, 6, gate),
    }  # fmt: skip


def test_each_meter_has_its_own_coordinates():
    pytest.importorskip("xarray")
    table = morgana.sweep(two_meters(deep=3), {"mua": [0.1, 0.2]}, particles=64).to_xarray()
    assert table["near.fluence"].dims == ("mua", "near.opl", "near.z", "y", "x")
    assert table["deep.fluence_error"].dims == ("mua", "deep.opl", "deep.z", "y", "x")
    assert table["faces.power"].dims == ("mua", "side")
    np.testing.assert_allclose(table["near.fluence"].coords["near.z"], [0.5, 1.5])
    np.testing.assert_allclose(table["deep.fluence"].coords["deep.z"], [6 + 1 / 3, 7, 7 + 2 / 3])
    np.testing.assert_allclose(table["near.absorbed"].coords["near.opl"], [5, 15])
    np.testing.assert_allclose(table["deep.absorbed"].coords["deep.opl"], [10, 30])
    assert table["near.fluence"].attrs == {"units": "J/unit^2"} == table["near.fluence_error"].attrs
    # Bins with different edges differ, even if their middles are equal.
    edges = {"q": {"z": np.array([0.0, 2.0])}, "r": {"z": np.array([0.5, 1.5])}}
    values = {name: np.zeros((1, 1)) for name in edges}
    apart = morgana.Sweep({"a": np.zeros(1)}, values, values, {}, edges, np.empty(1, object), {}, {"q": [], "r": []}).to_xarray()
    assert apart["q"].dims == ("a", "q.z") and apart["r"].dims == ("a", "r.z")


def test_parameters_may_have_the_names_of_axes_and_quantities():
    pytest.importorskip("xarray")
    table = morgana.sweep(two_meters(), {"z": [1.0, 2.0, 3.0]}, particles=64).to_xarray()
    assert table["near.fluence"].dims == ("z", "near.opl", "near.z", "y", "x")
    np.testing.assert_array_equal(table["z"], [1, 2, 3])
    alone = two_meters()
    del alone["deep"], alone["tissue"]["faces"]
    table = morgana.sweep(alone, {"z": [1.0, 2.0, 3.0]}, particles=64).to_xarray()
    assert table["fluence"].dims == ("z", "opl", "fluence.z", "y", "x") == table["absorbed"].dims
    np.testing.assert_allclose(table["fluence.z"], [0.5, 1.5])
    only = two_meters()
    del only["near"], only["deep"]
    table = morgana.sweep(only, {"power": [1.0, 2.0]}, particles=64).to_xarray()
    assert table["power"].dims == ("parameters.power", "side")
    np.testing.assert_array_equal(table["parameters.power"], [1, 2])


def test_channels_have_names_where_runs_agree():
    pytest.importorskip("xarray")
    described = two_meters(pixel_format="spectral", wavelengths="500, 600")
    table = morgana.sweep(described, {"mua": [0.1, 0.2]}, particles=64).to_xarray()
    assert list(table["near.fluence"].coords["channel"].values) == ["500nm", "600nm"]
    picture = morgana.sweep(scene(), {"slope": [0.0, 0.1]}, spp=1).to_xarray()
    assert list(picture["channel"].values) == ["R", "G", "B"] and picture["image"].attrs == {}
    described["parameters"]["bands"] = "500, 600"
    described["near"]["film"]["wavelengths"] = "$bands"
    found = morgana.sweep(described, {"bands": ["500, 600", "500, 700"]}, particles=64)
    assert found.channels["near.fluence"] == [] and "channel" not in found.to_xarray().coords


def test_bins_that_move_between_runs_have_no_edges():
    pytest.importorskip("xarray")
    described = two_meters()
    described["deep"]["to_world"][1]["translate"] = ["$shift", 0, 6]
    found = morgana.sweep(described, {"shift": [0.0, 0.5]}, particles=64)
    assert found.axes["deep.fluence"]["x"] is None and found.axes["near.fluence"]["x"] is not None
    table = found.to_xarray()
    assert "deep.x" not in table.coords and "near.x" in table.coords


def test_loaded_scenes_vary_by_names_of_their_parameters():
    described = small()
    described["ball"]["interior"]["id"] = "fog"
    loaded = morgana.load_dict(described)
    found = morgana.sweep(loaded, {"fog.sigma_t": [0.25, 1.0], "sky.radiance": [[1, 0.5, 0.25]]}, spp=2, seed=3)
    described["ball"]["interior"]["sigma_t"] = 1.0
    described["sky"]["radiance"] = {"type": "rgb", "value": [1, 0.5, 0.25]}
    assert np.array_equal(found.mean["image"][1, 0], morgana.render(described, spp=2, seed=3).image)
    table = found.to_xarray()
    assert list(table["fog.sigma_t"].values) == [0.25, 1.0] and "sky.radiance" not in table.coords


def test_configurations_of_mcx_vary_by_their_keys():
    cfg = {"vol": np.ones((4, 4, 4), "uint8"), "prop": [[0, 0, 1, 1], [0.05, 1, 0.01, 1.37]], "srcpos": [2, 2, 0], "srcdir": [0, 0, 1], "issrcfrom0": 1}
    found = morgana.sweep(cfg, {"srcpos": [[2, 2, 0], np.array([1, 1, 0])], "source.power": [1.0, 2.0]}, particles=200)
    assert found.mean["fluence"].shape == (2, 2, 4, 4, 4) and list(found.parameters["srcpos"]) == [[2, 2, 0], [1, 1, 0]]
    one = morgana.render({**cfg, "srcpos": [1, 1, 0]}, particles=200)
    assert np.array_equal(found.mean["fluence"][1, 0], one.meters["fluence"].mean)
    # The fluence per joule does not depend on the power of the source.
    np.testing.assert_allclose(found.mean["fluence"][1, 1], found.mean["fluence"][1, 0], rtol=1e-8)
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        again = morgana.sweep(cfg, {"srcpos": [[2, 2, 0], np.array([1, 1, 0])]}, executor=pool, particles=200)
    assert np.array_equal(again.mean["fluence"], found.mean["fluence"][:, 0])


def test_an_interrupt_ends_all(monkeypatch):
    class Interrupted:
        stopped = "interrupted"

    monkeypatch.setattr(morgana._sweep, "render", lambda *_, **__: Interrupted())
    with pytest.raises(KeyboardInterrupt):
        morgana.sweep(scene(), {"density": [0.1, 0.2]})


def test_pictures_as_xarray():
    pytest.importorskip("xarray")
    table = morgana.sweep(scene(), {"slope": [0.0, 0.1]}, spp=2).to_xarray()
    assert table["image"].dims == ("slope", "row", "column", "channel")


def test_pictures_have_their_layers():
    pytest.importorskip("xarray")
    described = scene()
    described["sensor"]["film"].update(decomposition="bounce", max_bounces=1)
    described["integrator"] = {"type": "aov", "aovs": "valid:valid,bend:deflection", "light": {"type": "path"}}
    found = morgana.sweep(described, {"density": [0.25, 0.5]}, spp=2, seed=3)
    one = morgana.render(morgana.load_dict(described, density=0.5), spp=2, seed=3)
    assert found.mean.keys() == found.error.keys() == found.few.keys() == found.axes.keys() == {"image", *one.layers} and len(one.layers) > 3
    for name, layer in one.layers.items():
        assert np.array_equal(found.mean[name][1], layer.mean) and np.array_equal(found.error[name][1], layer.error)
    table = found.to_xarray()
    assert table["bend"].dims == ("density", "row", "column", "bend.channel")
    assert table["image"].dims[-1] == "channel"


def test_what_makes_no_sense_is_refused():
    for wanted in ({}, {"density": []}):
        with pytest.raises(morgana.RenderError, match="at least one value"):
            morgana.sweep(scene(), wanted)
    with pytest.raises(morgana.SceneError):
        morgana.sweep(scene(), {"colour": [1]})
    wide = scene()
    wide["sensor"]["film"]["width"] = "$width"
    with pytest.raises(morgana.RenderError, match="another shape"):
        morgana.sweep(wide, {"width": [4, 5]}, spp=1)
