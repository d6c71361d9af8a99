"""Renders and measurements, compared with the program: equal seeds give equal bits."""

import json
import time
import warnings

import morgana
import numpy as np
import pytest
from conftest import SCENES, load, meters, small


@pytest.mark.parametrize("integrator", ["path", "bdpt", "particle", "vcm", "sppm"])
def test_pictures_are_those_of_the_program(program, tmp_path, integrator):
    (tmp_path / "scene.json").write_text(json.dumps(small()))
    program("render", "scene.json", "--integrator", integrator, "--spp", 6, "--seed", 3, "-o", "out.exr")
    expected = morgana.read(tmp_path / "out.exr")
    result = morgana.render(load(small()), integrator=integrator, spp=6, seed=3)
    np.testing.assert_array_equal(result.image, expected.image)
    np.testing.assert_array_equal(result.variance, expected.layers["variance"])
    assert result.image.dtype == np.float32 and result.image.shape == (8, 12, 3)
    assert result.image.flags.c_contiguous and result.image.mean() > 0.1
    np.testing.assert_array_equal(result.samples, 6)
    np.testing.assert_array_equal(result.error, np.sqrt(result.variance))
    assert result.stats["scene_hash"] == expected.attributes["scene_hash"]


def test_a_file_is_the_scene_of_the_program(program, tmp_path):
    path = SCENES / "luneburg_fog.xml"
    scene = morgana.load_file(path)
    info = json.loads(program("info", path, "--json"))
    assert scene.channels == ["R", "G", "B"] and scene.name == "luneburg_fog.xml"
    assert "fog" in " ".join(scene.fields) and scene.hash == info.get("hash", scene.hash)


def test_numbers_of_threads_do_not_matter():
    scene = load(small("bdpt"))
    one, two = (morgana.render(scene, spp=3, threads=n).image for n in (1, 2))
    np.testing.assert_array_equal(one, two)
    assert (one != morgana.render(scene, spp=3, seed=1).image).any()


def test_means_have_errors():
    result = morgana.render(load(small()), spp=16)
    assert result.mean == pytest.approx(float(result.image.mean()), rel=1e-5)
    # Pixels of the path tracer are independent.
    expected = np.sqrt(result.variance.astype(float).sum()) / result.image.size
    assert 0.3 * expected < result.mean_error < 3 * expected


def test_errors_that_cannot_be_trusted_are_flagged():
    result = morgana.render(load(small()), spp=64)
    assert result.few.shape == result.effective.shape == result.image.shape and result.few.dtype == bool
    assert result.few[result.effective < 9.99].all()
    assert result.effective.max() <= 64 * (1 + 1e-6)
    assert result.mean_few == result.stats["trust"]["few"]
    assert morgana.render(load(small()), spp=4).few.all()


def test_pictures_without_light_are_told():
    scene = small()
    scene["sky"] = {"type": "point", "position": [0, 0, 9], "intensity": 1.0}
    scene["wall"] = {"type": "rectangle", "to_world": [{"scale": 100}, {"translate": [0, 0, 8]}]}
    dark = morgana.render(load(scene), spp=4)
    assert dark.mean == 0.0 and dark.mean_few and dark.stats["trust"]["few"]
    for text in (repr(dark), dark._repr_html_()):
        assert "no sample found any light: does light get to the sensor? morgana check says" in text and "±" not in text


def test_meters_are_those_of_the_program(program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(meters()))
    program("render", "scene.json", "--particles", 2000, "--seed", 5, "-o", "out.npz")
    expected = np.load(tmp_path / "out.npz")
    result = morgana.render(load(meters()), particles=2000, seed=5)
    fluence = result.meters["fluence"]
    np.testing.assert_array_equal(fluence.mean, expected["fluence"])
    np.testing.assert_array_equal(fluence.error, expected["fluence_error"])
    np.testing.assert_array_equal(fluence.effective, expected["fluence_effective"])
    np.testing.assert_array_equal(fluence.few, expected["fluence_few"] != 0)
    assert result.stats["meters"][0]["readings"][0]["bins_of_few_particles"] == fluence.few.sum()
    assert fluence.mean.shape == (2, 3, 4) and list(fluence.axes) == ["z", "y", "x"] and "unit^2" in fluence.unit
    np.testing.assert_allclose(fluence.axes["x"], np.linspace(-1, 1, 5), atol=1e-12)
    assert result.emitted[0] == pytest.approx(4 * np.pi)
    shares = [share["mean"] for name, share in result.balance.items() if name != "emitted"]
    assert sum(shares) == pytest.approx(result.balance["emitted"], rel=1e-9)
    with pytest.raises(morgana.RenderError, match="meters instead of a camera"):
        result.image


@pytest.mark.parametrize(
    "wrong",
    [{"spp": 0}, {"seed": -1}, {"seed": 2**64}, {"threads": 0}, {"time": -1.0}, {"time": float("nan")}, {"target_error": 0.0}, {"target": "x"}, {"particles": 9}, {"threads": 10**9}],
)
def test_wrong_options_are_refused(wrong):
    with pytest.raises(morgana.RenderError, match=next(iter(wrong))):
        morgana.render(load(small()), **wrong)


def test_a_time_limit_acts_within_a_pass():
    scene = small()
    scene["sensor"]["film"].update(width=1500, height=1000)
    scene = load(scene)
    started = time.monotonic()
    # No machine takes the 1.5 million samples of the pass in this time.
    result = morgana.render(scene, spp=1, time=0.02)
    assert result.stopped == "time" and result.stats["spp"] == 0
    assert time.monotonic() - started < 10


def test_limits_end_a_render():
    scene = load(small())
    result = morgana.render(scene, time=0.3)
    assert result.stopped == "time" and result.stats["spp"] > 1
    result = morgana.render(scene, target_error=0.5)
    assert result.stopped == "target"
    assert morgana.render(scene).stopped is None and scene.spp == 4


def test_results_show_themselves():
    result = morgana.render(load(small()), spp=2)
    assert "12 × 8 × 3, 2 spp" in repr(result)
    assert "data:image/png;base64,iVBOR" in result._repr_html_()
    wide = small()
    wide["sensor"]["film"].update(width=700, height=1)
    assert 'height="1"' in morgana.render(load(wide), spp=1)._repr_html_()
    assert "fluence" in repr(morgana.render(load(meters()), particles=100))


def test_samplers_can_be_chosen(program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(small()))
    program("render", "scene.json", "--sampler", "ldsampler", "--adaptive", "--spp", 40, "-o", "out.exr")
    expected = morgana.read(tmp_path / "out.exr")
    result = morgana.render(load(small(), sampler="ldsampler", adaptive=True), spp=40)
    np.testing.assert_array_equal(result.image, expected.image)
    np.testing.assert_array_equal(result.samples, expected.layers["samples"][..., 0])
    assert result.samples.min() < 40 < result.samples.max()
    with pytest.raises(morgana.SceneError, match="did you mean 'ldsampler'"):
        load(small(), sampler="ldsample")


def test_integrators_by_name():
    scene = load(small())
    with pytest.raises(morgana.SceneError, match="did you mean 'bdpt'"):
        morgana.render(scene, integrator="bdtp")
    with pytest.raises(morgana.SceneError, match="load it for the integrator aov"):
        morgana.render(scene, integrator="aov")
    aov = morgana.render(load(small(), integrator="aov"), spp=1)
    assert "depth" in aov.channels or len(aov.channels) > 3


def test_quantities_beside_light_have_layers(program, tmp_path):
    path = {"type": "path"}
    aov = {"type": "aov", "aovs": "dd.y:depth, position, deflection, L:optical_length", "img": path}
    scene = {**small(), "integrator": {"type": "moment", "held": aov}}
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    program("render", "scene.json", "--spp", 6, "-o", "out.exr")
    expected = morgana.read(tmp_path / "out.exr")
    result = morgana.render(load(scene), spp=6)
    np.testing.assert_array_equal(result.image, morgana.render(load(small()), spp=6).image)
    np.testing.assert_array_equal(result.image, expected.image)
    for name in ("dd.y", "position", "deflection", "L"):
        layer = result.layers[name]
        assert layer.channels == expected.channels[name]
        np.testing.assert_array_equal(layer.mean, expected.layers[name])
        np.testing.assert_array_equal(layer.variance, expected.layers[f"variance.{name}"])
        np.testing.assert_array_equal(result.layers[f"m2_{name}"].mean, expected.layers[f"m2_{name}"])
    np.testing.assert_array_equal(result.layers["m2_img"].mean, expected.layers["m2_img"])
    assert np.isinf(result.layers["m2_img"].variance).all() and "R" in result.layers["m2_img"].channels
    assert result.stats["quantities"]["rays"] == 6 * 12 * 8
    assert "mean" in repr(result)


def test_files_and_dictionaries_are_scenes(tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(small()))
    expected = morgana.render(load(small()), spp=2)
    for scene in (small(), tmp_path / "scene.json", str(tmp_path / "scene.json")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", morgana.SceneWarning)
            assert np.array_equal(morgana.render(scene, spp=2).image, expected.image)
