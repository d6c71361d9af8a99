"""Graded media in Optiland: homogeneous lenses, closed forms, SciPy, and morgana's own lenses.

Skipped without Optiland, which installs a compiler of 200 MB (Numba): ``pip install optiland``.
"""

import copy
import math

import morgana
import numpy as np
import pytest
from morgana import lens

pytest.importorskip("optiland")
pytestmark = pytest.mark.filterwarnings("ignore")

SELFOC = {"type": "selfoc", "n0": 1.6, "alpha": 0.3, "direction": [0, 0, 1]}


def made(rows, entrance_pupil=1.0, fields=(0.0,), wavelengths=(0.5875618,), stop=1):
    """Optiland's lens of rows (radius, thickness, index, conic)."""
    from optiland.materials import IdealMaterial  # noqa: PLC0415
    from optiland.optic import Optic  # noqa: PLC0415

    optic = Optic()
    optic.surfaces.add(index=0, thickness=np.inf)
    for i, (radius, thickness, n, conic) in enumerate(rows, 1):
        optic.surfaces.add(index=i, radius=radius, thickness=thickness, material=IdealMaterial(n), conic=conic, is_stop=i == stop)
    optic.surfaces.add(index=len(rows) + 1)
    optic.set_aperture("EPD", entrance_pupil)
    optic.fields.set_type("angle")
    for field in fields:
        optic.fields.add(y=field)
    for i, wavelength in enumerate(wavelengths):
        optic.wavelengths.add(value=wavelength, is_primary=i == 0)
    return optic


def graded(*arguments, **options):
    import morgana.optiland  # noqa: PLC0415

    return morgana.optiland.grade(*arguments, **options)


def traced(optic, field=0.0, rings=5, wavelength=0.5875618):
    rays = optic.trace(Hx=0, Hy=field, wavelength=wavelength, num_rays=rings, distribution="hexapolar")
    return np.stack([rays.x, rays.y, rays.z], 1), np.stack([rays.L, rays.M, rays.N], 1), rays.opd


@pytest.mark.parametrize("shape", [(30.0, 0.0, -40.0, 0.0), (-50.0, 0.5, 20.0, -1.0), (np.inf, 0.0, -25.0, -2.25), (25.0, -0.7, np.inf, 0.0)])
def test_a_constant_index_is_a_homogeneous_lens(shape):
    """Positions, directions and optical lengths of a singlet, on and off the axis."""
    front, k, back, kk = shape
    plain, other = (made([(front, 6.0, 1.6, k), (back, 40.0, 1.0, kk)], 8.0, fields=(0.0, 10.0)) for _ in range(2))
    graded(other, 1, {"type": "expression", "n": "1.6 + 0*x"})
    for field in (0.0, 1.0):
        for found, expected in zip(traced(other, field), traced(plain, field)):
            np.testing.assert_allclose(found, expected, atol=1e-10)
    for name in ("f1", "f2", "F2", "EPL", "XPL", "FNO"):
        assert float(getattr(other.paraxial, name)()) == pytest.approx(float(getattr(plain.paraxial, name)()), rel=1e-9), name


def test_a_rod_has_the_closed_form():
    """Meridional rays in n² = n₀²(1 − α²r²): y = y₀ cos(αn₀z/β), with β = n cos of the angle at the front."""
    rod = made([(np.inf, 4.0, 1.6, 0), (np.inf, 0.8, 1.0, 0)], 1.6)
    graded(rod, 1, SELFOC)
    positions, directions, _ = traced(rod)
    heights = np.stack([rod.surfaces[1].x, rod.surfaces[1].y], 1)
    beta = 1.6 * np.sqrt(1 - 0.09 * (heights**2).sum(1))
    phase = 0.3 * 1.6 * 4.0 / beta
    slope = -heights * (0.3 * 1.6 * np.sin(phase))[:, None]  # Optical direction cosines: n dy/ds.
    np.testing.assert_allclose(np.stack([rod.surfaces[2].x, rod.surfaces[2].y], 1), heights * np.cos(phase)[:, None], atol=1e-10)
    np.testing.assert_allclose(directions[:, :2], slope, atol=1e-10)
    along = np.sqrt(1 - (slope**2).sum(1))
    np.testing.assert_allclose(positions[:, :2], heights * np.cos(phase)[:, None] + 0.8 * slope / along[:, None], atol=1e-10)
    assert float(rod.paraxial.f2()) == pytest.approx(1 / (1.6 * 0.3 * math.sin(1.2)), rel=1e-9)
    assert float(rod.paraxial.f1()) == pytest.approx(-1 / (1.6 * 0.3 * math.sin(1.2)), rel=1e-9)


def test_rays_against_an_integration_of_the_ray_equation():
    """DOP853 in a medium that varies along all axes, up to a curved back."""
    integrate = pytest.importorskip("scipy.integrate")
    n = lambda x, y, z: 1.6 - 0.02 * (x * x + y * y) + 0.01 * z - 0.004 * x * z  # noqa: E731
    lens_ = made([(20.0, 5.0, 1.6, 0.3), (-15.0, 10.0, 1.0, -0.5)], 6.0, fields=(0.0, 8.0))
    graded(lens_, 1, {"type": "expression", "n": "1.6 - 0.02*(x^2+y^2) + 0.01*z - 0.004*x*z"})
    traced(lens_, 1.0, rings=2)
    first, second = lens_.surfaces[1], lens_.surfaces[2]

    def slope(_, s):
        x, y, z = s[:3]
        index = n(x, y, z)
        gradient = np.array([-0.04 * x - 0.004 * z, -0.04 * y, 0.01 - 0.004 * x])
        return [*s[3:6], *(index * gradient), index**2]  # dx/dt = p, dp/dt = ∇n²/2, with ds = n dt.

    c, k = 1 / -15.0, 0.5

    def met(_, s):
        z = s[2] - 5.0
        return 2 * z - c * (s[0] ** 2 + s[1] ** 2 + k * z * z)

    met.terminal, met.direction = True, 1
    for i in range(len(first.x)):
        p = np.array([first.x[i], first.y[i], first.z[i]])
        d = np.array([first.L[i], first.M[i], first.N[i]])
        run = integrate.solve_ivp(slope, (0, 20.0), [*p, *(n(*p) * d), 0.0], method="DOP853", rtol=1e-12, atol=1e-13, events=met)
        end = run.y_events[0][0]
        np.testing.assert_allclose([second.x[i], second.y[i], second.z[i]], end[:3], atol=1e-9)
        assert second.opd[i] - first.opd[i] == pytest.approx(end[6], abs=1e-9)
        # Refraction at the back with the local index.
        normal = np.array([-c * end[0], -c * end[1], 1 - c * k * (end[2] - 5.0)])
        normal /= np.linalg.norm(normal)
        across = end[3:6] - (end[3:6] @ normal) * normal
        np.testing.assert_allclose([second.L[i], second.M[i], second.N[i]], across + math.sqrt(1 - across @ across) * normal, atol=1e-9)


def test_two_graded_media_in_contact_are_an_eye():
    """The eye of Liou and Brennan by morgana's own prescription."""
    eye = morgana.lens_examples.liou_brennan()
    rows = [(row.radius, row.thickness, row.material if isinstance(row.material, float) else 1.4, row.conic) for row in eye.surfaces]
    theirs = made(rows, 4.0, wavelengths=(0.555,), stop=3)
    for number in (3, 4):
        graded(theirs, number, eye.surfaces[number - 1].material)
    own = lens.paraxial(eye)
    # The image surface of this lens is in air, where the slope is 1.336 times larger.
    assert float(theirs.paraxial.f2()) == pytest.approx(own.focal_length / 1.336, rel=1e-8)
    assert float(theirs.paraxial.EPL()) == pytest.approx(own.entrance_pupil, rel=1e-8)
    ours = lens.trace(eye, 0.0, count=5, aim=False)
    positions, _, opd = traced(theirs, wavelength=0.555)
    spread = np.sqrt(np.sum((positions[:, :2] - positions[:, :2].mean(0)) ** 2, 1).max())
    assert spread == pytest.approx(float(np.linalg.norm(ours.points - ours.points.mean(0), axis=1).max()), rel=1e-6)
    assert np.ptp(opd) == pytest.approx(np.ptp(ours.optical_lengths), rel=1e-5)


def test_wavelengths_copies_and_lost_rays():
    volume = {"type": "cauchy", "a": 1.5, "b": 0.004}
    chromatic = made([(30.0, 5.0, 1.5, 0), (-30.0, 20.0, 1.0, 0)], 4.0, wavelengths=(0.5875618, 0.45))
    graded(chromatic, 1, volume)
    index = float(chromatic.surfaces[1].material_post.field(0.45).n([0, 0, 0]))
    same = made([(30.0, 5.0, index, 0), (-30.0, 20.0, 1.0, 0)], 4.0, wavelengths=(0.45,))
    for lens_ in (chromatic, copy.deepcopy(chromatic)):
        np.testing.assert_allclose(traced(lens_, wavelength=0.45)[0], traced(same, wavelength=0.45)[0], atol=1e-10)
    # Rays that miss the back surface have no end.
    ball = made([(np.inf, 1.0, 1.6, 0), (-2.0, 5.0, 1.0, 0)], 5.0)
    graded(ball, 1, SELFOC)
    positions, _, opd = traced(ball)
    assert np.isnan(opd).any() and np.isfinite(opd).any() and (np.isnan(positions).all(1) == np.isnan(opd)).all()


def test_mistakes_are_told():
    rod = made([(np.inf, 4.0, 1.6, 0), (np.inf, 0.8, 1.0, 0)])
    for number, message in [(0, "surface is 0"), (3, "surface is 3")]:
        with pytest.raises((morgana.RenderError, morgana.grad.GradError), match=message):
            graded(rod, number, SELFOC)
    mirror = made([(np.inf, 4.0, 1.6, 0), (np.inf, 0.8, 1.0, 0)])
    mirror.surfaces[2].interaction_model.is_reflective = True
    with pytest.raises(morgana.grad.GradError, match="surface 2 does not only refract"):
        graded(mirror, 1, SELFOC)
    graded(rod, 1, SELFOC)
    with pytest.raises(NotImplementedError, match=r"call morgana.optiland.grade after reading"):
        rod.surfaces[1].material_post.propagation_model.to_dict()
