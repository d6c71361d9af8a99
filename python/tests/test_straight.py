"""Derivatives of directions along straight rays, and reconstructions with them."""

import morgana
import numpy as np
import pytest
from morgana import grad, reconstruct

pytest.importorskip("scipy")
from morgana import _straight as straight  # noqa: E402

BOX = ((-1, -1, -1), (1, 1, 1))


def views(count=6, size=12, elevation=0.3, **options):
    """Parallel rays of views around z, some of them inclined."""
    line = (np.arange(size) + 0.5) / size * 1.9 - 0.95
    u, v = (part.ravel()[:, None] for part in np.meshgrid(line, line))
    origins, directions = [], []
    for i, angle in enumerate(np.pi * np.arange(count) / count):
        along = np.array([np.cos(angle), np.sin(angle), elevation * (i % 2)])
        along /= np.linalg.norm(along)
        side = np.array([-np.sin(angle), np.cos(angle), 0])
        origins.append(-3 * along + u * side + v * np.cross(along, side))
        directions.append(np.tile(2.0 * along, (size * size, 1)))  # Any length.
    return grad.Rays(np.concatenate(origins), np.concatenate(directions), box=BOX, tolerance=1e-8, **options)


def blob(shape, width=4.0, peak=2e-4):
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    return peak * np.exp(-width * ((x - 0.2) ** 2 + y**2 + 1.3 * (z + 0.1) ** 2))


@pytest.mark.parametrize("placement", ["nodes", "centers"])
@pytest.mark.parametrize("shape", [(16, 16, 16), (12, 17, 14)])
def test_derivatives_are_those_of_curved_rays_in_a_uniform_index(placement, shape):
    """The quadrature has a point in each slice: for smooth changes the error is far below a per cent."""
    rays = views(placement=placement, ambient=1.3)
    model = straight.Derivatives(rays, shape)
    change = blob(shape)
    exact = rays.jvp(np.full(shape, 1.3), change).directions
    assert np.linalg.norm(model(change) - exact) < 0.01 * np.linalg.norm(exact), np.linalg.norm(model(change) - exact) / np.linalg.norm(exact)


def test_transposes_fit():
    rng = np.random.default_rng(0)
    model = straight.Derivatives(views(), (9, 10, 11))
    change, by = rng.normal(size=(9, 10, 11)), rng.normal(size=(864, 3))
    # Weights are 32-bit floats.
    assert np.vdot(model(change), by) == pytest.approx(np.vdot(change, model.transposed(by)), rel=1e-5)


@pytest.mark.parametrize("options", [{}, {"smoothness": 3e10}, {"total_variation": 3e6}])
def test_a_weak_field_is_found_down_to_noise(options, tmp_path):
    shape = (12, 12, 12)
    rays, index = views(size=16), 1 + blob(shape)
    exact = rays.forward(index).directions
    noise = 0.01 * float(np.abs(exact - rays.forward(np.ones(shape)).directions).max())
    measured = exact + noise * np.random.default_rng(1).normal(size=exact.shape)
    told = []
    given = {"directions": measured, "direction_noise": noise, "lower": 1.0, "derivatives": "straight", **options}
    found = reconstruct.fit(rays, shape, **given, progress=told.append, checkpoint=tmp_path / "weak.npz")
    error = np.linalg.norm(found.samples - index) / np.linalg.norm(index - 1)
    assert found.chi_square < 1.2 and error < 0.15, (found, error)
    assert found.history == told and found.stopped == ("slow" if options else "noise")
    assert {one.shape for one in told} == {shape} and found.lost == 0
    # The end of the search is in the checkpoint.
    again = reconstruct.fit(rays, shape, **given, checkpoint=tmp_path / "weak.npz")
    np.testing.assert_array_equal(again.samples, found.samples)
    with pytest.raises(reconstruct.ReconstructionError, match="belongs to other rays, data or options"):
        reconstruct.fit(rays, shape, **{**given, "derivatives": "exact"}, checkpoint=tmp_path / "weak.npz")


def test_missing_data_have_no_effect():
    shape = (8, 8, 8)
    rays, index = views(), 1 + blob(shape)
    measured = rays.forward(index).directions
    given = {"direction_noise": 1e-6, "derivatives": "straight", "iterations": 2, "lower": 1.0}
    some = np.arange(len(rays)) % 3 > 0
    alone = reconstruct.fit(rays.select(some), shape, directions=measured[some], **given).samples
    gaps = reconstruct.fit(rays, shape, directions=np.where(some[:, None], measured, np.nan), **given).samples
    np.testing.assert_allclose(gaps, alone, atol=1e-8)


@pytest.mark.parametrize(
    ("shape", "options", "message"),
    [
        ((8, 8, 8), {"derivatives": "fast"}, "derivatives is 'fast' but must be 'exact' or 'straight'"),
        ((8, 8, 3), {}, "fewer than 4 samples along an axis"),
        ((8, 8, 8), {"loss": "huber"}, "need directions alone, with loss='squares'"),
        ((8, 8, 8), {"optical_lengths": np.ones(864), "optical_length_noise": 1.0}, "need directions alone"),
        ((8, 8, 100000), {}, "GB of memory"),
    ],
)
def test_mistakes_are_told(shape, options, message):
    rays = views()
    given = {"directions": rays.starts[1], "direction_noise": 1e-5, "derivatives": "straight", **options}
    with pytest.raises(morgana.reconstruct.ReconstructionError, match=message):
        reconstruct.fit(rays, shape, **given)
