"""Representations of results in notebooks, and conversion to xarray."""

import base64
import io
import re
from xml.etree import ElementTree

import morgana
import numpy as np
import pytest
from conftest import SCENES, load, meters, small

pytestmark = pytest.mark.filterwarnings("ignore::morgana.SceneWarning")


def gated():
    """A lit ball with a meter of cells and gates, and with records."""
    scene = meters()
    scene["sensor"].update(min_bound=0, max_bound=20, bin_width=1, id="cells")
    scene["ball"]["skin"] = {"type": "irradiancemeter", "records": True, "id": "skin"}
    scene["parameters"] = {"power": 1.0}
    scene["light"]["intensity"] = "$power"
    return scene


def html(shown, *words):
    """Returns the representation, which is well-formed and contains words."""
    text = shown._repr_html_()
    ElementTree.fromstring("<div>" + re.sub(r"(<img [^>]*[^/])>", r"\1/>", text) + "</div>")
    assert all(word in text for word in words), text
    return text


def pixels(text):
    from matplotlib import image

    (png,) = re.findall(r"data:image/png;base64,([^\"]*)", text)
    return image.imread(io.BytesIO(base64.b64decode(png)))


def test_scenes_show_a_small_render(monkeypatch):
    # Independent of the load of the machine.
    monkeypatch.setattr(morgana._preview, "SECONDS", 1000.0)
    assert html(load(small()), "<img", "12 × 8 × 3", "emitters: sky").count("<p>") == 1
    assert pixels(html(load(small()))).shape[:2] == (8, 12)
    assert "<img" not in html(load(meters()), "meters: fluencemeter")
    large = morgana.load_file(SCENES / "luneburg_fog.xml", integrator="path")
    assert pixels(html(large)).shape[:2] == (76, 128) and large.size == (336, 200)


def labelled(data, **media):
    tissue = {"type": "labels", "data": data, "skin": {"type": "irradiancemeter"}, **media}
    return {"type": "scene", "integrator": {"type": "particle"}, "tissue": tissue, "light": {"type": "point", "intensity": 1.0}}


def test_scenes_with_meters_show_labels_media_and_meters(monkeypatch):
    # Nothing is rendered.
    monkeypatch.setattr(morgana._preview, "render", None)
    data = np.ones((4, 6, 8))
    data[2:] = 2
    data[:, 3, 4:] = 0
    text = html(load(labelled(data, properties=np.array([[0, 0, 1, 1], [0.1, 2, 0.9, 1.37], [0.25, 3, 0.8, 1.4]]))), "labels of tissue in the voxels y = 3: z down, x to the right")
    grey, blue, orange = (np.array(colour) / 255 for colour in morgana._pictures.LABELS[:3])
    shown = pixels(text)
    assert shown.shape[:2] == (4, 8)
    np.testing.assert_allclose(shown[:, :4, :3], np.repeat([blue, orange], 2, axis=0)[:, None] * np.ones((1, 4, 1)), atol=1e-6)
    np.testing.assert_allclose(shown[:, 4:, :3], np.broadcast_to(grey, (4, 4, 3)), atol=1e-6)
    assert "tissue: label 2</td><td>0.25</td><td>3</td><td>0.8</td><td>1.4</td>" in text and "label 0" not in text
    assert "<td>irradiancemeter</td><td>power, optical_moment, irradiance</td><td>2 side</td>" in text
    # Media of their own, by number; many labels; a single layer of voxels.
    own = {"2": {"type": "homogeneous", "sigma_a": 0.5, "ior": {"type": "linear", "n0": 1.3, "slope": [0, 0.01, 0]}}, "1": {"type": "homogeneous", "sigma_s": 2}}
    text = html(load(labelled(np.maximum(data, 1), **own)), "varies")
    assert text.index("tissue: label 1") < text.index("tissue: label 2</td><td>0.5")
    many = labelled(np.arange(1, 101).reshape(10, 10, 1), properties=np.repeat([[0.1, 1, 0.9, 1.37]], 101, axis=0))
    assert pixels(html(load(many), "… and 88 more", "x = 0: z down, y to the right")).shape[:2] == (10, 10)
    html(load(meters()), "<td>ball.interior</td><td>0.5</td><td>0.9</td>", "<td>2 z × 3 y × 4 x</td>")


def test_results_show_pictures_with_their_units():
    picture, measured = morgana.render(load(small()), spp=2), morgana.render(load(gated()), particles=640)
    html(picture, "<img", "mean 0.")
    html(picture.sel(channel="R"), "<img", "row down, column to the right")
    html(measured, "cells.fluence", "J/unit^2", "<img", "particles")
    fluence = measured.meters["cells.fluence"]
    map_ = html(fluence, "<img", "J/unit^2", "opl down, x to the right, averaged over z, y")
    assert pixels(map_).shape[:2] == (20, 4)
    html(fluence.average("x", "y", "z"), "<svg", "polygon", "over opl")
    html(measured.meters["skin.power"], "±", "W")
    html(measured.records["skin"], "<svg", "power (W)", "passages")
    html(measured.records["skin"].power(), "Power", "±")
    # Of axes of equal length, z and x are shown.
    cube = morgana.Reading(np.ones((4, 3, 3, 3)), np.zeros((4, 3, 3, 3)), dict.fromkeys(["opl", "z", "y", "x"]), "J")
    html(cube._replace(mean=np.ones((3, 3, 3, 3))), "z down, x to the right, averaged over opl, y")
    html(cube, "opl down, z to the right")
    # Values that are not finite are grey.
    hole = morgana.Estimate(np.array([[1.0, 2.0, 3.0], [4.0, np.nan, 6.0], [7.0, 8.0, 9.0]]), np.zeros((3, 3)), {"y": None, "x": None})
    assert np.allclose(pixels(html(hole))[1, 1, :3], 217 / 255) and np.allclose(pixels(html(hole))[2, 2, :3], np.array([253, 231, 37]) / 255)


def test_rays_show_their_paths():
    starts = np.stack([np.linspace(-0.5, 0.5, 5), np.zeros(5), np.full(5, -3.0)], axis=-1)
    rays = morgana.trace(load(small()), starts, [0, 0, 1])
    assert html(rays, "5 rays", "z to the right, x upwards").count("<polyline") == 5
    assert html(morgana.trace(load(small()), np.repeat(starts, 100, axis=0), [0, 0, 1])).count("<polyline") <= 200


def test_sweeps_show_their_first_quantity():
    swept = {**small(), "parameters": {"fov": 40}}
    swept["sensor"]["fov"] = "$fov"
    assert html(morgana.sweep(swept, {"fov": [30, 40, 50]}, spp=1), "3 values of fov", "fov = 30, 40, 50").count("<img") == 3
    html(morgana.sweep(gated(), {"power": [1.0, 2.0]}, particles=64), "<svg", "cells.fluence J/unit^2 over power")


def test_readings_convert_to_xarray(tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("scipy")
    reading = morgana.render(load(gated()), particles=640).meters["cells.fluence"]
    array = reading.to_xarray(name="fluence", metres_per_unit=1e-3)
    assert array.dims == ("opl", "z", "y", "x") and array.attrs == {"units": "J/unit^2"}
    assert np.array_equal(array, reading.mean) and np.array_equal(array["error"], reading.error) and np.array_equal(array["few"], reading.few)
    np.testing.assert_allclose(array["x"], [-0.75, -0.25, 0.25, 0.75])
    assert np.array_equal(np.append(array["x_lower"], array["x_upper"][-1]), reading.axes["x"])
    np.testing.assert_allclose(array["time"], (np.arange(20) + 0.5) * 1e-3 / 299_792_458.0, rtol=1e-12)
    assert array["time"].attrs["units"] == "s" and "time" not in reading.to_xarray().coords
    # Both select equal bins.
    at = {"opl": slice(2.5, 7.5), "z": 0.5}
    assert np.array_equal(array.sel(**at), reading.sel(**at).mean)
    array.to_netcdf(tmp_path / "fluence.nc", engine="scipy")
    with xarray.open_dataarray(tmp_path / "fluence.nc", engine="scipy") as again:
        assert again.identical(array) or (again.equals(array) and again.attrs == array.attrs)
    with pytest.raises(morgana.RenderError, match="metres_per_unit"):
        reading.to_xarray(metres_per_unit=0)
    # Arrays of xarray keep their own arithmetic.
    assert isinstance(reading * array, xarray.DataArray) and isinstance(array * reading, xarray.DataArray)


def test_results_and_records_convert_to_data_sets(tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("scipy")
    measured = morgana.render(load(gated()), particles=640)
    table = measured.to_xarray(metres_per_unit=1e-3)
    assert {"cells.fluence", "cells.fluence_error", "skin.power"} <= set(table) and table["skin.power"].attrs["units"] == "W"
    assert table["cells.absorbed"].dims == ("opl", "z", "y", "x") and "time" in table.coords
    assert list(measured.to_xarray(name="skin.power")) == ["skin.power", "skin.power_error"]
    with pytest.raises(KeyError, match="no quantity 'p0': there are 'cells.fluence'"):
        measured.to_xarray(name="p0")
    picture = morgana.render(load(small(), integrator="aov"), spp=1).to_xarray()
    assert picture["deflection"].dims == ("row", "column", "deflection.channel") and picture["deflection"].attrs == {"units": "rad"}
    assert list(picture["deflection.channel"].values) == ["X", "Y"]
    records = measured.records["skin"]
    columns = records.to_xarray()
    assert columns["path_length"].dims == ("record", "region") and list(columns["region"].values) == records.regions
    assert np.array_equal(columns["weight"], records.weight) and columns.attrs["particles"] == records.particles
    columns.to_netcdf(tmp_path / "records.nc", engine="scipy")
    with xarray.open_dataset(tmp_path / "records.nc", engine="scipy") as again:
        np.testing.assert_array_equal(again["weight"], records.weight)
