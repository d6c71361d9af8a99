"""Abel inversion and integration of deflections, compared with closed forms, traced rays, and the
scatter of repeated measurements."""

import numpy as np
import pytest
from morgana import grad, reconstruct

WIDTH, CONTRAST = 0.4, 2e-4


def deflection(y):
    """Deflections by n = 1 + Δ exp(−r²/w²) with w = WIDTH: −2√π Δ (y/w) exp(−y²/w²)."""
    return -2 * np.sqrt(np.pi) * CONTRAST * (y / WIDTH) * np.exp(-((y / WIDTH) ** 2))


def gaussian(r):
    return 1 + CONTRAST * np.exp(-((r / WIDTH) ** 2))


def test_abel_inversions_of_a_gaussian_converge_in_second_order():
    errors = []
    for count in (41, 81):
        y = np.linspace(-2, 2, count)
        found = reconstruct.abel(y, deflection(y), noise=1e-6)
        errors.append(np.abs(found.n - gaussian(found.radii)).max() / CONTRAST)
    assert errors[1] < 0.3 * errors[0] and errors[1] < 6e-3


def test_abel_inversions_of_linear_deflections_are_exact():
    # For ε = y on 0 to 1: n = 1 − (1/π)∫y/√(y² − r²) dy = 1 − √(1 − r²)/π. For ambient 1.3 it is 1.3 times the contrast.
    y = np.array([0.3, 1.0, 0.55])
    radii = np.array([0.0, 0.2, 0.7, 1.0, 1.5])
    found = reconstruct.abel(y, y, noise=1e-3, radii=radii, ambient=1.3)
    np.testing.assert_allclose(found.n, 1.3 - 1.3 * np.sqrt(np.maximum(1 - radii**2, 0)) / np.pi, rtol=1e-12)
    assert found.deviation[-1] == 0


def test_sides_of_the_axis_are_combined():
    y = np.linspace(0.1, 2, 20)
    one = reconstruct.abel(y, deflection(y), noise=1e-6)
    both = reconstruct.abel(np.r_[-y, 0, y], np.r_[-deflection(y) - 1e-7, np.nan, deflection(y) - 1e-7], noise=1e-6)
    np.testing.assert_allclose(both.radii, one.radii)
    np.testing.assert_allclose(both.n, one.n, atol=1e-15)
    np.testing.assert_allclose(both.deviation, one.deviation / np.sqrt(2))


def test_deviations_of_abel_inversions_are_the_scatter_of_measurements():
    # Variances of 400 measurements have a relative standard error of √(2/399) = 0.071.
    y, rng = np.linspace(-2, 2, 41), np.random.default_rng(1)
    noise = 1e-6 * (1 + np.abs(y))
    many = np.array([reconstruct.abel(y, deflection(y) + noise * rng.normal(size=41), noise=noise).n for _ in range(400)])
    expected = reconstruct.abel(y, deflection(y), noise=noise).deviation[:-1]
    np.testing.assert_allclose(many.var(axis=0)[:-1], expected**2, rtol=4 * 0.071)


def test_abel_inversions_of_traced_rays_find_the_index():
    x = np.linspace(-1, 1, 33)
    index = np.broadcast_to(gaussian(np.hypot(*np.meshgrid(x, x))), (2, 33, 33))
    y = np.linspace(-0.95, 0.95, 39)
    rays = grad.Rays(np.column_stack([0 * y - 2, y, 0 * y]), [1, 0, 0], box=((-1, -1, -1), (1, 1, 1)), tolerance=1e-7)
    found = reconstruct.abel(y, rays.forward(index).directions[:, 1], noise=1e-7)
    # The linear deflections between rays have an error of 0.5 %, as above.
    np.testing.assert_allclose(found.n, gaussian(found.radii), atol=0.01 * CONTRAST)


def bump(count):
    """Path-integrated index exp(−4x² − 8y²) · 1e-4 on −1.2 to 1.2, and its gradient."""
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, count), np.linspace(-1.2, 1.2, count))
    values = 1e-4 * np.exp(-4 * x**2 - 8 * y**2)
    return values, np.stack([-8 * x * values, -16 * y * values], axis=-1), 2.4 / (count - 1)


def test_integrals_of_gradients_converge_in_second_order():
    errors = []
    for count in (25, 49):
        values, slopes, spacing = bump(count)
        far = values < 1e-8
        found = reconstruct.integrate(slopes / 1.3, spacing=spacing, noise=1e-6, reference=far, ambient=1.3, draws=2)
        errors.append(np.abs(found.values - values).max() / 1e-4)
    assert errors[1] < 0.3 * errors[0] and errors[1] < 5e-3


def test_integrals_of_traced_deflections_are_optical_path_differences():
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 21)], indexing="ij")
    index = 1 + 1e-4 * np.exp(-(x**2 + 2 * y**2 + z**2) / 0.1)
    camera = grad.Camera.look_at((0, 0, -2), (0, 0, 0), width=2.0, size=(24, 20))
    rays = grad.Rays.from_sensor(camera, box=((-1, -1, -1), (1, 1, 1)), tolerance=1e-8)
    ends = rays.forward(index)
    # The camera's right is −x, and its down −y.
    deflections = -ends.directions[:, :2].reshape(20, 24, 2)
    lengths = (ends.optical_lengths - rays.forward(np.ones((2, 2, 2))).optical_lengths).reshape(20, 24)
    found = reconstruct.integrate(deflections, spacing=2 / 24, noise=1e-6, draws=2)
    # The error is of second order in the size of a pixel, 0.38 of the width √0.05 of the bump.
    np.testing.assert_allclose(found.values, lengths, atol=0.03 * lengths.max())


def test_deviations_of_integrals_are_the_scatter_of_measurements():
    _, slopes, spacing = bump(6)
    rng = np.random.default_rng(2)
    noise = 1e-6 * (1 + rng.random((6, 6)))
    # Both variances have a relative standard error of √(2/200) = 0.1.
    deviation = reconstruct.integrate(slopes, spacing=spacing, noise=noise, draws=200).deviation
    measured = (slopes + noise[..., None] * rng.normal(size=slopes.shape) for _ in range(200))
    many = np.array([reconstruct.integrate(one, spacing=spacing, noise=noise, draws=2).values for one in measured])
    np.testing.assert_allclose(many.var(axis=0), deviation**2, rtol=4 * 0.141)


def test_unknown_deflections_are_bridged_or_left_out():
    values, slopes, spacing = bump(25)
    slopes[10, 10] = np.nan
    slopes[:, 18] = np.nan
    left = np.zeros(values.shape, bool)
    left[:, 0] = True
    found = reconstruct.integrate(slopes, spacing=(spacing, spacing), noise=1e-6, reference=left, draws=2)
    assert np.isnan(found.values[10, 10]) and np.isnan(found.values[:, 18:]).all()
    others = found.values[:, :18][np.isfinite(found.values[:, :18])]
    assert others.size == 25 * 18 - 1
    assert np.nanmax(np.abs(found.values[:, :18] - values[:, :18])) < 2e-6


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: reconstruct.abel([1, 2], [1, 2, 3], noise=1), r"heights have the shape \(2,\), deflections \(3,\)"),
        (lambda: reconstruct.abel([1, np.nan], [1, 2], noise=1), "heights must be finite"),
        (lambda: reconstruct.abel([1, 2], [1, np.nan], noise=1), "1 deflections are known"),
        (lambda: reconstruct.abel([1, 2], [1, 2], noise=0), "noise must be positive"),
        (lambda: reconstruct.abel([1, 2], [1, 2], noise=1, radii=[-1]), "radii must be finite numbers of at least 0"),
        (lambda: reconstruct.integrate(np.zeros((4, 4)), spacing=1, noise=1), r"deflections have the shape \(4, 4\)"),
        (lambda: reconstruct.integrate(np.zeros((4, 4, 2)), spacing=1, noise=np.ones(3)), r"noise has the shape \(3,\)"),
        (lambda: reconstruct.integrate(np.zeros((4, 4, 2)), spacing=1, noise=-1), "noise must be positive"),
        (lambda: reconstruct.integrate(np.full((4, 4, 2), np.nan), spacing=1, noise=1), "no pixel with a known deflection is a reference"),
        (lambda: reconstruct.integrate(np.zeros((4, 4, 2)), spacing=1, noise=1, reference=np.ones((4, 4))), "must be .* of bool"),
    ],
)
def test_mistakes_are_told(call, message):
    with pytest.raises(reconstruct.ReconstructionError, match=message):
        call()
