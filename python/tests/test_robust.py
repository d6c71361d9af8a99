"""Reconstructions from data with outliers, and with noise that differs from ray to ray."""

import numpy as np
import pytest
from morgana import _losses, _misfit, reconstruct
from test_reconstruct import bump, error, measured, views, walls

RNG = np.random.default_rng(7)


def with_outliers(rays, true, share=0.02, noise=0.01):
    """Returns measured directions with outliers as large as the largest deflections, their noise,
    and the mask of the outliers."""
    directions, sigma = measured(rays, true, noise)
    rng = np.random.default_rng(5)
    bad = rng.random(len(rays)) < share
    largest = np.abs(directions - rays.forward(np.ones((2, 2, 2))).directions).max()
    directions[bad] += largest * rng.uniform(-1, 1, (bad.sum(), 3))
    return directions, sigma, bad


def test_scales_are_standard_deviations_of_the_inliers():
    # The standard error of the median of 20000 lengths is below 1 %. Outliers of 10 % move the
    # median to the quantile 0.5/0.9 of the inliers, by a factor of 1.08 for two components.
    two, one = np.linalg.norm(3 * RNG.normal(size=(20000, 2)), axis=1), np.abs(3 * RNG.normal(size=20000))
    assert _losses.robust_scale({"directions": two}) == pytest.approx(3, rel=0.03)
    assert _losses.robust_scale({"optical_lengths": one}) == pytest.approx(3, rel=0.03)
    two[:2000] = 1e6
    assert _losses.robust_scale({"positions": two}) == pytest.approx(3 * np.sqrt(np.log(1 - 0.5 / 0.9) / np.log(0.5)), rel=0.03)
    assert _losses.robust_scale({"positions": two / 1e3}) == 1.0
    assert np.mean(np.linalg.norm(RNG.normal(size=(200000, 2)), axis=1) > _losses.OUTLYING) == pytest.approx(np.exp(-8), abs=1.5e-4)


@pytest.mark.parametrize("kinds", [("directions",), ("positions", "optical_lengths")])
@pytest.mark.parametrize("loss", [_losses.Squares(), _losses.Huber(1.5)])
def test_gradients_of_losses_are_those_of_differences(loss, kinds):
    # Differences over 4e-4 of samples in f32 are accurate to about 1e-4.
    rays, n = views(2, 5), bump(6)
    ends = rays.forward(n)
    data = []
    for name in kinds:
        exact = getattr(ends, name)
        sigma = 1e-3 * (1 + RNG.random(len(rays)))
        values = exact + 3e-3 * RNG.standard_t(2, size=exact.shape)
        values[::7] = np.nan
        data.append(_losses.Kind.of(name, values, sigma))
    change = RNG.normal(size=n.shape)
    at = lambda h: _losses.sum_of_losses(rays, n + h * change, data, loss).least_squares  # noqa: E731
    difference = (at(2e-4).value - at(-2e-4).value) / 4e-4
    by = at(0.0).gradient
    assert abs(np.sum(by * change) - difference) < 1e-3 * np.linalg.norm(by) * np.linalg.norm(change)


def test_huber_is_half_the_square_below_its_edge_and_linear_beyond():
    loss = _losses.Huber(scale=2.0)
    r = np.array([0.0, 1.0, 4.0, 5.0, 100.0])
    values, weights = loss.values(r**2)
    np.testing.assert_allclose(values, [0, 0.5, 8, 8 + 4, 8 + 4 * 96])
    np.testing.assert_allclose(weights * r, [0, 1, 4, 4, 4])


def test_one_noise_for_each_ray_is_one_noise_for_all():
    rays, true = views(2, 8), bump(8)
    directions, sigma = measured(rays, true)
    weights = _misfit.Weights(1.0, 0.0)
    one, each = (
        _misfit.Misfit(rays, _misfit.measured_kinds(rays, (None, None), (directions, noise), (None, None)), weights, _losses.Squares())
        for noise in (sigma, np.full(len(rays), sigma))
    )
    (value, gradient), (value_2, gradient_2) = one(true), each(true)
    assert one.given is not None and each.given is None
    assert value_2 == pytest.approx(value, rel=1e-9) and each.chi_square == pytest.approx(one.chi_square, rel=1e-9)
    np.testing.assert_allclose(gradient_2, gradient, rtol=1e-6, atol=1e-6 * np.abs(gradient).max())
    assert each.without_derivatives(true) == pytest.approx(one.without_derivatives(true), rel=1e-9)


def test_huber_finds_the_index_in_spite_of_outliers():
    """Squares reach an error of 0.024 without these 27 outliers of 864, and 0.19 with them. Huber's
    loss reaches 0.031 with them."""
    rays, true = views(6, 12), bump(10)
    directions, sigma, bad = with_outliers(rays, true)
    data = {"directions": directions, "direction_noise": sigma}
    search = {"lower": 1.0, "known": walls(10)}
    squares, huber = (reconstruct.fit(rays, true.shape, **data, **search, loss=loss, iterations=limit) for loss, limit in (("squares", 10), ("huber", 20)))
    assert huber.chi_square < 1.5 and error(huber.samples, true) < 0.05
    assert error(squares.samples, true) > 3 * error(huber.samples, true)
    left = reconstruct.residuals(rays, huber.samples, **data)
    assert left.scale < 1.5
    assert np.mean(left.outliers[bad]) > 0.9 and np.mean(left.outliers[~bad]) < 0.01


def test_residuals_are_lengths_of_differences():
    rays, n = views(2, 4), bump(6)
    ends = rays.forward(n)
    away = np.zeros((len(rays), 3))
    away[3, 1], away[5, 2] = 5e-3, -3e-3
    directions = ends.directions + away
    directions[7] = np.nan
    sigma = np.full(len(rays), 1e-3)
    sigma[5] = 5e-4
    lengths = ends.optical_lengths.copy()
    lengths[2] += 0.3
    left = reconstruct.residuals(rays, n, directions=directions, direction_noise=sigma, optical_lengths=lengths, optical_length_noise=0.1)
    expected = np.zeros(len(rays))
    expected[[2, 3, 5]] = 3, 5, 6
    np.testing.assert_allclose(left.lengths, expected, atol=0.05)
    assert left.scale == 1 and np.flatnonzero(left.outliers).tolist() == [3, 5]
    only = reconstruct.residuals(rays, n, directions=directions, direction_noise=sigma)
    assert np.isnan(only.lengths[7]) and not only.outliers[7]
    assert repr(only) == "<morgana.reconstruct.Residuals of 32 rays: scale 1, 2 outliers>"


def test_posteriors_take_the_noise_of_each_ray():
    rays, n = views(2, 4), bump(4)
    data = {"directions": rays.forward(n).directions, "smoothness": 1e3}
    vector = RNG.normal(size=n.shape)
    noises = (1e-3, np.full(32, 1e-3), np.repeat([1e-3, 2e-3], 16))
    one, each, half = (reconstruct.posterior(rays, n, direction_noise=noise, **data) for noise in noises)
    np.testing.assert_allclose(each.precision(vector), one.precision(vector), rtol=1e-12)
    assert vector.ravel() @ half.precision(vector).ravel() < vector.ravel() @ one.precision(vector).ravel()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"loss": "cauchy"}, "loss is 'cauchy' but must be one of 'squares', 'huber'"),
        ({"direction_noise": np.ones(3)}, r"direction_noise has the shape \(3,\) but must be a positive number, or one for each ray, \(32,\)"),
        ({"direction_noise": np.r_[np.ones(31), 0.0]}, "direction_noise is 0.0 for ray 31 but must be a positive number"),
    ],
)
def test_mistakes_are_told(options, message):
    rays = views(2, 4)
    with pytest.raises(reconstruct.ReconstructionError, match=message):
        reconstruct.fit(rays, (4, 4, 4), **{"directions": rays.starts[1], "direction_noise": 1.0, **options})
