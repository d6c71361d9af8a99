"""Derivatives of rays through lenses with respect to all parameters of fields and surfaces, forward
and backward; and messages for invalid arguments."""

import itertools

import morgana
import numpy as np
import pytest
from morgana import grad

BOX = ((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5))
RNG = np.random.default_rng(5)
COUNT = 40


def samples():
    z, y, x = np.meshgrid(*(np.linspace(-1.5, 1.5, n) for n in (9, 10, 8)), indexing="ij")
    return 1.5 + 0.03 * np.sin(2 * x + y) * np.cos(1.5 * z - 0.5 * y)


def gaussian(n0=1.1, delta=0.1, center=(0.1, 0.05, 0.9), width=0.4):
    return morgana.load_field({"type": "gaussian", "n0": n0, "delta": delta, "center": list(center), "width": width})


PARTS = {
    "surfaces[0].vertex": (0.02, 0, -0.6),
    "surfaces[0].axis": (0.1, -0.04, 2.0),
    "surfaces[0].curvature": 0.6,
    "surfaces[0].conic": -0.8,
    "surfaces[2].center": (0, 0.05, -1.0),
    "surfaces[2].radius": 1.4,
    "surfaces[3].point": (0.05, 0, 1.9),
    "surfaces[3].axis": (0.2, 2.0, 0.1),
    "surfaces[3].radius": 1.0,
    "surfaces[4].point": (0, 0, 1.3),
    "surfaces[4].normal": (0.05, 0.02, 0.5),
    "media[0]": 1.2,
    "media[2].n0": 1.1,
    "media[2].delta": 0.1,
    "media[2].center": (0.1, 0.05, 0.9),
    "media[2].width": 0.4,
    "media[3]": 1.4,
    "media[4]": 1.0,
}


def train(index=None, **changed):
    p = {**PARTS, **changed}
    part = lambda prefix: {name.split(".")[1]: value for name, value in p.items() if name.startswith(prefix + ".")}  # noqa: E731
    bump = gaussian(**part("media[2]"))
    surfaces = [
        grad.Conic(**part("surfaces[0]")),
        grad.Aperture((0, 0, -0.1), (0, 0.1, 1), 0.6),
        grad.Sphere(**part("surfaces[2]")),
        grad.Cylinder(**part("surfaces[3]")),
        grad.Plane(**part("surfaces[4]")),
    ]
    return grad.System([p["media[0]"], samples() if index is None else index, bump, p["media[3]"], p["media[4]"]], surfaces)


def rays(exit=grad.Plane((0, 0, 2), (0.2, 0.1, 2)), count=COUNT, tolerance=1e-10):
    rng = np.random.default_rng(2)
    origins = np.column_stack([rng.uniform(-0.3, 0.3, (count, 2)), np.full(count, -1.3)])
    return grad.Rays(origins, rng.uniform(-0.1, 0.1, (count, 3)) + [0, 0, 1], box=BOX, exit=exit, tolerance=tolerance)


WEIGHTS = {"positions": RNG.normal(size=(COUNT, 3)), "directions": RNG.normal(size=(COUNT, 3)), "optical_lengths": RNG.normal(size=COUNT)}


def loss(ends):
    return sum(float(np.sum(weights * getattr(ends, name))) for name, weights in WEIGHTS.items())


def slope(f, h):
    """Returns f′(0) by central differences, extrapolated once."""
    central = lambda h: (f(h) - f(-h)) / (2 * h)  # noqa: E731
    return (4 * central(h / 2) - central(h)) / 3


def test_gradients_by_all_parameters_of_a_lens():
    bundle = rays()
    gradient = bundle.vjp(train(), **WEIGHTS)
    assert list(gradient.parameters) == list(grad.parameters(train()))
    checked = {"media[1]"}
    for name, value in PARTS.items():
        checked.add(name)
        for at in itertools.product(*map(range, np.shape(value))):
            step = np.zeros(np.shape(value))
            step[at] = 1.0
            expected = slope(lambda h: loss(bundle.forward(train(**{name: np.asarray(value) + h * step}))), 1e-3)
            assert gradient.parameters[name][at] == pytest.approx(expected, rel=2e-6, abs=2e-6 * np.abs(gradient.parameters[name]).max() + 1e-6), name
    assert checked == set(gradient.parameters)
    np.testing.assert_array_equal(np.concatenate([by.ravel() for by in gradient.parameters.values()]), gradient.field)
    # Coefficients are f32.
    change = RNG.normal(size=samples().shape)
    expected = slope(lambda h: loss(bundle.forward(train(samples() + h * change))), 2e-3)
    assert abs(np.sum(gradient.parameters["media[1]"] * change) - expected) < 3e-5 * np.linalg.norm(gradient.parameters["media[1]"])


def test_gradients_by_the_exit():
    point, normal = np.array([0, 0, 2.0]), np.array([0.2, 0.1, 2.0])
    by = rays().vjp(train(), **WEIGHTS).exit
    for i in range(3):
        step = np.eye(3)[i]
        moved = slope(lambda h: loss(rays(grad.Plane(point + h * step, normal)).forward(train())), 1e-3)
        turned = slope(lambda h: loss(rays(grad.Plane(point, normal + h * step)).forward(train())), 1e-3)
        np.testing.assert_allclose([by.point[i], by.normal[i]], [moved, turned], rtol=1e-6, atol=1e-6)
    box = grad.Rays([[0, 0, -2]], [0, 0, 1], box=BOX)
    assert box.vjp(samples(), positions=[[1, 0, 0]]).exit is None


@pytest.mark.parametrize("through", [train, gaussian, samples])
def test_forward_mode_is_the_transpose(through):
    bundle, index = rays(), through()
    gradient = bundle.vjp(index, **WEIGHTS)
    field, origins, directions = (RNG.normal(size=by.shape) for by in (gradient.field, gradient.origins, gradient.directions))
    exit = grad.Plane(RNG.normal(size=3), RNG.normal(size=3))
    change = bundle.jvp(index, field, origins=origins, directions=directions, exit=exit)
    forward = [np.sum(WEIGHTS[name] * of) for name, of in zip(WEIGHTS, change)]
    backward = [np.sum(gradient.field * field), np.sum(gradient.origins * origins), np.sum(gradient.directions * directions)]
    backward += [np.sum(gradient.exit.point * exit.point), np.sum(gradient.exit.normal * exit.normal)]
    assert abs(sum(forward) - sum(backward)) < 1e-12 * np.abs(forward + backward).sum()


def test_changes_of_named_parameters():
    bundle, index = rays(), train()
    flat = {name: np.zeros(np.shape(value)) for name, value in grad.parameters(index).items()}
    flat["surfaces[2].radius"] = np.array(1.0)
    vector = np.concatenate([value.ravel() for value in flat.values()])
    assert bundle.jvp(index, {"surfaces[2].radius": 1.0}) == bundle.jvp(index, vector)


TURNED = [{"rotate": {"axis": [1, 2, 0], "angle": 30}}, {"scale": 1.2}]
CUBE = [{"scale": 3}, {"translate": [-1.5, -1.5, -1.5]}]
BUMP = {"type": "gaussian", "n0": 1.3, "delta": 0.1, "width": 0.5}
FIELDS = [
    ({"type": "constant", "value": 1.3}, "value"),
    ({"type": "linear", "n0": 1.3, "slope": [0.1, -0.05, 0.08]}, "n0 slope origin"),
    ({"type": "linear_square", "n0": 1.3, "slope": [0.1, -0.05, 0.08]}, "n0 slope origin"),
    ({"type": "luneburg", "radius": 1.6}, "n_exterior center radius"),
    ({"type": "selfoc", "n0": 1.5, "alpha": 0.4}, "n0 alpha origin direction"),
    ({"type": "fisheye", "n0": 1.9, "radius": 1.6}, "n0 center radius"),
    ({**BUMP, "to_world": TURNED}, "n0 delta center width to_world"),
    (
        {"type": "acoustic", "n0": 1.33, "amplitude": 0.01, "wave_number": 4.0, "order": 2, "phase": 0.3, "time_phase": 0.5},
        "n0 origin direction reference amplitude wave_number phase time_phase",
    ),
    ({"type": "expression", "n": "a + b*exp(-(x^2 + 2*y^2)/w^2)", "a": 1.3, "b": 0.1, "w": 0.7}, "a b w"),
    ({"type": "expression", "n2": "a - b*rho^g", "a": 2.2, "b": 0.2, "g": 2.0}, "a b g"),
    ({"type": "profile", "coordinate": "z", "data": [[-2, 1.3], [-0.5, 1.35], [0.4, 1.4], [1.2, 1.38], [3, 1.35]]}, "samples"),
    ({"type": "bspline", "data": samples(), "placement": "nodes", "to_world": CUBE}, "samples to_world"),
    (
        {
            "type": "pressure",
            "data": (1e5 * (samples() - 1.5j)),
            "placement": "nodes",
            "to_world": CUBE,
            "n0": 1.33,
            "dn_dp": 1.4e-10,
            "frequency": 1e6,
            "sound_speed": 1e6,
        },
        "n0 amplitude to_world",
    ),
    (
        {"type": "sum", "reference": 1.3, "a": BUMP, "b": {"type": "constant", "value": 1.32}},
        "reference terms[0].n0 terms[0].delta terms[0].center terms[0].width terms[1].value",
    ),
]


@pytest.mark.filterwarnings("ignore:.*samples are of waves:morgana.SceneWarning")
@pytest.mark.parametrize(("volume", "names"), FIELDS, ids=lambda value: value["type"] if isinstance(value, dict) else "")
def test_every_type_of_field(volume, names):
    """Checks names, values and transposes; tests of the compiled part compare every number with
    differences."""
    field = morgana.load_field(volume)
    numbers = grad.parameters(field)
    assert set(numbers) - {"to_world"} == set(names.split()) - {"to_world"}
    for name in set(numbers) & set(volume) - {"to_world"}:
        np.testing.assert_allclose(numbers[name], volume[name], atol=1e-12)
    bundle = rays()
    gradient = bundle.vjp(field, **WEIGHTS)
    change = RNG.normal(size=gradient.field.shape)
    forward = [np.sum(WEIGHTS[name] * of) for name, of in zip(WEIGHTS, bundle.jvp(field, change))]
    terms = gradient.field * change
    assert abs(sum(forward) - terms.sum()) < 1e-12 * (np.abs(forward).sum() + np.abs(terms).sum())


@pytest.mark.parametrize(
    ("volume", "names"),
    [
        ({"type": "gladstone_dale", "data": samples(), "placement": "nodes", "constant": 2.3e-4}, "samples"),
        ({"type": "standard_atmosphere", "constant": 2.3e-4, "radius": 6.371e6}, "samples"),
        ({"type": "cauchy", "a": 1.5, "b": 0.004}, "value"),
        ({"type": "cauchy", "a": 1.5, "b": 0.004, "reference_wavelength": 589, "ior": BUMP}, "n0 delta center width factor"),
    ],
    ids=["gas", "atmosphere", "glass", "graded glass"],
)
def test_fields_that_are_made_into_others_have_the_parameters_of_these(volume, names):
    """Parameters agree with the table of docs/guides/inverse-problems.md#parameters-of-fields."""
    wavelength = 550.0 if volume["type"] == "cauchy" else None
    assert list(grad.parameters(morgana.load_field(volume, wavelength=wavelength))) == names.split()


def test_an_ellipsoid_has_no_spherical_aberration():
    """From air into glass of index n, a surface of conic −1/n² focuses all rays parallel to its
    axis at the distance nR/(n − 1)."""
    optimize = pytest.importorskip("scipy.optimize")
    n, radius = 1.6, 1.0
    heights = np.linspace(0.05, 0.6, 12)
    origins = np.column_stack([heights, np.zeros((12, 1)), np.full(12, -1.0)])
    bundle = grad.Rays(origins, [0, 0, 1], exit=grad.Plane((0, 0, n * radius / (n - 1)), (0, 0, 1)))

    def spot(p):
        lens = grad.System([1.0, n], [grad.Conic((0, 0, 0), (0, 0, 1), curvature=p[0], conic=p[1])])
        loss = bundle.least_squares(lens, positions=np.zeros((12, 3)) + [0, 0, n * radius / (n - 1)])
        by = dict(zip(grad.parameters(lens), np.split(loss.gradient, np.cumsum([v.size for v in grad.parameters(lens).values()])[:-1])))
        return loss.value, np.array([by["surfaces[0].curvature"][0], by["surfaces[0].conic"][0]])

    found = optimize.minimize(spot, [0.9, 0.0], jac=True, method="BFGS", options={"gtol": 1e-12})
    np.testing.assert_allclose(found.x, [1 / radius, -1 / n**2], atol=1e-5)


def test_rays_that_do_not_come_through_are_counted():
    ball = grad.Sphere((0, 0, 0), 1.0)
    lens = grad.System([1.0, 1.5, 1.0], [grad.Aperture((0, 0, -2), (0, 0, 1), 1.2), ball, ball])
    bundle = grad.Rays([[0, 0, -3], [1.1, 0, -3], [1.5, 0, -3]], [0, 0, 1], exit=grad.Plane((0, 0, 2), (0, 0, 1)))
    ends = bundle.forward(lens)
    assert ends.failures == {"missed a surface": 1, "was stopped by an aperture": 1} and list(ends.valid) == [True, False, False]
    within = grad.Rays([[0.9, 0, 0]], [0, 0, 1], exit=grad.Plane((0, 0, 2), (0, 0, 1)))
    assert within.forward(grad.System([1.5, 1.0], [ball])).failures == {"was totally reflected": 1}
    with pytest.raises(grad.GradError, match="2 rays that have no end"):
        bundle.vjp(lens, optical_lengths=[1, 1, 1])
    assert np.isnan(bundle.jvp(lens, {"media[1]": 1.0}).positions[1:]).all()


SPHERE = grad.Sphere((0, 0, 0), 1.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda rays: rays.forward(grad.System([1.0], [SPHERE])), "1 media and 1 refracting surfaces do not fit"),
        (lambda rays: rays.forward(grad.System([1.0, 0.0], [SPHERE])), r"media\[1\] is 0.0"),
        (lambda rays: rays.forward(grad.System([1.0, np.ones((2, 2))], [SPHERE])), r"media\[1\] must be a Field or an array"),
        (lambda rays: rays.forward(grad.System([1.0, np.ones((2, 2, 2))], [SPHERE])), "give Rays the box"),
        (lambda rays: rays.forward(grad.System([1.0, 1.5], [grad.Sphere((0, 0, 0), -1)])), r"surfaces\[0\].radius is -1"),
        (lambda rays: rays.forward(grad.System([1.0, 1.5], [grad.Sphere((0, 0), 1)])), r"surfaces\[0\].center is \[0.0, 0.0\]"),
        (lambda rays: rays.forward(grad.System([1.0, 1.5], [grad.Plane((0, 0, 0), (0, 0, 0))])), r"surfaces\[0\].normal .* must not be zero"),
        (lambda rays: rays.forward(grad.System([1.0, 1.5], [grad.Conic((0, 0, 0), (0, 0, 1), np.nan)])), r"surfaces\[0\].curvature is nan"),
        (lambda rays: rays.forward(grad.System([1.0, 1.5], ["sphere"])), r"surfaces\[0\] is 'sphere' but must be a Plane"),
        (lambda rays: rays.forward(grad.System([grad.System([1.0], [])], [])), "only whole rays can pass"),
        (lambda rays: grad.Rays([[0, 0, -2]], [0, 0, 1], box=BOX).forward(grad.System([1.0], [])), "give Rays an exit"),
        (lambda rays: rays.jvp(gaussian(), {"depth": 1.0}), "no parameter 'depth': the system has n0, delta, center, width"),
        (lambda rays: rays.jvp(gaussian(), {"center": 1.0}), r"center has the shape \(\) but must have \(3,\)"),
        (lambda rays: rays.jvp(gaussian(), np.zeros(5)), r"has the shape \(5,\) but must have \(6,\)"),
        (lambda rays: rays.jvp(gaussian(), {"n0": np.inf}), "not finite"),
        (lambda rays: rays.jvp(gaussian(), origins=np.zeros((2, 3))), "origins has the shape"),
        (lambda rays: rays.jvp(gaussian(), exit=grad.Plane((0, 0, 0), (np.nan, 0, 0))), "must be three finite numbers"),
        (lambda rays: grad.Rays([[0, 0, -2]], [0, 0, 1], box=BOX).jvp(samples(), exit=grad.Plane((0, 0, 0), (0, 0, 0))), "no exit plane"),
        (lambda rays: rays.vjp(gaussian(), positions=[[np.inf, 0, 0]]), "not finite"),
    ],
)
def test_mistakes_are_told(call, message):
    with pytest.raises((grad.GradError, morgana.RenderError, TypeError), match=message):
        call(grad.Rays([[0, 0, -2]], [0, 0, 1], exit=grad.Plane((0, 0, 2), (0, 0, 1))))


def test_parameters_are_those_of_fields_and_systems():
    with pytest.raises(TypeError, match="expected a Field or a System, found float"):
        grad.parameters(1.5)
