"""Wavefronts, point spread and modulation of lenses.

References are closed forms: perfect conics, the Airy pattern, the modulation of a perfect and of a
defocused pupil, and Zernike's polynomials. Each test states its tolerance.
"""

import math

import morgana
import numpy as np
import pytest
from morgana import lens
from morgana.lens import Prescription, Surface
from test_lens import triplet

N, RADIUS = 1.5, 20.0
FOCUS = N * RADIUS / (N - 1)
"""Distance from an ellipsoid to its focus, in glass."""
WAVELENGTH = 500.0


def ellipsoid(conic=-1 / N**2, **changes):
    """A surface without spherical aberration, in glass."""
    surface = Surface(RADIUS, FOCUS, N, conic=conic)
    return Prescription([surface], **{"entrance_pupil": 4.0, "wavelengths": [WAVELENGTH], **changes})


def numerical_aperture(height=2.0):
    """Index times the sine of the marginal ray of the ellipsoid, from its sag."""
    c, k = 1 / RADIUS, -1 / N**2
    z = c * height**2 / (1 + math.sqrt(1 - (1 + k) * c**2 * height**2))
    return N * height / math.hypot(height, FOCUS - z)


def test_a_perfect_conic_has_no_wavefront_error():
    """Rays have the relative accuracy 1e-11; of 60 mm this is 1e-6 waves."""
    wave = lens.wavefront(ellipsoid(entrance_pupil=16.0))
    assert np.abs(wave.waves).max() < 1e-5 and wave.rms < 1e-5
    assert lens.wavefront(ellipsoid(conic=0.0, entrance_pupil=16.0)).peak_to_valley > 10


def test_wavefront_of_a_sphere_by_paths():
    """On the axis, the optical length to a sphere around the paraxial focus, by geometry."""
    sphere = ellipsoid(conic=0.0)
    heights = np.linspace(0, 1, 9)
    wave = lens.wavefront(sphere, pupil=np.column_stack([np.zeros(9), heights]))
    y = 2.0 * heights
    z = RADIUS - np.sqrt(RADIUS**2 - y**2)
    incident = np.arcsin(y / RADIUS)
    slope = np.arcsin(np.sin(incident) / N) - incident
    # The exit pupil is the surface itself, and the reference sphere has the radius FOCUS.
    start = np.column_stack([y, z - FOCUS])
    way = np.column_stack([np.sin(slope), np.cos(slope)])
    along = (start * way).sum(1)
    s = -along - np.sqrt(FOCUS**2 - (start**2).sum(1) + along**2)
    np.testing.assert_allclose(wave.waves, -(z + N * s) / (WAVELENGTH * 1e-6), atol=1e-5)


def test_defocus_moves_the_wavefront():
    """A shift δ of the image gives W = nδ(1 − cos θ)/λ, minus terms of the order δ²/R."""
    delta = 0.02
    wave = lens.wavefront(ellipsoid(), defocus=delta)
    cosine = np.sqrt(1 - (wave.cosines**2).sum(1))
    np.testing.assert_allclose(wave.waves, N * delta * (1 - cosine) / (WAVELENGTH * 1e-6), atol=3e-3)
    assert wave.zernikes(11)[3] == pytest.approx(N * delta * (1 - cosine.min()) / (WAVELENGTH * 1e-6) / (2 * math.sqrt(3)), rel=5e-3)


def test_zernike_polynomials_are_noll_s():
    """Names and signs of Noll's table; orthonormal over the disc, by a polar quadrature."""
    x, y = 0.3, 0.4
    r2 = x * x + y * y
    table = {
        1: 1.0,
        2: 2 * x,
        3: 2 * y,
        4: math.sqrt(3) * (2 * r2 - 1),
        5: math.sqrt(6) * 2 * x * y,
        6: math.sqrt(6) * (x * x - y * y),
        7: math.sqrt(8) * (3 * r2 - 2) * y,
        8: math.sqrt(8) * (3 * r2 - 2) * x,
        9: math.sqrt(8) * (3 * x * x * y - y**3),
        10: math.sqrt(8) * (x**3 - 3 * x * y * y),
        11: math.sqrt(5) * (6 * r2**2 - 6 * r2 + 1),
        12: math.sqrt(10) * (4 * r2 - 3) * (x * x - y * y),
        13: math.sqrt(10) * (4 * r2 - 3) * 2 * x * y,
    }
    for j, value in table.items():
        assert float(lens.zernike(j, [x, y])) == pytest.approx(value, abs=1e-14), j
    nodes, weights = np.polynomial.legendre.leggauss(20)
    r, angle = np.sqrt((nodes + 1) / 2), 2 * np.pi * np.arange(40) / 40
    points = (r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], -1)).reshape(-1, 2)
    basis = np.stack([lens.zernike(j, points) for j in range(1, 67)])
    product = (basis * np.repeat(weights / 2, 40) / 40) @ basis.T
    np.testing.assert_allclose(product, np.eye(66), atol=1e-10)


def test_zernikes_of_a_wavefront_reproduce_it():
    wave = lens.wavefront(triplet(), 14.0)
    found = wave.zernikes(66)
    again = sum(a * lens.zernike(j, wave.pupil) for j, a in enumerate(found, 1))
    assert np.abs(again - wave.waves).max() < 2e-3 < wave.rms
    # The field lies along y: the wavefront is symmetric in x.
    odd = [j for j in range(1, 67) if abs(float(lens.zernike(j, [0.3, 0.4]) - lens.zernike(j, [-0.3, 0.4]))) > 1e-12]
    assert len(odd) > 20 and np.abs(found[np.array(odd) - 1]).max() < 1e-6


def perfect_modulation(nu):
    """Modulation of a round pupil at fractions of the cutoff."""
    nu = np.clip(nu, 0, 1)
    return 2 / np.pi * (np.arccos(nu) - nu * np.sqrt(1 - nu**2))


def test_modulation_of_a_perfect_lens():
    """The rim of the pupil adds 3e-4 for 128 cells, at the lowest frequency."""
    found = lens.mtf(ellipsoid(), count=128)
    assert found.cutoff == pytest.approx(2 * numerical_aperture() / (WAVELENGTH * 1e-6), rel=2e-3)
    for curve in (found.x, found.y):
        np.testing.assert_allclose(curve, perfect_modulation(found.frequencies / found.cutoff), atol=5e-4)


def test_modulation_of_a_defocused_lens():
    """Hopkins' integral of a defocused round pupil, by Gauss quadrature over the overlap.

    The defocus is nδ s₀ s₁/2λ at the rim, with its slopes s₀ and s₁ from the focus and from the
    image plane."""
    delta = 0.5
    found = lens.mtf(ellipsoid(), defocus=delta)
    sine = found.cutoff * WAVELENGTH * 1e-6 / 2 / N
    nodes, weights = np.polynomial.legendre.leggauss(200)

    def hopkins(nu):
        # Strips at x of the lens that two discs at distance 2ν share.
        half = 1 - nu
        x = nodes * half
        height = 2 * np.sqrt(np.maximum(1 - (np.abs(x) + nu) ** 2, 0))
        waves = N * delta * sine**2 * (1 + delta / FOCUS) / 2 / (WAVELENGTH * 1e-6)
        return np.sum(weights * half * height * np.cos(2 * np.pi * waves * 4 * nu * x)) / np.pi

    expected = np.abs([hopkins(nu) for nu in found.frequencies / found.cutoff])
    np.testing.assert_allclose(found.x, expected, atol=2e-3)
    assert found.x.min() < 0.02 and np.abs(found.x - perfect_modulation(found.frequencies / found.cutoff)).max() > 0.3


def test_geometric_modulation():
    """A blurred disc of radius r has 2 J₁(z)/z with z = 2πνr, here by its series. Diffraction at 2 % of
    the cutoff subtracts at most 0.025."""
    frequencies, delta = np.array([0.0, 1.0, 2.0, 4.0]), 2.0
    waves, rays = (lens.mtf(ellipsoid(), frequencies=frequencies, diffraction=kind, defocus=delta) for kind in (True, False))
    z = 2 * np.pi * frequencies * lens.trace(ellipsoid(), defocus=delta).geometric_radius
    disc = 1 - z**2 / 8 + z**4 / 192 - z**6 / 9216
    for curve in (rays.x, rays.y):
        np.testing.assert_allclose(curve, disc, atol=3e-3)
    np.testing.assert_allclose(waves.y, disc, atol=0.025)
    assert 0.5 < disc[-1] < 0.75 and math.isinf(rays.cutoff)


def test_the_airy_pattern():
    """The first dark ring of a round pupil lies at 0.60983 λ/NA; the Strehl ratio is 1."""
    found = lens.psf(ellipsoid(), count=48, padding=8)
    assert found.strehl == pytest.approx(1, abs=1e-4)
    middle = len(found.values) // 2
    assert np.unravel_index(found.values.argmax(), found.values.shape) == (middle, middle)
    radius = 0.6098349 * WAVELENGTH * 1e-6 / numerical_aperture()
    line = found.values[middle, middle:]
    at = int(line[: int(1.5 * radius / found.spacing)].argmin())
    a, b, c = np.sqrt(line[at - 1 : at + 2]) * [1, 0, 1]
    assert at * found.spacing == pytest.approx(radius, abs=0.6 * found.spacing) and line[at] < 1e-3 and a > b < c


def test_small_aberrations_lower_the_strehl_ratio():
    """Maréchal: exp(−(2πσ)²) for the RMS wavefront σ, which is tilt-free on the axis."""
    moved = lens.wavefront(ellipsoid(), count=20, defocus=0.15)
    sigma = math.sqrt((moved.zernikes(11)[1:] ** 2).sum())
    assert 0.02 < sigma < 0.1
    assert lens.psf(ellipsoid(), count=32, defocus=0.15).strehl == pytest.approx(math.exp(-((2 * math.pi * sigma) ** 2)), abs=5e-3)


def test_point_spread_has_the_centroid_of_the_rays():
    """Ehrenfest: the centroid of |U|² is the mean of the rays, here shifted by coma. The tolerance is
    light outside the window."""
    spot = lens.trace(triplet(), 14.0, pupil="grid", count=40)
    found = lens.psf(triplet(), 14.0, count=64, padding=2)
    mass = found.values / found.values.sum()
    y = (mass.sum(1) * found.coordinates).sum()
    assert spot.centroid[1] == pytest.approx(y, rel=0.01) and spot.centroid[1] > 1e-3
    assert abs((mass.sum(0) * found.coordinates).sum()) < 1e-4


def test_distortion_of_a_lens_with_a_distant_stop():
    """A plane surface of glass at distance t behind the stop moves the chief ray by Snell's law."""
    distance, depth, n, angle = 10.0, 8.0, 1.5, 25.0
    slab = Prescription([Surface(thickness=distance, stop=True), Surface(thickness=depth, material=n)], entrance_pupil=1.0)
    inside = math.tan(math.asin(math.sin(math.radians(angle)) / n))
    height = distance * math.tan(math.radians(angle)) + depth * inside
    ideal = (distance + depth / n) * math.tan(math.radians(angle))
    assert lens.distortion(slab, angle) == pytest.approx(height / ideal - 1, rel=1e-8)
    assert lens.distortion(slab, (3.0, 4.0)) < 0


def test_chromatic_shift_of_a_surface():
    """The focus of a surface of radius R lies at nR/(n − 1), in the glass."""
    glass, radius = lens.glass("N-SF6"), 30.0
    single = Prescription([Surface(radius, 66.0, glass)], entrance_pupil=1.0, wavelengths=[486.1, 587.6, 656.3], primary=1)
    n = glass.n(single.wavelengths)
    focus = n * radius / (n - 1)
    np.testing.assert_allclose(lens.focus_shift(single), focus - focus[1], atol=1e-8)
    assert lens.focus_shift(single)[2] > 0.2


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: lens.wavefront(ellipsoid(), count=1).zernikes(11), "7 rays have an end, too few for 11"),
        (lambda: lens.mtf(ellipsoid(), frequencies=[-1.0]), "finite numbers ≥ 0"),
        (lambda: lens.psf(ellipsoid(), count=4), "count is 4 but must be at least 8"),
        (lambda: lens.distortion(triplet(), 0.0), "on the axis has no distortion"),
        (lambda: lens.zernike(0, [0, 0]), "j is 0 but must be at least 1"),
        (lambda: lens.wavefront(ellipsoid()._replace(surfaces=[Surface(20.0, 5.0, {"type": "linear", "n0": 1.5, "slope": [0, 0, 0.01]})])), "image space is a field"),
    ],
)
def test_mistakes_are_told(call, message):
    with pytest.raises((morgana.grad.GradError, morgana.RenderError), match=message):
        call()
