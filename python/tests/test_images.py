"""Files of images and readings, and comparisons of images."""

import json

import morgana
import numpy as np
import pytest
from conftest import load, meters, small
from matplotlib.image import imread

RNG = np.random.default_rng(3)


def layered():
    scene = small()
    scene["sensor"]["film"] = {**scene["sensor"]["film"], "decomposition": "bounce", "max_bounces": 2}
    return scene


def test_files_of_renders_are_those_of_the_program(program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(layered()))
    program("render", "scene.json", "--seed", 3, "-o", "program.exr", "-o", "program.npy", "-o", "program.png")
    result = morgana.render(load(layered()), seed=3)
    for name in ("python.exr", "python.npy", "python.png"):
        morgana.write(tmp_path / name, result)
    ours, theirs = (morgana.read(tmp_path / f"{name}.exr") for name in ("python", "program"))
    assert list(ours.layers) == list(theirs.layers) and ours.channels == theirs.channels
    for name, values in theirs.layers.items():
        np.testing.assert_array_equal(ours.layers[name], values)
    alike = set(theirs.attributes) - {"scene", "options"}
    assert {a: ours.attributes[a] for a in alike} == {a: theirs.attributes[a] for a in alike}
    for extension in ("npy", "png"):
        both = ((tmp_path / f"{name}.{extension}").read_bytes() for name in ("python", "program"))
        assert len(set(both)) == 1, extension


def test_layers_add_up():
    result = morgana.render(load(layered()))
    assert list(result.layers) == ["bounce.0", "bounce.1", "bounce.2", "bounce.over"]
    total = sum(layer.mean for layer in result.layers.values())
    np.testing.assert_allclose(total, result.image, rtol=1e-5)
    assert result.axes == [{"name": "bounce", "max": 2}]
    assert morgana.render(load(small())).layers == {}


def test_files_of_readings_are_those_of_the_program(program, tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(meters()))
    program("render", "scene.json", "--particles", 500, "-o", "program.npz", "-o", "program.nrrd")
    result = morgana.render(load(meters()), particles=500)
    for name in ("python.npz", "python.nrrd"):
        morgana.write(tmp_path / name, result)
    ours, theirs = (np.load(tmp_path / f"{name}.npz") for name in ("python", "program"))
    assert ours.files == theirs.files
    about = [json.loads(str(file["metadata"])) for file in (ours, theirs)]
    for metadata in about:
        assert metadata["balance"] == result.stats["balance"]
        assert (metadata["seed"], metadata["particles"]) == (0, result.stats["particles"])
    for name in set(theirs.files) - {"metadata"}:
        np.testing.assert_array_equal(ours[name], theirs[name])
    with pytest.raises(morgana.FileError, match=".npz"):
        morgana.write(tmp_path / "readings.txt", result)


@pytest.mark.parametrize("end", ["npz", "H5", "nrrd", "txt"])
def test_messages_say_what_reads_files_of_meters(tmp_path, end):
    with pytest.raises(morgana.FileError, match="images are read from .exr, .png, .jpg and .npy") as caught:
        morgana.read(tmp_path / f"readings.{end}")
    assert ("by morgana.Reading.load and morgana.Records.load" in str(caught.value)) == (end != "txt")


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 2)])
def test_arrays_are_images(tmp_path, shape):
    values = RNG.random(shape)
    morgana.write(tmp_path / "image.exr", values[::-1], attributes={"note": "upside down"})
    image = morgana.read(tmp_path / "image.exr")
    stored = values[::-1].astype(np.float32).reshape(5, 7, -1)
    # EXR files sort channels by name.
    order = [image.channels[""].index(c) for c in ({1: "Y", 3: "RGB"}.get(stored.shape[2], "01"))]
    np.testing.assert_array_equal(image.image[:, :, order], stored)
    assert image.attributes["note"] == "upside down"
    assert "7 × 5" in repr(image) and "base64" in image._repr_html_()


def test_files_that_are_none_are_refused(tmp_path):
    with pytest.raises(morgana.FileError, match="cannot read") as caught:
        morgana.read(tmp_path / "missing.exr")
    assert isinstance(caught.value, OSError)
    with pytest.raises(morgana.FileError, match=".exr"):
        morgana.write(tmp_path / "image.gif", np.zeros((2, 2)))
    with pytest.raises(morgana.RenderError, match="height, width"):
        morgana.write(tmp_path / "image.exr", np.zeros(4))
    assert list(tmp_path.iterdir()) == []


def test_differences_are_measured(tmp_path):
    a, b = RNG.random((2, 6, 8, 3)).astype(np.float32)
    found = morgana.compare(a, b)
    difference = a.astype(float) - b
    assert found.rmse == pytest.approx(np.sqrt((difference**2).mean()), rel=1e-12)
    assert found.largest == pytest.approx(abs(difference).max(), rel=1e-12)
    assert found.means == pytest.approx((a.mean(dtype=float), b.mean(dtype=float)), rel=1e-12)
    assert found.flip_map.shape == (6, 8) and found.flip == pytest.approx(found.flip_map.mean(), rel=1e-6)
    assert found.z is None
    same = morgana.compare(a, a)
    assert same.rmse == 0 and same.psnr == np.inf and same.flip == 0
    morgana.write(tmp_path / "a.exr", a)
    assert morgana.compare(tmp_path / "a.exr", a).rmse == 0
    with pytest.raises(morgana.RenderError, match="pixels"):
        morgana.compare(a, b[:5])
    with pytest.raises(morgana.RenderError, match="block"):
        morgana.compare(a, b, block=0)


def test_renders_differ_by_their_noise():
    scene = load(small())
    a, b = (morgana.render(scene, spp=64, seed=seed) for seed in (1, 2))
    found = morgana.compare(a, b)
    # Seeds are fixed. About a hundred pixels are compared; the limit has one false alarm in 1000
    # comparisons.
    assert found.z["largest"] < found.z["limit"] and 0.5 < found.z["mean_square"] < 2


def test_pictures_are_exposed_unless_told_otherwise(tmp_path):
    """For a grey of 0.1, log₂(0.5/0.1) is 2.3, hence 2.5 stops, by the rule of docs/images.md."""
    dark = np.full((4, 6, 3), 0.1)
    assert morgana.exposure(dark) == 2.5
    assert morgana.exposure(np.zeros((2, 2))) == morgana.exposure(np.full((2, 2), np.nan)) == 0
    levels = {}
    for name, options in {"auto": {}, "given": {"exposure": 2.5}, "plain": {"exposure": 0}}.items():
        path = tmp_path / f"{name}.png"
        morgana.write(path, dark, **options)
        levels[name] = ((imread(path)[..., :3].mean() + 0.055) / 1.055) ** 2.4
        assert (b"exposure" in path.read_bytes()) == (name != "plain")
        # Reading the file undoes the exposure.
        assert morgana.read(path).image.mean() == pytest.approx(0.1, rel=0.02)
    assert levels["auto"] == levels["given"] == pytest.approx(0.1 * 2**2.5, rel=0.01)
    assert levels["plain"] == pytest.approx(0.1, rel=0.02)
    result = morgana.render(load(small()), spp=2)
    result.write(tmp_path / "result.png", exposure=-1)
    assert morgana.read(tmp_path / "result.png").image.max() == pytest.approx(result.image.max(), rel=0.02)
    for bad in ("1", float("nan")):
        with pytest.raises(TypeError, match="exposure is"):
            morgana.write(tmp_path / "bad.png", dark, exposure=bad)
    with pytest.raises(morgana.RenderError, match="exposure is for pictures"):
        morgana.render(load(meters()), particles=10).write(tmp_path / "bad.npz", exposure=1)
