"""Scenes written in the format of Mitsuba 3."""

import morgana
import numpy as np
import pytest
from conftest import ROOT

BALL = {
    "type": "scene",
    "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 3}},
    "sky": {"type": "constant"},
    "ball": {"type": "sphere", "center": [0, 0, 5], "to_world": np.diag([1.0, 1.5, 1.0, 1.0])},
}


@pytest.mark.parametrize("name", ["copy.xml", "copy.json"])
def test_an_exported_scene_is_the_same(tmp_path, name):
    path = tmp_path / name
    assert morgana.export(BALL, path) == []
    copy, scene = morgana.load_file(path), morgana.load_dict(BALL)
    assert np.array_equal(morgana.render(copy, spp=1).image, morgana.render(scene, spp=1).image)


def test_what_only_morgana_has_is_told(tmp_path):
    path = tmp_path / "copy.xml"
    own = morgana.export(ROOT / "scenes" / "acousto_optic_tissue.xml", path, sigma_t=0.25)
    assert "'ior' of medium 'homogeneous'" in own and "volume 'acoustic'" in own
    assert '<float name="sigma_t" value="0.25"/>' in path.read_text()


def test_what_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(ValueError, match="must end in .xml or .json"):
        morgana.export(BALL, tmp_path / "copy.png")
    grid = {"type": "gridvolume", "data": np.ones((2, 2, 2))}
    smoke = {"type": "scene", "smoke": {"type": "heterogeneous", "sigma_t": grid}}
    with pytest.raises(ValueError, match="XML cannot hold an array as 'data'"):
        morgana.export(smoke, tmp_path / "copy.xml")
    with pytest.raises(morgana.SceneError):
        morgana.export(tmp_path / "none.xml", tmp_path / "copy.xml")
    with pytest.raises(morgana.FileError):
        morgana.export(BALL, tmp_path / "nowhere" / "copy.xml")
