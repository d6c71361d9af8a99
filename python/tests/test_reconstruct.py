"""Indices found from rays that an index has bent, and what users are told."""

import numpy as np
import pytest
from morgana import grad, reconstruct

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def bump(samples, contrast=0.03):
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, samples)], indexing="ij")
    blob = lambda a, b, c, w: np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / (2 * w * w))  # noqa: E731
    return 1 + contrast * (blob(0.2, 0, 0.1, 0.25) + 0.7 * blob(-0.3, 0.2, -0.2, 0.2))


def views(count=8, pixels=20):
    across = np.linspace(-0.9, 0.9, pixels)
    u, w = (a.ravel() for a in np.meshgrid(across, across))
    origins, directions = [], []
    for angle in np.pi * np.arange(count) / count:
        along, side = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        origins.append(u[:, None] * side + w[:, None] * [0, 0, 1] - 2 * along)
        directions.append(np.tile(along, (len(u), 1)))
    return grad.Rays(np.concatenate(origins), np.concatenate(directions), box=BOX, tolerance=1e-4)


def error(found, true):
    return np.linalg.norm(found**2 - true**2) / np.linalg.norm(true**2 - 1)


def measured(rays, true, share=0.01):
    """Unit exit directions with noise of a share of the root mean square deflection; and its standard deviation."""
    exact = rays.forward(true).directions
    moved = exact - rays.forward(np.ones((2, 2, 2))).directions
    noise = share * np.sqrt(np.mean(np.sum(moved**2, axis=1)) / 2)
    noisy = exact + noise * np.random.default_rng(0).normal(size=exact.shape)
    return noisy / np.linalg.norm(noisy, axis=1, keepdims=True), noise


def test_an_index_is_found_down_to_noise():
    rays, true = views(), bump(16)
    directions, noise = measured(rays, true)
    told = []
    found = reconstruct.fit(rays, true.shape, directions=directions, direction_noise=noise, lower=1.0, iterations=80, progress=told.append)
    assert found.history == told and found.lost == 0
    assert [now.shape for now in told][0] == (8, 8, 8) and told[-1].shape == true.shape
    assert found.chi_square == pytest.approx(1, abs=0.3)
    assert error(found.samples, true) < 0.1
    assert found.samples.min() >= 1


def test_noise_is_not_fitted():
    rays, true = views(), bump(16)
    directions, noise = measured(rays, true, 0.1)
    found = reconstruct.fit(rays, true.shape, directions=directions, direction_noise=noise)
    assert found.stopped == "noise" and found.chi_square <= 1 and len(found.history) < 40
    assert error(found.samples, true) < 0.3


def test_optical_lengths_and_missing_data():
    rays, true = views(), bump(16, 0.003)
    lengths = rays.forward(true).optical_lengths
    lengths[::7] = np.nan
    found = reconstruct.fit(rays, true.shape, optical_lengths=lengths, optical_length_noise=1e-5, smoothness=1.0)
    assert error(found.samples, true) < 0.2


def test_the_penalty_is_that_of_a_slope():
    # ½∫|∇n|² dV of n = 1 + x/10 over the box is ½·0.01·8; its derivative is that of differences.
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (5, 6, 7)), indexing="ij")
    value, _ = reconstruct._roughness(1 + x / 10, np.array([2 / 6, 2 / 5, 2 / 4]))
    cells = np.prod([2 / 6, 2 / 5, 2 / 4]) * 6 * 6 * 5
    assert value == pytest.approx(0.5 * 0.01 * cells)
    index, change = np.random.default_rng(2).normal(size=(2, 5, 6, 7))
    spacing = np.array([0.3, 0.4, 0.5])
    at = lambda h: reconstruct._roughness(index + h * change, spacing)[0]  # noqa: E731
    assert np.sum(reconstruct._roughness(index, spacing)[1] * change) == pytest.approx((at(1) - at(-1)) / 2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "nothing to fit"),
        ({"directions": np.zeros((4, 3)), "direction_noise": 1.0}, "a row for each ray"),
        ({"directions": np.zeros((3200, 3))}, "give direction_noise"),
        ({"position_noise": 1.0}, "without positions"),
        ({"optical_lengths": np.full(3200, np.nan), "optical_length_noise": 1.0}, "none of the optical_lengths"),
        ({"optical_lengths": np.ones(3200), "optical_length_noise": 1.0, "smoothness": -1}, "at least 0"),
        ({"optical_lengths": np.ones(3200), "optical_length_noise": 1.0, "start": np.ones(3)}, r"\[z, y, x\]"),
    ],
)
def test_mistakes_are_told(options, message):
    with pytest.raises(reconstruct.ReconstructionError, match=message):
        reconstruct.fit(views(), (8, 8, 8), **options)
