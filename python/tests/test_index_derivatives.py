"""Derivatives of images with respect to the index of scattering media: shapes, names, bits, and
refused arguments. Rust's tests compare them with differences."""

import morgana
import numpy as np
import pytest
from conftest import load, small

BUMP = {"type": "gaussian", "n0": 1.3, "delta": 0.05, "width": 0.4}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder for the images."""
    monkeypatch.chdir(tmp_path)


def written(name, pattern):
    """Writes a file with a grey image. Returns its name."""
    morgana.write(name, pattern.astype(np.float32))
    return name


def foggy(ior=BUMP, **medium):
    """A ball of fog in front of a smooth sky, 6 by 4 pixels in one channel."""
    scene = small(sigma_t=1.5, albedo=0.9, ior=ior, **medium)
    scene["sensor"]["film"].update(width=6, height=4, pixel_format="luminance")
    scene["ball"]["interior"]["id"] = "fog"
    y, x = np.mgrid[:9, :16]
    sky = 1 + 0.8 * np.sin(np.pi * y / 8) * np.cos(2 * np.pi * x / 16)
    scene["sky"] = {"type": "envmap", "filename": written("sky.exr", sky)}
    return scene


def weights():
    return np.linspace(-1, 1, 24).reshape(4, 6, 1)


def test_derivatives_have_the_shapes_of_indices_and_the_same_bits():
    scene = load(foggy())
    found = morgana.derivatives(scene, ["fog.ior", "fog.sigma_a"], weights(), spp=8)
    assert list(found) == ["fog.ior", "fog.sigma_a"]
    assert found["fog.ior"].value.shape == found["fog.ior"].error.shape == (6,)
    parts = morgana.derivatives(scene, ["fog.ior.width", "fog.ior.center"], weights(), spp=8)
    assert parts["fog.ior.center"].value.tolist() == found["fog.ior"].value[2:5].tolist()
    assert parts["fog.ior.width"].value == found["fog.ior"].value[5]
    assert found["fog.sigma_a"].value.shape == (1,)
    assert morgana.derivatives(scene, ["fog.ior"], weights(), spp=8, threads=1)["fog.ior"] == found["fog.ior"]
    assert morgana.derivatives(scene, ["fog.ior"], weights(), spp=8, seed=1)["fog.ior"] != found["fog.ior"]
    assert morgana.derivatives(scene, ["fog.sigma_a"], weights(), spp=8)["fog.sigma_a"] == found["fog.sigma_a"]


def test_derivatives_by_samples_add_up_to_those_by_a_formula():
    """The derivatives by samples of a bump, weighted by the samples' change with its height, add up
    to the derivative by the height: grids resolve it to a per cent."""
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 21)], indexing="ij")
    shape = np.exp(-(x**2 + y**2 + z**2) / (2 * 0.4**2))
    grid = {"type": "bspline", "data": 1.3 + 0.05 * shape, "placement": "nodes", "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]}
    by_samples = morgana.derivatives(load(foggy(grid)), ["fog.ior"], weights(), spp=64)["fog.ior"]
    by_formula = morgana.derivatives(load(foggy()), ["fog.ior"], weights(), spp=64)["fog.ior"]
    assert by_samples.value.shape == (21, 21, 21)
    assert np.sum(by_samples.value * shape) == pytest.approx(by_formula.value[1], rel=0.02, abs=2e-3)


def test_scenes_whose_light_jumps_are_refused():
    def refused(match, scene, names=("fog.ior",), by=None, **options):
        with pytest.raises(morgana.RenderError, match=match):
            morgana.derivatives(load(scene), list(names), weights() if by is None else by, **options)

    point = {"type": "point", "position": [0, 3, 0], "intensity": 1.0}
    refused("the light of 'point' has sharp edges", {**foggy(), "lantern": point})
    wall = {"type": "rectangle", "to_world": [{"translate": [0, 0, 3]}], "bsdf": {"type": "diffuse"}}
    refused("'wall' is not", {**foggy(), "wall": wall})
    bright = {**wall, "bsdf": {"type": "diffuse", "reflectance": 0.0}, "light": {"type": "area", "radiance": 1.0}}
    refused("give it a bitmap that is dark", {**foggy(), "wall": bright})
    cube = foggy()
    cube["ball"] = {**cube["ball"], "type": "cube", "bsdf": {"type": "dielectric"}}
    refused("'ball' is not", cube)
    refused("the index has no parameter 'height': there are n0, delta, center, width", foggy(), names=["fog.ior.height"])
    refused("is constant, so rays would step over", foggy({**BUMP, "delta": 0.0}))
    refused("no medium 'mist'", foggy(), names=["mist.ior"])
    refused("listed twice", foggy(), names=["fog.ior", "fog.ior"])
    refused("at least two samples", foggy(), spp=1)
    refused("not all finite", foggy(), by=np.full((4, 6, 1), np.nan))

    def never(result):
        raise AssertionError("a render before the check")

    refused("the light of 'point' has sharp edges", {**foggy(), "lantern": point}, by=never)
    refused("no parameter 'height'", foggy(), names=["fog.ior.height"], by=never)
    for blurs in ("photon", "sppm", "vcm"):
        refused(f"the integrator {blurs} blurs light, which then has no derivatives", foggy(), by=never, integrator=blurs)
    paths = [morgana.derivatives(load(foggy()), ["fog.ior"], weights(), spp=4, integrator=name) for name in (None, "path", "bdpt", "particle")]
    assert all(found == paths[0] for found in paths)


def test_fog_with_a_colour_is_grey_where_its_channels_are_alike():
    """Channels of equal extinction have equal derivatives, to rounding; a channel with less
    extinction has another."""
    scene = foggy()
    scene["ball"]["interior"]["sigma_t"] = {"type": "rgb", "value": [1.5, 1.5, 0.2]}
    scene["sensor"]["film"]["pixel_format"] = "rgb"
    scene, by = load(scene), [np.zeros((4, 6, 3)) for _ in range(3)]
    for channel, own in enumerate(by):
        own[..., channel] = weights()[..., 0]
    red, green, blue, all_three = (morgana.derivatives(scene, ["fog.ior.delta"], own, spp=16)["fog.ior.delta"].value for own in [*by, sum(by)])
    assert red == pytest.approx(green, rel=1e-9)
    assert abs(blue - red) > 1e-3 * abs(red)
    assert red + green + blue == pytest.approx(all_three, rel=1e-9)


def smoke(size=2.2, **grid):
    """The ball with voxels of extinction, some of them empty, in a box of this size."""
    pattern = 4 * np.modf(np.arange(5**3).reshape(5, 5, 5) * 0.377)[0] - 1
    where = [{"translate": [-0.5, -0.5, -0.5]}, {"scale": size}]
    volume = {"type": "gridvolume", "data": np.maximum(pattern, 0), "placement": "centers", "to_world": where, **grid}
    scene = foggy()
    scene["ball"]["interior"].update(type="heterogeneous", sigma_t=volume)
    return scene


def test_smoke_has_derivatives_unless_it_jumps():
    scene = load(smoke())
    found = morgana.derivatives(scene, ["fog.ior"], weights(), spp=16)["fog.ior"]
    assert np.isfinite(found.value).all() and (found.value != 0).all()
    for match, other in [("jumps from voxel to voxel", smoke(filter_type="nearest")), ("of 'fog' ends within its shapes", smoke(1.2))]:
        with pytest.raises(morgana.RenderError, match=match):
            morgana.derivatives(load(other), ["fog.ior"], weights(), spp=8)
    # The grid may end where it is empty.
    data = np.pad(np.ones((3, 3, 3)), 1)
    assert np.isfinite(morgana.derivatives(load(smoke(1.2, data=data)), ["fog.ior"], weights(), spp=8)["fog.ior"].value).all()


def test_derivatives_of_layers_by_bounces_add_up():
    def layered(**film):
        scene = foggy()
        scene["sensor"]["film"].update(film)
        return load(scene)

    scene = layered(decomposition="bounce", max_bounces=1)
    names = list(morgana.render(scene, spp=2).layers)
    assert names == ["bounce.0", "bounce.1", "bounce.over"]
    apart = [morgana.derivatives(scene, ["fog.ior"], {name: weights()}, spp=32)["fog.ior"].value for name in names]
    whole = morgana.derivatives(scene, ["fog.ior"], weights(), spp=32)["fog.ior"].value
    assert all(np.abs(value).max() > 0 for value in apart)
    np.testing.assert_allclose(sum(apart), whole, rtol=1e-9, atol=1e-12)
    gates = layered(decomposition="length", min_bound=0, max_bound=9, bin_width=3)
    with pytest.raises(morgana.RenderError, match="jumps when its optical length changes.*give weights of the whole picture"):
        morgana.derivatives(gates, ["fog.ior"], {"length.0": weights()}, spp=32)
    np.testing.assert_array_equal(morgana.derivatives(gates, ["fog.ior"], weights(), spp=32)["fog.ior"].value, whole)


def test_silhouettes_of_glass_that_rays_graze_are_refused():
    glass = {"type": "dielectric"}
    core = {"type": "sphere", "center": [0.1, 0.1, 0.2], "radius": 0.4, "bsdf": glass, "interior": {"type": "homogeneous", "sigma_t": 1, "ior": 1.6}, "exterior": {"type": "ref", "id": "fog"}}

    def refused(match, depth=-1, core=core, **ball):
        scene = {**foggy(), "integrator": {"type": "path", "max_depth": depth}, "core": core}
        scene["ball"].update(ball)
        with pytest.raises(morgana.RenderError, match=match):
            morgana.derivatives(load(scene), ["fog.ior"], weights(), spp=8)

    refused("meet 'core' from outside.*set it to -1", depth=9)
    refused("of 'core' jumps at its silhouette", core={**core, "bsdf": {**glass, "specular_reflectance": 0.5}})
    refused("edge at which 'core' and 'ball' cross", core={**core, "radius": 0.9, "center": [0.5, 0, 0]})
    sheet = {"type": "rectangle", "to_world": [{"translate": [0, 0, 3]}], "bsdf": {"type": "null"}, "interior": {"type": "ref", "id": "fog"}}
    refused("'core' does not enclose a volume", core=sheet)


def test_polarised_light_is_refused():
    """The image of the integrator stokes differs, also if its layers are not separate."""
    scene = load({**foggy(), "integrator": {"type": "stokes", "nested": {"type": "path"}}})
    for name in ["fog.ior", "fog.sigma_a"]:
        with pytest.raises(morgana.RenderError, match="leave out the integrator stokes"):
            morgana.derivatives(scene, [name], weights(), spp=2)


def test_lost_paths_are_counted(monkeypatch):
    """Lost paths take long: between perfect mirrors."""
    found = morgana.derivatives(load(foggy()), ["fog.ior"], weights(), spp=2)["fog.ior"]
    monkeypatch.setattr(morgana._morgana, "differentiate_index", lambda *_: ([(found.value, found.error)], (48, 3), False))
    with pytest.warns(morgana.SceneWarning, match="3 of 48 paths were lost"):
        assert morgana.derivatives(load(foggy()), ["fog.ior"], weights(), spp=2)["fog.ior"] == found


def test_a_panel_must_be_dark_at_its_edge():
    def panel(pattern):
        scene = foggy()
        del scene["sky"]
        image = {"type": "bitmap", "filename": written("pattern.exr", pattern), "raw": True, "wrap_mode": "clamp"}
        scene["panel"] = {
            "type": "rectangle",
            "to_world": [{"scale": 3}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 2]}],
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "light": {"type": "area", "radiance": image},
        }
        return load(scene)

    y, x = np.mgrid[:12, :12] / 11
    window = 16 * x * (1 - x) * y * (1 - y)
    found = morgana.derivatives(panel(window), ["fog.ior"], weights(), spp=16)["fog.ior"]
    assert np.isfinite(found.value).all() and np.abs(found.value).max() > 0
    with pytest.raises(morgana.RenderError, match="'panel' must be dark at its edge"):
        morgana.derivatives(panel(window + 0.1), ["fog.ior"], weights(), spp=16)


def test_derivatives_that_single_paths_make_up_are_told():
    """Within a steep ball of thin fog, totally reflected rays contribute more the longer they go;
    short paths cause no warning."""
    steep = {"type": "linear_square", "n0": 5.5**0.5, "slope": [4.0, 0, 0]}
    scene = foggy(steep)
    scene["ball"]["bsdf"] = {"type": "dielectric"}
    scene["ball"]["interior"].update(sigma_t=0.02)
    inside = {"origin": [-0.5, 0, 0], "target": [-1, 0.6, 0], "up": [0, 0, 1]}
    scene["sensor"].update(fov=100, to_world=[{"lookat": inside}])
    scene["integrator"] = {"type": "path", "max_depth": 2}
    short = morgana.derivatives(load(scene), ["fog.ior.n0"], weights(), spp=128)["fog.ior.n0"]
    assert abs(short.value) < 100
    scene["integrator"] = {"type": "path", "max_depth": -1}
    with pytest.warns(morgana.SceneWarning, match="single batches of samples make nearly all of the scatter"):
        morgana.derivatives(load(scene), ["fog.ior.n0"], weights(), spp=128)
