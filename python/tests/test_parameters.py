"""Parameters by name: changed scenes equal scenes loaded with the changed values, and share parts."""

import copy
import pickle

import morgana
import numpy as np
import pytest
from conftest import load, small


def room(folder):
    """A mesh, a picture on it, fog with a grid, and an environment image, all in files."""
    rng = np.random.default_rng(5)
    corners = [[x, y, 0] for y in (-1, 1) for x in (-1, 1)]
    lines = ["v {} {} {}".format(*x) for x in corners] + [f"vt {u} {v}" for v in (0, 1) for u in (0, 1)]
    lines += ["f 1/1 2/2 4/4", "f 1/1 4/4 3/3"]
    (folder / "square.obj").write_text("\n".join(lines))
    morgana.write(folder / "wall.exr", rng.random((4, 4, 3)).astype(np.float32))
    morgana.write(folder / "sky.exr", rng.random((4, 8, 3)).astype(np.float32))
    np.save(folder / "fog.npy", rng.random((3, 3, 3)).astype(np.float32))
    cube = [{"scale": 2}, {"translate": [-1, -1, -1]}]
    fog = {"type": "gridvolume", "filename": str(folder / "fog.npy"), "axis_order": "zyx", "placement": "centers", "to_world": cube}
    picture = {"type": "bitmap", "filename": str(folder / "wall.exr")}
    scene = small()
    del scene["ball"]
    scene["sky"] = {"type": "envmap", "filename": str(folder / "sky.exr")}
    scene["square"] = {
        "type": "obj",
        "filename": str(folder / "square.obj"),
        "bsdf": {"type": "twosided", "nested": {"type": "diffuse", "id": "paint", "reflectance": picture}},
    }
    scene["box"] = {
        "type": "cube",
        "bsdf": {"type": "null"},
        "interior": {"type": "heterogeneous", "sigma_t": fog, "albedo": 0.8},
    }
    scene["ball"] = {"type": "sphere", "center": [0, 0, -1.5], "radius": 0.3, "bsdf": {"type": "plastic"}}
    return scene


def put(scene, name, value):
    """Returns the dictionary with a value at a path such as ``box.interior.albedo``."""
    scene = copy.deepcopy(scene)
    *path, last = name.split(".")
    place = scene
    for key in path:
        place = place[key]
    place[last] = value
    return scene


CHANGES = {
    "box.interior.albedo": 0.3,
    "box.interior.scale": 2.5,
    "ball.radius": 0.6,
    "ball.bsdf.diffuse_reflectance": {"type": "rgb", "value": [0.2, 0.5, 0.8]},
    "sky.scale": 0.5,
    "sensor.fov": 25,
    "square.to_world": [{"rotate": {"axis": [0, 1, 0], "angle": 30}}],
}
"""Values by their paths in the dictionary, which are also their names."""

GIVEN = {
    "ball.bsdf.diffuse_reflectance": [0.2, 0.5, 0.8],
    "square.to_world": [[3**0.5 / 2, 0, 0.5, 0], [0, 1, 0, 0], [-0.5, 0, 3**0.5 / 2, 0], [0, 0, 0, 1]],
}
"""Values as parameters, if they differ from those of the dictionary."""


@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_scene_is_the_scene_loaded_with_the_value(name, tmp_path):
    scene = room(tmp_path)
    parameters = load(scene).parameters()
    parameters[name] = GIVEN.get(name, CHANGES[name])
    changed = parameters.update()
    expected = load(put(scene, name, CHANGES[name]))
    if name != "square.to_world":
        assert changed.hash == expected.hash
    found, exact = (morgana.render(s, spp=4, seed=3).image for s in (changed, expected))
    if name == "square.to_world":
        np.testing.assert_allclose(found, exact, rtol=1e-3, atol=1e-3)
    else:
        np.testing.assert_array_equal(found, exact)
    assert (found != morgana.render(load(scene), spp=4, seed=3).image).any()


def test_files_are_not_read_again(tmp_path):
    scene = room(tmp_path)
    loaded = load(scene)
    exact = morgana.render(load(put(scene, "box.interior.albedo", 0.3)), spp=2).image
    for file in ("square.obj", "wall.exr", "sky.exr", "fog.npy"):
        (tmp_path / file).unlink()
    changed = loaded.parameters().update({"box.interior.albedo": 0.3})
    np.testing.assert_array_equal(morgana.render(changed, spp=2).image, exact)
    with pytest.raises(morgana.SceneError, match="square.obj"):
        loaded.parameters().update({"square.face_normals": True})


def test_changes_add_up_and_leave_the_old_scene(tmp_path):
    scene = room(tmp_path)
    loaded = load(scene)
    before = loaded.hash
    parameters = loaded.parameters()
    first = parameters.update({"ball.radius": 0.6})
    second = parameters.update({"sky.scale": 0.5})
    assert parameters.scene == second and parameters["ball.radius"] == 0.6
    assert loaded.hash == before != first.hash
    assert second == load(put(put(scene, "ball.radius", 0.6), "sky.scale", 0.5))
    back = parameters.update({"ball.radius": 0.3, "sky.scale": 1.0})
    np.testing.assert_array_equal(morgana.render(back, spp=2).image, morgana.render(loaded, spp=2).image)
    assert pickle.loads(pickle.dumps(second)) == second


def test_names_values_and_types(tmp_path):
    parameters = load(room(tmp_path)).parameters()
    assert parameters["ball.radius"] == 0.3
    np.testing.assert_array_equal(parameters["ball.center"], [0, 0, -1.5])
    assert parameters["box.interior.albedo"] == 0.8
    assert parameters["sensor.film.width"] == small()["sensor"]["film"]["width"]
    assert parameters["paint.reflectance.filter_type"] == "bilinear"
    assert "square.filename" not in parameters
    table = str(parameters).splitlines()
    assert table[0].split() == ["name", "type", "value"]
    assert ["ball.radius", "float", "0.3"] in [line.split() for line in table]
    assert ["sky.scale", "float", "1.0", "(default)"] in [line.split() for line in table]
    parameters["ball.radius"] = 0.5
    assert ["ball.radius", "float", "0.5", "(new)"] in [line.split() for line in str(parameters).splitlines()]
    assert "<td>ball.radius</td>" in parameters._repr_html_()
    assert len(list(parameters)) == len(parameters) == len(table) - 1


def test_arrays_can_be_replaced():
    rng = np.random.default_rng(6)
    first, second = rng.random((2, 3, 3, 3)).astype(np.float32)

    def scene(values):
        cube = [{"scale": 2}, {"translate": [-1, -1, -1]}]
        volume = {"type": "gridvolume", "data": values, "placement": "centers", "to_world": cube}
        return small(type="heterogeneous", sigma_t=volume)

    parameters = load(scene(first)).parameters()
    name = next(name for name in parameters if name.endswith("sigma_t.data"))
    np.testing.assert_array_equal(parameters[name], first)
    changed = parameters.update({name: second})
    np.testing.assert_array_equal(morgana.render(changed, spp=2).image, morgana.render(load(scene(second)), spp=2).image)


def test_mistakes_have_places_and_names(tmp_path):
    parameters = load(room(tmp_path)).parameters()
    with pytest.raises(KeyError, match="similar names are 'ball.radius'"):
        parameters["ball.radios"] = 1
    with pytest.raises(KeyError, match="'box.interior.albedo'"):
        parameters["fog.albedo"]
    for name, value, message in [
        ("ball.radius", -1, "radius"),
        ("ball.radius", "large", "float"),
        ("box.interior.albedo", 1.5, "albedo"),
        ("sensor.film.width", 2.5, "width"),
    ]:
        with pytest.raises(morgana.SceneError, match=message) as raised:
            parameters.update({name: value})
        assert f'parameters["{name}"]' in str(raised.value)
    with pytest.raises(TypeError, match="parameters"):
        parameters.update({"ball.radius": object()})
