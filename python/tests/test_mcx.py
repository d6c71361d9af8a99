"""Configurations of MCX: the scene of a dictionary is that of the same input file."""

import json

import morgana
import numpy as np
import pytest

VOL = np.ones((6, 8, 10), np.uint8)
VOL[:, :, 5:] = 2
VOL[0, 0, 0] = 0
PROP = [[0, 0, 1, 1], [0.01, 1.0, 0.5, 1.37], [0.05, 2.0, 0.9, 1.5]]


def configuration(**more):
    return {"vol": VOL, "prop": PROP, "srcpos": [3.2, 4.1, 0], "srcdir": [0, 0, 1], "issrcfrom0": 1, "nphoton": 500, **more}


def test_a_dictionary_says_what_a_file_says(tmp_path):
    (tmp_path / "labels.bin").write_bytes(VOL.tobytes(order="F"))
    (tmp_path / "input.json").write_text(json.dumps({
        "Session": {"Photons": 500, "DoMismatch": 1},
        "Forward": {"T0": 0, "T1": 5e-9, "Dt": 5e-9},
        "Optode": {"Source": {"Type": "pencil", "Pos": [3.2, 4.1, 0], "Dir": [0, 0, 1]}},
        "Domain": {"OriginType": 1, "Dim": VOL.shape, "VolumeFile": "labels.bin", "Media": PROP},
    }))
    by_file = morgana.render(morgana.load_file(tmp_path / "input.json"), seed=1)
    by_dict = morgana.render(morgana.load_mcx(configuration(tstart=0, tend=5e-9, tstep=5e-9)), seed=1)
    fluence = by_dict.meters["fluence"]
    assert fluence.mean.shape == (10, 8, 6)
    assert fluence.mean.sum() > 0
    np.testing.assert_array_equal(fluence.mean, by_file.meters["fluence"].mean)


def test_mistakes_are_named():
    with pytest.raises(ValueError, match="not read: bc"):
        morgana.load_mcx(configuration(bc="aaaaaa"))
    with pytest.raises(morgana.SceneError, match="source 'fourier'"):
        morgana.load_mcx(configuration(srctype="fourier"))
    with pytest.raises(morgana.SceneError, match="Domain needs"):
        morgana.load_mcx({key: value for key, value in configuration().items() if key != "vol"})
