"""The package's public interface: every public item has a docstring; results have a representation,
compare and pickle."""

import ast
import doctest
import inspect
import pickle
import re
import subprocess
import sys
import textwrap

import morgana
import morgana.coherence
import morgana.correlation
import morgana.distributed
import morgana.flow
import morgana.grad
import morgana.lens
import morgana.lens_examples
import morgana.reconstruct
import morgana.schlieren
import morgana.speckle
import numpy as np
import pytest
from conftest import load, meters, small
from morgana import plot

MODULES = [
    morgana,
    morgana.coherence,
    morgana.correlation,
    morgana.distributed,
    morgana.flow,
    morgana.grad,
    morgana.lens,
    morgana.lens_examples,
    morgana.reconstruct,
    morgana.schlieren,
    morgana.speckle,
    plot,
]

ARRAY = {"type": "transducer", "aperture": "linear_array", "elements": 2, "pitch": 1.0, "height": 2.0, "frequency": 1.0, "sound_speed": 1.5}
ARRAY.update({"pressure": 2e5, "n0": 1.333, "dn_dp": 1.4e-10, "min": [-1, -1, 6], "max": [1, 1, 7], "spacing": 0.7})


def public():
    for module in MODULES:
        for name in module.__all__:
            yield f"{module.__name__}.{name}", getattr(module, name)


def described(cls):
    """Returns the attributes of a class with a text below them in the source."""
    try:
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (TypeError, OSError):  # Compiled classes have no source.
        return set()
    pairs = zip(tree.body, tree.body[1:])
    is_text = lambda node: isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)  # noqa: E731
    return {of.target.id for of, text in pairs if isinstance(of, ast.AnnAssign) and is_text(text)}


def members(cls):
    """Returns the public attributes and methods that a class defines, with their texts."""
    texts = described(cls)
    for name in {*vars(cls), *getattr(cls, "__annotations__", {})}:
        if not name.startswith("_"):
            yield name, name in texts or getattr(vars(cls)[name], "__doc__", None)


def arguments(item):
    """Returns the names of parameters in a docstring."""
    try:
        parameters = inspect.signature(item).parameters.values()
    except ValueError:
        return []
    stars = {inspect.Parameter.VAR_KEYWORD: "**", inspect.Parameter.VAR_POSITIONAL: "*"}
    return [stars.get(p.kind, "") + p.name for p in parameters if p.name != "self"]


def functions():
    for name, item in public():
        if inspect.isfunction(item):
            yield name, item
        elif inspect.isclass(item):
            for method, value in vars(item).items():
                if not method.startswith("_") and callable(value) and not inspect.isclass(value):
                    yield f"{name}.{method}", value


def test_every_public_item_has_a_docstring():
    assert [module.__name__ for module in MODULES if not module.__doc__] == []
    missing = []
    for name, item in public():
        if inspect.isclass(item):
            # Skip docstrings inherited from base classes, and those of named tuples, which list
            # only fields.
            own = vars(item).get("__doc__")
            if not own or own.startswith(f"{item.__name__}("):
                missing.append(name)
            missing += [f"{name}.{member}" for member, text in members(item) if not text]
        elif inspect.isroutine(item) and not getattr(item, "__doc__", None):
            missing.append(name)
    assert missing == []


@pytest.mark.parametrize(("name", "item"), list(functions()), ids=lambda value: value if isinstance(value, str) else "")
def test_docstrings_say_what_functions_take_and_return(name, item):
    text = inspect.getdoc(item)
    parts = re.split(r"^(\w+)\n-{3,}\n", text, flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2]))
    lines = re.findall(r"^(\*{0,2}\w[\w, ]*?)(?: : .*)?$", sections.get("Parameters", ""), re.MULTILINE)
    listed = [name for line in lines for name in line.split(", ")]
    assert listed == arguments(item), name
    assert text.splitlines()[0].endswith(".")
    returns = inspect.signature(item).return_annotation if inspect.isfunction(item) else "?"
    assert "Returns" in sections or returns in (None, "None")


def names(module):
    """Returns the names that examples may use without an import: the modules and packages."""
    return {"morgana": morgana, "np": np, **{each.__name__.rpartition(".")[2]: each for each in MODULES[1:]}, **vars(module)}


def named(node, known):
    """Returns the object of a dotted name such as ``morgana.grad.Rays``; `None` if it begins with a
    variable of the example."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    owner = named(node.value, known) if isinstance(node, ast.Attribute) else None
    return getattr(owner, node.attr) if inspect.ismodule(owner) or inspect.isclass(owner) else None


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_examples_of_docstrings_call_what_there_is(module):
    """Examples need scenes and data of users, so they are not run. The test checks that their names
    exist and accept these arguments."""
    texts = {inspect.getdoc(module)}
    for name in module.__all__:
        item = getattr(module, name)
        texts.add(inspect.getdoc(item))
        if inspect.isclass(item):
            texts.update(inspect.getdoc(value) for key, value in vars(item).items() if not key.startswith("_"))
    examples = [example.source for text in texts if text for example in doctest.DocTestParser().get_examples(text)]
    assert examples, module
    known = names(module)
    for source in examples:
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Attribute):
                named(node, known)  # AttributeError: the name does not exist.
            if isinstance(node, ast.Call) and not any(isinstance(argument, ast.Starred) for argument in node.args):
                called = named(node.func, known)
                if called and called.__module__.startswith("morgana"):
                    keywords = [keyword.arg for keyword in node.keywords if keyword.arg]
                    # TypeError: it does not accept the arguments.
                    inspect.signature(called).bind_partial(*node.args, **dict.fromkeys(keywords))



def samples():
    scene = load(small())
    picture = morgana.render(scene, spp=2)
    measured = morgana.render(load(meters()), particles=640)
    detecting = meters()
    skin = {"type": "irradiancemeter", "records": True, "tagged": True}
    sound = {"type": "acoustic", "n0": 1.3, "amplitude": 1e-6, "wave_number": 5.0, "elasto_optic": 0.32}
    detecting["ball"] = {**detecting["ball"], "interior": {**detecting["ball"]["interior"], "ior": sound}, "skin": skin}
    del detecting["sensor"]
    recorded = morgana.render(load(detecting), particles=640).records["irradiancemeter"]
    motion = {recorded.regions[0]: morgana.correlation.brownian(1e-9)}
    light = {"wavelength": 5e-4, "index": 1.3}
    rays = morgana.trace(scene, [[0, 0, -3], [0, 0.1, -3]], [0, 0, 1])
    found = morgana.connect(scene, [0, 0, 0], [0.1, 0.2, 0.3])
    with pytest.raises(morgana.SceneError) as refused:
        load({"type": "scene", "ball": {"type": "sphere", "radius": -1}})
    aov = morgana.render(load(small(), integrator="aov"), spp=1)
    swept = {**small(), "parameters": {"n": 4}}
    swept["sensor"] = {**swept["sensor"], "sampler": {"type": "independent", "sample_count": "$n"}}
    bundle = morgana.grad.Rays([[0, 0, -2]], [0, 0, 1], box=((-1, -1, -1), (1, 1, 1)))
    iteration = morgana.reconstruct.Iteration((4, 4, 4), 1, 2.0, 1)
    camera = morgana.grad.Camera.look_at((0, 0, -5), (0, 0, 0), fov=20, size=(4, 3))
    wall = morgana.grad.Plane((0, 0, 3), (0, 0, 1))
    singlet = morgana.lens.Prescription([morgana.lens.Surface(50.0, 5.0, "F2"), morgana.lens.Surface(thickness=70.0)], entrance_pupil=8.0)
    unit_box = ((-1, -1, -1), (1, 1, 1))
    background = morgana.grad.Background((0, 0, 1), (2, 0, 0), (0, 2, 0), (2, 2))
    at_wall = [[0, 0, 1]]
    return [
        morgana.Device("GPU", "discrete", "driver 1.0", 2**30),
        bundle,
        bundle.forward(np.full((4, 4, 4), 1.2)),
        bundle.vjp(np.full((4, 4, 4), 1.2), optical_lengths=[1.0]),
        bundle.least_squares(np.full((4, 4, 4), 1.2), optical_lengths=[1.0]),
        morgana.grad.Plane((0, 0, 1), (0, 0, 1)),
        morgana.grad.Sphere((0, 0, 1), 1.0),
        morgana.grad.Cylinder((0, 0, 1), (0, 1, 0), 1.0),
        morgana.grad.Conic((0, 0, 1), (0, 0, 1), 0.5),
        morgana.grad.Aperture((0, 0, 1), (0, 0, 1), 0.5),
        morgana.grad.System([1.0, 1.5], [morgana.grad.Sphere((0, 0, 1), 1.0)]),
        bundle.jvp(np.full((4, 4, 4), 1.2), np.ones((4, 4, 4))),
        morgana.grad.ElementArray(ARRAY),
        morgana.reconstruct.posterior(bundle, np.full((4, 4, 4), 1.2), optical_lengths=[1.0], optical_length_noise=0.1, smoothness=1.0),
        camera,
        morgana.grad.BosData.of_camera(camera, np.zeros((3, 4, 2)), background=wall, noise=0.1, box=unit_box),
        background,
        morgana.grad.Screen((0, 0, 3), (2, 0, 0), (0, 2, 0), (2, 2)),
        background.picture(at_wall, np.ones((2, 2))),
        background.vjp(at_wall, np.ones((2, 2)), [1.0]),
        background.least_squares(bundle, 1.2 * np.ones((4, 4, 4)), [1.0], np.ones((2, 2))),
        morgana.grad.GradError("no box"),
        singlet,
        singlet.surfaces[0],
        morgana.lens.glass("F2"),
        morgana.lens.Dispersion("water", 0, (0.4, 1.34, 0.7, 1.33), (400.0, 700.0)),
        morgana.lens.paraxial(singlet),
        morgana.lens.trace(singlet, count=1),
        morgana.lens.wavefront(singlet, count=1),
        morgana.lens.psf(singlet, count=8),
        morgana.lens.mtf(singlet, count=8),
        morgana.lens.Tolerance(0, "radius", 0.1),
        morgana.lens.tolerances(singlet, [morgana.lens.Tolerance(0, "radius", 0.1)], trials=1, count=1),
        iteration,
        morgana.reconstruct.Reconstruction(np.ones((4, 4, 4)), 2.0, "slow", [iteration], 0),
        morgana.reconstruct.residuals(bundle, np.full((4, 4, 4), 1.2), optical_lengths=[1.0], optical_length_noise=0.1),
        morgana.reconstruct.abel([0.5, 1.0], [1e-3, 1e-3], noise=1e-5),
        morgana.reconstruct.integrate(np.zeros((3, 4, 2)), spacing=0.1, noise=1e-5),
        morgana.reconstruct.ReconstructionError("no data"),
        scene,
        scene.parameters(),
        scene.fields["ambient"],
        morgana.load_field({"type": "luneburg"}),
        picture,
        measured,
        aov.layers["exit_position"],
        measured.meters["fluence"],
        2 * aov.layers["exit_position"],
        recorded,
        recorded.power(),
        recorded.jacobian(),
        recorded.modulated([1e8], metres_per_unit=1e-3),
        recorded.modulated_jacobian([1e8], metres_per_unit=1e-3),
        morgana.derivatives(scene, ["sky.emission"], np.ones((8, 12, len(scene.channels))), spp=2)["sky.emission"],
        morgana.coherence.gaussian(1.3e-3, 1e-4),
        morgana.coherence.a_scan(recorded, [3.0], morgana.coherence.gaussian(0.1, 0.01)),
        morgana.correlation.correlate(recorded, [0.0, 1e-3], motion, **light),
        morgana.speckle.Pattern(np.ones((2, 3)), np.arange(3.0), np.arange(2.0), 1.0, 20.0),
        morgana.correlation.speckle_contrast(recorded, [1e-3], motion, **light),
        morgana.correlation.tagged(recorded, wavelength=5e-4),
        morgana.correlation.ModulationDepth(np.ones((2, 3, 1)), np.zeros((2, 3, 1))),
        morgana.sweep(swept, {"n": [2, 3]}),
        rays,
        rays[0],
        morgana.trace(scene, [0, 0, -3], [0, 0, 1], paths=False),
        found,
        found.rays[0],
        morgana.Image({"": picture.image}, {"": picture.channels}, {"seed": "0"}),
        morgana.compare(picture, picture),
        morgana.Pulse.gaussian(30),
        morgana.Denoised(picture.image, picture.image, 0.0, 0.0, picture.channels, {"denoised": "by nobody"}),
        refused.value.diagnostics[0],
        refused.value,
        morgana.FileError("no such file"),
        morgana.RenderError("refused"),
        morgana.Error("wrong"),
        morgana.SceneWarning("doubtful"),
        plot.PlotError("no such plane"),
        morgana.flow.FlowError("no such array"),
        morgana.schlieren.Bos(*[np.zeros((2, 3, n), np.float32) for n in (1, 1, 2, 2, 2)], np.ones((2, 3), bool)),
        morgana.flow.ResamplingError(0.1, 0.2, 0.01, 7),
        morgana.flow.Sampled(np.ones((2, 3, 4)), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), "rho", morgana.flow.ResamplingError(0, 0, 0, 1), 0.0),
    ]


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_what_users_get_has_a_representation_compares_and_pickles():
    given = samples()
    assert {item for _, item in public() if inspect.isclass(item)} - set(map(type, given)) == set()
    for value in given:
        text = repr(value)
        assert "\n" not in text and " at 0x" not in text and type(value).__name__ in text
        assert len(text) < 300 or isinstance(value, (morgana.SceneError, morgana.Diagnostic)), text
        copy = pickle.loads(pickle.dumps(value))
        assert type(copy) is type(value)
        if isinstance(value, (Exception, Warning)):
            assert str(copy) == str(value) and copy.args == value.args
        else:
            assert (copy == value) is True and (copy != value) is False and (copy == "something else") is False


def test_arrays_decide_whether_values_are_equal():
    layer = morgana.Layer(*np.ones((3, 2, 2, 1)), ["Y"])
    assert layer == layer._replace(mean=np.ones((2, 2, 1))) and layer != layer._replace(mean=np.zeros((2, 2, 1)))
    assert layer._replace(mean=np.full((1, 1, 1), np.nan)) == layer._replace(mean=np.full((1, 1, 1), np.nan))


def test_modules_are_attributes_without_an_import():
    """A new process, in which no module has been imported."""
    code = """
import sys, morgana
assert not any(name in sys.modules for name in ("morgana.grad", "morgana.plot", "matplotlib"))
assert {"grad", "plot", "reconstruct", "correlation", "distributed", "render"} <= set(dir(morgana))
assert callable(morgana.grad.parameters) and callable(morgana.plot.image) and callable(morgana.reconstruct.fit)
assert not hasattr(morgana, "gard")
"""
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
