"""The site: the first program runs; the examples of the plugin reference load, and their two forms are one scene."""

import json
import re
import shutil
import struct
import subprocess
import sys

import morgana
import numpy as np
import pytest
from conftest import PROGRAM, ROOT

sys.path.insert(0, str(ROOT / "scripts/site"))

import notebook_pages  # noqa: E402
import plugin_examples  # noqa: E402
import plugin_scenes  # noqa: E402

DATA = ROOT / "crates/io/tests/data"
DEFINITIONS = json.loads(subprocess.run([PROGRAM, "schema"], check=True, capture_output=True, text=True).stdout)["$defs"]
PLUGINS = [name for name in DEFINITIONS if "." in name]


SOUND = {"type": "acoustic", "n0": 1.33, "amplitude": 1e-4, "wave_number": 14, "elasto_optic": 0.32}


def vol(values):
    """Returns the bytes of a Mitsuba grid over [0, 1]³."""
    z, y, x = values.shape
    return b"VOL\x03" + struct.pack("<5i6f", 1, x, y, z, 1, 0, 0, 0, 1, 1, 1) + values.astype("<f4").tobytes()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with the files that examples name."""
    from PIL import Image

    folder = tmp_path_factory.mktemp("files")
    for name in ("picture", "heights", "normals", "dusk", "slide"):
        Image.new("RGB", (4, 4), (128, 128, 255)).save(folder / f"{name}.png")
    plugin_scenes.luminaire(folder)
    across = np.linspace(-1, 1, 5)
    distance = np.sqrt(across**2 + across[:, None] ** 2 + across[:, None, None] ** 2)
    (folder / "smoke.vol").write_bytes(vol(np.exp(-distance)))
    (folder / "distances.vol").write_bytes(vol(distance - 0.7))
    np.save(folder / "index.npy", 1.3 + 0.01 * np.exp(-distance))
    np.save(folder / "density.npy", 1.2 + 0.1 * np.exp(-distance))
    np.save(folder / "pressure.npy", 1e5 * np.exp(-distance))
    (folder / "curves.txt").write_text("0 0 0 0.1\n0.5 0 0 0.1\n0.5 0.5 0 0.1\n0.5 0.5 0.5 0.1\n")
    (folder / "strands.txt").write_text("0 0 0\n0.5 0 0\n0.5 0.5 0\n")
    (folder / "model.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "coloured.obj").write_text("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n")
    shutil.copy(ROOT / "scenes/bos_jet.ply", folder / "model.ply")
    shutil.copy(DATA / "meshes/two_boxes.glb", folder / "model.glb")
    shutil.copy(DATA / "meshes/meshes4.serialized", folder / "model.serialized")
    mesh = {"MeshNode": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "MeshElem": [[1, 2, 3, 4, 1]]}
    (folder / "tetrahedra.jmsh").write_text(json.dumps(mesh))
    np.save(folder / "labels.npy", (distance < 0.7).astype(np.uint8) + 1)
    return folder


def flat(xml):
    """Returns XML without indentation."""
    return "".join(line.strip() for line in xml.splitlines())


def scene_with(name, plugin):
    """Returns a small scene with an example, to load it."""
    kind, kept = name.split(".")[0], plugin["type"]
    film = {"type": "hdrfilm", "width": 16, "height": 8}
    sensor = {**plugin_examples.VIEW, "film": film, "sampler": {"type": "independent", "sample_count": 1}}
    ball = {"type": "sphere"}
    objects = {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": sensor,
        "ball": ball,
        "sky": {"type": "constant"},
    }
    if kind in ("film", "sampler"):
        sensor[kind] = plugin
    elif kind == "rfilter":
        film["rfilter"] = plugin
    elif kind == "integrator":
        objects["integrator"] = plugin
        ball.update(bsdf={"type": "null"}, interior={"type": "transparent", "ior": SOUND})
    elif kind == "sensor" and "meter" in kept and kept != "radiancemeter":
        objects["integrator"] = {"type": "particle"}
        del objects["sensor"]
        objects["sky"] = {"type": "point", "position": [0, 0, 4]}
        (objects if kept == "fluencemeter" else ball)["meter"] = plugin
    elif kind == "sensor":
        objects["sensor"] = plugin
    elif kind == "bsdf":
        ball["bsdf"] = plugin
    elif kind == "texture" and kept == "mesh_attribute":
        objects["ball"] = {"type": "obj", "filename": "coloured.obj", "bsdf": {"type": "diffuse", "reflectance": plugin}}
    elif kind in ("texture", "spectrum"):
        ball["bsdf"] = {"type": "diffuse", "reflectance": plugin}
        if kept in ("blackbody", "d65"):
            del ball["bsdf"]
            objects["sky"] = {"type": "constant", "radiance": plugin}
    elif kind == "emitter" and kept in ("area", "directionalarea"):
        ball["type"] = "disk"
        ball["emitter"] = plugin
    elif kind == "emitter":
        objects["sky"] = plugin
    elif kept == "shapegroup":
        objects["ball"] = {"type": "instance", "group": plugin}
    elif kept == "instance":
        objects["group"] = {
            "type": "shapegroup",
            "id": plugin["group"]["id"],
            "ball": {"type": "sphere"},
        }
        objects["ball"] = plugin
    elif kind == "shape":
        objects["ball"] = plugin
    else:
        ball["bsdf"] = {"type": "null"}
        ball["interior"] = matter(kind, kept, plugin)
        if kept in ("cauchy", "sellmeier"):
            film.update(pixel_format="spectral", wavelengths=[450, 650])
    return objects


def matter(kind, kept, plugin):
    """Returns a medium with an example of a medium, phase function or volume."""
    if kind == "medium":
        return plugin
    if kind == "phase":
        return {"type": "homogeneous", "sigma_t": 1, "albedo": 0.9, "phase": plugin}
    if kept in ("gridvolume", "constvolume"):
        return {"type": "heterogeneous", "sigma_t": 1, "albedo": plugin}
    return {
        "type": "transparent",
        "ior": {"type": "acoustic", "n0": 1.33, "wave": plugin} if kept == "mode" else plugin,
    }


@pytest.mark.parametrize("name", PLUGINS)
@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_examples_load(name, files, monkeypatch):
    monkeypatch.chdir(files)
    example = plugin_examples.example(name)
    shown = eval(plugin_examples.python(example))
    assert shown == example
    scene = scene_with(name, example)
    loaded = morgana.load_dict(scene)
    xml = plugin_examples.xml(name, example, DEFINITIONS)
    assert (xml is None) == bool(set(example) & set(plugin_examples.ONLY_PYTHON))
    if xml:
        whole = plugin_examples.whole(scene, DEFINITIONS)
        # The page shows a part of this scene, except for its role and its indentation.
        assert flat("\n".join(xml.splitlines()[1:-1])) in flat(whole)
        (files / "scene.xml").write_text(whole)
        assert morgana.load_file("scene.xml").hash == loaded.hash


def test_values_become_elements():
    plugin = {
        "type": "sphere",
        "center": [0, 1, 2],
        "radius": 2,
        "flip_normals": True,
        "to_world": [{"rotate": {"axis": [0, 0, 1], "angle": 90}}],
        "bsdf": {
            "type": "diffuse",
            "reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]},
        },
        "interior": {"type": "ref", "id": "fog"},
    }
    assert plugin_examples.xml("shape.sphere", plugin, DEFINITIONS).splitlines() == [
        '<shape type="sphere">',
        '  <point name="center" value="0, 1, 2"/>',
        '  <float name="radius" value="2"/>',
        '  <boolean name="flip_normals" value="true"/>',
        '  <transform name="to_world"><rotate value="0, 0, 1" angle="90"/></transform>',
        '  <bsdf type="diffuse">',
        '    <rgb name="reflectance" value="0.1, 0.2, 0.3"/>',
        "  </bsdf>",
        '  <ref name="interior" id="fog"/>',
        "</shape>",
    ]


def test_a_plugin_without_an_example_is_an_error():
    with pytest.raises(ValueError, match=r"bsdf\.new has no example: add one"):
        plugin_examples.example("bsdf.new")


def test_the_first_program_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs/index.md").read_text(), re.DOTALL | re.MULTILINE)
    exec(compile(block, "docs/index.md", "exec"), {})
    assert (tmp_path / "lens.png").stat().st_size > 1000
    assert "mean 0.41" in capsys.readouterr().out


def test_notebooks_of_a_published_version_open_in_colab():
    assert notebook_pages.colab("grin_optics", None, "0.2.0") == []
    button, commands = notebook_pages.colab("grin_optics", "https://github.com/owner/name", "0.2.0")
    assert "(https://colab.research.google.com/github/owner/name/blob/v0.2.0/docs/notebooks/grin_optics.ipynb)" in button
    assert "--branch v0.2.0 https://github.com/owner/name morgana" in commands and "morgana-render[plot]==0.2.0" in commands
