"""Content of figures: the data of their artists, labels and limits, compared with the source
arrays."""

import importlib
import sys

import matplotlib.pyplot as plt
import morgana
import numpy as np
import pytest
from conftest import load, meters, small
from matplotlib.colors import LogNorm, to_rgba
from morgana import plot


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    figure.canvas.draw()
    plt.close("all")


@pytest.fixture(scope="module")
def picture():
    scene = small()
    scene["sensor"]["film"].update(decomposition="length, bounce", min_bound=2, max_bound=12, bin_width=2.5, max_bounces=1)
    return morgana.render(load(scene), spp=8)


@pytest.fixture(scope="module")
def fluence():
    return morgana.render(load(meters()), particles=500).meters["fluence"]


def bar_label(artist):
    return artist.colorbar.ax.get_ylabel()


def ends(container):
    """Returns the lower and upper ends of error bars."""
    (bars,) = container[2]
    return np.array([segment[:, 1] for segment in bars.get_segments()]).T


def test_an_image_has_the_picture_and_a_bar(picture, ax):
    artist = plot.image(picture, channel="G", ax=ax)
    np.testing.assert_array_equal(artist.get_array(), picture.image[:, :, 1].astype(float))
    assert artist.axes is ax and artist.norm.vmax == picture.image[:, :, 1].max()
    assert bar_label(artist) == "radiance, G"
    assert ax.get_xlabel() == "column (pixels)" and ax.get_ylabel() == "row (pixels)"
    assert ax.yaxis_inverted()  # Row 0 is at the top.


def test_images_come_from_files_and_arrays(picture, tmp_path, ax):
    morgana.write(tmp_path / "a.exr", picture)
    file = morgana.read(tmp_path / "a.exr")
    ours, theirs = (plot.image(p, layer="length.0001.bounce.0", show="error").get_array() for p in (picture, file))
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)
    np.testing.assert_allclose(
        plot.image(picture, show="error").get_array(), np.sqrt(picture.variance.astype(float)).mean(-1), rtol=1e-6
    )
    mean = plot.image(picture.image, limits=(0, 1)).get_array()
    np.testing.assert_allclose(mean, picture.image.mean(-1, dtype=float), rtol=1e-6)
    grey = plot.image(np.arange(6.0).reshape(2, 3), label="depth (mm)", limits=(1, 4))
    assert grey.get_clim() == (1, 4) and bar_label(grey) == "depth (mm)"


def test_light_appears_as_on_a_screen(picture, tmp_path, ax):
    """The colours of a file that ``write`` makes."""
    pillow = pytest.importorskip("PIL.Image")
    for stops in (None, -1.5):
        picture.write(tmp_path / "a.png", exposure=stops)
        file = np.asarray(pillow.open(tmp_path / "a.png").convert("RGB"))
        for source in (picture, picture.image):
            artist = plot.image(source, exposure=stops, ax=ax)
            np.testing.assert_allclose(255 * artist.get_array(), file, atol=0.51)
            assert artist.colorbar is None
    morgana.write(tmp_path / "a.exr", picture)
    file = morgana.read(tmp_path / "a.exr")
    assert plot.image(file, layer="variance", ax=ax).colorbar is not None
    for shown in ({"channel": "R"}, {"show": "error"}, {"log": True}, {"limits": (0, 1)}, {"label": "radiance"}):
        assert plot.image(picture, **shown).get_array().ndim == 2
        with pytest.raises(plot.PlotError, match="exposure is for light"):
            plot.image(picture, exposure=0, **shown)


def test_signed_values_have_a_diverging_map(ax):
    artist = plot.image([[-1.0, 0.0], [0.5, 3.0]], ax=ax)
    assert artist.get_cmap().name == "RdBu_r" and artist.get_clim() == (-3, 3)
    lopsided = plot.image([[-1.0, 0.0], [0.5, 3.0]], limits=(-1, 2))
    np.testing.assert_allclose([lopsided.norm(v) for v in (-1, 0, 1, 2)], [0, 0.5, 0.75, 1])
    assert lopsided.colorbar.extend == "max"
    sums = plot.image(np.stack([[[1.0, -1.0]]] * 3, -1))  # Stokes parameters have the channels R, G and B.
    assert sums.get_array().ndim == 2 and sums.get_cmap().name == "RdBu_r"
    for unsigned in ([[-1.0, 100.0]], [[0.0, 1.0]], [[-2.0, -1.0]]):
        assert plot.image(unsigned).get_cmap().name == "viridis"


def test_quantities_of_rays_have_units(ax):
    layers = {"": np.zeros((1, 2, 1)), "deflection": np.array([[[1.0, 2.0]]]), "optical_length": np.array([[[1.0]]])}
    image = morgana.Image(layers, {"": ["Y"], "deflection": ["X", "Y"], "optical_length": ["V"]}, {})
    assert bar_label(plot.image(image, layer="deflection", channel="X", ax=ax)) == "deflection, X (rad)"
    assert bar_label(plot.image(image, layer="optical_length")) == "optical_length (scene units)"
    assert bar_label(plot.image(image, layer="optical_length", unit="mm")) == "optical_length (mm)"


def test_a_logarithmic_scale_begins_at_a_percentile(ax):
    values = np.append(np.full(9, 1e-30), np.linspace(1, 10, 991))
    artist = plot.image(values.reshape(10, 100), log=True, ax=ax)
    assert artist.get_clim() == pytest.approx((1, 10), rel=0.02) and artist.colorbar.extend == "min"


def test_a_logarithmic_scale_hides_what_it_cannot_show(ax):
    artist = plot.image([[0.0, 1e-3], [-1.0, 10.0]], log=True, ax=ax)
    assert isinstance(artist.norm, LogNorm) and artist.get_clim() == (1e-3, 10)
    np.testing.assert_array_equal(artist.get_array().mask, [[True, False], [True, False]])
    assert tuple(artist.get_cmap().get_bad()) == to_rgba("0.85")
    with pytest.raises(plot.PlotError, match="logarithmic"):
        plot.image(np.zeros((2, 2)), log=True, ax=ax)


def test_a_profile_has_a_band_of_one_standard_error(picture, ax):
    line = plot.profile(picture, "column", row=3, channel="R", label="R", ax=ax)
    np.testing.assert_array_equal(line.get_xdata(), np.arange(12))
    np.testing.assert_array_equal(line.get_ydata(), picture.image[3, :, 0].astype(float))
    (band,) = ax.collections
    corners = band.get_paths()[0].vertices
    at_5 = corners[corners[:, 0] == 5, 1]
    mean, error = float(picture.image[3, 5, 0]), float(picture.error[3, 5, 0])
    assert at_5.min() == pytest.approx(mean - error) and at_5.max() == pytest.approx(mean + error)
    assert ax.get_xlabel() == "column (pixels)" and ax.get_ylabel() == "radiance"
    assert [text.get_text() for text in ax.legend().get_texts()] == ["R"]
    plot.profile(picture.image, "row", column=0, ax=ax)
    assert len(ax.collections) == 1  # An array has no errors.


def test_a_profile_follows_cells_of_a_meter(fluence, ax):
    line = plot.profile(fluence, "x", y=0.1, z=0.9, unit="mm", ax=ax)
    np.testing.assert_allclose(line.get_xdata(), [-0.75, -0.25, 0.25, 0.75], atol=1e-12)
    np.testing.assert_array_equal(line.get_ydata(), fluence.mean[1, 1, :])
    assert ax.get_xlabel() == "x (mm)" and ax.get_ylabel() == "W/mm²"


def test_a_histogram_is_light_per_length(picture, ax):
    steps = plot.histogram(picture, row=4, column=6, channel="B", ax=ax)
    values, edges, _ = steps.get_data()
    np.testing.assert_allclose(edges, [2, 4.5, 7, 9.5, 12])
    bins = [[layer for name, layer in picture.layers.items() if name.startswith(f"length.000{i}.")] for i in range(4)]
    sums = np.array([sum(float(layer.mean[4, 6, 2]) for layer in layers) for layers in bins])
    errors = np.array([sum(float(layer.variance[4, 6, 2]) ** 0.5 for layer in layers) for layers in bins])
    assert sums.max() > 0 and errors.max() > 0
    np.testing.assert_allclose(values, sums / 2.5, rtol=1e-6)
    np.testing.assert_allclose(ends(ax.containers[0]), [(sums - errors) / 2.5, (sums + errors) / 2.5], rtol=1e-5, atol=1e-9)
    assert ax.get_xlabel() == "optical path length (scene units)" and ax.get_ylabel() == "radiance per unit of length"


def test_a_histogram_of_all_pixels_adds_up_to_the_image(picture, ax):
    values, edges, _ = plot.histogram(picture, unit="mm", ax=ax).get_data()
    outside = [layer for name, layer in picture.layers.items() if ".under" in name[:12] or name.startswith("length.over")]
    rest = sum(layer.mean.mean(dtype=float) for layer in outside)
    assert (values * np.diff(edges)).sum() + rest == pytest.approx(picture.image.mean(dtype=float), rel=1e-5)
    assert not ax.containers and ax.get_ylabel() == "radiance per mm"


def polarised():
    """A wall of light behind a polariser, 5 to 10 away, as far as the filter of the film reaches."""
    film = {"type": "hdrfilm", "width": 2, "height": 2, "decomposition": "length", "min_bound": 0, "max_bound": 10, "bin_width": 5}
    wall = [{"scale": 3}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 6]}]
    return {
        "type": "scene",
        "integrator": {"type": "stokes", "light": {"type": "path"}},
        "sensor": {"type": "orthographic", "film": film},
        "filter": {"type": "rectangle", "to_world": [{"scale": 3}, {"translate": [0, 0, 3]}], "bsdf": {"type": "polarizer"}},
        "wall": {"type": "rectangle", "to_world": wall, "emitter": {"type": "area", "radiance": 1}},
    }


def tagged():
    """A ball of fog in sound, by length and bounces."""
    scene = small("tagged")
    scene["integrator"].update(wavelength=5e-4, delays=2, light={"type": "path"})
    scene["ball"]["interior"]["ior"] = {"type": "acoustic", "n0": 1.3, "amplitude": 1e-4, "wave_number": 9.0, "elasto_optic": 0.32}
    bins = {"min_bound": 0, "max_bound": 100, "bin_width": 25}
    scene["sensor"]["film"].update(decomposition="length, bounce", max_bounces=1, **bins)
    return scene


@pytest.mark.parametrize("scene", [polarised, tagged])
def test_parts_of_light_do_not_count_twice(scene, tmp_path, ax):
    """Stokes parameters, sidebands and delays are shown beside the light, not added to it."""
    result = morgana.render(load(scene()), spp=16)
    result.write(tmp_path / "a.exr")
    for picture in (result, morgana.read(tmp_path / "a.exr")):
        values, edges, _ = plot.histogram(picture, ax=ax).get_data()
        assert (values * np.diff(edges)).sum() == pytest.approx(result.image.mean(dtype=float), rel=1e-5)
    if scene is polarised:
        np.testing.assert_allclose(values * np.diff(edges), [0, 0.5], atol=1e-6)


def test_a_histogram_of_a_meter_has_its_errors(ax):
    mean, error = np.array([[1.0, 2.0], [3.0, 5.0]]), np.array([[0.1, 0.2], [0.3, 0.4]])
    reading = morgana.Reading(mean, error, {"side": None, "opl": np.array([0.0, 0.5, 2.5])}, "W")
    steps = plot.histogram(reading, side=1, unit="mm", ax=ax)
    np.testing.assert_allclose(steps.get_data()[0], [6, 2.5])
    np.testing.assert_allclose(ends(ax.containers[0]), [[5.4, 2.3], [6.6, 2.7]])
    assert ax.get_ylabel() == "W per mm"


def test_a_slice_lies_in_the_scene(fluence, ax):
    mesh = plot.slice(fluence, "xz", y=-1, label="fluence rate", unit="mm", ax=ax)
    np.testing.assert_array_equal(mesh.get_array(), fluence.mean[:, 0, :])
    corners = mesh.get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], fluence.axes["x"])
    np.testing.assert_allclose(corners[:, 0, 1], fluence.axes["z"])
    assert bar_label(mesh) == "fluence rate (W/mm²)" and ax.get_title() == "y from -1 to -0.333"
    assert ax.get_xlabel() == "x (mm)" and ax.get_ylabel() == "z (mm)"
    mean = fluence.mean.copy()
    mean[0, 2, 3] = 0  # Without any arrivals the relative error is unknown.
    turned = plot.slice(fluence._replace(mean=mean), "zx", y=1, show="relative error", label="fluence rate")
    expected = np.where(mean > 0, fluence.error / np.where(mean > 0, mean, 1), np.nan)[:, 2, :].T
    np.testing.assert_allclose(turned.get_array().filled(np.nan), expected)
    assert bar_label(turned) == "relative error, fluence rate"


def test_a_field_is_sampled_in_the_middle_of_cells(ax):
    index = morgana.load_field({"type": "linear", "n0": 1.3, "slope": [0.1, 0, 0.02]})
    mesh = plot.field(index, "zx", z=(0, 4), x=(-1, 1), reference=1.3, resolution=4, unit="mm", ax=ax)
    x, z = np.meshgrid([-0.75, -0.25, 0.25, 0.75], [0.5, 1.5, 2.5, 3.5], indexing="ij")
    np.testing.assert_allclose(mesh.get_array(), 0.1 * x + 0.02 * z, atol=1e-14)
    low, high = mesh.get_clim()
    assert low == -high and bar_label(mesh) == "n − 1.3" and ax.get_xlabel() == "z (mm)"
    plain = plot.field(index, "xy", x=(0, 1), y=(0, 1), z=5, resolution=2)
    np.testing.assert_allclose(plain.get_array(), [[1.425, 1.475]] * 2)
    assert bar_label(plain) == "n"


def test_rays_lie_on_their_field(ax):
    index = morgana.load_field({"type": "linear", "n0": 1.3, "slope": [0.1, 0, 0]})
    plot.field(index, "zx", z=(0, 4), x=(-1, 1), resolution=4, ax=ax)
    rays = morgana.trace(index, [[0, 0, 0], [0.5, 0, 0]], [0, 0, 1], max_length=9)
    lines = plot.rays(rays, "zx", color="white", ax=ax)
    for ray, segment in zip(rays, lines.get_segments()):
        np.testing.assert_array_equal(segment, ray.points[:, [2, 0]])
    assert ax.get_xlim() == (0, 4) and len(lines.get_segments()) == 2
    alone = plot.rays([rays[0], [[0, 0, 0], [0, 0, 20]]], "zx", ax=plt.subplots()[1])
    assert alone.axes.get_xlim()[1] > 20


def test_spots_are_where_rays_arrive(ax):
    # In a constant field rays are straight lines, so that spots at z = 7 are known.
    index = morgana.load_field({"type": "constant", "value": 1.0})
    starts = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 2, 0], [0, -2, 0]])
    rays = morgana.trace(index, starts, [[-0.1, 0, 1], [0.1, 0, 1], [0, -0.1, 1], [0, 0.1, 1]], max_length=1)
    spots = plot.spots(rays, "xy", z=7, unit="mm", ax=ax)
    np.testing.assert_allclose(spots.get_offsets(), [[0.3, 0], [-0.3, 0], [0, 1.3], [0, -1.3]], atol=1e-12)
    assert ax.get_title() == f"RMS radius {np.sqrt((2 * 0.3**2 + 2 * 1.3**2) / 4):.3g} mm" and ax.get_aspect() == 1
    shifted = plot.spots(starts + 5, "yx", ax=ax)
    np.testing.assert_allclose(shifted.get_offsets(), starts[:, [1, 0]])


def test_lost_rays_make_no_spots(ax):
    index = morgana.load_field({"type": "linear_square", "n0": 1.5, "slope": [0, 0, 0.4]})
    rays = morgana.trace(index, [[0, 0, 0], [0, 0, -6.0]], [0, 0, 1], max_length=1)
    assert list(rays.end) == ["maximum length", "lost"]
    assert len(plot.spots(rays, ax=ax).get_offsets()) == 1
    with pytest.raises(plot.PlotError, match="no rays that have arrived"):
        plot.spots(morgana.trace(index, [0, 0, -6.0], [0, 0, 1], max_length=1))


def test_wrong_requests_say_what_there_is(picture, fluence, ax):
    field = morgana.load_field({"type": "luneburg"})
    for message, draw in {
        "no channel 'X'; there are R, G, B": lambda: plot.image(picture, channel="X"),
        "no layer 'length'; there are length.0000": lambda: plot.image(picture, layer="length"),
        "errors are unknown": lambda: plot.image(picture.image, show="error"),
        "show is 'variance'": lambda: plot.image(picture, show="variance"),
        "expected an image": lambda: plot.image(np.zeros(3)),
        "have no layers": lambda: plot.profile(fluence, "x", layer="a", y=0, z=0),
        "'y' has 3 bins: choose one by y=, from -1 to 1": lambda: plot.slice(fluence, "xz"),
        "y is 3 but must be from -1 to 1": lambda: plot.slice(fluence, "xz", y=3),
        "no axis 'r' with bins; there are 'z', 'y', 'x'": lambda: plot.slice(fluence, "rz"),
        "'w' cannot be chosen": lambda: plot.slice(fluence, "xz", y=0, w=1),
        "name two axes": lambda: plot.slice(fluence, "x"),
        "one channel": lambda: plot.slice(fluence, "xz", y=0, channel=1),
        "no bins of length or time": lambda: plot.histogram(morgana.Image({"": picture.image}, {"": list("RGB")}, {})),
        "no axis 'opl'": lambda: plot.histogram(fluence),
        r"x=\(from, to\)": lambda: plot.field(field, "xy", y=(0, 1)),
        "must be x, y or z": lambda: plot.field(field, "xy", x=(0, 1), y=(0, 1), r=1),
        "takes one value": lambda: plot.field(field, "xy", x=(0, 1), y=(0, 1), z=(0, 1)),
        "two of x, y, z": lambda: plot.spots(np.zeros((1, 3)), "xr"),
        "only z": lambda: plot.spots(np.zeros((1, 3)), "xy", x=1),
        "cannot be moved": lambda: plot.spots(np.zeros((1, 3)), "xy", z=1),
        r"shape \(points, 3\)": lambda: plot.rays([np.zeros((4, 2))], "xy"),
    }.items():
        with pytest.raises(plot.PlotError, match=message):
            draw()


def test_without_matplotlib_the_message_says_what_to_install(monkeypatch):
    for name in [n for n in sys.modules if n.startswith("morgana.plot")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r'pip install "\.\[plot\]" in a clone'):
        importlib.import_module("morgana.plot")


def test_a_lens_has_its_rays_and_aberrations(ax):
    from test_lens import triplet

    of = triplet(fields=[0.0, 14.0])
    lines = plot.lens(of, count=3, ax=ax).get_segments()
    assert len(lines) == 6 and ax.get_xlabel() == "z (mm)" and len(ax.patches) == 3
    for line, ray in zip(lines[3:], morgana.lens.trace(of, 14.0, pupil="y", count=3).ends.positions):
        np.testing.assert_allclose(line[-1], ray[[2, 1]])
        # The fourth surface is the stop; points lie on its sphere.
        assert np.hypot(line[4, 0] - of.vertices[3] - 20.29192, line[4, 1]) == pytest.approx(20.29192, abs=1e-6)
    for waves in (False, True):
        drawn = plot.fan(of, 14.0, waves=waves, count=5, ax=ax)
        assert [line.get_label() for line in drawn] == ["486 nm", "588 nm", "656 nm"]
        found = morgana.lens.wavefront(of, 14.0, pupil="y", count=5)
        expected = found.waves if waves else found.bundle.points[:, 1]
        np.testing.assert_allclose(drawn[1].get_ydata(), expected, atol=1e-9)
    tangential, sagittal = plot.modulation(of, [14.0], frequencies=[0.0, 20.0], ax=ax)
    found = morgana.lens.mtf(of, 14.0, frequencies=[0.0, 20.0])
    np.testing.assert_array_equal(tangential.get_ydata(), found.y)
    np.testing.assert_array_equal(sagittal.get_ydata(), found.x)
    assert tangential.get_label() == "14°, y"
    with pytest.raises(plot.PlotError, match="axis is 'z'"):
        plot.fan(of, axis="z")


def test_rays_are_drawn_curved_in_graded_media(ax):
    """Rays parallel to the axis of a SELFOC rod are cosines up to their spherical aberration."""
    selfoc = {"type": "selfoc", "n0": 1.6, "alpha": 0.3, "direction": [0, 0, 1]}
    surfaces = [morgana.lens.Surface(thickness=4.0, material=selfoc), morgana.lens.Surface(thickness=0.5)]
    rod = morgana.lens.Prescription(surfaces, entrance_pupil=0.2)
    line = plot.lens(rod, count=3, ax=ax).get_segments()[2]
    inside = line[(line[:, 0] > 0) & (line[:, 0] < 4)]
    assert len(inside) > 20
    np.testing.assert_allclose(inside[:, 1], 0.1 * np.cos(0.3 * inside[:, 0]), atol=1e-4)
