"""Configurations of MCX: a dictionary gives the scene of the equivalent input file."""

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
    with pytest.raises(ValueError, match="does not support these keys of the configuration: polprop"):
        morgana.load_mcx(configuration(polprop=[1]))
    with pytest.raises(morgana.SceneError, match="InverseCDF .* number 1 is -1"):
        morgana.load_mcx(configuration(invcdf=[-1, 0, 1]))
    with pytest.raises(morgana.SceneError, match="source 'hyperboloid'"):
        morgana.load_mcx(configuration(srctype="hyperboloid"))
    with pytest.raises(morgana.SceneError, match="Domain needs"):
        morgana.load_mcx({key: value for key, value in configuration().items() if key != "vol"})


def test_mirrors_quantiles_and_focuses():
    def escaped(**changes):
        return morgana.render(morgana.load_mcx(configuration(**changes)), particles=4000, seed=1).balance["escaped"]["mean"]

    assert escaped(bc="mmmmmm") == 0.0 < escaped(bc="m_____") < escaped()
    # Evenly spaced quantiles are isotropic scattering, whatever g is. The difference has a standard error below 0.01.
    forward, isotropic = ([PROP[0], *([mua, mus, g, n] for mua, mus, _, n in PROP[1:])] for g in (0.95, 0.0))
    by_quantiles = escaped(prop=forward, invcdf=np.linspace(-1, 1, 21)[1:-1])
    assert abs(by_quantiles - escaped(prop=isotropic)) < 0.04 < abs(by_quantiles - escaped(prop=forward))
    wide = {"srctype": "disk", "srcparam1": [2, 0, 0, 0], "srcpos": [3, 4, -1]}
    for focus in (np.nan, -np.inf, 5.0):
        for direction in ([0, 0, 1, focus], np.array([0, 0, 1, focus])):
            assert 0 < escaped(**wide, srcdir=direction) < 1
    assert 0 < escaped(**wide, angleinvcdf=[0, 0.1, 0.2]) < 1


def test_several_patterns():
    both = np.zeros((2, 3, 2))
    both[0, 1, 0], both[1, 0, 1] = 1, 1
    shape = {"srctype": "pattern", "srcpos": [0, 0, -1], "srcparam1": [6, 0, 0, 3], "srcparam2": [0, 8, 0, 2]}
    several = {**shape, "srcpattern": both, "srcnum": 2}
    with pytest.raises(morgana.SceneError, match="choose one by PatternID, from 1 to 2"):
        morgana.load_mcx(configuration(**several))
    for number in (1, 2):
        of_both = morgana.render(morgana.load_mcx(configuration(**several), pattern=number), particles=500, seed=1)
        alone = morgana.render(morgana.load_mcx(configuration(**shape, srcpattern=both[number - 1])), particles=500, seed=1)
        np.testing.assert_array_equal(of_both.meters["fluence"].mean, alone.meters["fluence"].mean)


def test_arrays_have_their_shapes():
    detectors = morgana.load_mcx(configuration(detpos=[3, 4, 10, 1])), morgana.load_mcx(configuration(detpos=np.array([[3, 4, 10, 1.0], [3, 2, 10, 1]])))
    assert [len(scene.meters) for scene in detectors] == [2, 3]
    assert len(morgana.load_mcx(configuration(detpos=[])).meters) == 1
    for wrong, said in [
        ({"detpos": np.ones((4, 3))}, r"cfg\['detpos'\] has the shape \(4, 3\) but must be rows of four numbers"),
        ({"detpos": np.ones((1, 1, 4))}, r"cfg\['detpos'\] has the shape"),
        ({"vol": VOL[0]}, r"cfg\['vol'\] has the shape \(8, 10\) but must be labels"),
    ]:
        with pytest.raises(ValueError, match=said):
            morgana.load_mcx(configuration(**wrong))
    pattern = {"srctype": "pattern", "srcpos": [0, 0, -1], "srcparam1": [6, 0, 0, 3], "srcparam2": [0, 8, 0, 2]}
    for wrong in [{"vol": VOL + 0j}, {"prop": np.array(PROP) + 0j}, {"srcpos": np.array([3, 4, 0j])}, {**pattern, "srcpattern": np.ones((3, 2)) + 1j}]:
        with pytest.raises(TypeError, match=r"cfg\['.*'\] has complex numbers but must be an array of real ones"):
            morgana.load_mcx(configuration(**wrong))
    with pytest.raises(TypeError, match="real numbers"):
        morgana.load_mcx(configuration(**pattern, srcpattern=[[1j, 2], [3, 4], [5, 6]]))
    with pytest.raises(TypeError, match="expected a configuration as a dictionary, found list"):
        morgana.load_mcx([1])


def test_volumes_of_coefficients():
    mua, mus = (np.array(PROP)[VOL, k] for k in (0, 1))
    mus[0, 0, 0] = np.nan
    same = [[0, 0, 1, 1], [0.01, 1.0, 0.5, 1.37]]
    volumes = {
        "muamus_float": (np.stack([mua, mus]), same),
        "mua_float": (mua[None].astype(np.float32), same),
        "asgn_byte": (np.stack([np.where(VOL == 2, 255, 1)] * 4).astype(np.uint8), PROP),
        "muamus_short": (np.stack([np.where(VOL == 2, 65535, 1)] * 2).astype(np.uint16), [*same, [0.05, 2.0, 0.5, 1.37]]),
    }
    for name, (vol, prop) in volumes.items():
        measured = morgana.render(morgana.load_mcx(configuration(vol=vol, prop=prop)), seed=1)
        assert measured.meters["fluence"].mean.shape == (10, 8, 6), name
        assert measured.meters["absorbed"].mean.sum() > 0, name
    with pytest.raises(morgana.SceneError, match="a volume of 3 numbers for each voxel"):
        morgana.load_mcx(configuration(vol=np.ones((3, 6, 8, 10))))


def test_named_axes_are_put_in_order():
    xarray = pytest.importorskip("xarray")
    expected = morgana.load_mcx(configuration())
    assert morgana.load_mcx(configuration(vol=xarray.DataArray(VOL.T, dims=("z", "y", "x")))) == expected


def test_output_is_the_fluence():
    assert morgana.load_mcx(configuration(outputtype="fluence")) == morgana.load_mcx(configuration())
    with pytest.warns(morgana.SceneWarning, match=r"\(outputtype\) has no effect: morgana reads the fluence per joule; .* 'absorbed'"):
        morgana.load_mcx(configuration(outputtype="energy"))
    with pytest.warns(morgana.SceneWarning, match="by the width of a time gate"):
        morgana.load_mcx(configuration(outputtype="flux"))
    with pytest.warns(morgana.SceneWarning, match="'fluence_in_phase' − i 'fluence_quadrature'"):
        modulated = morgana.load_mcx(configuration(outputtype="rf", omega=2 * np.pi * 1e8))
    amplitude = morgana.render(modulated, particles=100).meters["fluence_amplitude"]
    assert amplitude.coordinates["frequency"] == pytest.approx([1e8])
    with pytest.raises(ValueError, match="outputtype is 'jacobian' but must be one of flux, fluence, energy, rf: morgana returns the fluence per joule"):
        morgana.load_mcx(configuration(outputtype="jacobian"))


def test_patterns_are_columns_and_rows(tmp_path):
    pattern = np.array([[1, 0.5], [0, 0.25], [2, 0.125]])                    # three columns of two rows
    source = {"srctype": "pattern", "srcpos": [0, 0, -1], "srcparam1": [6, 0, 0, 3], "srcparam2": [0, 8, 0, 2]}
    by_dict = morgana.load_mcx(configuration(**source, srcpattern=pattern))
    (tmp_path / "input.json").write_text(json.dumps({
        "Session": {"Photons": 500},
        "Optode": {"Source": {
            "Type": "pattern", "Pos": [0, 0, -1], "Dir": [0, 0, 1], "Param1": [6, 0, 0, 3], "Param2": [0, 8, 0, 2],
            "Pattern": {"Nx": 3, "Ny": 2, "Data": pattern.T.ravel().tolist()},
        }},
        "Domain": {"OriginType": 1, "Volume": {"_ArrayType_": "uint8", "_ArraySize_": VOL.shape, "_ArrayData_": VOL.ravel().tolist()}, "Media": PROP},
    }))
    results = [morgana.render(scene, seed=1).meters["fluence"].mean for scene in (by_dict, morgana.load_file(tmp_path / "input.json"))]
    np.testing.assert_array_equal(results[0], results[1])
    # Light reaches the volume below the second column only by scattering.
    column = results[0][0].sum(0)
    assert column[:2].sum() > 1.5 * column[2:4].sum() < column[4:].sum()


def test_several_sources_are_rows():
    scene = morgana.load_mcx(configuration(srcpos=np.array([[1.5, 4, -1, 1], [4.5, 4, -1, 3.0]]), srcdir=np.array([[0, 0, 1.0]] * 2)))
    fluence = morgana.render(scene, seed=1).meters["fluence"].mean[0]
    assert 2 < fluence[3:5, 4].sum() / fluence[3:5, 1].sum() < 4


def test_devices_files_and_messages_change_nothing():
    everything = {
        "session": "cube60", "debuglevel": "P", "flog": "log.txt", "issaveseed": 1, "issaveref": 1, "isgpuinfo": 1, "printgpu": False, "minenergy": 1e-5,
        "isspecular": 1, "ismomentum": 1, "maxgate": 10, "faststep": 0, "workload": [50, 50], "respin": 1, "seed": 1648335518, "issave2pt": True,
        "gpuid": "11", "autopilot": 1, "issavedet": 1, "issaveexit": 1, "savedetflag": "dspmxvw",
    }
    gates = {"tstart": 0, "tend": 5e-9, "tstep": 5e-10}
    assert morgana.load_mcx(configuration(**gates, **everything)) == morgana.load_mcx(configuration(**gates))
    assert morgana.load_mcx(configuration(nphoton=np.float64(1e3))) == morgana.load_mcx(configuration(nphoton=1000))
    with pytest.warns(morgana.SceneWarning, match=r"\(isspecular\) 0 changes nothing: light that enters from outside is reflected in part"):
        morgana.load_mcx(configuration(isspecular=0))


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
@pytest.mark.parametrize("given", [{"bc": "______"}, {"bc": "_RRrr_000000"}, {"bc": ""}, {"bc": "aa__aa", "isreflect": 0}])
def test_sides_may_be_said_twice(given):
    """Reflection at sides may be given as flags of MCX and by ``isreflect``."""
    once = {key: value for key, value in given.items() if key != "bc"}
    assert morgana.load_mcx(configuration(**given)) == morgana.load_mcx(configuration(**once))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"nphoton": 1000.5}, "nphoton is 1000.5 but must be a whole number"),
        ({"nphoton": float("nan")}, "nphoton is nan but must be a whole number"),
        ({"respin": 10}, "respin is 10 but must be 1: give the total number of photons as nphoton"),
        ({"seed": np.zeros((16, 5), "uint8")}, "does not replay photons"),
        ({"debuglevel": "PR"}, "random numbers instead of the fluence"),
        ({"maxgate": 3, "tend": 5e-9, "tstep": 1e-9}, "maxgate is 3, less than the number of time gates: leave it out"),
        ({"isspecular": 1, "isreflect": 0}, "give DoMismatch 1 or DoSpecular 0"),
        *[({"bc": flags}, f"bc is '{flags}', but sides") for flags in ("cccccc", "_____x", "aaaaaa", "______001000")],
        ({"bc": "rrrrrr", "isreflect": 0}, "bc is 'rrrrrr', but sides"),
        ({"bc": 5}, "bc is 5, but sides"),
        ({"shapes": "{"}, r"cfg\['shapes'\] is not JSON"),
        ({"shapes": '{"Shapes": [{"Tetrahedron": {"Tag": 2}}]}'}, "unknown shape 'tetrahedron'"),
        ({"shapes": 3}, "Shapes must be a list of shapes"),
    ],
)
def test_what_would_change_the_result_is_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        morgana.load_mcx(configuration(**wrong))
    with pytest.raises(TypeError, match="nphoton is '1e3' but must be a whole number"):
        morgana.load_mcx(configuration(nphoton="1e3"))


def test_shapes_are_drawn_into_the_volume(tmp_path):
    ball = {"Sphere": {"Tag": 2, "O": [3, 4, 3], "R": 2}}
    layers = {"ZLayers": [[1, 2, 1], [7, 10, 2]]}
    vol = np.ones((6, 8, 10), np.uint8)
    drawn = vol.copy()
    drawn[:, :, 6:] = 2
    x, y, z = np.meshgrid(*(np.arange(n) + 0.5 for n in vol.shape), indexing="ij")
    drawn[(x - 3) ** 2 + (y - 4) ** 2 + (z - 3) ** 2 <= 4] = 2
    expected = morgana.load_mcx(configuration(vol=drawn))
    as_list = [layers, ball]
    for shapes in (as_list, {"Shapes": as_list}, json.dumps({"Shapes": as_list}), json.dumps(as_list)):
        assert morgana.load_mcx(configuration(vol=vol, shapes=shapes)) == expected
    # A grid replaces the volume, and a single shape needs no list.
    grid = {"Grid": {"Tag": 1, "Size": [6, 8, 10]}}
    without = {key: value for key, value in configuration(shapes=json.dumps({"Shapes": [grid, layers, ball]})).items() if key != "vol"}
    assert morgana.load_mcx(without) == expected
    assert morgana.load_mcx(configuration(vol=drawn, shapes={"Shapes": ball})) == expected
    (tmp_path / "input.json").write_text(json.dumps({
        "Session": {"Photons": 500},
        "Optode": {"Source": {"Type": "pencil", "Pos": [3.2, 4.1, 0], "Dir": [0, 0, 1]}},
        "Domain": {"OriginType": 1, "Dim": vol.shape, "Media": PROP},
        "Shapes": [grid, layers, ball],
    }))
    results = [morgana.render(scene, seed=1).meters["fluence"].mean for scene in (expected, morgana.load_file(tmp_path / "input.json"))]
    np.testing.assert_array_equal(results[0], results[1])


def test_time_gates_cost_no_flights_unless_windows_are_asked_for():
    gates = configuration(tstart=0, tend=2e-9, tstep=1e-9)
    scenes = [morgana.load_mcx(configuration()), morgana.load_mcx(gates), morgana.load_mcx(gates, weight_windows=True)]
    found = [morgana.render(scene, seed=1) for scene in scenes]
    one, two, windowed = (result.stats["counters"]["edges_in_cells"] for result in found)
    assert one == two < windowed
    assert found[1].meters["fluence"].mean.shape == (2, 10, 8, 6)


def test_large_readings_take_the_memory_that_is_asked_for():
    found = morgana.render(morgana.load_mcx(configuration(tstart=0, tend=2e-9, tstep=1e-9)), seed=1)
    whole, single = found.meters["fluence"], found.reading("fluence", dtype="float32")
    assert single.mean.nbytes + single.error.nbytes == 8 * whole.mean.size
    np.testing.assert_array_equal(single.mean, whole.mean.astype("float32"))
    np.testing.assert_array_equal(single.error, whole.error.astype("float32"))
    assert (single.unit, single.effective, single.few) == (whole.unit, None, None)
    np.testing.assert_array_equal(single.axes["opl"], whole.axes["opl"])
    means = found.reading("fluence", errors=False)
    np.testing.assert_array_equal(means.mean, whole.mean)
    assert means.error.shape == means.mean.shape and np.isnan(means.error).all()
    with pytest.raises(KeyError, match="no reading 'flux': there are 'fluence', 'absorbed'"):
        found.reading("flux")
