"""Runs for many values of parameters."""

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
