"""Denoising with a stand-in for pyoidn whose results are known, and with pyoidn itself if it is
installed."""

import pathlib
import pickle
import sys
import types

import morgana
import numpy as np
import pytest
from conftest import load, meters, small


class StandIn(types.ModuleType):
    """Adds ``shift`` to its input, and keeps the arguments."""

    def __init__(self, shift=0.0):
        super().__init__("pyoidn")
        self.shift = shift
        self.calls = []

    def denoise(self, color, albedo=None, normal=None, *, hdr=False):
        assert hdr and color.dtype == np.float32 and color.flags["C_CONTIGUOUS"] and color.shape[2] == 3
        self.calls.append((color, albedo, normal))
        return color + np.float32(self.shift)


@pytest.fixture
def stand_in(monkeypatch):
    module = StandIn()
    monkeypatch.setitem(sys.modules, "pyoidn", module)
    return module


def guided():
    """A diffuse ball under uniform light, with layers of albedo and normals."""
    scene = small()
    scene["integrator"] = {"type": "aov", "aovs": "albedo, sh_normal", "light": {"type": "path"}}
    scene["ball"] = {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.25}}
    return morgana.render(load(scene), spp=8, seed=1)


def test_differences_are_in_standard_errors(stand_in):
    stand_in.shift = 1.0
    noisy = np.full((2, 3, 3), 0.75)
    error = np.full(noisy.shape, 0.25)
    error[0, 0] = 0.0
    error[1, 2] = 0.5
    found = morgana.denoise(noisy, error=error)
    assert np.array_equal(found.image, noisy + 1)
    expected = np.full(noisy.shape, 4.0)
    expected[0, 0] = np.nan
    expected[1, 2] = 2.0
    assert np.array_equal(found.difference, expected, equal_nan=True)
    assert (found.beyond_three, found.unknown) == (4 / 5, 1 / 6)
    stand_in.shift = 0.0
    still = morgana.denoise(noisy, error=error)
    assert not still.difference.any() and (still.beyond_three, still.unknown) == (0.0, 0.0)


def test_guides_come_from_layers_or_arguments(stand_in):
    result = guided()
    found = morgana.denoise(result)
    ((color, albedo, normal),) = stand_in.calls
    assert np.array_equal(albedo, result.layers["albedo"].mean)
    assert np.array_equal(normal, result.layers["sh_normal"].mean)
    assert np.array_equal(found.image, result.image)
    assert found.attributes["denoised"].endswith("with albedo, sh_normal")
    own = np.zeros((8, 12, 3))
    morgana.denoise(result, albedo=own, guides=False)
    _, albedo, normal = stand_in.calls[-1]
    assert not albedo.any() and normal is None
    assert "without guides" in morgana.denoise(result, guides=False).attributes["denoised"]
    assert stand_in.calls[-1][1:] == (None, None)


def test_files_say_that_they_are_denoised(stand_in, tmp_path):
    result = guided()
    result.write(tmp_path / "noisy.exr")
    found = morgana.denoise(tmp_path / "noisy.exr")
    assert found.difference.shape == (8, 12, 3) and "trust" not in found.attributes
    assert pickle.loads(pickle.dumps(found)) == found
    assert "moved by more than 3 standard errors" in repr(found) and "<img" in found._repr_html_()
    found.write(tmp_path / "denoised.exr")
    written = morgana.read(tmp_path / "denoised.exr")
    assert set(written.layers) == {"denoised", "difference"}
    assert written.attributes["denoised"].startswith("by Open Image Denoise")
    order = [written.channels["denoised"].index(c) for c in found.channels]
    assert np.array_equal(written.layers["denoised"][:, :, order], found.image)
    found.write(tmp_path / "denoised.png")
    assert b"denoised" in (tmp_path / "denoised.png").read_bytes()
    for refused in (tmp_path / "denoised.exr", written, found):
        with pytest.raises(morgana.RenderError, match="denoised already"):
            morgana.denoise(refused)
    with pytest.raises(morgana.RenderError, match="which say that they are denoised"):
        found.write(tmp_path / "denoised.npy")


def test_any_brightness_and_number_of_channels(stand_in):
    for level in (1e-20, 1.0, 1e12):
        for shape in ((4, 5), (4, 5, 1), (4, 5, 2), (4, 5, 4)):
            noisy = np.full(shape, level)
            found = morgana.denoise(noisy)
            assert found.image.shape == noisy.reshape(4, 5, -1).shape
            assert np.allclose(found.image.ravel(), level, rtol=1e-6)
            assert found.difference is found.beyond_three is None
            assert all(0.3 < color.max() < 1.5 for color, _, _ in stand_in.calls)
    assert morgana.denoise(np.zeros((3, 3))).image.max() == 0


@pytest.mark.parametrize(
    "options, message",
    [
        ({"normal": np.zeros((8, 12, 3))}, "only beside an albedo"),
        ({"albedo": np.zeros((8, 12))}, r"the albedo must have shape \(8, 12, 3\)"),
        ({"error": np.zeros((8, 11, 3))}, r"the error must have shape \(8, 12, 3\)"),
    ],
)
def test_what_does_not_fit_is_refused(stand_in, options, message):
    with pytest.raises(morgana.RenderError, match=message):
        morgana.denoise(np.ones((8, 12, 3)), **options)


def test_what_is_no_light_is_refused(stand_in):
    with pytest.raises(morgana.RenderError, match="not light"):
        morgana.denoise(morgana.render(load(small("aov")), spp=1))
    with pytest.raises(morgana.RenderError, match="no picture"):
        morgana.denoise(morgana.render(load(meters()), particles=100))
    with pytest.raises(morgana.RenderError, match="not finite"):
        morgana.denoise(np.full((2, 2), np.nan))


def test_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(ImportError, match=r'pip install "\.\[denoise\]" in a clone'):
        morgana.denoise(np.ones((2, 2)))


def test_pyoidn_removes_noise():
    """For a ramp with noise of 0.1, the output is closer to the true ramp, and changes little of
    it."""
    pytest.importorskip("pyoidn")
    truth = np.broadcast_to(np.linspace(0.2, 0.8, 96)[None, :, None], (64, 96, 3)) * 1e-9
    error = np.full(truth.shape, 0.1e-9)
    noisy = truth + np.random.default_rng(3).normal(0, error)
    found = morgana.denoise(noisy, error=error)
    rms = [np.sqrt(np.mean((image - truth) ** 2)) for image in (noisy, found.image)]
    assert rms[1] < 0.3 * rms[0], rms
    assert found.beyond_three < 0.02 and found.unknown == 0


def test_the_program_finds_the_same(program, tmp_path):
    pyoidn = pytest.importorskip("pyoidn")
    oidn = pathlib.Path(pyoidn.__file__).parent / "oidn/bin/oidnDenoise"
    if not oidn.exists():
        pytest.skip("pyoidn comes without the program")
    guided().write(tmp_path / "noisy.exr")
    program("denoise", "noisy.exr", "--oidn", oidn, "-o", "program.exr")
    theirs, ours = morgana.read(tmp_path / "program.exr"), morgana.denoise(tmp_path / "noisy.exr")
    order = [theirs.channels["denoised"].index(c) for c in ours.channels]
    assert np.allclose(theirs.layers["denoised"][:, :, order], ours.image, rtol=1e-4, atol=1e-6)
    assert np.allclose(theirs.layers["difference"][:, :, order], ours.difference, rtol=1e-2, atol=1e-3, equal_nan=True)
