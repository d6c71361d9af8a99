"""Scenes of dictionaries: arrays equal files of their content, and mistakes have positions."""

import importlib
import itertools
import pickle

import morgana
import numpy as np
import pytest
from conftest import load, small

RNG = np.random.default_rng(2)
INDEX = 1.3 + 0.1 * RNG.random((4, 5, 6))
"""[z, y, x]"""
EXTINCTION = RNG.random((3, 4, 5)).astype(np.float32)


def picture(scene, **options):
    return morgana.render(load(scene, **options), spp=2).image


def graded(**source):
    box = {"to_world": [{"scale": 3}, {"translate": [-1.5, -1.5, -1.5]}]}
    return small(ior={"type": "bspline", "placement": "nodes", **box, **source})


def cloudy(**source):
    box = {"to_world": [{"scale": 3}, {"translate": [-1.5, -1.5, -1.5]}]}
    volume = {"type": "gridvolume", "placement": "centers", **box, **source}
    return small(type="heterogeneous", sigma_t=volume)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_an_index_in_an_array_is_that_in_a_file(tmp_path, kind):
    np.save(tmp_path / "index.npy", INDEX.astype(kind))
    expected = picture(graded(filename=tmp_path / "index.npy", axis_order="zyx"))
    np.testing.assert_array_equal(picture(graded(data=INDEX.astype(kind))), expected)
    assert (picture(graded(data=INDEX[::-1])) != expected).any()


def test_an_extinction_in_an_array_is_that_in_a_file(tmp_path):
    np.save(tmp_path / "extinction.npy", EXTINCTION)
    expected = picture(cloudy(filename=str(tmp_path / "extinction.npy"), axis_order="zyx"))
    np.testing.assert_array_equal(picture(cloudy(data=EXTINCTION)), expected)


def strided(values):
    wide = np.zeros(tuple(2 * n for n in values.shape), values.dtype)
    wide[::2, ::2, ::2] = values
    return wide[::2, ::2, ::2]


@pytest.mark.parametrize(
    "same",
    [
        np.asfortranarray,
        strided,
        lambda v: v[::-1].copy()[::-1],
        lambda v: v.astype(">f8"),
        lambda v: v.astype(np.longdouble),
        lambda v: v.tolist(),
    ],
)
def test_memory_layout_and_types_do_not_matter(same):
    np.testing.assert_array_equal(picture(graded(data=same(INDEX))), picture(graded(data=INDEX)))


def test_axes_may_be_in_another_order():
    expected = picture(graded(data=INDEX))
    np.testing.assert_array_equal(picture(graded(data=INDEX.transpose(2, 1, 0), axis_order="xyz")), expected)


def test_arrays_are_in_the_hash():
    hashes = {load(graded(data=v)).hash for v in (INDEX, INDEX + 1e-9, INDEX[:, ::-1], INDEX.reshape(5, 4, 6))}
    assert len(hashes) == 4
    assert load(graded(data=INDEX)).hash == load(graded(data=np.asfortranarray(INDEX))).hash


def test_later_changes_of_an_array_do_not_matter():
    values = INDEX.copy()
    scene = load(graded(data=values))
    before = morgana.render(scene, spp=1).image
    values[:] = 1
    np.testing.assert_array_equal(morgana.render(scene, spp=1).image, before)


CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([[q[0], q[i], q[i + 1]] for q in QUADS for i in (1, 2)])


def solid(**shape):
    scene = small()
    scene["ball"] = {"bsdf": {"type": "diffuse", "reflectance": 0.5}, **shape}
    return scene


def test_a_mesh_in_arrays_is_that_in_a_file(tmp_path):
    lines = ["v {} {} {}".format(*x) for x in CORNERS] + ["f {} {} {}".format(*(f + 1)) for f in FACES]
    (tmp_path / "cube.obj").write_text("\n".join(lines))
    expected = picture(solid(type="obj", filename=tmp_path / "cube.obj", face_normals=True))
    for faces in (FACES, FACES.astype(np.uint32), FACES.astype(float), FACES.tolist()):
        found = picture(solid(type="mesh", vertex_positions=CORNERS, faces=faces))
        np.testing.assert_array_equal(found, expected)
    # A cube of diffuse reflectance ½ under a white sky.
    assert 0.2 < expected.min() < 0.6


def test_matrices_points_and_colours_may_be_arrays():
    scene = small()
    matrix = np.eye(4)
    matrix[:3, 3] = [0.3, 0.2, 0.1]
    expected = picture({**scene, "ball": {**scene["ball"], "to_world": matrix.tolist()}})
    for same in (matrix, np.asfortranarray(matrix), [{"translate": np.array([0.3, 0.2, 0.1])}]):
        np.testing.assert_array_equal(picture({**scene, "ball": {**scene["ball"], "to_world": same}}), expected)

    class Transform:
        def __init__(self, matrix):
            self.matrix = matrix

    np.testing.assert_array_equal(
        picture({**scene, "ball": {**scene["ball"], "to_world": Transform(matrix)}}), expected
    )
    red = {"type": "rgb", "value": np.array([0.5, 0.25, 0.125], np.float32)}
    image = picture({**scene, "sky": {"type": "constant", "radiance": red}})
    assert image[0, 0].tolist() == [0.5, 0.25, 0.125]
    scalar = {**scene, "sky": {"type": "constant", "radiance": np.float32(0.5)}}
    assert picture(scalar)[0, 0].tolist() == [0.5] * 3


def test_parameters_take_the_place_of_texts():
    scene = {**small(), "parameters": {"light": 1.0}, "sky": {"type": "constant", "radiance": "$light"}}
    assert picture(scene)[0, 0, 0] == 1 and picture(scene, light=0.5)[0, 0, 0] == 0.5


def refused(scene):
    with pytest.raises(morgana.SceneError) as caught:
        load(scene)
    assert isinstance(caught.value, ValueError)
    errors = [d for d in caught.value.diagnostics if d.severity == "error"]
    assert str(errors[0]) in str(caught.value)
    return errors[0]


def test_mistakes_have_places():
    ior = 'scene["ball"]["interior"]["ior"]'
    found = refused(graded(data=INDEX[0]))
    assert found.where == ior + '["data"]' and "3 axes" in found.message
    found = refused(graded(data=np.where(INDEX > 1.39, np.nan, INDEX)))
    assert found.where == ior + '["data"]' and "not finite" in found.message and "numpy.isfinite" in found.help
    found = refused(graded(data=[]))
    assert found.message.endswith("found an empty array of shape [0]")
    found = refused(graded(data=INDEX, filename="index.npy"))
    assert found.where == ior + '["data"]' and "not both" in found.message
    found = refused(graded(daat=INDEX))
    assert found.where.startswith(ior)
    found = refused(small(sigma_t=-1.0))
    assert found.where == 'scene["ball"]["interior"]["sigma_t"]'
    found = refused({**small(), "ball": {"type": "sphere", "radius": float("nan")}})
    assert found.where == 'scene["ball"]["radius"]'
    found = refused({**small(), "ball": {"type": "sphere", "radius": INDEX}})
    assert found.where == 'scene["ball"]["radius"]' and "does not belong" in found.message
    found = refused(solid(type="mesh", vertex_positions=CORNERS, faces=FACES + 1))
    assert found.where == 'scene["ball"]["faces"]' and "from 0 to 7" in found.message
    found = refused(solid(type="mesh", vertex_positions=CORNERS[:, :2], faces=FACES))
    assert found.where == 'scene["ball"]["vertex_positions"]' and "(n, 3)" in found.message
    found = refused(solid(type="mesh", vertex_positions=CORNERS))
    assert '"faces"' in found.message and found.where == 'scene["ball"]'
    assert "did you mean 'sphere'" in refused(solid(type="shpere")).help


@pytest.mark.parametrize(
    "use",
    [
        lambda hidden: load(graded(data=hidden)),
        lambda hidden: load(graded(data=list(hidden))),
        lambda hidden: morgana.load_field({"type": "bspline", "placement": "nodes", "data": hidden}),
        lambda hidden: load(small()).fields["ambient"].n(hidden[0, 0, :3]),
        lambda hidden: morgana.trace(load(small()), hidden[0, 0, :3], [0, 0, 1]),
        lambda hidden: morgana.trace(load(small()), [0, 0, 1], [list(hidden[0, 0, :3])]),
        lambda hidden: morgana.connect(load(small()), [0, 0, 0], hidden[0, 0, :3]),
        lambda hidden: morgana.compare(hidden[0], INDEX[0]),
        lambda hidden: morgana.write("image.exr", hidden[0]),
    ],
)
def test_hidden_elements_of_arrays_are_refused(use):
    hidden = np.ma.masked_array(INDEX, mask=False)
    hidden[0, 0, 0] = np.ma.masked
    with pytest.raises(ValueError, match=r"masked array.*numpy\.ma\.filled"):
        use(hidden)


@pytest.mark.parametrize(
    "scene",
    [
        graded(data=INDEX + 0j),
        graded(data=INDEX[0, 0] + 1j),
        graded(type="pressure", n0=1.3, dn_dp=1e-10, data=INDEX[0] + 1j),
        solid(type="mesh", vertex_positions=CORNERS + 0j, faces=FACES),
    ],
)
def test_complex_numbers_are_those_of_sound(scene):
    assert "only sound of a 'frequency'" in refused(scene).message


def test_fields_on_their_own_warn_as_scenes_do():
    wave = np.exp(0.5j * np.pi * np.arange(16)) * np.ones((4, 4, 16))
    volume = {"type": "pressure", "n0": 1.3, "dn_dp": 1e-10, "data": wave, "placement": "centers", "frequency": 1e6}
    morgana.load_field({**volume, "sound_speed": 0.25e6})
    with pytest.warns(morgana.SceneWarning, match="the samples are of waves of a length of"):
        morgana.load_field({**volume, "sound_speed": 0.5e6})


def test_complex_amplitudes_have_three_axes():
    wave = {"type": "pressure", "n0": 1.3, "dn_dp": 1e-10, "frequency": 1e6, "sound_speed": 1e6}
    found = refused(graded(**wave, data=INDEX[0] + 1j))
    assert "complex amplitudes have three axes, this array has 2" in found.message


def test_masks_that_hide_nothing_do_not_matter():
    nothing = np.ma.masked_array(INDEX, mask=False)
    np.testing.assert_array_equal(picture(graded(data=nothing)), picture(graded(data=INDEX)))


def test_dictionaries_that_hold_one_another_twice_have_an_end():
    surface, index, numbers = {"type": "diffuse"}, {"type": "constant", "value": 1}, [0.0, 1.0]
    for _ in range(60):
        surface = {"type": "blendbsdf", "a": surface, "b": surface}
        index = {"type": "sum", "a": index, "b": index}
        numbers = [numbers, numbers]
    for scene in [
        {"ball": {"type": "sphere", "bsdf": surface}},
        {"ball": {"type": "sphere", "interior": {"type": "transparent", "ior": index}}},
        {"ball": {"type": "mesh", "faces": numbers}},
    ]:
        with pytest.raises(ValueError, match="more than 65536 copies"):
            morgana.load_dict({"type": "scene", **scene})
    with pytest.raises(ValueError, match="more than 65536 copies"):
        morgana.load_field(index)


def test_fields_at_a_wavelength():
    # N-BK7 at the lines F' and C, by SCHOTT's data sheet.
    glass = {"type": "sellmeier", "b1": 1.03961212, "c1": 0.00600069867, "b2": 0.231792344, "c2": 0.0200179144, "b3": 1.01046945, "c3": 103.560653}
    for wavelength, expected in ((479.9914, 1.52283), (656.2725, 1.51432)):
        assert morgana.load_field(glass, wavelength=wavelength).n([0, 0, 0]) == pytest.approx(expected, abs=1e-5)
    # A gradient-index glass measured at one wavelength.
    rod = {**glass, "nested": {"type": "selfoc", "n0": 1.6, "alpha": 0.3}, "reference_wavelength": 589.3}
    ratio = morgana.load_field(rod, wavelength=450).n([0.5, 0, 0]) / morgana.load_field(rod, wavelength=589.3).n([0.5, 0, 0])
    assert ratio == pytest.approx(1.52532 / 1.51673, abs=2e-5)
    with pytest.raises(morgana.SceneError, match="load_field takes a 'wavelength'"):
        morgana.load_field(glass)
    for wavelength in (0, -500, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="a wavelength must be positive"):
            morgana.load_field(glass, wavelength=wavelength)


def test_what_many_shapes_share_is_no_repetition():
    surface = {"type": "twosided", "nested": {"type": "diffuse"}}
    balls = {f"ball_{i}": {"type": "sphere", "bsdf": surface} for i in range(300)}
    load({**small(), **balls})


def test_what_no_scene_has_is_refused():
    with pytest.raises(TypeError, match=r'scene\["ball"\]\["radius"\] is a '):
        load({**small(), "ball": {"type": "sphere", "radius": object()}})
    with pytest.raises(TypeError, match="complex|expected a number"):
        load({**small(), "ball": {"type": "sphere", "radius": 1j}})
    with pytest.raises(TypeError, match="keys of scenes must be strings"):
        load({1: 2})
    cycle = small()
    cycle["ball"]["interior"] = cycle
    with pytest.raises(RecursionError):
        load(cycle)


def test_differences_from_mitsuba_are_known():
    messages = [note.message for note in load(small()).differences]
    assert any(message.startswith("not as in Mitsuba 3 (path in media)") for message in messages)


def test_memory_limits_what_a_file_may_become(tmp_path):
    np.savez_compressed(tmp_path / "zeros.npz", n=np.ones((256, 256, 300), dtype=np.float32))
    volume = {"type": "bspline", "filename": str(tmp_path / "zeros.npz"), "axis_order": "zyx", "placement": "nodes",
              "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]}
    with pytest.raises(morgana.SceneError, match="--memory"):
        morgana.load_dict(small(ior=volume), memory=10**7)
    morgana.load_dict(small(ior=volume), memory=10**8)


def test_doubts_are_warnings():
    with pytest.warns(morgana.SceneWarning):
        scene = morgana.load_dict({**small(), "light": {"type": "point", "position": [0, 0, 0], "intensity": 0.0}})
    assert scene.warnings and scene.warnings[0].severity == "warning"


def test_errors_in_files_have_lines(tmp_path):
    (tmp_path / "scene.json").write_text('{"type": "scene",\n "ball": {"type": "spher"}}')
    with pytest.raises(morgana.SceneError) as caught:
        morgana.load_file(tmp_path / "scene.json")
    assert caught.value.diagnostics[0].where.endswith("scene.json:2:19")
    with pytest.raises(morgana.SceneError, match="missing.xml"):
        morgana.load_file(tmp_path / "missing.xml")


@pytest.mark.parametrize("names", list(itertools.permutations("xyz")))
def test_axes_with_names_are_put_in_order(names):
    xarray = pytest.importorskip("xarray")
    values = 1.3 + 0.1 * np.random.default_rng(0).random((3, 4, 5))
    points = np.random.default_rng(1).random((20, 3))
    box = {"type": "bspline", "placement": "nodes"}
    array = xarray.DataArray(values, dims=("z", "y", "x")).transpose(*names)
    expected = morgana.load_field({**box, "data": values}).n(points)
    for order in ({}, {"axis_order": "zyx"}, {"axis_order": "xzy"}):
        np.testing.assert_array_equal(morgana.load_field({**box, "data": array, **order}).n(points), expected)
    # Without names of dimensions an array follows NumPy's order; the library calls them dim_0, ….
    np.testing.assert_array_equal(morgana.load_field({**box, "data": xarray.DataArray(values)}).n(points), expected)


def test_named_channels_and_pixels_are_put_in_order():
    xarray = pytest.importorskip("xarray")
    order = importlib.import_module("morgana._numbers").in_order
    values = np.arange(120.0).reshape(2, 3, 4, 5)
    array = xarray.DataArray(values, dims=("z", "y", "x", "wavelength"))
    for names in itertools.permutations(array.dims):
        np.testing.assert_array_equal(order(array.transpose(*names), "data", "zyx"), values)
        np.testing.assert_array_equal(order(array.transpose(*names), "data", "czyx"), np.moveaxis(values, -1, 0))
    pixels = xarray.DataArray(values[0], dims=("y", "x", "band"))
    np.testing.assert_array_equal(order(pixels.transpose("x", "band", "y"), "data", "yx"), values[0])


def test_names_of_axes_that_say_nothing_are_refused():
    xarray = pytest.importorskip("xarray")
    with pytest.raises(ValueError, match=r"the dimensions lat, lon, z, but which of them is x and which y\? Rename them, as in array.rename\(lat='x'\)"):
        morgana.load_field({"type": "bspline", "placement": "nodes", "data": xarray.DataArray(INDEX, dims=("lat", "lon", "z"))})
    table = xarray.DataArray([[0.0, 1.3], [1.0, 1.4]], dims=("row", "column"))
    field = morgana.load_field({"type": "profile", "coordinate": "z", "data": table})
    assert field.n([[0, 0, 0]])[0] == pytest.approx(1.3)


class Swizzled:
    """An array like points and colours of Dr.Jit: it has attributes for all letters of its
    components, including those of `matrix`."""

    def __array__(self, dtype=None, copy=None):
        return np.array([1.0, 2.0, 3.0], dtype)

    matrix = property(lambda self: np.ones(6))


def test_points_of_mitsuba_are_three_numbers():
    field = morgana.load_field({"type": "linear", "n0": 1.3, "slope": Swizzled()})
    assert field.n([[0.0, 0.0, 0.01]])[0] == pytest.approx(1.33)


def test_checks_are_silenced_by_name(recwarn):
    scene = {"type": "scene", "sensor": {"type": "perspective", "fov": 40}}
    with pytest.warns(morgana.SceneWarning, match=r"^warning\[no_emitter\]: "):
        loaded = morgana.load_dict(scene)
    assert [doubt.check for doubt in loaded.warnings] == ["no_emitter"]
    recwarn.clear()
    for silence in ("no_emitter", ["no_emitter", "thin_beam"]):
        assert morgana.load_dict(scene, silence=silence).warnings == []
    assert not recwarn.list
    with pytest.raises(ValueError, match="did you mean 'no_emitter'"):
        morgana.load_dict(scene, silence="no_emiter")
    with pytest.raises(TypeError, match="silence is"):
        morgana.load_dict(scene, silence=[1])


def test_unknown_names_list_the_known_ones():
    scene = load(small())
    with pytest.raises(KeyError, match="no field 'lens': there are 'ambient'"):
        scene.fields["lens"]
    result = morgana.render(scene, spp=1)
    with pytest.raises(KeyError, match="no layer 'deflection': the result has no layer"):
        result.layers["deflection"]
    with pytest.raises(KeyError, match="no reading 'fluence': the result has no reading"):
        result.meters["fluence"]
    assert result.layers.get("deflection") is None and "deflection" not in result.layers
    assert pickle.loads(pickle.dumps(result)).layers == result.layers


class Bitmap:
    """Stand-in for Mitsuba's bitmap: an array that says whether it is encoded as in sRGB."""

    def __init__(self, values, encoded=False):
        self.values = values
        self.encoded = encoded

    @property
    def __array_interface__(self):
        return self.values.__array_interface__

    def srgb_gamma(self):
        return self.encoded


class VolumeGrid:
    """Stand-in for Mitsuba's grids of volumes."""

    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.values, dtype=dtype)


def linear(encoded):
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def painted(**image):
    scene = small()
    scene["ball"] = {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": {"type": "bitmap", **image}}}
    return scene


def test_bitmaps_are_images():
    values = RNG.random((3, 4, 3)).astype(np.float32)
    bytes_ = (255 * values).astype(np.uint8)
    decoded = linear(bytes_ / 255)
    cases = [
        (Bitmap(values), {}, values),
        (values, {}, values),
        (Bitmap(values, encoded=True), {}, linear(values)),
        (Bitmap(values, encoded=True), {"raw": True}, values),
        (Bitmap(bytes_, encoded=True), {}, decoded),
        (Bitmap(bytes_, encoded=False), {}, bytes_ / 255),
        (bytes_, {}, decoded),
        (bytes_, {"raw": True}, bytes_ / 255),
        (np.concatenate([values, values[..., :1]], axis=-1), {}, values),
    ]
    for bitmap, more, pixels in cases:
        expected = picture(painted(data=pixels.astype(np.float32)))
        np.testing.assert_allclose(picture(painted(bitmap=bitmap, **more)), expected, rtol=1e-5)
    with pytest.raises(ValueError, match="give 'bitmap' or 'data', not both"):
        load(painted(bitmap=values, data=values))
    with pytest.raises(TypeError, match=r'scene\["ball"\]\["bsdf"\]\["reflectance"\]\["bitmap"\]'):
        load(painted(bitmap=object()))


def test_environments_may_be_arrays(tmp_path):
    values = RNG.random((4, 8, 3)).astype(np.float32)
    morgana.write(tmp_path / "sky.exr", values)
    scene = solid(type="sphere")
    expected = picture({**scene, "sky": {"type": "envmap", "filename": tmp_path / "sky.exr"}})
    for given in ({"data": values}, {"bitmap": Bitmap(values)}):
        np.testing.assert_array_equal(picture({**scene, "sky": {"type": "envmap", **given}}), expected)
    black = {"type": "envmap", "bitmap": Bitmap(0 * values)}
    light = {"type": "point", "position": [0, 0, -4]}
    assert picture({**scene, "sky": black, "light": light}).max() > 0
    with pytest.raises(morgana.SceneError, match="filename"):
        load({**scene, "sky": {"type": "envmap"}})


def test_grids_of_mitsuba_are_volumes():
    expected = picture(cloudy(data=EXTINCTION))
    for grid in (VolumeGrid(EXTINCTION), VolumeGrid(EXTINCTION[..., None]), EXTINCTION):
        np.testing.assert_array_equal(picture(cloudy(grid=grid)), expected)


def test_lists_may_be_arrays():
    flakes = [1.0, 0.5, 0.2, 0.1, 0.0, 0.0]
    expected = picture(small(phase={"type": "sggx", "S": flakes}))
    np.testing.assert_array_equal(picture(small(phase={"type": "sggx", "S": np.array(flakes)})), expected)
    grid = np.array(flakes, np.float32).reshape(1, 1, 1, 6)
    found = picture(small(phase={"type": "sggx", "S": {"type": "gridvolume", "grid": VolumeGrid(grid)}}))
    np.testing.assert_allclose(found, expected, rtol=1e-4)
