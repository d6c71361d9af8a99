"""Rays as functions of PyTorch and JAX: their gradients equal `Rays.vjp`, and pass through
functions that users compose."""

import importlib

import morgana
import numpy as np
import pytest
from morgana import grad

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
RNG = np.random.default_rng(5)
ORIGINS = np.column_stack([RNG.uniform(-0.7, 0.7, (30, 2)), np.full(30, -2.0)])
DIRECTIONS = RNG.uniform(-0.1, 0.1, (30, 3)) + [0, 0, 1]
INDEX = 1.3 + 0.03 * RNG.random((6, 7, 8))
WEIGHTS = [RNG.normal(size=(30, 3)), RNG.normal(size=(30, 3)), RNG.normal(size=30)]


@pytest.fixture
def jax():
    """JAX in double precision."""
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    yield jax
    jax.config.update("jax_enable_x64", False)


def rays(origins=ORIGINS):
    return grad.Rays(origins, DIRECTIONS, box=BOX, exit=grad.Plane((0, 0, 3), (0, 0, 1)), ambient=1.3, tolerance=1e-8)


def expected():
    found = rays().vjp(INDEX, positions=WEIGHTS[0], directions=WEIGHTS[1], optical_lengths=WEIGHTS[2])
    return found.field, found.origins, found.directions


def test_jax(jax):
    numpy = jax.numpy
    ends = rays().jax()
    loss = lambda *given: sum(numpy.sum(w * end) for w, end in zip(WEIGHTS, ends(*given)))  # noqa: E731
    found = jax.grad(loss, argnums=(0, 1, 2))(INDEX, ORIGINS, DIRECTIONS)
    for value, exact in zip(found, expected()):
        np.testing.assert_allclose(value, exact, rtol=1e-12, atol=1e-12)
    # A sensor that moves along x moves all origins; tested compiled, too.
    moved = lambda shift: loss(INDEX, ORIGINS + shift * numpy.array([1.0, 0, 0]))  # noqa: E731
    assert float(jax.jit(jax.grad(moved))(0.0)) == pytest.approx(expected()[1][:, 0].sum(), rel=1e-9)


def test_jax_leaves_rays_without_an_end_out(jax):
    numpy = jax.numpy
    origins = ORIGINS.copy()
    origins[3, 2] = 4.0
    ends = rays(origins).jax()

    def loss(index):
        # Rays without an end must not send zero times NaN back.
        lengths = ends(index)[2]
        return numpy.sum(numpy.where(numpy.isnan(lengths), 0.0, lengths**2))

    found = np.asarray(jax.grad(loss)(INDEX))
    lengths = rays(origins).forward(INDEX).optical_lengths
    by = np.where(np.isnan(lengths), 0.0, 2 * lengths)
    assert np.isnan(lengths[3])
    np.testing.assert_allclose(found, rays(origins).vjp(INDEX, optical_lengths=by).field, rtol=1e-12)


def test_jax_takes_one_direction_and_whole_numbers(jax):
    numpy = jax.numpy
    ends = rays().jax()
    loss = lambda *given: sum(numpy.sum(w * end) for w, end in zip(WEIGHTS, ends(*given)))  # noqa: E731
    along = np.array([0.05, -0.02, 1.0])
    exact = rays().with_starts(ORIGINS, along).vjp(INDEX, positions=WEIGHTS[0], directions=WEIGHTS[1], optical_lengths=WEIGHTS[2])
    gradient = jax.grad(loss, argnums=(1, 2))
    for found in (gradient(INDEX, ORIGINS, along), jax.jit(gradient)(INDEX, ORIGINS, along)):
        np.testing.assert_allclose(found[0], exact.origins, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found[1], exact.directions.sum(0), rtol=1e-12, atol=1e-12)
    # Integer starts must not round the ends to integers.
    straight = rays().with_starts(np.array([[0.0, 0.0, -2.0]]), [0, 0, 1]).forward(INDEX)
    for end, expected in zip(ends(INDEX, numpy.array([[0, 0, -2]]), numpy.array([0, 0, 1])), straight):
        np.testing.assert_allclose(end, expected, rtol=1e-12, atol=1e-12)


def test_torch():
    torch = pytest.importorskip("torch")
    given = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (INDEX, ORIGINS, DIRECTIONS)]
    ends = rays().torch()(*given)
    sum((torch.tensor(w) * end).sum() for w, end in zip(WEIGHTS, ends)).backward()
    for tensor, exact in zip(given, expected()):
        np.testing.assert_allclose(tensor.grad.numpy(), exact, rtol=1e-12, atol=1e-12)
    only = torch.tensor(INDEX, dtype=torch.float64, requires_grad=True)
    rays().torch()(only)[2].sum().backward()
    along = torch.tensor([0.05, -0.02, 1.0], dtype=torch.float64, requires_grad=True)
    rays().torch()(torch.tensor(INDEX), torch.tensor(ORIGINS), along)[2].sum().backward()
    turned = rays().with_starts(ORIGINS, along.detach().numpy()).vjp(INDEX, optical_lengths=np.ones(30)).directions
    np.testing.assert_allclose(along.grad.numpy(), turned.sum(0), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(only.grad.numpy(), rays().vjp(INDEX, optical_lengths=np.ones(30)).field, rtol=1e-12)


@pytest.mark.parametrize("dtype", ["float64", "float32", "bfloat16", "int64"])
def test_torch_gives_ends_of_the_widest_type_of_its_tensors(dtype):
    torch = pytest.importorskip("torch")
    index = torch.full((3, 3, 3), 2, dtype=getattr(torch, dtype))
    expected = rays().forward(np.full((3, 3, 3), 2.0))
    widest = torch.get_default_dtype() if dtype == "int64" else index.dtype
    for end, exact in zip(rays().torch()(index), expected):
        assert end.dtype == widest
        np.testing.assert_allclose(end.double(), exact, rtol=2 * torch.finfo(widest).eps, atol=torch.finfo(widest).eps)
    # Starts of the rays are not rounded to the type of the index, and other starts are not rounded
    # to the type of an index with fewer digits.
    for end, exact in zip(rays().torch()(index, torch.tensor(ORIGINS), torch.tensor(DIRECTIONS)), expected):
        assert end.dtype == torch.float64
        np.testing.assert_allclose(end, exact, rtol=1e-14, atol=1e-14)


def test_torch_composes_functions():
    torch = pytest.importorskip("torch")
    few = rays().with_starts(ORIGINS[:4], DIRECTIONS[:4])
    ends, index = few.torch(), torch.tensor(INDEX)
    by_index = few.vjp(INDEX, optical_lengths=np.ones(4)).field
    np.testing.assert_allclose(torch.func.grad(lambda n: ends(n)[2].sum())(index), by_index, rtol=1e-12)
    value, back = torch.func.vjp(lambda n: ends(n)[2], index)
    np.testing.assert_allclose(back(torch.ones_like(value))[0], by_index, rtol=1e-12)
    rows = torch.func.jacrev(lambda n: ends(n)[2])(index)
    for ray, row in enumerate(rows):
        np.testing.assert_allclose(row, few.vjp(INDEX, optical_lengths=np.eye(4)[ray]).field, rtol=1e-12, atol=1e-14)
    # A batch of sensors, along an axis that is not the first, through one index, with derivatives
    # for each.
    moved = torch.stack([torch.tensor(ORIGINS[:4] + [0, 0, shift]) for shift in (0.0, 0.2)], dim=1)
    lengths, slopes = torch.vmap(lambda origins: (ends(index, origins)[2], torch.func.grad(lambda o: ends(index, o)[2].sum())(origins)), in_dims=1)(moved)
    for i in range(2):
        there = few.with_starts(moved[:, i].numpy(), DIRECTIONS[:4])
        np.testing.assert_allclose(lengths[i], there.forward(INDEX).optical_lengths, rtol=1e-14)
        np.testing.assert_allclose(slopes[i], there.vjp(INDEX, optical_lengths=np.ones(4)).origins, rtol=1e-12, atol=1e-14)


def test_torch_differentiates_a_batch_of_lenses():
    torch = pytest.importorskip("torch")
    height = lambda c: rays().torch(lens)({"surfaces[0].curvature": c, "media[0]": 1.2})[0][:, 0].sum()  # noqa: E731
    curvatures = torch.tensor([0.25, 0.3], dtype=torch.float64)
    by = np.tile([1.0, 0, 0], (30, 1))
    exact = [rays().vjp(lens({"surfaces[0].curvature": c}), positions=by).parameters["surfaces[0].curvature"] for c in (0.25, 0.3)]
    np.testing.assert_allclose(torch.vmap(torch.func.grad(height))(curvatures), exact, rtol=1e-12)


def test_torch_refuses_second_derivatives():
    torch = pytest.importorskip("torch")
    index = torch.tensor(INDEX, requires_grad=True)
    (once,) = torch.autograd.grad((rays().torch()(index)[1] ** 2).sum(), index, create_graph=True)
    with pytest.raises(grad.GradError, match="only first derivatives"):
        once.sum().backward()


LENS = {"surfaces[0].curvature": 0.3, "surfaces[0].vertex": [0.05, 0.0, 0.0], "media[0]": 1.2, "media[1].alpha": 0.2}


def lens(values):
    """A graded lens with a curved front; the exponent of its profile is not a parameter of the
    loss."""
    p = {**LENS, **values}
    graded = morgana.load_field({"type": "expression", "n2": "2.5*(1 - (alpha*rho)^g)", "alpha": float(p["media[1].alpha"]), "g": 2.0})
    front = grad.Conic(p["surfaces[0].vertex"], (0, 0, 1), float(p["surfaces[0].curvature"]), -0.5)
    return grad.System([float(p["media[0]"]), graded], [front])


def test_jax_by_parameters_of_lenses(jax):
    numpy = jax.numpy
    ends = rays().jax(lens)
    loss = lambda *given: sum(numpy.sum(w * end) for w, end in zip(WEIGHTS, ends(*given)))  # noqa: E731
    values = {name: numpy.asarray(value) for name, value in LENS.items()}
    exact = rays().vjp(lens({}), positions=WEIGHTS[0], directions=WEIGHTS[1], optical_lengths=WEIGHTS[2])
    by_values, by_origins = jax.grad(loss, argnums=(0, 1))(values, ORIGINS)
    assert list(by_values) == sorted(LENS)
    for name, value in by_values.items():
        np.testing.assert_allclose(value, exact.parameters[name], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(by_origins, exact.origins, rtol=1e-12, atol=1e-12)
    # A design variable that two parameters depend on, compiled; compared with differences.
    bent = lambda c: loss({"surfaces[0].curvature": c, "media[1].alpha": 0.5 * c**2})  # noqa: E731
    difference = (float(bent(0.3 + 1e-4)) - float(bent(0.3 - 1e-4))) / 2e-4
    assert float(jax.jit(jax.grad(bent))(0.3)) == pytest.approx(difference, rel=1e-6)


def test_jax_by_parameters_of_fields_in_single_precision():
    jax = pytest.importorskip("jax")
    build = lambda values: morgana.load_field({"type": "gaussian", "n0": 1.3, "delta": float(values["delta"]), "width": 0.4})  # noqa: E731
    found = jax.grad(lambda delta: jax.numpy.sum(rays().jax(build)({"delta": delta})[2]))(0.05)
    expected = rays().vjp(build({"delta": np.float32(0.05)}), optical_lengths=np.ones(30)).parameters["delta"]
    assert found.dtype == np.float32 and float(found) == pytest.approx(float(expected), rel=1e-6)


def test_torch_by_parameters_of_lenses():
    torch = pytest.importorskip("torch")
    values = {name: torch.tensor(value, dtype=torch.float64, requires_grad=True) for name, value in LENS.items()}
    ends = rays().torch(lens)(values)
    sum((torch.tensor(w) * end).sum() for w, end in zip(WEIGHTS, ends)).backward()
    exact = rays().vjp(lens({}), positions=WEIGHTS[0], directions=WEIGHTS[1], optical_lengths=WEIGHTS[2])
    for name, tensor in values.items():
        np.testing.assert_allclose(tensor.grad.numpy(), exact.parameters[name], rtol=1e-12, atol=1e-12)


def test_torch_takes_numbers_and_arrays_beside_tensors():
    torch = pytest.importorskip("torch")
    curvature = torch.tensor(0.3, dtype=torch.float64, requires_grad=True)
    for vertex in ([0.05, 0.0, 0.0], np.array([0.05, 0.0, 0.0]), torch.tensor([0.05, 0.0, 0.0], dtype=torch.float64)):
        curvature.grad = None
        for values in ({"surfaces[0].curvature": curvature, "surfaces[0].vertex": vertex}, {"media[1].alpha": 0.2, "surfaces[0].curvature": curvature}):
            lengths = rays().torch(lens)(values)[2]
            np.testing.assert_allclose(lengths.detach(), rays().forward(lens({})).optical_lengths, rtol=1e-14)
            lengths.sum().backward()
        exact = rays().vjp(lens({}), optical_lengths=np.ones(30)).parameters["surfaces[0].curvature"]
        assert float(curvature.grad) == pytest.approx(2 * float(exact), rel=1e-12)
    # Rays are computed in double precision; only the results are rounded.
    for end, exact in zip(rays().torch()(INDEX, ORIGINS, DIRECTIONS[0].tolist()), rays().with_starts(ORIGINS, DIRECTIONS[0]).forward(INDEX)):
        np.testing.assert_array_equal(end, exact.astype(np.float32))


@pytest.mark.parametrize("kind", ["none", "text", "complex"])
def test_torch_names_parameters_that_are_no_numbers(kind):
    torch = pytest.importorskip("torch")
    wrong = {"none": None, "text": "1.2", "complex": torch.tensor(1.2 + 0j)}[kind]
    with pytest.raises(TypeError, match=r"media\[0\] (is None but )?must be an array of real numbers"):
        rays().torch(lens)({"surfaces[0].curvature": torch.tensor(0.3), "media[0]": wrong})


@pytest.mark.parametrize(
    ("build", "index", "message"),
    [
        (lens, {"surfaces[0].radius": 1.0}, "has no parameter 'surfaces\\[0\\].radius': it has media"),
        (lambda values: lens({}), {"media[0]": 1.3}, r"media\[0\] is 1.3\d* but the result of build has 1.2"),
        (lambda values: 1.3, {"media[0]": 1.3}, "build must return a Field or a System"),
        (lens, {}, "with at least one array"),
        (lens, INDEX, "with at least one array"),
        (None, {"media[0]": 1.3}, "expected samples of n, not dict"),
        (None, lens({}), "expected samples of n, not System"),
    ],
)
def test_mistakes_about_what_is_built_are_told(jax, build, index, message):
    with pytest.raises(grad.GradError, match=message):
        rays().jax(build)(index)
    with pytest.raises(grad.GradError, match=message):
        jax.grad(lambda shift: rays().jax(build)(index, ORIGINS + shift)[2].sum())(0.1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((INDEX[0], ORIGINS, DIRECTIONS), r"must be a Field or an array \[z, y, x\] of samples, but has the shape \(7, 8\)"),
        ((INDEX, ORIGINS[:3], DIRECTIONS), r"origins have the shape \(3, 3\) and directions \(30, 3\): give \(rays, 3\) of both, or one direction"),
        ((INDEX, ORIGINS[0], DIRECTIONS[0]), r"origins have the shape \(3,\)"),
        ((INDEX, ORIGINS, DIRECTIONS[0, :2]), r"directions \(2,\)"),
    ],
)
def test_shapes_that_do_not_fit_are_told(jax, given, message):
    for ends in (rays().jax(), jax.jit(rays().jax())):
        with pytest.raises(grad.GradError, match=message):
            ends(*given)
    unbounded = grad.Rays(ORIGINS, DIRECTIONS, exit=grad.Plane((0, 0, 3), (0, 0, 1)))
    with pytest.raises(grad.GradError, match="give Rays the box"):
        jax.jit(unbounded.jax())(INDEX)


def test_other_mistakes_are_told_through_jax_where_it_compiles(jax):
    with pytest.raises(grad.GradError, match="not refractive indices > 0"):
        rays().jax()(-INDEX)
    with pytest.raises(jax.errors.JaxRuntimeError, match="GradError: .*not refractive indices > 0"):
        jax.block_until_ready(jax.jit(rays().jax())(-INDEX))


def test_scipy_minimises_least_squares():
    optimize = pytest.importorskip("scipy.optimize")
    measured = rays().forward(np.full((2, 2, 2), 1.32)).optical_lengths

    def loss(n):
        found = rays().least_squares(np.full((2, 2, 2), n[0]), optical_lengths=measured, optical_length_noise=1e-3)
        return found.value, [found.gradient.sum()]

    found = optimize.minimize(loss, [1.3], jac=True, method="BFGS")
    assert found.x[0] == pytest.approx(1.32, abs=1e-6) and found.fun < 1e-6


@pytest.mark.parametrize("name", ["torch", "jax"])
def test_a_missing_library_is_named(name, monkeypatch):
    def missing(module):
        raise ImportError(module)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(grad.GradError, match=rf'needs {name}: run pip install "\.\[{name}\]" in a clone of morgana'):
        getattr(rays(), name)()
