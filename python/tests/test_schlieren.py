"""Background-oriented schlieren in one step, and fringes, compared with closed forms and one
another."""

import subprocess
import sys

import morgana
import morgana.schlieren as schlieren
import numpy as np
import pytest

SLOPE = 4e-4


def slab(size=24, **lens):
    """A slab of thickness 2 with n² = 1 + g x between a camera at z = −30 and a chequered wall at z = 30."""
    return {
        "type": "scene",
        "parameters": {"slope": SLOPE},
        "integrator": {"type": "path", "max_depth": 1},
        "sensor": {
            "type": "perspective", "fov": 8.0, **lens, "to_world": [{"translate": [0, 0, -30]}],
            "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "luminance", "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": 4},
        },
        "slab": {
            "type": "cube", "to_world": [{"scale": [20, 20, 1]}], "bsdf": {"type": "null"},
            "interior": {"type": "transparent", "ior": {"type": "expression", "n2": "1 + slope*x", "slope": "$slope"}},
        },
        "wall": {
            "type": "rectangle", "to_world": [{"scale": 20}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 30]}],
            "bsdf": {"type": "diffuse", "reflectance": 0}, "emitter": {"type": "area", "radiance": 0.5},
        },
    }


def expected(size=24):
    """Returns pixels on the axis: an angle g/2 · 2 over n³, half the distance to the wall, seen
    from twice the distance."""
    pixels = size / (2 * np.tan(np.radians(4)))
    return 0.5 * SLOPE * 2 * 30 / 60 * pixels


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
@pytest.mark.parametrize("lens", [{}, {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 60.0}])
def test_displacements_of_a_gradient(lens):
    pair = schlieren.bos(slab(**lens), still={"slope": 0}, seed=2)
    assert pair.flow.shape == (24, 24, 1)
    assert pair.valid.all()
    middle = pair.displacement[11:13, 11:13].mean(axis=(0, 1))
    # To 1 %: the error is of second order in the angle of view and the slope.
    assert middle[0] == pytest.approx(expected(), rel=0.01)
    assert abs(middle[1]) < 1e-3
    assert middle[0] > 0.03
    assert np.all(pair.error < 0.01)
    np.testing.assert_allclose(pair.spread, 4 * pair.error, rtol=1e-6)
    # Both images use the same rays; radiance follows n².
    np.testing.assert_allclose(pair.flow, pair.still, rtol=1e-4)
    assert "24 × 24, at most 0." in repr(pair)


def tank(size=24):
    """The slab as a tank of water, from z = −0.5 to beyond the wall. Its face magnifies, whether
    the index varies or not."""
    scene = slab(size, fov=20.0)
    scene["slab"]["to_world"] = [{"scale": [20, 20, 16]}, {"translate": [0, 0, 15.5]}]
    scene["slab"]["bsdf"] = {"type": "dielectric"}
    scene["slab"]["interior"]["ior"]["n2"] = "1.33^2 + slope*x"
    scene["wall"]["to_world"][0] = {"scale": 15}
    return scene


def moved(pixels, size=24):
    """Returns p − q, where the ray of q in still water ends where the ray of p does with the
    gradient, by Newton's method on traced rays."""
    flow, still = morgana.load_dict(tank(size)), morgana.load_dict(tank(size), slope=0)

    def end(scene, p):
        across = (0.5 * size - p) * 2 * np.tan(np.radians(10)) / size
        direction = np.concatenate([across, np.ones((len(p), 1))], axis=1)
        rays = morgana.trace(scene, np.tile([0.0, 0.0, -30.0], (len(p), 1)), direction)
        return np.array([ray.points[-1, :2] for ray in rays])

    aim, q, step = end(flow, pixels), pixels.copy(), 1e-3
    for _ in range(4):
        there = end(still, q)
        slopes = np.stack([(end(still, q + step * axis) - there) / step for axis in np.eye(2)], axis=-1)
        q -= np.linalg.solve(slopes, (there - aim)[..., None])[..., 0]
    np.testing.assert_allclose(end(still, q), aim, atol=1e-9)
    return pixels - q


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_displacements_in_water_are_those_between_the_pictures():
    pixels = np.array([[x, y] for x in (3, 12, 20) for y in (3, 12, 20)])
    expected = moved(pixels + 0.5)
    assert 0.06 < expected[:, 0].min() and expected[:, 0].max() < 0.08
    pair = schlieren.bos(tank(), still={"slope": 0}, spp=1, rays=64, seed=3)
    found = pair.displacement[pixels[:, 1], pixels[:, 0]]
    # Straight rays would be off by up to a pixel. The remaining error comes from the start of rays
    # within a pixel.
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert pair.valid.all()
    assert np.all(np.abs(found - expected) < 3 * pair.error[pixels[:, 1], pixels[:, 0]])


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_without_parameters_varying_indices_become_constant():
    """Formulas do not define an undisturbed index: their medium gets the surrounding index. Other
    fields define it."""
    named, found = (schlieren.bos(slab(8), still=still, spp=1, rays=2) for still in ({"slope": 0}, None))
    assert np.abs(found.displacement).max() > 0.01
    for a, b in zip(named, found):
        np.testing.assert_allclose(a, b, atol=1e-9)
    field = {
        "gladstone_dale": {"data": np.full((4, 4, 4), 1.2), "constant": 2.3e-4, "placement": "nodes", "reference": 1.0, "n0": 1.1},
        "gaussian": {"n0": 1.1, "delta": 0.01, "width": 0.3},
        "sum": {"reference": 1.1, "bump": {"type": "gaussian", "n0": 1.0, "delta": 0.01, "width": 0.3}},
    }
    for kind, parameters in field.items():
        scene = slab(8)
        scene["slab"]["interior"]["ior"] = {"type": kind, **parameters}
        scene["slab"]["bsdf"] = {"type": "dielectric"}
        scene["parameters"] = {}
        undisturbed = morgana.load_dict(scene, undisturbed=True)
        ends = [undisturbed.fields[name].n([[0.1, 0.2, 0.3]])[0] for name in undisturbed.fields if name != "ambient"]
        assert ends == [pytest.approx(1.1, abs=1e-12)], kind
        assert undisturbed.hash != morgana.load_dict(scene).hash


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_files_of_a_pair(tmp_path):
    pair = schlieren.bos(slab(8), still={"slope": 0}, parameters={"slope": 2 * SLOPE}, spp=1, rays=2)
    assert pair.displacement[4, 4, 0] == pytest.approx(2 * expected(8), rel=0.02)
    files = pair.write(tmp_path / "slab")
    assert [file.rpartition("_")[2] for file in files] == ["flow.png", "still.png", "displacement.npy"]
    np.testing.assert_array_equal(np.load(files[2]), pair.displacement)


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_mistakes_of_a_pair_are_named(tmp_path):
    with pytest.raises(morgana.RenderError, match="still is empty"):
        schlieren.bos(slab(), still={})
    with pytest.raises(morgana.SceneError, match="strength"):
        schlieren.bos(slab(), still={"strength": 0})
    with pytest.raises(morgana.RenderError, match="rays is 1 but must be at least 2"):
        schlieren.bos(slab(), still={"slope": 0}, rays=1)
    with pytest.raises(TypeError, match="a Scene has fixed parameters: give bos a file or a dictionary"):
        schlieren.bos(morgana.load_dict(slab()))


def test_mistakes_of_the_command_are_named(tmp_path, monkeypatch, capsys):
    missing = str(tmp_path / "missing.xml")
    command = [sys.executable, "-m", "morgana.schlieren", missing, "--still", "a=0", "-o", str(tmp_path / "x")]
    failed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert failed.returncode == 1
    assert failed.stderr.startswith("error: ") and failed.stderr.count("error: ") == 1
    assert schlieren.main([missing, "--rays", "1", "-o", str(tmp_path / "x")]) == 1
    assert capsys.readouterr().err == "error: rays is 1 but must be at least 2\n"
    # A missing folder is reported before anything is rendered.
    monkeypatch.setattr(schlieren, "bos", None)
    assert schlieren.main([missing, "-o", str(tmp_path / "none" / "x")]) == 1
    told = capsys.readouterr().err
    assert told.startswith("error: cannot write '") and f"there is no folder '{tmp_path / 'none'}'" in told


def test_fringes_keep_the_phase():
    y, x = np.mgrid[:40, :60]
    waves = 0.3 * np.sin(x / 9.0) + 0.1 * y / 40
    for steps, carrier in [(3, (0, 0)), (4, (12, 3)), (7, (0, -5))]:
        series = schlieren.fringes(waves, carrier=carrier, steps=steps, visibility=0.7)
        assert series.shape == (steps, 40, 60)
        assert series.min() >= 0.15 - 1e-12 and series.max() <= 0.85 + 1e-12
        tilt = carrier[0] * (x + 0.5) / 60 + carrier[1] * (y + 0.5) / 40
        difference = schlieren.phase(series) - waves - tilt
        np.testing.assert_allclose(difference, np.rint(difference), atol=1e-12)
    # The carrier has this number of fringes across the image.
    flat = schlieren.fringes(np.zeros((4, 1200)), carrier=(12, 0))[0, 0]
    assert np.sum((flat[:-1] < 0.5) & (flat[1:] >= 0.5)) == 12
    for arguments, message in [({"steps": 0}, "steps is 0"), ({"visibility": 2}, "between 0 and 1")]:
        with pytest.raises(morgana.RenderError, match=message):
            schlieren.fringes(waves, **arguments)
    with pytest.raises(morgana.RenderError, match="at least three images"):
        schlieren.phase(series[:2])
    with pytest.raises(morgana.RenderError, match=r"have the shape \(height, width\)"):
        schlieren.fringes(waves[0])


def beside_a_reference():
    """A bump of the index against a Luneburg lens. Few rays of the lens join the ends of rays
    through the bump; all others are lost."""
    return {
        "type": "scene",
        "integrator": {"type": "aov", "wavelength": 0.05, "reference_index": {"type": "luneburg", "radius": 2.3, "n_exterior": 1.0}},
        "sensor": {
            "type": "orthographic", "to_world": [{"scale": [1.6, 1.6, 1]}, {"translate": [0, 0, -3]}],
            "film": {"type": "hdrfilm", "width": 16, "height": 8, "rfilter": {"type": "box"}},
        },
        "sky": {"type": "constant"},
        "box": {
            "type": "cube", "to_world": [{"scale": [2, 2, 1]}], "bsdf": {"type": "null"},
            "interior": {"type": "transparent", "ior": {"type": "gaussian", "n0": 1, "delta": 0.01, "width": 0.5}},
        },
        "screen": {
            "type": "rectangle", "to_world": [{"scale": [20, 20, 1]}, {"translate": [0, 0, 3]}], "bsdf": {"type": "diffuse"},
        },
    }  # fmt: skip


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_fringes_do_not_count_lost_rays():
    result = morgana.render(morgana.load_dict(beside_a_reference()), spp=64)
    valid, waves = (result.layers[name].mean[..., 0].astype(float) for name in ("valid", "waves"))
    lost, partly = valid == 0, (valid > 0) & (valid < 1)
    assert lost.any() and partly.any()
    found = schlieren.fringes(result)[0]
    np.testing.assert_array_equal(np.isnan(found), lost)
    np.testing.assert_allclose(found[~lost], 0.5 + 0.5 * np.cos(2 * np.pi * (waves / np.where(lost, 1, valid)))[~lost], atol=1e-9)


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
@pytest.mark.parametrize("integrator", [{}, {"aovs": "waves"}, {"light": {"type": "path", "max_depth": 1}}])
def test_fringes_of_files_are_those_of_renders(integrator, tmp_path):
    scene = beside_a_reference()
    scene["integrator"].update(integrator)
    result = morgana.render(morgana.load_dict(scene), spp=4)
    for extension in ("exr", "npy"):
        morgana.write(tmp_path / f"waves.{extension}", result)
    read = morgana.read(tmp_path / "waves.exr")
    np.testing.assert_array_equal(schlieren.fringes(read, carrier=(3, 0)), schlieren.fringes(result, carrier=(3, 0)))
    # NumPy arrays have no channel names.
    with pytest.raises(morgana.RenderError, match="the render has no 'waves': use the integrator aov with a wavelength, and write .exr files"):
        schlieren.fringes(morgana.read(tmp_path / "waves.npy"))
