"""Prescriptions of lenses: glasses, files, paraxial data, and rays aimed at the stop.

References are ray matrices, closed forms, and published data. Tolerances are the accuracy of rays
(1e-11 of their length) and of aims (1e-9 of the stop) unless a test states another.
"""

import math

import morgana
import numpy as np
import pytest
import scipy.special
from morgana import lens
from morgana.lens import Prescription, Surface

CATALOGUE = {  # n_d and the Abbe number in SCHOTT's data sheets, and in the papers of Malitson.
    "N-BK7": (1.51680, 64.17),
    "N-BAK4": (1.56883, 55.98),
    "N-SK16": (1.62041, 60.32),
    "N-BAF10": (1.67003, 47.11),
    "N-LAK22": (1.65113, 55.89),
    "F2": (1.62004, 36.37),
    "N-F2": (1.62005, 36.43),
    "SF2": (1.64769, 33.85),
    "SF5": (1.67270, 32.21),
    "N-SF5": (1.67271, 32.25),
    "N-SF6": (1.80518, 25.36),
    "N-SF10": (1.72828, 28.53),
    "SF11": (1.78472, 25.76),
    "N-SF11": (1.78472, 25.68),
    "N-LASF9": (1.85025, 32.17),
    "SILICA": (1.45846, 67.8),
    "CAF2": (1.43385, 95.0),
}

TRIPLET = [  # A Cooke triplet of focal length 50 at f/5, in widely used tables of examples.
    Surface(22.01359, 3.25896, "N-SK16"),
    Surface(-435.76044, 6.00755),
    Surface(-22.21328, 0.99997, "N-F2"),
    Surface(20.29192, 4.75041, stop=True),
    Surface(79.68360, 2.95208, "N-SK16"),
    Surface(-18.39533, 42.20778),
]


def triplet(**changes):
    given = {"entrance_pupil": 10.0, "fields": [0.0, 14.0, 20.0], "wavelengths": [486.1327, 587.5618, 656.2725], "primary": 1, **changes}
    return Prescription(TRIPLET, **given)


def matrix(surfaces, wavelength):
    """Ray matrix with slopes from the first to the last vertex."""
    whole, n = np.eye(2), 1.0
    for i, surface in enumerate(surfaces):
        behind = 1.0 if surface.material == "air" else float(lens.glass(surface.material).n(wavelength))
        power = 0.0 if math.isinf(surface.radius) else (behind - n) / surface.radius
        whole = np.array([[1, 0], [-power / behind, n / behind]]) @ whole
        if i < len(surfaces) - 1:
            whole = np.array([[1, surface.thickness], [0, 1]]) @ whole
        n = behind
    return whole


@pytest.mark.parametrize("name", CATALOGUE)
def test_indices_of_glasses(name):
    """Data sheets give five decimals of n_d, and two of the Abbe number."""
    glass = lens.glass(name)
    assert abs(glass.n(587.5618) - CATALOGUE[name][0]) < 1.2e-5 and glass.source
    assert abs(glass.abbe_number - CATALOGUE[name][1]) < 0.06


def test_model_glasses_have_their_index_and_abbe_number():
    model = lens.Glass.model(1.5168, 64.17)
    assert float(model.n(587.5618)) == pytest.approx(1.5168, abs=1e-12) and model.abbe_number == pytest.approx(64.17, abs=1e-9)
    np.testing.assert_allclose(model.n([486.1, 656.3]), lens.glass("N-BK7").n([486.1, 656.3]), atol=1e-4)


@pytest.mark.parametrize("wavelength", [486.1327, 587.5618, 656.2725])
def test_paraxial_data_are_those_of_ray_matrices(wavelength):
    found = lens.paraxial(triplet(), wavelength)
    (a, b), (c, d) = matrix(TRIPLET, wavelength)
    assert found.focal_length == pytest.approx(-1 / c, rel=1e-10)
    assert found.back_focal_length == pytest.approx(-a / c, rel=1e-10)
    assert found.front_focal_length == pytest.approx(d / c, rel=1e-10)
    # The stop is the fourth surface. Light reaches its plane in the glass before it.
    front = np.array([[1, TRIPLET[2].thickness], [0, 1]]) @ matrix(TRIPLET[:3], wavelength)
    assert found.entrance_pupil == pytest.approx(front[0, 1] / front[0, 0], rel=1e-10)
    assert found.stop_radius == pytest.approx(5 * front[0, 0], rel=1e-10)
    behind = np.array([[a, b], [c, d]]) @ np.linalg.inv(front)
    pupil = -behind[0, 1] / behind[1, 1]
    assert found.exit_pupil - triplet().vertices[-2] == pytest.approx(pupil, rel=1e-9)
    assert found.exit_pupil_diameter == pytest.approx(2 * found.stop_radius * (behind[0, 0] + pupil * behind[1, 0]), rel=1e-9)


def test_the_published_data_of_a_triplet():
    """The table states a focal length of 50 at f/5, to two digits behind the point."""
    found = lens.paraxial(triplet())
    assert found.focal_length == pytest.approx(50, abs=0.05) and found.f_number == pytest.approx(5, abs=0.005)
    assert lens.paraxial(triplet(entrance_pupil=None, f_number=5.0)).entrance_pupil_diameter == pytest.approx(found.focal_length / 5)


def test_images_of_near_objects():
    near = Prescription([Surface(50.0, 5.0, "N-BK7"), Surface(-50.0, 95.0)], entrance_pupil=4.0, object_distance=100.0)
    (a, b), (c, d) = matrix(near.surfaces, near.wavelength())
    found = lens.paraxial(near)
    distance = -(100 * a + b) / (100 * c + d)
    assert found.image == pytest.approx(5 + distance, rel=1e-10)
    assert found.magnification == pytest.approx(a + distance * c, rel=1e-10)
    # A narrow bundle meets near the image point.
    rays = lens.trace(near._replace(entrance_pupil=1e-3), 0.01, defocus=found.image - 100.0)
    assert rays.chief.positions[0, 1] == pytest.approx(0.01 * found.magnification, rel=1e-6) and rays.rms_radius < 1e-9


@pytest.mark.parametrize(("distance", "field"), [(math.inf, (5.0, 14.0)), (200.0, (10.0, -30.0))])
def test_rays_pass_the_stop_at_their_aims(distance, field):
    """Traces the starts to the plane of the stop by a system of the surfaces before it."""
    aimed = triplet(object_distance=distance, fields=[field])
    rays = lens.trace(aimed, field, count=3)
    assert rays.failures == {}
    whole = aimed.system()
    before = morgana.grad.System(list(whole.media)[:4], list(whole.surfaces)[:3])
    z = float(aimed.vertices[3])
    stop = morgana.grad.Rays(rays.origins, rays.directions, exit=morgana.grad.Plane((0, 0, z), (0, 0, 1))).forward(before)
    radius = lens.paraxial(aimed).stop_radius
    np.testing.assert_allclose(stop.positions[:, :2], radius * rays.pupil, atol=2e-9 * radius)
    # Without aims, rays pass the stop elsewhere: the pupil has aberrations.
    rough = lens.trace(aimed, field, count=3, aim=False)
    missed = morgana.grad.Rays(rough.origins, rough.directions, exit=morgana.grad.Plane((0, 0, z), (0, 0, 1))).forward(before)
    assert 1e-4 * radius < np.abs(missed.positions[:, :2] - radius * rays.pupil).max() < 0.2 * radius


def test_an_ellipsoid_focuses_all_rays():
    """In glass of index n, the focus of a surface of conic −1/n² lies at nR/(n − 1)."""
    n, radius = 1.6, 10.0
    perfect = Prescription([Surface(radius, n * radius / (n - 1), n, conic=-1 / n**2)], entrance_pupil=12.0)
    rays = lens.trace(perfect, count=8)
    assert lens.paraxial(perfect).back_focal_length == pytest.approx(n * radius / (n - 1), rel=1e-10)
    assert rays.geometric_radius < 1e-8 and np.abs(rays.optical_lengths).max() < 1e-9
    assert lens.trace(perfect._replace(surfaces=[perfect.surfaces[0]._replace(conic=0.0)])).rms_radius > 0.01


def ends(surface, rays=12):
    """Returns the ends of rays through a plano-convex lens with this first surface."""
    lens = morgana.lens.Prescription([surface, morgana.lens.Surface(thickness=90.0)], entrance_pupil=16.0)
    x = np.linspace(-8, 8, rays)
    starts = np.stack([x, 0.3 * x + 0.1, 0 * x - 5], axis=-1)
    beam = morgana.grad.Rays(starts, np.tile([0.02, 0.01, 1.0], (rays, 1)), exit=lens.image)
    return beam.forward(lens.system()).positions


def test_aspheres_are_conics_where_both_are_possible():
    surface = morgana.lens.Surface
    # A paraboloid is a plane with the coefficient 1/2R of ρ².
    np.testing.assert_allclose(ends(surface(math.inf, 6.0, 1.6, aspheric=[1 / 100])), ends(surface(50.0, 6.0, 1.6, conic=-1.0)), atol=1e-11)
    # An ellipsoid is a sphere with the difference of both series in ρ², which converges as (ρ/R)¹⁸.
    c, k = 1 / 50, -0.6
    series = [abs(scipy.special.binom(0.5, j)) * c ** (2 * j - 1) * ((1 + k) ** (j - 1) - 1) for j in range(1, 9)]
    np.testing.assert_allclose(ends(surface(50.0, 6.0, 1.6, aspheric=series)), ends(surface(50.0, 6.0, 1.6, conic=k)), atol=1e-11)
    assert abs(ends(surface(50.0, 6.0, 1.6)) - ends(surface(50.0, 6.0, 1.6, conic=k))).max() > 1e-3


def test_derivatives_by_aspheric_coefficients():
    lens = morgana.lens.Prescription([morgana.lens.Surface(50.0, 6.0, 1.6, aspheric=[1e-4, -1e-6]), morgana.lens.Surface(thickness=90.0)], entrance_pupil=16.0)
    rays = morgana.grad.Rays([[6.0, 2.0, -5.0]], [[0.02, 0.01, 1.0]], exit=lens.image)
    system = lens.system()
    assert morgana.grad.parameters(system)["surfaces[0].aspheric"].shape == (2,)
    along = rays.jvp(system, {"surfaces[0].aspheric": [1.0, -3.0]}).positions
    step = 1e-9

    def moved(by):
        front = system.surfaces[0]._replace(aspheric=np.array([1e-4, -1e-6]) + by * np.array([1.0, -3.0]))
        return rays.forward(system._replace(surfaces=[front, *system.surfaces[1:]])).positions

    np.testing.assert_allclose(along, (moved(step) - moved(-step)) / (2 * step), rtol=1e-5)


def test_gradient_rods_against_an_integration_of_the_ray_equation():
    """DOP853 integrates d/ds(n dx/ds) = ∇n with t = ∫ds/n, in which x″ = ½∇n²."""
    integrate = pytest.importorskip("scipy.integrate")
    n0, r2, r4, length = 1.6, -0.02, 0.003, 7.0
    volume = {"type": "expression", "n2": "n0 + r2*(x^2+y^2) + r4*(x^2+y^2)^2", "n0": n0**2, "r2": r2, "r4": r4}
    # A plane in front shifts the rod: its index starts at the vertex of its surface.
    rod = Prescription([Surface(thickness=2.0), Surface(thickness=length, material=volume), Surface(thickness=3.0)], entrance_pupil=1.5)
    rays = lens.trace(rod, (1.0, 2.0), count=1)

    def slope(t, state):
        x, y, _, *velocity, _ = state
        square = x * x + y * y
        half = r2 + 2 * r4 * square
        return [*velocity, half * x, half * y, 0.0, n0**2 + r2 * square + r4 * square**2]

    for start, direction, end, way, optical in zip(rays.origins, rays.directions, *rays.ends[:3]):
        at = start + direction * (2.0 - start[2])
        unit = direction / np.linalg.norm(direction)
        first = n0**2 + r2 * (at[0] ** 2 + at[1] ** 2) + r4 * (at[0] ** 2 + at[1] ** 2) ** 2
        velocity = np.array([unit[0], unit[1], math.sqrt(first - unit[0] ** 2 - unit[1] ** 2)])
        done = integrate.solve_ivp(slope, (0, length / velocity[2]), [*at, *velocity, 0.0], method="DOP853", rtol=1e-12, atol=1e-13)
        x, v, inside = done.y[:3, -1], done.y[3:6, -1], done.y[6, -1]
        out = np.array([v[0], v[1], math.sqrt(1 - v[0] ** 2 - v[1] ** 2)])
        np.testing.assert_allclose(way, out, atol=1e-10)
        np.testing.assert_allclose(end, x + out * 3.0 / out[2], atol=1e-9)
        assert optical == pytest.approx(np.linalg.norm(at - start) + inside + 3.0 / out[2], abs=1e-9)


def test_a_luneburg_ball_focuses_at_its_far_pole():
    """A ball between two surfaces that do not refract, because its index at the rim is 1."""
    ball = {"type": "luneburg", "center": [0, 0, 5.0], "radius": 5.0}
    whole = Prescription([Surface(5.0, 10.0, ball), Surface(-5.0, 0.5)], entrance_pupil=6.0)
    rays = lens.trace(whole, count=3, defocus=-0.5 + 1e-6)
    assert rays.failures == {} and rays.geometric_radius < 5e-6
    assert lens.paraxial(whole).back_focal_length == pytest.approx(0, abs=1e-8)
    assert lens.paraxial(whole).focal_length == pytest.approx(5, rel=1e-8)


def test_rims_stop_rays_where_they_meet_the_surface():
    """Heights of rays along the axis are heights on a first surface, curved to either side."""
    heights = np.column_stack([np.zeros(5), [0.0, 0.4, 0.599, 0.601, 0.9]])
    for radius in (20.0, -20.0, math.inf):
        surfaces = [Surface(thickness=0.0, stop=True), Surface(radius, 4.0, "N-BK7", aperture=6.0), Surface(thickness=10.0)]
        rays = lens.trace(Prescription(surfaces, entrance_pupil=20.0) if radius > 0 else shifted(surfaces), pupil=heights)
        assert list(np.isfinite(rays.points[:, 0])) == [True, True, True, False, False], radius
        assert sum(rays.failures.values()) == 2


def shifted(surfaces):
    return Prescription([surfaces[0]._replace(thickness=8.0), *surfaces[1:]], entrance_pupil=20.0)


def test_rays_that_do_not_arrive_are_counted():
    """Parallel light in glass meets a sphere at sin α = height/radius, and total reflection begins
    at sin α = 1/n."""
    n = 1.5
    ball = Prescription([Surface(thickness=8.0, material=n, stop=True), Surface(-10.0, 20.0)], entrance_pupil=19.0)
    heights = np.array([0.0, 6.6, 6.7, 9.0]) / 9.5  # Total reflection at 10/n = 6.67.
    rays = lens.trace(ball, pupil=np.column_stack([0 * heights, heights]))
    assert rays.failures == {"was totally reflected": 2} and np.isnan(rays.points[2:]).all() and np.isfinite(rays.rms_radius)


def test_samplings_of_the_pupil():
    for sampling, count, size in [("hexapolar", 6, 127), ("x", 5, 5), ("y", 5, 5), ("random", 300, 300)]:
        points = lens.pupil_points(sampling, count)
        assert points.shape == (size, 2) and np.hypot(*points.T).max() <= 1 + 1e-15
    assert len(lens.pupil_points("grid", 100)) == pytest.approx(math.pi / 4 * 100**2, rel=0.01)
    # A uniform disc has ⟨x²⟩ = 1/4; five standard errors of 300 points, from ⟨x⁴⟩ = 1/8.
    assert (points := lens.pupil_points("random", 300, seed=3))[:, 0].var() == pytest.approx(0.25, abs=5 * math.sqrt((1 / 8 - 1 / 16) / len(points)))


ZMX = """VERS 140124 258 36214
MODE SEQ
NAME A triplet
UNIT MM X W X CM MR CPMM
ENPD 10
FTYP 0 0 3 3 0 0 0
XFLN 0 0 0 0 0
YFLN 0 14 20 0 0
WAVM 1 0.4861327 1
WAVM 2 0.5875618 1
WAVM 3 0.6562725 1
WAVM 4 0.55 1
PWAV 2
SURF 0
  TYPE STANDARD
  CURV 0 0 0 0 0
  DISZ INFINITY
{surfaces}SURF 7
  TYPE STANDARD
  DISZ 0
"""


def zmx(extra=None, **words):
    """Text of the triplet as a file; ``extra`` has lines for some surfaces."""
    text = ""
    for i, row in enumerate(TRIPLET, 1):
        glass = "" if row.material == "air" else f"  GLAS {row.material} 0 0 1.5 40\n"
        stop = "  STOP\n" if row.stop else ""
        lines = f"SURF {i}\n{stop}  TYPE {words.get('kind', 'STANDARD')}\n  CURV {1 / row.radius!r} 0 0 0\n  DISZ {row.thickness}\n{glass}"
        text += lines + (extra or {}).get(i, "")
    return ZMX.format(surfaces=text)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_files_have_the_prescription(tmp_path, encoding):
    path = tmp_path / "triplet.zmx"
    path.write_bytes(zmx().replace("A triplet", "A triplét").encode(encoding))
    read = lens.read_zmx(path)
    assert read.name == "A triplét" and read.stop == 3 and read.primary == 1
    np.testing.assert_allclose(read.wavelengths, triplet().wavelengths)
    assert [tuple(field) for field in read.fields] == [(0, 0), (0, 14), (0, 20)]
    ours, theirs = (lens.trace(one, 14.0, count=2) for one in (triplet(), read))
    np.testing.assert_allclose(theirs.ends.positions, ours.ends.positions, atol=1e-9)


def test_aspheres_of_files(tmp_path):
    (tmp_path / "lens.zmx").write_text(zmx({2: "  PARM 1 0\n  PARM 2 1e-5\n  PARM 3 -2e-8\n  PARM 8 0\n"}, kind="EVENASPH"))
    lens = morgana.lens.read_zmx(tmp_path / "lens.zmx")
    assert [surface.aspheric for surface in lens.surfaces].count((0.0, 1e-5, -2e-8)) == 1
    assert morgana.lens.paraxial(lens).focal_length == pytest.approx(morgana.lens.paraxial(triplet()).focal_length)


def test_gradients_pupils_and_apertures_of_files(tmp_path):
    def read(text, **options):
        path = tmp_path / "lens.zmx"
        path.write_text(text)
        return lens.read_zmx(path, **options)

    # The rod of gradient 2 with n² = n0²(1 − α²r²) has the focal length 1/(n0 α sin αL).
    row = "SURF 1\n  STOP\n  TYPE GRINSUR2\n  PARM 1 0.1\n  PARM 2 2.56\n  PARM 3 -0.2304\n  DISZ 4\n  DIAM 0.7 1 0 0\nSURF 2\n  TYPE STANDARD\n  DISZ 1\n"
    rod = read(ZMX.format(surfaces=row).replace("ENPD 10", "FLOA").replace("UNIT MM", "UNIT IN").replace("YFLN 0 14 20", "YFLN 0 1 2"))
    found = lens.paraxial(rod)
    assert found.focal_length == pytest.approx(1 / (1.6 * 0.3 * math.sin(1.2)), rel=1e-9)
    assert found.stop_radius == 0.7 and rod.metres_per_unit == 0.0254
    kinds = {"GRINSUR1": "n0 + r2*(x^2+y^2)", "GRINSUR3": "n0 + r2*(x^2+y^2)"}
    for kind in kinds:
        one = read(ZMX.format(surfaces=row.replace("GRINSUR2", kind).replace("2.56", "1.6").replace("-0.2304", "-0.072")))
        assert float(one.system().media[1].n([0.1, 0.2, 1.0])) == pytest.approx(1.6 - 0.072 * 0.05)
    assert read(zmx({2: "  CLAP 0 4.5 0\n"})).surfaces[1].aperture == 4.5
    assert read(zmx({2: "  DIAM 4.25 1\n  FLAP 0 4.25\n"})).surfaces[1].aperture == 4.25
    assert read(zmx().replace("ENPD 10", "FNUM 5 0")).f_number == 5
    assert read(zmx().replace("N-F2", "MYGLASS"), glasses={"myglass": 1.62}).surfaces[2].material == 1.62
    assert read(zmx().replace("GLAS N-F2 0 0 1.5 40", "GLAS ___BLANK 1 0 1.62 36.4")).surfaces[2].material.abbe_number == pytest.approx(36.4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (zmx({2: "  PARM 9 1e-5\n"}, kind="EVENASPH"), r"lens.zmx:27: EVENASPH has the coefficient 1e-05 of r\^18: the orders are r\^2 to r\^16"),
        (zmx(kind="COORDBRK"), r"lens.zmx:19: surface 1 has the type COORDBRK, which is not supported: the types are STANDARD, EVENASPH"),
        (zmx().replace("N-F2", "N-F22"), r"lens.zmx:\d+: no glass 'N-F22': close names are N-F2"),
        (zmx().replace("N-F2", "MIRROR"), "surface 3 is a mirror"),
        (zmx().replace("DISZ 6.00755", "DISZ six"), "DISZ has 'six' where a number must be"),
        (zmx().replace("DISZ 6.00755", "DISZ nan"), "DISZ has 'nan' where a number must be"),
        (zmx().replace("FTYP 0", "FTYP 3"), "field type 3 is not supported"),
        (zmx().replace("FTYP 0", "FTYP 1"), "fields are heights, but the object is at infinity"),
        (zmx().replace("ENPD 10", ""), "there is no ENPD, FNUM or FLOA"),
        (zmx().replace("UNIT MM", "UNIT FURLONG"), "unit 'FURLONG' but must be one of MM"),
        (zmx().replace("MODE SEQ", "MODE NSC"), "only sequential lenses"),
        (zmx().replace("PWAV 2", "PWAV 7"), "primary wavelength is 7 of 3"),
        (zmx({2: "  OBSC 0 1 0\n"}), "the aperture OBSC is not supported"),
        (zmx().replace("FTYP 0 0 3", "FTYP 0 0 INFINITY"), "lens.zmx:6: FTYP has inf where a whole number must be"),
        (zmx().replace("GLAS N-F2 0 0 1.5 40", "GLAS"), "GLAS has nothing behind it"),
        (zmx().replace("SURF 7\n", "SURF 7\n  STOP\n").replace("  STOP\n", "", 1), "the object or the image is the stop"),
        ("SURF 0\n", "found 1 surfaces"),
    ],
)
def test_mistakes_in_files_are_located(tmp_path, text, message):
    path = tmp_path / "lens.zmx"
    path.write_text(text)
    with pytest.raises(morgana.grad.GradError, match=message):
        lens.read_zmx(path)


def test_changed_files_give_a_lens_or_an_error(tmp_path):
    """Random changes of words and lines, with fixed seeds."""
    rng = np.random.default_rng(0)
    words = ["INFINITY", "nan", "-1", "1e308", "x", "", "SURF", "STOP", "1e-320", "GRINSUR2", "-INFINITY", "9" * 20]
    path = tmp_path / "lens.zmx"
    lenses = 0
    for _ in range(400):
        lines = zmx({2: "  CLAP 0 4.5 0\n"}).split("\n")
        for _ in range(2):
            k = rng.integers(len(lines))
            parts = lines[k].split(" ")
            parts[rng.integers(len(parts))] = str(rng.choice(words))
            lines[k : k + 1] = [" ".join(parts)] * int(rng.integers(0, 3))
        path.write_text("\n".join(lines))
        try:
            lenses += isinstance(lens.read_zmx(path), Prescription)
        except morgana.grad.GradError as error:
            assert "lens.zmx" in str(error)
    assert 50 < lenses < 350


def test_a_missing_file_is_named():
    with pytest.raises(morgana.FileError, match="nowhere.zmx"):
        lens.read_zmx("nowhere.zmx")


ROW = Surface(50.0, 5.0, "N-BK7")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Prescription([], entrance_pupil=1.0), "at least one surface"),
        (lambda: Prescription([ROW._replace(radius=0.0)], entrance_pupil=1.0), r"surfaces\[0\].radius is 0.0"),
        (lambda: Prescription([ROW._replace(thickness=math.nan)], entrance_pupil=1.0), r"surfaces\[0\].thickness is nan"),
        (lambda: Prescription([ROW._replace(aperture=51.0)], entrance_pupil=1.0), "does not reach this far"),
        (lambda: Prescription([ROW._replace(stop=True)] * 2, entrance_pupil=1.0), "surfaces 0, 1 are all marked as the stop"),
        (lambda: Prescription([ROW]), "the pupil has no size"),
        (lambda: Prescription([ROW], entrance_pupil=1.0, f_number=2.0), "give one of them"),
        (lambda: Prescription([ROW], entrance_pupil=1.0, fields=[90.0]), "below 90 degrees"),
        (lambda: Prescription([ROW], entrance_pupil=1.0, primary=1), "primary is 1 but must be at most 0"),
        (lambda: Prescription([ROW._replace(material="N-BK77")], entrance_pupil=1.0).system(), r"surfaces\[0\]: no glass 'N-BK77': close names are N-BK7"),
        (lambda: Prescription([ROW._replace(material=math.nan)], entrance_pupil=1.0).system(), r"surfaces\[0\] is nan"),
        (lambda: lens.trace(triplet(), 5.0, pupil="spiral"), "sampling is 'spiral'"),
        (lambda: lens.trace(triplet(), 5.0, pupil=[[0.0, math.nan]]), "finite numbers of shape"),
        (lambda: lens.trace(triplet(), 70.0), "the chief ray of field .* at 587.562 nm"),
        (lambda: lens.glass("F2").n(-5.0), "must be positive, in nanometres"),
        (lambda: lens.Glass("bad", (1.0,), (0.25,)).n(500.0), "has a resonance"),
    ],
)
def test_mistakes_in_prescriptions_are_told(call, message):
    with pytest.raises((morgana.grad.GradError, morgana.RenderError), match=message):
        call()


def test_weights_of_hexapolar_samplings_are_areas():
    """Moments of the unit disc, ⟨r²⟩ = 1/2 and ⟨r⁶⟩ = 1/4, to second order in the ring spacing."""
    singlet = Prescription([ROW], entrance_pupil=1.0)
    for count in (10, 20):
        rays = lens.trace(singlet, count=count)
        square = (rays.pupil**2).sum(1)
        for power, moment in ((1, 1 / 2), (3, 1 / 4)):
            assert np.average(square**power, weights=rays.weights) == pytest.approx(moment, abs=1.5 / count**2)
    # The spot of a wide field is that of a fine grid.
    fine = lens.trace(triplet(), 20.0, pupil="grid", count=60).rms_radius
    assert lens.trace(triplet(), 20.0, count=20).rms_radius == pytest.approx(fine, rel=0.02)
