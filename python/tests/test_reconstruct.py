"""Indices reconstructed from rays that they bend, and messages for users."""

import pickle

import morgana
import numpy as np
import pytest
from morgana import _conjugate, _descent, _penalties, grad, reconstruct

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def bump(samples, contrast=0.03):
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, samples)], indexing="ij")
    blob = lambda a, b, c, w: np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / (2 * w * w))  # noqa: E731
    return 1 + contrast * (blob(0.2, 0, 0.1, 0.25) + 0.7 * blob(-0.3, 0.2, -0.2, 0.2))


def views(count=8, pixels=20):
    """Parallel rays around the z axis, over half a turn."""
    places = [(-2 * np.cos(angle), -2 * np.sin(angle), 0) for angle in np.pi * np.arange(count) / count]
    cameras = [grad.Camera.look_at(place, (0, 0, 0), up=(0, 0, 1), width=1.8 * pixels / (pixels - 1), size=(pixels, pixels)) for place in places]
    return grad.Rays.join([grad.Rays.from_sensor(camera, camera.pixels()[::-1, ::-1], box=BOX, tolerance=1e-4) for camera in cameras])


def error(found, true):
    return np.linalg.norm(found**2 - true**2) / np.linalg.norm(true**2 - 1)


def measured(rays, true, share=0.01):
    """Returns unit exit directions with noise, relative to the root mean square deflection, and the
    noise's standard deviation."""
    exact = rays.forward(true).directions
    moved = exact - rays.forward(np.ones((2, 2, 2))).directions
    noise = share * np.sqrt(np.mean(np.sum(moved**2, axis=1)) / 2)
    noisy = exact + noise * np.random.default_rng(0).normal(size=exact.shape)
    return noisy / np.linalg.norm(noisy, axis=1, keepdims=True), noise


def walls(samples):
    """The faces along the axis of the views, where the index equals the surroundings."""
    known = np.zeros((samples, samples, samples), bool)
    known[:, [0, -1]] = known[:, :, [0, -1]] = True
    return known


def test_an_index_is_found_down_to_noise():
    rays, true = views(), bump(16)
    directions, noise = measured(rays, true)
    told = []
    found = reconstruct.fit(rays, true.shape, directions=directions, direction_noise=noise, lower=1.0, known=walls(16), progress=told.append)
    assert found.history == told and found.lost == 0
    assert [now.shape for now in told][0] == (8, 8, 8) and told[-1].shape == true.shape
    assert found.chi_square == pytest.approx(1, abs=0.3)
    assert error(found.samples, true) < 0.03
    assert found.samples.min() >= 1 - 1e-12 and np.all(np.abs(found.samples[walls(16)] - 1) < 1e-12)


def test_deflections_leave_an_offset_open_without_a_known_region():
    rays, true = views(), bump(16)
    directions, noise = measured(rays, true)
    found = reconstruct.fit(rays, true.shape, directions=directions, direction_noise=noise).samples
    assert error(found, true) > 0.1
    assert error(found - np.mean(found - true), true) < 0.05


def test_many_rays_take_turns_and_noise_of_all_is_not_fitted():
    """Fits 1000 free samples to 25600 rays, at first in parts of 2048 rays. All rays determine when
    the search ends. χ² per datum of the true index is 1 within 0.5 % (standard deviation 0.4 %). A
    result down to noise fits equally well, or better by a fraction of 1000/51200."""
    rays, true = views(16, 40), bump(16)
    directions, noise = measured(rays, true)
    data = {"directions": directions, "direction_noise": noise, "known": walls(16)}
    told = []
    found = reconstruct.fit(rays, true.shape, **data, progress=told.append)
    assert [now.rays for now in told] == sorted(now.rays for now in told)
    assert {now.rays for now in told if now.shape == true.shape} <= {2048, 4096, 8192, 25600}
    assert told[0].rays == 256 and [now.number for now in told if now.shape == true.shape] == list(range(1, 1 + sum(n.shape == true.shape for n in told)))
    ends = rays.forward(found.samples)
    residual = np.sum(np.square((ends.directions - directions) / noise)) / (2 * len(rays))
    assert found.chi_square == pytest.approx(residual, rel=1e-12)
    assert found.stopped == "noise" and 0.9 < found.chi_square <= 1.0
    # A tenth of the rays leaves more noise in equal time: errors fall as more rays are used.
    few = rays.select(np.arange(0, len(rays), 10))
    data.update(directions=directions[::10])
    assert error(found.samples, true) < error(reconstruct.fit(few, true.shape, **data).samples, true)


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


LATTICES = [_penalties.Lattice(np.array([0.3, 0.4, 0.5]), centers) for centers in (False, True)]


@pytest.mark.parametrize("shape", [(5, 6, 7), (2, 2, 3), (1, 4, 1)])
@pytest.mark.parametrize("placement", ["nodes", "centers"])
def test_penalties_are_integrals_for_a_linear_index(placement, shape):
    # ½∫|∇n|² dV is ½|g|²V, and ∫|∇n| dV is |g|V. Along an axis with a single sample n is constant.
    rays = grad.Rays([[0, 0, -2]], [0, 0, 1], box=((-1, -2, -3), (2, 2, 3)), placement=placement)
    lattice, volume = _penalties.lattice_of(rays, shape), 3.0 * 4 * 6
    slope = np.where(np.array(shape[::-1]) > 1, [0.1, -0.2, 0.15], 0.0)
    places = np.meshgrid(*map(np.arange, shape), indexing="ij")[::-1]
    index = 1 + sum(g * step * place for g, step, place in zip(slope, lattice.spacing, places))
    size = np.linalg.norm(slope)
    assert _penalties.roughness(index, lattice)[0] == pytest.approx(0.5 * size**2 * volume)
    assert _penalties.total_variation(index, lattice, 1e-12)[0] == pytest.approx(size * volume)
    assert _penalties.largest_slope(index, lattice) == pytest.approx(size)


def test_penalties_of_waves_converge_in_second_order():
    # n = cos(πx/2)cos(πy/3) for x from 0 to 2, y from 0 to 3 and z from 0 to 1: ½∫|∇n|² dV is ½(π²/4 + π²/9)V/4.
    exact = 0.5 * (np.pi**2 / 4 + np.pi**2 / 9) * 6 / 4
    for placement in ("nodes", "centers"):
        rays = grad.Rays([[0, 0, -2]], [0, 0, 1], box=((0, 0, 0), (2, 3, 1)), placement=placement)
        errors = []
        for count in (16, 32):
            places = (np.linspace(0, 1, count) if placement == "nodes" else (np.arange(count) + 0.5) / count) * np.pi
            index = np.broadcast_to(np.cos(places)[:, None] * np.cos(places), (2, count, count))
            errors.append(abs(_penalties.roughness(index, _penalties.lattice_of(rays, index.shape))[0] / exact - 1))
        assert errors[1] < errors[0] / 3 and errors[1] < 2e-2, errors


@pytest.mark.parametrize("lattice", LATTICES)
@pytest.mark.parametrize("penalty", [_penalties.roughness, lambda n, lattice: _penalties.total_variation(n, lattice, 0.5)])
@pytest.mark.parametrize("shape", [(5, 6, 7), (2, 3, 2), (1, 4, 1)])
def test_slopes_of_penalties_are_those_of_differences(penalty, shape, lattice):
    index, change = np.random.default_rng(2).normal(size=(2, *shape))
    at = lambda h: penalty(index + h * change, lattice)[0]  # noqa: E731
    difference = (at(1e-4) - at(-1e-4)) / 2e-4
    assert np.sum(penalty(index, lattice)[1] * change) == pytest.approx(difference, rel=1e-7)


@pytest.mark.parametrize("lattice", LATTICES)
def test_total_variation_below_the_flat_slope_is_roughness(lattice):
    index = np.random.default_rng(3).normal(size=(4, 2, 5))
    value, slopes = _penalties.total_variation(index, lattice, 1e5)
    expected, expected_slopes = _penalties.roughness(index, lattice)
    # Slopes are below 20. The relative error is their square over that of the flat slope 1e5, 4e-8.
    assert 1e5 * value == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(1e5 * slopes, expected_slopes, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("lattice", LATTICES)
def test_rough_noise_has_the_covariance_of_roughness(lattice):
    # Over 2000 draws, variances of 12 samples lie within 5 standard errors, √(2/2000), of which one
    # fails by chance in 1e-5. The standard error of covariances is at most that of their variances.
    shape, rng = (2, 2, 3), np.random.default_rng(5)
    exact = np.array([_penalties.roughness(one.reshape(shape), lattice)[1].ravel() for one in np.eye(12)])
    draws = np.array([_penalties.rough_noise(shape, lattice, rng).ravel() for _ in range(2000)])
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    assert np.abs((draws.T @ draws / 2000 - exact) / scale).max() < 5 * np.sqrt(2 / 2000)


def test_descent_finds_the_minimum_within_limits():
    # ½(x − c)ᵀA(x − c) with limits: at the minimum, the gradient vanishes where x is free, and
    # points out of the limits elsewhere.
    rng = np.random.default_rng(4)
    root, centre = rng.normal(size=(20, 20)), rng.normal(size=20)
    matrix = root @ root.T + np.eye(20)
    function = lambda x: (0.5 * (x - centre) @ matrix @ (x - centre), matrix @ (x - centre))  # noqa: E731
    low, high = np.full(20, -0.8), np.full(20, 0.7)
    low[3] = high[3] = 0.1
    precondition = lambda v: v / np.diag(matrix)  # noqa: E731
    start = np.zeros(20)
    start[3] = 0.1
    scale, _ = _descent.first_scale(function, start, function(start)[1], precondition)
    *_, (x, value) = _descent.minimize(function, (start, *function(start)), scale, (low, high), precondition, [])
    gradient = matrix @ (x - centre)
    inside = (x > low) & (x < high)
    assert x[3] == 0.1 and 3 < inside.sum() < 20 and value == pytest.approx(function(x)[0])
    assert np.abs(gradient[inside]).max() < 1e-5
    assert (gradient[x == low] > -1e-5).sum() + (gradient[x == high] < 1e-5).sum() >= 20 - inside.sum()


def test_total_variation_keeps_edges():
    # A box of constant index from four views: 1 % noise.
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 16)], indexing="ij")
    true = np.where((np.abs(x) < 0.4) & (np.abs(y) < 0.5) & (np.abs(z) < 0.4), 1.003, 1.0)
    rays = views(4)
    lengths = rays.forward(true).optical_lengths
    noise = 0.01 * np.std(lengths)
    lengths = lengths + noise * np.random.default_rng(1).normal(size=lengths.shape)
    data = {"optical_lengths": lengths, "optical_length_noise": noise, "known": walls(16)}
    plain = reconstruct.fit(rays, true.shape, **data)
    edges = reconstruct.fit(rays, true.shape, **data, total_variation=1e4)
    assert error(edges.samples, true) < 0.8 * error(plain.samples, true)


def test_an_interrupted_search_continues(tmp_path):
    rays, true = views(), bump(16)
    directions, noise = measured(rays, true)
    data = {"directions": directions, "direction_noise": noise, "known": walls(16), "checkpoint": tmp_path / "jet.npz"}

    def interrupt(now):
        if now.shape == (16, 16, 16) and now.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reconstruct.fit(rays, true.shape, **data, progress=interrupt)
    told = []
    found = reconstruct.fit(rays, true.shape, **data, progress=told.append)
    assert {now.shape for now in told} == {(16, 16, 16)} and len(found.history) > len(told)
    assert found.stopped == "noise" and error(found.samples, true) < 0.05
    assert reconstruct.fit(rays, true.shape, **data, progress=told.clear) == found
    with pytest.raises(reconstruct.ReconstructionError, match="belongs to other rays, data or options"):
        reconstruct.fit(rays, true.shape, **data, lower=1.0)
    (tmp_path / "jet.npz").write_bytes(b"no checkpoint")
    with pytest.raises(reconstruct.ReconstructionError, match="is not a checkpoint"):
        reconstruct.fit(rays, true.shape, **data)


def small_search(checkpoint, **options):
    """Runs two iterations on 4³ samples."""
    rays = views(2, 4)
    measured = {"directions": rays.forward(bump(4)).directions, "direction_noise": 1e-5}
    return reconstruct.fit(rays, (4, 4, 4), **measured, iterations=2, checkpoint=checkpoint, **options)


def test_damaged_checkpoints_are_told(tmp_path):
    file = tmp_path / "jet.npz"
    found = small_search(file)
    whole = file.read_bytes()
    told = 0
    for place in range(0, len(whole), 29):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            # Some bytes, such as the time of writing, do not matter.
            assert small_search(file) == found
        except reconstruct.ReconstructionError as error:
            assert "jet.npz is not a checkpoint of a reconstruction: " in str(error)
            told += 1
    assert told > 50
    for damaged in (b"", whole[: len(whole) // 2], whole[:-1]):
        file.write_bytes(damaged)
        with pytest.raises(reconstruct.ReconstructionError, match="jet.npz is not a checkpoint of a reconstruction"):
            small_search(file)
    np.save(tmp_path / "samples.npy", np.zeros(3))
    with pytest.raises(reconstruct.ReconstructionError, match="samples.npy is not a checkpoint of a reconstruction"):
        small_search(tmp_path / "samples.npy")


def test_checkpoints_that_cannot_be_written_are_refused_at_once(tmp_path):
    told = []
    with pytest.raises(reconstruct.ReconstructionError, match="the checkpoint .*jet.npz cannot be written: No such file or directory"):
        small_search(tmp_path / "results" / "jet.npz", progress=told.append)
    # Root can write to every folder, so block the name of the temporary file instead.
    (tmp_path / "jet.npz.part").mkdir()
    with pytest.raises(reconstruct.ReconstructionError, match="the checkpoint .*jet.npz cannot be written"):
        small_search(tmp_path / "jet.npz", progress=told.append)
    assert not told
    (tmp_path / "jet.npz.part").rmdir()
    found = small_search(tmp_path / "jet.npz")
    assert [file.name for file in tmp_path.iterdir()] == ["jet.npz"]
    # A completed search is only read.
    (tmp_path / "jet.npz.part").mkdir()
    assert small_search(tmp_path / "jet.npz") == found


def test_deviations_are_those_of_repeated_measurements():
    # There are more data than samples. The variance over 10 measurements with independent noise is
    # compared with the variance of 10 replicates, both averaged over 3³ free samples: F with at
    # least 9 and 9 degrees of freedom for one sample, and more for their mean. If all samples moved
    # as one, the ratio would exceed 5.35 by chance in 1 of 100 cases; their number makes this far
    # rarer.
    rays, true = views(8, 10), bump(5)
    exact = rays.forward(true)
    noise = 2e-4
    options = {"known": walls(5), "start": true, "iterations": 30, "direction_noise": noise}

    def measure(seed):
        directions = exact.directions + noise * np.random.default_rng(seed).normal(size=exact.directions.shape)
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)

    repeated = np.std([reconstruct.fit(rays, true.shape, directions=measure(seed), **options).samples for seed in range(10)], axis=0, ddof=1)
    deviation = reconstruct.fit(rays, true.shape, directions=measure(10), replicates=10, **options).deviation
    free = ~walls(5)
    assert np.all(deviation[walls(5)] < 1e-12)
    assert 1 / 5.35 < np.mean(deviation[free] ** 2) / np.mean(repeated[free] ** 2) < 5.35


@pytest.mark.parametrize("room", [60, 7, 1])
def test_solutions_share_their_directions(room, monkeypatch):
    """With 60 unknowns of condition 1e6 and room for all directions, the number of directions
    equals the number of products, for any number of solutions."""
    rng = np.random.default_rng(6)
    basis, _ = np.linalg.qr(rng.normal(size=(60, 60)))
    matrix = basis @ np.diag(np.logspace(-3, 3, 60)) @ basis.T
    products = []
    monkeypatch.setattr(_conjugate, "BYTES", 16 * 60 * room)
    monkeypatch.setattr(_conjugate, "FIRST", 4)
    solver = _conjugate.ConjugateDirections(lambda v: products.append(1) or matrix @ v, lambda v: v / np.diag(matrix), 60)
    for _ in range(20):
        b = rng.normal(size=60)
        found = solver.solve(b, 1e-8, 2000)
        assert np.linalg.norm(matrix @ found - b) < 2e-8 * np.linalg.norm(b)
    assert solver.count == room
    if room == 60:
        assert len(products) <= 62
    assert solver.solve(rng.normal(size=60), 1e-30, 3) is None


def test_the_posterior_is_that_of_matrices():
    """Compares with the inverse of a matrix of 16 free samples, column by column; standard
    deviations by 50 draws lie within 5 standard errors (10 %) each."""
    true, free = bump(4), ~walls(4)
    rays = grad.Rays(*views(4, 6).starts, box=BOX, tolerance=1e-6)
    ends = rays.forward(true)
    rows = np.flatnonzero(free)
    options = {"known": walls(4), "smoothness": 1e4, "prior_deviation": 0.01}
    for data in (
        {"directions": ends.directions, "direction_noise": 1e-3},
        {"positions": ends.positions, "position_noise": 2e-3, "optical_lengths": ends.optical_lengths, "optical_length_noise": 1e-3},
    ):
        found = reconstruct.posterior(rays, true, **options, **data)
        unit = [np.eye(true.size)[row].reshape(true.shape) for row in rows]
        precision = np.array([found.precision(one).ravel()[rows] for one in unit])
        np.testing.assert_allclose(precision, precision.T, rtol=1e-9, atol=1e-9 * np.abs(precision).max())
        # Compute it from differences of ends, without the prior.
        scale = {"positions": 2e-3, "directions": 1e-3, "optical_lengths": 1e-3}
        names = [name for name in data if name in scale]
        change = lambda one, name: getattr(rays.forward(true + 1e-3 * one), name) - getattr(rays.forward(true - 1e-3 * one), name)  # noqa: E731
        jacobian = np.array([np.concatenate([(change(one, name) / (2e-3 * scale[name])).ravel() for name in names]) for one in unit])
        slopes = np.array([_penalties.roughness(one, _penalties.lattice_of(rays, true.shape))[1].ravel()[rows] for one in unit])
        expected = jacobian @ jacobian.T + 1e4 * slopes + np.eye(len(rows)) / 0.01**2
        np.testing.assert_allclose(precision, expected, atol=1e-3 * np.abs(expected).max())
        covariance = np.linalg.inv(precision)
        columns = np.array([found.covariance(one).ravel()[rows] for one in unit])
        np.testing.assert_allclose(columns, covariance, rtol=1e-4, atol=1e-4 * np.abs(covariance).max())
    assert pickle.loads(pickle.dumps(found)) == found
    deviation = found.deviation(draws=50)
    assert np.all(deviation[walls(4)] == 0)
    np.testing.assert_allclose(deviation.ravel()[rows], np.sqrt(np.diag(covariance)), rtol=5 / np.sqrt(2 * 50))


def test_the_posterior_foretells_replicates():
    """Noise of the data alone changes the result with the covariance C F C, for the covariance C
    and the precision F of the data. The test compares the variances of 12 replicates with it: 45
    samples of 11 degrees of freedom. If all samples were one, their mean would be off by more than
    a factor of 4 by chance once in 1e4."""
    rays, true, noise = views(8, 10), bump(5), 2e-4
    exact, free = rays.forward(true), ~walls(5)
    measured = exact.directions + noise * np.random.default_rng(1).normal(size=exact.directions.shape)
    data = {"directions": measured, "direction_noise": noise, "known": walls(5), "smoothness": 3e4}
    found = reconstruct.fit(rays, true.shape, start=true, iterations=60, replicates=12, **data)
    spread = reconstruct.posterior(rays, found.samples, **data)
    rows = np.flatnonzero(free)
    covariance = np.array([spread.covariance(np.eye(true.size)[row].reshape(true.shape)).ravel()[rows] for row in rows])
    lattice = _penalties.lattice_of(rays, true.shape)
    slopes = np.array([_penalties.roughness(np.eye(true.size)[row].reshape(true.shape), lattice)[1].ravel()[rows] for row in rows])
    of_noise = covariance @ (np.linalg.inv(covariance) - 3e4 * slopes) @ covariance
    ratio = np.mean(found.deviation[free] ** 2) / np.mean(np.diag(of_noise))
    assert 1 / 4 < ratio < 4, ratio
    # Uncertainty that the penalty leaves is added.
    assert np.all(np.diag(covariance) > np.diag(of_noise))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"smoothness": 1.0}, "nothing to fit"),
        ({"directions": np.ones((3200, 3)), "direction_noise": 1.0}, "give smoothness or prior_deviation"),
        ({"directions": np.ones((3200, 3)), "smoothness": 1.0}, "give direction_noise"),
        ({"samples": np.ones(3), "smoothness": 1.0}, r"\[z, y, x\]"),
        ({"optical_lengths": np.ones(3200), "optical_length_noise": 1.0, "smoothness": 1.0, "known": np.ones((8, 8, 8), bool)}, "nothing to find"),
    ],
)
def test_mistakes_about_posteriors_are_told(options, message):
    with pytest.raises(reconstruct.ReconstructionError, match=message):
        reconstruct.posterior(views(), **{"samples": np.ones((8, 8, 8)), **options})


def test_changes_of_other_shapes_are_told():
    found = reconstruct.posterior(views(), np.ones((8, 8, 8)), optical_lengths=np.ones(3200), optical_length_noise=1.0, smoothness=1.0)
    with pytest.raises(reconstruct.ReconstructionError, match="must be finite numbers of shape"):
        found.covariance(np.ones(3))
    with pytest.raises(reconstruct.ReconstructionError, match="draws is 1"):
        found.deviation(draws=1)


LENGTHS = {"optical_lengths": np.ones(3200), "optical_length_noise": 1.0}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "nothing to fit"),
        ({"directions": np.zeros((4, 3)), "direction_noise": 1.0}, "a row for each ray"),
        ({"directions": np.zeros((3200, 3))}, "give direction_noise"),
        ({"position_noise": 1.0}, "without positions"),
        ({"optical_lengths": np.full(3200, np.nan), "optical_length_noise": 1.0}, "none of the optical_lengths"),
        ({"directions": np.zeros((3200, 3)), "direction_noise": 1.0}, "no length"),
        ({**LENGTHS, "smoothness": -1}, "at least 0"),
        ({**LENGTHS, "start": np.ones(3)}, r"\[z, y, x\]"),
        ({**LENGTHS, "total_variation": np.nan}, "total_variation is nan"),
        ({**LENGTHS, "known": np.ones((8, 8, 8))}, "of bool"),
        ({**LENGTHS, "known": np.ones((8, 8, 8), bool)}, "nothing to find"),
        ({**LENGTHS, "lower": 1.2, "upper": 1.1}, "below upper"),
        ({**LENGTHS, "replicates": 1}, "at least 2"),
    ],
)
def test_mistakes_are_told(options, message):
    with pytest.raises(reconstruct.ReconstructionError, match=message):
        reconstruct.fit(views(), (8, 8, 8), **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": 8}, r"the shape of a grid is 8 but must be \(nz, ny, nx\)"),
        ({"shape": (8, 8)}, r"the shape of a grid is \(8, 8\) but must be"),
        ({"shape": (8, 8.5, 8)}, "ny is 8.5 but must be a whole number"),
        ({"smoothness": "a"}, "smoothness is 'a' but must be a number of at least 0"),
        ({"total_variation": None}, "total_variation is None but must be a number of at least 0"),
        ({"optical_length_noise": np.full(320, 0.1)}, r"optical_length_noise has the shape \(320,\) but must be a positive number, or one for each ray"),
        ({"optical_length_noise": "a"}, "optical_length_noise is 'a' but must be a positive number"),
        ({"lower": np.array([1.0])}, r"lower is an array of shape \(1,\) but must be a positive number"),
    ],
)
def test_arguments_of_other_types_are_told(options, message):
    with pytest.raises((TypeError, reconstruct.ReconstructionError), match=f"^{message}"):
        reconstruct.fit(views(), **{"shape": (8, 8, 8), **LENGTHS, **options})


def focused(views, pixels, half):
    """Returns parallel rays onto a Luneburg lens of radius 1 from several sides, and their exits
    from a box around it. The rays of each view meet at the point of the lens that lies behind, at
    equal optical lengths. Their directions there follow from where they meet the lens off its axis."""
    number = np.arange(views) + 0.5
    height, turn = 1 - number / views, np.pi * (1 + 5**0.5) * number
    found = []
    for axis in np.column_stack([np.sqrt(1 - height**2) * np.cos(turn), np.sqrt(1 - height**2) * np.sin(turn), height]):
        side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        side /= np.linalg.norm(side)
        u, w = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-0.97, 0.97, pixels)]))
        off = u[:, None] * side + w[:, None] * np.cross(axis, side)
        size = np.hypot(u, w)
        off, size = off[size < 0.97], size[size < 0.97]
        direction = np.sqrt(1 - size**2)[:, None] * axis - off
        with np.errstate(divide="ignore"):
            further = np.min(np.where(direction != 0, (np.sign(direction) * half - axis) / direction, np.inf), axis=1)
        along = np.tile(axis, (len(off), 1))
        found.append((off - 2 * axis, along, axis + further[:, None] * direction, direction, 2 + np.pi / 2 + further))
    return (np.concatenate(part) for part in zip(*found))


def test_a_luneburg_lens_is_found_from_what_it_should_do():
    half, noise = 1.05, 1e-2
    origins, along, positions, directions, lengths = focused(12, 20, half)
    rays = grad.Rays(origins, along, box=(3 * [-half], 3 * [half]), tolerance=1e-4)
    z, y, x = np.meshgrid(*3 * [np.linspace(-half, half, 17)], indexing="ij")
    r2 = x**2 + y**2 + z**2
    data = {"positions": positions, "directions": directions, "optical_lengths": lengths}
    data.update({"position_noise": noise, "direction_noise": noise, "optical_length_noise": noise})
    found = reconstruct.fit(rays, r2.shape, **data, known=r2 > 1, lower=1.0, upper=1.5, iterations=60).samples
    inside = r2 < 1
    assert np.mean(np.abs(found / np.sqrt(2 - np.minimum(r2, 1)) - 1)[inside] < 0.01) > 0.8


def across(spread=14):
    u, w = (q.ravel() for q in np.meshgrid(*2 * [np.linspace(-0.9, 0.9, spread)]))
    return np.c_[np.full(u.size, -2.0), u, w]


def test_rays_that_never_reach_the_exit_are_an_error():
    origins = across()
    rays = grad.Rays(origins, [1, 0, 0], box=BOX, exit=grad.Plane((-4, 0, 0), (1, 0, 0)))
    with pytest.raises(reconstruct.ReconstructionError, match="no measured ray has an end in the index at the start"):
        reconstruct.fit(rays, (4, 4, 4), positions=origins - [2, 0, 0], position_noise=1e-4)


@pytest.mark.parametrize("lost", [0, 18, 80])
def test_lost_rays_are_warned_of_and_left_out(lost):
    origins = across()
    directions = np.where((np.arange(len(origins)) < lost)[:, None], [-1.0, 0, 0], [1.0, 0, 0])
    rays = grad.Rays(origins, directions, box=BOX, exit=grad.Plane((3, 0, 0), (1, 0, 0)))
    noise = 1e-4 * np.random.default_rng(0).normal(size=origins.shape) * [0, 1, 1]
    positions = origins * [0, 1, 1] + [3, 0, 0] + noise

    def fit():
        return reconstruct.fit(rays, (4, 4, 4), positions=positions, position_noise=1e-4, iterations=1, smoothness=1e3)

    if lost > 20:
        with pytest.warns(morgana.SceneWarning, match="41% of the measured rays have no end"):
            found = fit()
    else:
        found = fit()
    assert found.lost == lost
    # χ² of at least 232 effective data: its deviation is at most 0.09.
    assert found.chi_square == pytest.approx(1, abs=0.3)
    assert found.history[-1].chi_square == pytest.approx(1, abs=0.3)


def test_starts_with_named_axes_are_put_in_order():
    xarray = pytest.importorskip("xarray")
    rays, true = views(2, 6), bump(8)
    directions, noise = measured(rays, true)
    known = walls(8)

    def fit(start, known):
        return reconstruct.fit(rays, (8, 8, 8), directions=directions, direction_noise=noise, start=start, known=known, iterations=2).samples

    by_names = fit(xarray.DataArray(true.T, dims=("x", "y", "z")), xarray.DataArray(known.T, dims=("x", "y", "z")))
    np.testing.assert_array_equal(by_names, fit(true, known))
