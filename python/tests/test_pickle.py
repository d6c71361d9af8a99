"""Results for users can be pickled and compared."""

import concurrent.futures
import multiprocessing
import pickle

import numpy as np
import pytest

import morgana
from conftest import load, meters, small

FOG = {
    "type": "scene",
    "parameters": {"density": 0.5},
    "integrator": {"type": "path", "max_depth": 3},
    "sensor": {
        "type": "perspective",
        "fov": 40,
        "to_world": [{"lookat": {"origin": [0, 0, -4], "target": [0, 0, 0], "up": [0, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 6, "height": 4, "decomposition": "bounce", "max_bounces": 2},
        "sampler": {"type": "independent", "sample_count": 4},
    },
    "ball": {
        "type": "sphere",
        "bsdf": {"type": "null"},
        "interior": {"type": "homogeneous", "id": "fog", "sigma_t": "$density", "ior": {"type": "luneburg", "radius": 1}},
    },
    "sky": {"type": "constant"},
}


def again(value):
    return pickle.loads(pickle.dumps(value))


def grid():
    return 1.3 + 0.01 * np.random.default_rng(1).random((5, 6, 7))


def test_scenes():
    scene = morgana.load_dict(FOG, density=0.25)
    copy = again(scene)
    assert copy == scene and hash(copy) == hash(scene) and copy is not scene
    assert copy.hash == scene.hash and repr(copy) == repr(scene)
    assert scene != morgana.load_dict(FOG)
    assert scene != morgana.load_dict(FOG, density=0.25, integrator="particle")
    assert scene != "a scene"


def test_scene_files(tmp_path, monkeypatch):
    path = tmp_path / "fog.json"
    text = '{"type": "scene", "parameters": {"width": 4}, "sensor": {"type": "perspective", "fov": 40, "film": '
    path.write_text(text + '{"type": "hdrfilm", "width": "$width", "height": 3}}, "sky": {"type": "constant"}}')
    monkeypatch.chdir(tmp_path)
    scene = morgana.load_file("fog.json", width=5, integrator="bdpt")
    data = pickle.dumps(scene)
    monkeypatch.chdir("/")
    copy = pickle.loads(data)
    assert copy == scene and copy.size == (5, 3) and copy.integrator == "bdpt"
    path.write_text(path.read_text().replace('"fov": 40', '"fov": 41'))
    with pytest.raises(morgana.RenderError, match="changed"):
        pickle.loads(data)


def test_fields():
    scene = morgana.load_dict(FOG)
    field = scene.fields["fog"]
    assert again(field) == field and again(field).n([0, 0, 0]) == field.n([0, 0, 0])
    assert field != scene.fields["ambient"]
    data = grid()
    own = morgana.load_field({"type": "bspline", "data": data, "placement": "nodes"})
    copy = again(own)
    assert copy == own and hash(copy) == hash(own)
    points = np.random.default_rng(2).random((10, 3))
    assert np.array_equal(copy.n(points), own.n(points))
    assert own != morgana.load_field({"type": "bspline", "data": data + 0.1, "placement": "nodes"}) and own != field
    glass = [morgana.load_field({"type": "cauchy", "a": 1.5, "b": 0.004}, wavelength=nm) for nm in (500, 600)]
    assert [again(colour) for colour in glass] == glass and glass[0] != glass[1]


def test_arrays_that_have_changed_are_refused():
    data = grid()
    own = morgana.load_field({"type": "bspline", "data": data, "placement": "nodes"})
    data += 0.1
    with pytest.raises(morgana.RenderError, match="changed"):
        again(own)


def test_rays():
    scene = morgana.load_dict(FOG)
    rays = morgana.trace(scene, [[-3, 0.1, 0], [-3, 5, 0]], [1, 0, 0])
    copy = again(rays)
    assert copy == rays and len(copy) == 2 and (copy.end == rays.end).all() and (copy.surface == rays.surface).all()
    assert np.array_equal(copy[0].points, rays[0].points)
    assert rays != morgana.trace(scene, [[-3, 0.2, 0], [-3, 5, 0]], [1, 0, 0])
    ends = morgana.trace(scene, [[-3, 0.1, 0], [-3, 5, 0]], [1, 0, 0], paths=False)
    assert again(ends) == ends != rays and again(rays[0]) == rays[0] != rays[1]
    found = morgana.connect(scene, [-0.5, 0.2, 0], [0.7, 0, 0.1])
    assert again(found) == found and found.rays[0].jacobian == again(found).rays[0].jacobian


def test_pictures(tmp_path):
    scene = morgana.load_dict(FOG)
    result = morgana.render(scene, spp=8, seed=3)
    copy = again(result)
    assert copy == result and copy.scene == scene
    assert copy.stats == result.stats and copy.stopped is None
    assert copy.mean_error == result.mean_error and copy.layers.keys() == result.layers.keys() != set()
    assert result != morgana.render(scene, spp=8, seed=4)
    files = [tmp_path / "a.exr", tmp_path / "b.exr"]
    for one, path in zip((result, copy), files):
        one.write(path)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_result_of_another_version_is_refused():
    run = morgana.render(load(small()), spp=1)._run
    kind, (packed, *others) = run.__reduce__()
    for damaged in (packed[:-1], packed + b"x", b""):
        with pytest.raises(morgana.RenderError, match="one version of morgana"):
            kind(damaged, *others)


@pytest.mark.parametrize("integrator", ["bdpt", "photon", "aov"])
def test_pictures_by(integrator):
    result = morgana.render(load(small(integrator)), spp=2)
    assert again(result) == result and again(result).balance == result.balance


def test_pictures_with_quantities():
    aov = {"type": "aov", "aovs": "d:depth, steps", "img": {"type": "path"}}
    result = morgana.render(load({**small(), "integrator": {"type": "moment", "held": aov}}), spp=2)
    assert again(result) == result and "m2_d" in result.layers


def test_meters(tmp_path):
    result = morgana.render(load(meters()), particles=640)
    copy = again(result)
    assert copy == result and copy.balance == result.balance
    assert copy.meters.keys() == result.meters.keys() != set()
    for one, name in ((result, "a.npz"), (copy, "b.npz")):
        one.write(tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_another_process_renders_a_scene():
    scene = morgana.load_dict(FOG)
    with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        result = pool.submit(morgana.render, scene, spp=4, seed=2).result()
    assert result == morgana.render(scene, spp=4, seed=2)
