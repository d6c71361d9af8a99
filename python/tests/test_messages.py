"""Messages for wrong arguments: the argument, and its valid values."""

import concurrent.futures

import morgana
import morgana.coherence
import morgana.correlation
import morgana.distributed
import morgana.flow
import morgana.schlieren
import morgana.speckle
import numpy as np
import pytest
from conftest import SCENES, load, meters, small
from morgana import plot

LENS = SCENES / "grid_lens.xml"
MASKED = np.ma.masked_array(np.zeros((3, 3)), mask=np.eye(3))


@pytest.fixture(scope="module")
def made():
    """Returns arguments of functions: a scene, a field, a result, a reading."""
    scene = load(small())
    reading = morgana.render(load(meters()), particles=640).meters["fluence"]
    return scene, morgana.load_field({"type": "luneburg"}), morgana.render(scene, spp=2), reading


def here():
    return concurrent.futures.ThreadPoolExecutor(1)


IMAGINARY = np.ones(3) + 1j
"""Complex numbers, of which functions for real numbers would use only the real part."""

REAL = [
    lambda: morgana.Pulse.table([0, 1, 2], IMAGINARY),
    lambda: morgana.Pulse.rectangle(1.0).emitted(IMAGINARY),
    lambda: morgana.Pulse.rectangle(1.0).kernel(IMAGINARY),
    lambda: morgana.coherence.tabulated([1, 2, 3], IMAGINARY),
    lambda: morgana.coherence.gaussian(1.0, 0.1).degree(IMAGINARY),
    lambda: morgana.coherence.a_scan(LIGHT, IMAGINARY, morgana.coherence.gaussian(1.0, 0.1)),
    lambda: morgana.correlation.correlate(LIGHT, [0.0], {"haze": lambda delays: delays * 1j}, wavelength=1, index=1),
    lambda: morgana.flow.density(IMAGINARY, 300.0),
    lambda: morgana.schlieren.phase(np.ones((3, 2, 2)) * 1j),
    lambda: morgana.speckle.pattern(LIGHT, (2, 2), 0.1, wavelength=1.0, numerical_aperture=0.5, center=IMAGINARY),
    lambda: morgana.speckle.pattern(LIGHT, (2, 2), 0.1, wavelength=1.0, numerical_aperture=0.5, up=IMAGINARY),
    lambda: LIGHT.gated(IMAGINARY),
    lambda: LIGHT.rescaled({"haze": np.array([1j])}),
    lambda: LIGHT.jacobian({"haze": np.array([1j])}),
]
"""Functions that take real numbers."""

LIGHT = morgana.Records(
    np.zeros(1, int), np.ones((1, 1)), np.zeros((1, 3)), np.array([[0, 0, 1.0]]), np.ones(1), np.zeros(1, int), np.ones((1, 1)),
    np.ones((1, 1), int), np.ones((1, 1)), ["haze"], np.zeros((1, 1)), 1, "W",
)  # fmt: skip


@pytest.mark.parametrize("call", REAL)
def test_complex_numbers_are_no_real_ones(call):
    with pytest.raises(TypeError, match="must be an array of real numbers: elements of type complex128"):
        call()


CASES = [
    # Scenes.
    (lambda s, f, r, m: morgana.load_file("nope.xml"), morgana.SceneError, "nope.xml: cannot read"),
    (lambda s, f, r, m: morgana.load_file(LENS, widht=3), morgana.SceneError, "did you mean 'width'"),
    (lambda s, f, r, m: morgana.load_file(LENS, width="x"), morgana.SceneError, "'x' is not a whole number"),
    (lambda s, f, r, m: morgana.load_file(LENS, width=[1, 2]), TypeError, r"parameter 'width' is \[1, 2\] but must be"),
    (lambda s, f, r, m: morgana.load_file(LENS, width=10**12), morgana.SceneError, "must be at least 1 and at most"),
    (lambda s, f, r, m: morgana.load_file(LENS, integrator=3), TypeError, "integrator is 3 but must be a text"),
    (lambda s, f, r, m: morgana.load_file(LENS, adaptive="yes"), TypeError, "adaptive is 'yes' but must be True or False"),
    (lambda s, f, r, m: morgana.load_file(LENS, memory=-1), morgana.RenderError, "memory is -1 but must be at least 1"),
    (lambda s, f, r, m: morgana.load_dict([1, 2]), TypeError, "a scene as a dictionary, found list"),
    (lambda s, f, r, m: load({**small(), "x": {"type": "shpere"}}), morgana.SceneError, "did you mean 'sphere'"),
    (lambda s, f, r, m: load({**small(), "x": {"type": "sphere", "radius": 1j}}), TypeError, r'scene\["x"\]\["radius"\] is a complex'),
    (lambda s, f, r, m: load({**small(), "x": {"type": "sphere", "radius": np.nan}}), morgana.SceneError, r'NaN is not a finite number\n  at scene\["x"\]'),
    (lambda s, f, r, m: morgana.load_field(None), TypeError, "a volume as a dictionary, found NoneType"),
    (lambda s, f, r, m: morgana.load_field({"type": "lunebrg"}), morgana.SceneError, "did you mean 'luneburg'"),
    # Fields.
    (lambda s, f, r, m: f.n(np.zeros((3, 2))), ValueError, r"points must have shape \(\.\.\., 3\).*\(3, 2\)"),
    (lambda s, f, r, m: f.n("abc"), TypeError, "points must be an array of real numbers"),
    (lambda s, f, r, m: f.n(None), TypeError, "points is None"),
    (lambda s, f, r, m: f.gradient(np.zeros((2, 3), complex)), TypeError, "elements of type complex128"),
    (lambda s, f, r, m: f.hessian([[1, 2, 3], [1, 2]]), TypeError, "points must be an array"),
    (lambda s, f, r, m: f.n(MASKED), ValueError, "points is a masked array"),
    (lambda s, f, r, m: f.n([]), ValueError, r"\(0,\)"),
    (lambda s, f, r, m: f.bounds([1, 1, 1], [0, 0, 0]), ValueError, "from 1 to 0 in x"),
    (lambda s, f, r, m: f.bounds([np.nan, 0, 0], [0, 0, 0]), ValueError, "NaN"),
    # Renders.
    (lambda s, f, r, m: morgana.render("nope.xml"), morgana.SceneError, "nope.xml: cannot read"),
    (lambda s, f, r, m: morgana.render(f), TypeError, "expected a Scene, the path of a scene file or a dictionary, found Field"),
    (lambda s, f, r, m: morgana.render(s, spp=1.5), TypeError, "spp is 1.5 but must be a whole number"),
    (lambda s, f, r, m: morgana.render(s, spp=2**70), morgana.RenderError, "spp is .* but must be at most"),
    (lambda s, f, r, m: morgana.render(s, time="1s"), TypeError, "time is '1s'"),
    (lambda s, f, r, m: morgana.render(s, target="pixel"), morgana.RenderError, "give target_error"),
    (lambda s, f, r, m: morgana.render(s, spp=1, progress="yes"), TypeError, "progress is 'yes'"),
    (lambda s, f, r, m: morgana.render(s, sampls=1), TypeError, "sampls"),
    (lambda s, f, r, m: m.image, AttributeError, "image"),
    # Rays.
    (lambda s, f, r, m: morgana.trace(s, ["a", "b", "c"], [0, 0, 1]), TypeError, "origins must be an array of real numbers"),
    (lambda s, f, r, m: morgana.trace(s, [0, 0, 0], [0, 0, np.inf]), ValueError, r"direction 0 is \[0, 0, inf\]"),
    (lambda s, f, r, m: morgana.trace(s, [0, 0, 0], [0, 0, 1], max_length="1"), TypeError, "max_length is '1'"),
    (lambda s, f, r, m: morgana.trace(s, [0, 0, 0], [0, 0, 1], reference_index=s), TypeError, "reference_index"),
    (lambda s, f, r, m: morgana.trace(s, [0, 0, 0], [0, 0, 1], time=0), morgana.RenderError, "time is 0"),
    (lambda s, f, r, m: morgana.trace(s, [0, 0, 0], [0, 0, 1])[5], IndexError, "no ray 5"),
    (lambda s, f, r, m: morgana.connect(f, [0, 0, 0], [0, 0, 1]), TypeError, "expected a Scene, found Field"),
    (lambda s, f, r, m: morgana.connect(s, [0, 0], [0, 0, 1]), morgana.RenderError, r"a is \[0.0, 0.0\]"),
    (lambda s, f, r, m: morgana.connect(s, [0, 0, 0], [0, 0, np.nan]), morgana.RenderError, "b is .*nan"),
    (lambda s, f, r, m: morgana.connect(s, [0, 0, 0], [0, 0, 1], all=True, reflections=-1), morgana.RenderError, "reflections is -1"),
    (lambda s, f, r, m: morgana.connect(s, [0, 0, 0], [0, 0, 1], reflections=1), morgana.RenderError, "all=True"),
    # Images.
    (lambda s, f, r, m: morgana.read("nope.exr"), morgana.FileError, "nope.exr: cannot read"),
    (lambda s, f, r, m: morgana.write("a.jpg", r), morgana.FileError, "images are written to .exr, .png and .npy"),
    (lambda s, f, r, m: morgana.write("a.exr", np.zeros(3)), morgana.RenderError, r"\(height, width, channels\), found \(3,\)"),
    (lambda s, f, r, m: morgana.write("a.exr", np.zeros((0, 3))), morgana.RenderError, "found"),
    (lambda s, f, r, m: morgana.write("a.exr", np.zeros((2, 2)), attributes={"a": 3}), TypeError, r"attributes\['a'\] is 3"),
    (lambda s, f, r, m: morgana.write("a.exr", r, attributes={"a": "3"}), morgana.RenderError, "a result writes its own"),
    (lambda s, f, r, m: morgana.compare(np.zeros((2, 3)), np.zeros((3, 3))), morgana.RenderError, "3 x 2 pixels"),
    (lambda s, f, r, m: morgana.compare(np.full((2, 3), np.nan), np.zeros((2, 3))), morgana.RenderError, "NaN at pixel"),
    (lambda s, f, r, m: morgana.compare(r, r, block=1.5), TypeError, "block is 1.5"),
    # Many runs.
    (lambda s, f, r, m: morgana.sweep(LENS, {"width": "12"}), TypeError, "values of 'width' are '12': give a list"),
    (lambda s, f, r, m: morgana.sweep(LENS, {"width": [12]}, fixed={"width": 3}), morgana.RenderError, "both varied and fixed"),
    (lambda s, f, r, m: morgana.sweep(s, {"width": [12]}), KeyError, "no parameter 'width': similar names are 'sensor.film.width'"),
    (lambda s, f, r, m: morgana.distributed.render(s, None), TypeError, "an executor with a method submit"),
    (lambda s, f, r, m: morgana.distributed.render(s, here(), shards=0), morgana.RenderError, "shards is 0"),
    (lambda s, f, r, m: morgana.distributed.render(s, here(), retries=-1), morgana.RenderError, "retries is -1"),
    # Figures.
    (lambda s, f, r, m: plot.image("a.exr"), plot.PlotError, r"morgana.read\('a.exr'\)"),
    (lambda s, f, r, m: plot.image(r, limits=3), plot.PlotError, "limits is 3"),
    (lambda s, f, r, m: plot.field(s, "xz", x=(0, 1), z=(0, 1)), plot.PlotError, "Scene.fields"),
    (lambda s, f, r, m: plot.rays(morgana.trace(s, [0, 0, 0], [0, 0, 1], paths=False), "xz"), plot.PlotError, "paths=False"),
]


@pytest.mark.parametrize(("call", "kind", "message"), CASES, ids=[str(i) for i in range(len(CASES))])
def test_messages_say_what_is_wrong(made, call, kind, message):
    with pytest.raises(kind, match=message):
        call(*made)
