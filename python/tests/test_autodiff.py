"""Rays as functions of PyTorch and JAX: their gradients are those of `Rays.vjp`, and go through what users compose."""

import importlib

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
    """In double precision."""
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
    # A sensor that moves along x moves all origins; and compiled.
    moved = lambda shift: loss(INDEX, ORIGINS + shift * numpy.array([1.0, 0, 0]))  # noqa: E731
    assert float(jax.jit(jax.grad(moved))(0.0)) == pytest.approx(expected()[1][:, 0].sum(), rel=1e-9)


def test_jax_leaves_rays_without_an_end_out(jax):
    numpy = jax.numpy
    origins = ORIGINS.copy()
    origins[3, 2] = 4.0
    ends = rays(origins).jax()

    def loss(index):
        # Of rays without an end it is zero times NaN that comes back.
        lengths = ends(index)[2]
        return numpy.sum(numpy.where(numpy.isnan(lengths), 0.0, lengths**2))

    found = np.asarray(jax.grad(loss)(INDEX))
    lengths = rays(origins).forward(INDEX).optical_lengths
    by = np.where(np.isnan(lengths), 0.0, 2 * lengths)
    assert np.isnan(lengths[3])
    np.testing.assert_allclose(found, rays(origins).vjp(INDEX, optical_lengths=by).field, rtol=1e-12)


def test_torch():
    torch = pytest.importorskip("torch")
    given = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (INDEX, ORIGINS, DIRECTIONS)]
    ends = rays().torch()(*given)
    sum((torch.tensor(w) * end).sum() for w, end in zip(WEIGHTS, ends)).backward()
    for tensor, exact in zip(given, expected()):
        np.testing.assert_allclose(tensor.grad.numpy(), exact, rtol=1e-12, atol=1e-12)
    only = torch.tensor(INDEX, dtype=torch.float64, requires_grad=True)
    rays().torch()(only)[2].sum().backward()
    np.testing.assert_allclose(only.grad.numpy(), rays().vjp(INDEX, optical_lengths=np.ones(30)).field, rtol=1e-12)


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
    with pytest.raises(grad.GradError, match=rf"needs {name}: pip install .*\[{name}\]"):
        getattr(rays(), name)()
