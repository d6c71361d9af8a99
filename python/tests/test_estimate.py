"""Results compute like arrays: arithmetic with errors, selection of bins, functions of NumPy."""

import copy
import pickle

import morgana
import numpy as np
import pytest
from conftest import load, meters, small

EDGES = {"z": np.array([0.0, 10.0, 20.0, 40.0]), "x": np.array([-1.0, 0.0, 1.0])}
MEAN = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 8.0]])
ERROR = np.array([[0.1, 0.2], [0.3, 0.1], [0.5, 0.4]])
FEW = np.array([[True, False], [False, False], [False, False]])


def reading(mean=MEAN, error=ERROR, unit="W", **more):
    return morgana.Reading(mean, error, dict(EDGES), unit, **more)


def block(seed, particles=64):
    """Absorbed power in the ball, in one bin."""
    scene = meters()
    scene["sensor"].update(nx=1, ny=1, nz=1)
    return morgana.render(load(scene), particles=particles, seed=seed).meters["absorbed"].isel(x=0, y=0, z=0)


UNARY = [
    (lambda x: 2 * x, 2 * MEAN, 2 * ERROR, "W"),
    (lambda x: x * 2, 2 * MEAN, 2 * ERROR, "W"),
    (lambda x: np.float64(2) * x, 2 * MEAN, 2 * ERROR, "W"),
    (lambda x: MEAN * x, MEAN**2, MEAN * ERROR, "W"),
    (lambda x: x / -4, MEAN / -4, ERROR / 4, "W"),
    (lambda x: 1 / x, 1 / MEAN, ERROR / MEAN**2, "1/W"),
    (lambda x: x + 1, MEAN + 1, ERROR, "W"),
    (lambda x: 1 - x, 1 - MEAN, ERROR, "W"),
    (lambda x: -x, -MEAN, ERROR, "W"),
    (lambda x: abs(-x), MEAN, ERROR, "W"),
    (lambda x: x**2, MEAN**2, 2 * MEAN * ERROR, "W^2"),
    (lambda x: x**-0.5, MEAN**-0.5, 0.5 * MEAN**-1.5 * ERROR, "W^-0.5"),
    (lambda x: 2**x, 2**MEAN, 2**MEAN * np.log(2) * ERROR, ""),
    (np.square, MEAN**2, 2 * MEAN * ERROR, "square(W)"),
    (np.sqrt, np.sqrt(MEAN), ERROR / (2 * np.sqrt(MEAN)), "sqrt(W)"),
    (np.log, np.log(MEAN), ERROR / MEAN, "log(W)"),
    (np.log10, np.log10(MEAN), ERROR / MEAN / np.log(10), "log10(W)"),
    (np.log1p, np.log1p(MEAN), ERROR / (1 + MEAN), "log1p(W)"),
    (np.exp, np.exp(MEAN), np.exp(MEAN) * ERROR, "exp(W)"),
    (np.expm1, np.expm1(MEAN), np.exp(MEAN) * ERROR, "expm1(W)"),
]


@pytest.mark.parametrize(("compute", "mean", "error", "unit"), UNARY, ids=[str(i) for i in range(len(UNARY))])
def test_functions_of_one_reading_have_errors_in_closed_form(compute, mean, error, unit):
    found = compute(reading(few=FEW))
    assert type(found) is morgana.Reading and list(found.axes) == ["z", "x"]
    np.testing.assert_allclose(found.mean, mean, rtol=1e-14)
    np.testing.assert_allclose(found.error, error, rtol=1e-13)
    assert np.array_equal(found.few, FEW) and found.unit == unit


def test_independent_readings_add_errors_in_quadrature():
    x, y = reading(), reading(MEAN + 1, 2 * ERROR, few=FEW)
    for found, mean, error, unit in [
        (x + y, 2 * MEAN + 1, np.hypot(ERROR, 2 * ERROR), "W"),
        (x - y, -np.ones((3, 2)), np.hypot(ERROR, 2 * ERROR), "W"),
        (x * y, MEAN * (MEAN + 1), np.hypot((MEAN + 1) * ERROR, MEAN * 2 * ERROR), "W*W"),
        (x / y, MEAN / (MEAN + 1), MEAN / (MEAN + 1) * np.hypot(ERROR / MEAN, 2 * ERROR / (MEAN + 1)), ""),
    ]:
        np.testing.assert_allclose(found.mean, mean, rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(found.error, error, rtol=1e-13)
        assert found.unit == unit and np.array_equal(found.few, FEW)
    # A single value combines with all bins.
    np.testing.assert_allclose((x / y.isel(z=0, x=0)).error[0, 0], 0.5 * np.hypot(0.1, 0.2 / 2), rtol=1e-13)


def test_errors_of_sums_agree_with_the_spread_over_seeds():
    """Compares the error of 3x − 2y with the spread over 200 pairs of runs. The ratio of variances
    times 199 is distributed as χ² with 199 degrees of freedom, and errors of 64 particles are
    uncertain by some per cent: the limits are four standard deviations, 0.1 each. A correct program
    fails for one in 15 000 choices of the seeds."""
    found = [3 * block(2 * i) - 2 * block(2 * i + 1) for i in range(200)]
    predicted = np.mean([float(each.error) ** 2 for each in found])
    assert 0.6 < np.var([float(each) for each in found], ddof=1) / predicted < 1.4


def test_values_of_one_run_do_not_combine():
    """x − x has no error; values of one seed share random numbers, also of two scenes."""
    x = reading()
    for compute in (lambda: x - x, lambda: x + 2 * x, lambda: np.log(x) * x, lambda: sum(x)):
        with pytest.raises(ValueError, match="come from one estimate, so their noise is correlated"):
            compute()
    picture = morgana.render(load(small()), spp=4, seed=1)
    for same in (picture, pickle.loads(pickle.dumps(picture)), copy.copy(picture)):
        with pytest.raises(ValueError, match="the run with the seed 1, so"):
            picture - same
    with pytest.raises(ValueError, match="another seed"):
        block(3) + block(3, particles=128)
    np.testing.assert_allclose((block(3) + block(4)).error, np.hypot(block(3).error, block(4).error))


def test_pictures_compute_with_their_errors(tmp_path):
    picture, other = (morgana.render(load(small()), spp=4, seed=seed) for seed in (1, 2))
    difference = picture - other
    assert np.array_equal(difference.mean, picture.image - other.image)
    np.testing.assert_allclose(difference.error, np.sqrt(picture.variance + other.variance), rtol=1e-6)
    assert difference.dtype == np.float32 and difference.names == {"channel": ["R", "G", "B"]}
    picture.write(tmp_path / "a.exr")
    read = morgana.read(tmp_path / "a.exr")
    assert np.array_equal(np.asarray(read), picture.image) and np.array_equal((2 * read).error, (2 * picture).error)
    with pytest.raises(ValueError, match="the seed 1"):
        read + picture
    # A half of both pictures is an image, with its errors.
    half = (picture + other) / 2
    found = morgana.compare(half, picture)
    assert found.z["count"] == picture.image.size
    morgana.write(tmp_path / "half.exr", half)
    np.testing.assert_allclose(morgana.read(tmp_path / "half.exr").layers["variance"], half.error**2, rtol=1e-6)
    assert bool(picture) and picture.shape == (8, 12, 3) and len(picture) == 8
    red = picture.sel(channel="R", row=3)
    assert np.array_equal(red.mean, picture.image[3, :, 0]) and list(red.axes) == ["column"]
    measured = morgana.render(load(meters()), particles=640)
    assert bool(measured)
    with pytest.raises(morgana.RenderError, match="use Result.meters"):
        np.asarray(measured)


def test_wrong_combinations_are_errors():
    x, y = reading(), reading(unit="W/unit^2")
    for compute, message in [
        (lambda: x + y, "add of values in W and in W/unit"),
        (lambda: x * y.isel(z=slice(0, 2)), "the axes differ: 3 z × 2 x and 2 z × 2 x"),
        (lambda: x * (y * 1)._replace(axes={"z": EDGES["z"] + 1, "x": EDGES["x"]}), "the axes differ"),
        (lambda: x * np.ones((4, 3, 2)), r"shape \(4, 3, 2\), which is not the shape \(3, 2\)"),
    ]:
        with pytest.raises(ValueError, match=message):
            compute()
    with pytest.raises(TypeError, match="out of add must be an array"):
        np.add(x, 1, out=x)
    same = x
    x += 1
    assert np.array_equal(same.mean, MEAN) and np.array_equal(x.mean, MEAN + 1)


def test_functions_of_numpy_take_the_means():
    x = reading()
    assert np.mean(x) == MEAN.mean() and np.sum(x) == MEAN.sum() and np.max(x) == 8
    assert np.array_equal(np.sum(x, axis=0), MEAN.sum(axis=0)) and np.std(x) == MEAN.std()
    assert np.array_equal(np.stack([x, x]), [MEAN, MEAN]) and np.array_equal(np.where(x > 2, x, 0), np.where(MEAN > 2, MEAN, 0))
    assert np.array_equal(np.sin(x), np.sin(MEAN)) and np.array_equal(np.add.reduce(x), MEAN.sum(axis=0))
    assert type(x > 2) is np.ndarray and np.array_equal(x <= 2, MEAN <= 2)
    assert np.array_equal(np.ones((2, 3)) @ x, np.ones((2, 3)) @ MEAN)
    assert np.array_equal(np.asarray(x, np.float32), MEAN.astype(np.float32)) and np.asarray(x) is x.mean
    assert np.array(x, copy=True) is not x.mean and x.__array__(copy=True) is not x.mean
    with pytest.raises(ValueError, match="needs a copy"):
        x.__array__(np.float32, copy=False)
    assert (x.shape, x.ndim, x.size, x.dtype, len(x)) == ((3, 2), 2, 6, float, 3)
    assert [np.asarray(row).tolist() for row in x] == MEAN.tolist()
    assert float(x[0, 1]) == 2.0 and str(x[0, 1]) == "2 ± 0.2"
    for compute in (lambda: float(x), lambda: len(x[0, 0])):
        with pytest.raises(TypeError):
            compute()
    with pytest.raises(ValueError, match="ambiguous"):
        bool(x)


def test_bins_are_selected_by_position():
    x = reading(few=FEW)
    assert np.array_equal(x[1].mean, MEAN[1]) and list(x[1].axes) == ["x"]
    assert np.array_equal(x[..., 0].error, ERROR[:, 0]) and list(x[..., 0].axes) == ["z"]
    assert np.array_equal(x[1:].axes["z"], [10, 20, 40]) and np.array_equal(x[1:].few, FEW[1:])
    assert np.array_equal(x[-1, 1:].mean, [8.0]) and np.array_equal(x[FEW].mean, MEAN[FEW])
    assert np.array_equal(x.isel(x=-1, z=slice(0, 2)).mean, MEAN[:2, 1])
    for index, kind in [(3, IndexError), ((0, 0, 0), IndexError), (1.5, TypeError), ("z", TypeError), (slice(0, 3, 2), IndexError), (True, TypeError)]:
        with pytest.raises(kind):
            x[index]
    with pytest.raises(KeyError, match="no axis 'y': there are 'z', 'x'"):
        x.isel(y=0)


def test_matplotlib_draws_the_means():
    from matplotlib import pyplot

    _, ax = pyplot.subplots()
    (line,) = ax.plot(reading()[:, 0])
    assert np.array_equal(line.get_ydata(), MEAN[:, 0]) and np.array_equal(ax.imshow(reading()).get_array(), MEAN)
    pyplot.close()


def test_bins_are_selected_by_coordinates():
    x = reading()
    # A bin contains its lower edge; the last contains both.
    for z, row in [(0.0, 0), (9.99, 0), (10.0, 1), (12.5, 1), (20.0, 2), (40.0, 2)]:
        assert np.array_equal(x.sel(z=z).mean, MEAN[row]), z
    for z in (-1e-9, 40.1, np.inf):
        with pytest.raises(IndexError, match="the bins reach from 0 to 40"):
            x.sel(z=z)
    # A range contains the bins whose centres, 5, 15 and 30, lie in it.
    assert np.array_equal(x.sel(z=slice(5, 15)).mean, MEAN[:2]) and np.array_equal(x.sel(z=slice(6, None)).axes["z"], [10, 20, 40])
    with pytest.raises(IndexError, match="the centres reach from 5 to 30"):
        x.sel(z=slice(31, 99))
    with pytest.raises(TypeError, match="z is 'top' but must be a number"):
        x.sel(z="top")
    with pytest.raises(KeyError, match="no axis 'y'"):
        x.sel(y=1)
    falling = morgana.Estimate(MEAN[:, 0], ERROR[:, 0], {"z": EDGES["z"][::-1]})
    assert [float(falling.sel(z=z)) for z in (39.0, 15.0, 1.0)] == [1.0, 3.0, 5.0]
    np.testing.assert_array_equal(x.coordinates["z"], [5, 15, 30])
    sided = morgana.Reading(MEAN, ERROR, {"gate": None, "channel": None}, "W", names={"channel": ["500nm", "600nm"]})
    assert np.array_equal(sided.sel(channel="600nm").mean, MEAN[:, 1]) and float(sided.sel(gate=2, channel="500nm")) == 5
    with pytest.raises(KeyError, match="no channel 'R': there are '500nm', '600nm'"):
        sided.sel(channel="R")
    with pytest.raises(IndexError, match="a whole number from 0 to 2"):
        sided.sel(gate=3)


def test_sums_over_bins_have_upper_bounds_of_errors():
    x = reading(few=FEW)
    over = x.sum("z")
    np.testing.assert_allclose(over.error, ERROR.sum(axis=0))
    assert np.array_equal(over.mean, MEAN.sum(axis=0)) and list(over.axes) == ["x"] and np.array_equal(over.few, [True, False])
    np.testing.assert_allclose(x.average().error, ERROR.mean())
    assert float(x.average()) == MEAN.mean() and x.sum().unit == "W"
    with pytest.raises(KeyError, match="no axis 'y'"):
        x.sum("y")
    # The error of one bin over all is at most the bound of many.
    scene = meters()
    fine = morgana.render(load(scene), particles=640).meters["absorbed"].average()
    scene["sensor"].update(nx=1, ny=1, nz=1)
    whole = morgana.render(load(scene), particles=640).meters["absorbed"].average()
    np.testing.assert_allclose(fine.mean, whole.mean, rtol=1e-9)
    assert whole.error < fine.error < 10 * float(whole.error)


def test_powers_and_derivatives_compute_with_their_errors():
    scene = meters()
    scene["ball"]["skin"] = {"type": "irradiancemeter", "records": True}
    records = morgana.render(load(scene), particles=640, seed=1).records["irradiancemeter"]
    power = records.power()
    assert (2 * power).unit == "W" and np.array_equal((2 * power).error, 2 * power.error) and np.array_equal(np.asarray(power), power.mean)
    gates = records.gated([0, 3, 6, 9])
    assert float(gates.sel(opl=4.0, channel=0)) == gates.mean[1, 0]
    rows = records.jacobian({records.regions[-1]: 0.45})
    assert float(rows.sel(coefficient="mu_a", region=records.regions[-1], channel=0)) == rows.mu_a[-1, 0]
    assert np.array_equal(np.asarray(rows)[1], rows.mu_s, equal_nan=True)
    with pytest.raises(ValueError, match="the seed 1"):
        rows.sel(coefficient="mu_a").isel(region=0) / power
    loaded = load(small())
    found = morgana.derivatives(loaded, ["sky.emission"], np.ones((8, 12, 3)), spp=2)["sky.emission"]
    assert np.array_equal((3 * found).mean, 3 * found.value) and np.array_equal(np.asarray(found), found.value)
    # Derivatives and renders of one seed have independent random numbers; two derivatives do not.
    pixel = morgana.render(loaded, spp=2)[0, 0, 0]
    np.testing.assert_allclose((found[0] - pixel).error, np.hypot(found[0].error, pixel.error))
    with pytest.raises(ValueError, match="the run of derivatives with the seed 0"):
        found + found


def test_records_are_tables():
    scene = meters()
    scene["ball"]["skin"] = {"type": "irradiancemeter", "records": True}
    records = morgana.render(load(scene), particles=640).records["irradiancemeter"]
    late = records.optical_length > 5
    assert len(records) == len(records.weight) and len(records[late]) == late.sum() and len(records[:5]) == 5
    assert records[late].power() == records.power(late) and records[late].particles == records.particles
    assert np.array_equal(records[[3, 1]].weight, records.weight[[3, 1]])
    with pytest.raises(TypeError, match="columns are attributes"):
        records["weight"]
    with pytest.raises(ValueError, match="one for each|for each of"):
        records[late[:-1]]
    with pytest.raises(TypeError, match="records.weight"):
        np.asarray(records)


def test_results_are_copied_and_pickled_with_their_origin():
    x = 2 * block(1)
    for same in (pickle.loads(pickle.dumps(x)), copy.copy(x), copy.deepcopy(x), x._replace(unit="J")._replace(unit=x.unit)):
        assert same == x and type(same) is type(x)
        with pytest.raises(ValueError, match="the seed 1"):
            same + x
    with pytest.raises(AttributeError):
        x.unit = "J"
    with pytest.raises(TypeError, match="unhashable"):
        hash(x)
