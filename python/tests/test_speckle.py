"""Speckle patterns, compared with Fourier optics and the statistics of random waves.

False alarms: 1e-3 for all comparisons of statistics together.
"""

import math

import morgana
import numpy as np
import pytest
from morgana import speckle

WAVELENGTH, APERTURE = 0.5, 0.25
PIXEL = WAVELENGTH / (8 * APERTURE)
SHAPE = (64, 64)
LENS = {"wavelength": WAVELENGTH, "numerical_aperture": APERTURE}


def records(position, optical_length, weight=None, direction=(0, 0, 1)):
    """Records of light through the plane z = 0."""
    n = len(optical_length)
    position = np.column_stack([np.asarray(position, float), np.zeros(n)])
    direction = np.broadcast_to(np.asarray(direction, float), (n, 3))
    weight = np.ones(n) if weight is None else np.asarray(weight, float)
    return morgana.Records(
        np.arange(n), weight[:, None], position, direction, np.asarray(optical_length, float), np.zeros(n, int), np.zeros((n, 1)),
        np.zeros((n, 1), int), np.zeros((n, 1)), ["sample"], np.zeros((1, 1)), n, "W",
    )  # fmt: skip


def scattered(rng, n=4000, spread=1e4):
    """Light from everywhere in the pattern, with optical lengths that differ by many wavelengths."""
    extent = PIXEL * SHAPE[0]
    return records(extent * (rng.random((n, 2)) - 0.5), spread * rng.random(n))


def jinc(distance):
    """Returns the correlation of the field over a distance, 2 J₁(v)/v with v = 2π NA r/λ, by the
    integral of J₁."""
    v = 2 * math.pi * APERTURE * np.asarray(distance, float) / WAVELENGTH
    angle = (np.arange(2000) + 0.5) * math.pi / 2000
    # 2 J₁(v)/v = (2/π) ∫ sin² a cos(v cos a) da.
    return 2 * np.mean(np.sin(angle) ** 2 * np.cos(np.multiply.outer(v, np.cos(angle))), axis=-1)


def test_one_path_is_the_disc_of_airy():
    place = 0.3 * PIXEL, -1.6 * PIXEL
    seen = speckle.pattern(records([place], [7.0], [3.0]), SHAPE, PIXEL, **LENS)
    assert seen.power == 3
    np.testing.assert_allclose(seen.intensity.sum() * PIXEL**2, 3, rtol=1e-12)
    radius = np.hypot(seen.x - place[0], (seen.y - place[1])[:, None])
    # Pattern of an infinite plane, where the pupil is not a disc of 8 steps.
    airy = 3 * math.pi * (APERTURE / WAVELENGTH) ** 2 * jinc(radius) ** 2
    assert np.abs(seen.intensity - airy).max() < 0.03 * airy.max()
    assert seen.intensity[np.abs(radius - 0.61 * WAVELENGTH / APERTURE) < 0.2 * PIXEL].max() < 2e-3 * airy.max()


def test_random_phases_make_the_statistics_of_speckle():
    rng = np.random.default_rng(1)
    runs = [speckle.pattern(scattered(rng), SHAPE, PIXEL, **LENS) for _ in range(40)]
    lags = np.arange(1, 6)
    values, expected = [], [1.0, 1.0, 2.0] + [math.exp(-t) for t in (0.5, 1, 2, 3)] + list(jinc(PIXEL * lags) ** 2)
    for run in runs:
        i = run.intensity / run.power * (PIXEL**2 * run.intensity.size)
        correlation = [(i * np.roll(i, lag, axis=axis)).mean() - 1 for lag in lags for axis in (0, 1)]
        values.append([i.mean(), i.std(), (i**2).mean()] + [(i > t).mean() for t in (0.5, 1, 2, 3)] + list(np.reshape(correlation, (-1, 2)).mean(1)))
    mean, error = np.mean(values, axis=0), np.std(values, axis=0, ddof=1) / math.sqrt(len(runs))
    # The mean equals the mean of the paths to rounding. A pupil of 8 steps has its area to a per
    # cent, and 200 speckles have their contrast to half a per cent.
    z = (mean - expected)[1:] / np.hypot(error[1:], 0.01)
    assert abs(mean[0] - 1) < 0.02
    assert np.abs(z).max() < 4.1, z
    assert runs[0].paths_per_speckle == pytest.approx(4000 * WAVELENGTH**2 / (math.pi * APERTURE**2) / (64 * PIXEL) ** 2)



def test_light_in_phase_is_even():
    rng = np.random.default_rng(2)
    even = speckle.pattern(scattered(rng, spread=0.0), SHAPE, PIXEL, **LENS)
    rough = speckle.pattern(scattered(rng), SHAPE, PIXEL, **LENS)
    assert even.contrast < 0.5 < 0.8 < rough.contrast


def test_two_paths_interfere_by_their_optical_lengths():
    for longer in (0.0, WAVELENGTH / 3, WAVELENGTH / 2, 5 * WAVELENGTH):
        seen = speckle.pattern(records([(0, 0), (0, 0)], [3.0, 3.0 + longer]), SHAPE, PIXEL, **LENS)
        np.testing.assert_allclose(seen.intensity.sum() * PIXEL**2, 2 + 2 * math.cos(2 * math.pi * longer / WAVELENGTH), atol=1e-9)


def test_the_lens_accepts_its_cone_on_its_side():
    def power(sine, toward=1.0, **more):
        light = records([(0, 0)], [0.0], direction=(sine, 0, toward * math.sqrt(1 - sine**2)))
        return speckle.pattern(light, SHAPE, PIXEL, **{**LENS, **more}).power

    assert power(0.249) == 1 and power(0.18, index=1.33) == 1
    assert power(0.1, toward=-1.0, right=(0, 1, 0), up=(1, 0, 0)) == 1
    for rejected in ({"sine": 0.251}, {"sine": 0.2, "index": 1.33}, {"sine": 0.1, "toward": -1.0}, {"sine": 0.1, "center": (9, 0, 0)}):
        with pytest.raises(ValueError, match="none of 1 records"):
            power(**rejected)


@pytest.mark.parametrize(
    "wrong, says",
    [
        ({"pixel": 0.6}, "at most λ/"),
        ({"numerical_aperture": 1.2}, "at most the index"),
        ({"wavelength": -1.0}, "wavelength"),
        ({"up": (1, 1, 0)}, "right angles"),
        ({"shape": (0, 4)}, "one row"),
        ({"shape": 8}, "shape must be two whole numbers, rows and columns, not 8"),
        ({"shape": (8.5, 8)}, "two whole numbers"),
        ({"shape": (8, 8, 8)}, "two whole numbers"),
        ({"center": (0, 0, -3)}, "center must be in the plane of the records, but is 3 away"),
        ({"channel": 1}, "channel is 1 but must be below 1"),
    ],
)
def test_bad_input_is_refused(wrong, says):
    given = {"shape": SHAPE, "pixel": PIXEL, **LENS, **wrong}
    with pytest.raises(ValueError, match=says):
        speckle.pattern(records([(0, 0)], [0.0]), given.pop("shape"), given.pop("pixel"), **given)


@pytest.mark.parametrize("name", ["wavelength", "numerical_aperture", "pixel", "index", "channel"])
def test_what_is_no_number_is_named(name):
    given = {"shape": SHAPE, "pixel": PIXEL, **LENS, name: "a"}
    with pytest.raises(TypeError, match=rf"{name} (must be a number, finite and positive, not|is) 'a'"):
        speckle.pattern(records([(0, 0)], [0.0]), given.pop("shape"), given.pop("pixel"), **given)


def test_light_passes_in_a_plane():
    flat = records([(0, 0), (PIXEL, 0), (0, 900)], [0.0, 0.0, 0.0])
    seen = speckle.pattern(flat, SHAPE, PIXEL, **LENS)
    # Light beside the pattern, or without weight, may be anywhere; rounding does not matter.
    position = flat.position + [[0, 0, 1e-9], [0, 0, 0], [0, 0, 5]]
    np.testing.assert_allclose(speckle.pattern(flat._replace(position=position), SHAPE, PIXEL, **LENS).intensity, seen.intensity)
    steep = flat._replace(position=flat.position + [[0, 0, 0], [0, 0, 2.0], [0, 0, 0]])
    with pytest.raises(ValueError, match="light through a plane, but those within the pattern pass at heights from 0 to 2"):
        speckle.pattern(steep, SHAPE, PIXEL, **LENS)
    speckle.pattern(steep._replace(weight=np.array([[1.0], [0.0], [1.0]])), SHAPE, PIXEL, **LENS)
    with pytest.raises(TypeError, match="expected Records, found list"):
        speckle.pattern([], SHAPE, PIXEL, **LENS)
