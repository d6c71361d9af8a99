"""Fields and rays, compared with closed forms."""

import json
import subprocess
import sys
import time

import morgana
import numpy as np
import pytest
from conftest import SCENES, load, small

RNG = np.random.default_rng(1)


def luneburg(x):
    """n = √(2 − r²) and its derivatives, by hand."""
    n = np.sqrt(2 - (x**2).sum(-1))
    gradient = -x / n[..., None]
    outer = x[..., :, None] * x[..., None, :]
    hessian = -np.eye(3) / n[..., None, None] - outer / n[..., None, None] ** 3
    return n, gradient, hessian


@pytest.mark.parametrize(
    "points",
    [
        RNG.uniform(-0.5, 0.5, (7, 3)),
        RNG.uniform(-0.5, 0.5, (2, 5, 3)),
        np.asfortranarray(RNG.uniform(-0.5, 0.5, (4, 6, 3))),
        RNG.uniform(-0.5, 0.5, (9, 8))[::2, 1:7:2],
        RNG.uniform(-0.5, 0.5, (5, 3))[:, ::-1],
        RNG.uniform(-0.5, 0.5, 3),
        np.zeros((0, 3)),
    ],
)
def test_fields_have_values_and_derivatives(points):
    field = morgana.load_field({"type": "luneburg"})
    n, gradient, hessian = luneburg(points)
    np.testing.assert_allclose(field.n(points), n, rtol=1e-14)
    np.testing.assert_allclose(field.gradient(points), gradient, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(field.hessian(points), hessian, rtol=1e-12, atol=1e-14)
    assert field.hessian(points).shape == points.shape + (3,)


def test_points_may_be_of_any_type():
    field = morgana.load_field({"type": "luneburg"})
    points = RNG.uniform(-0.5, 0.5, (6, 3)).astype(np.float32)
    np.testing.assert_array_equal(field.n(points), field.n(points.astype(float)))
    assert field.n([0, 0, 0]) == pytest.approx(np.sqrt(2))
    with pytest.raises(ValueError, match=r"\(\.\.\., 3\)"):
        field.n(np.zeros((3, 2)))
    assert np.isnan(field.n([2.0, 0, 0]))
    low, high = field.bounds([0, 0, 0], [0.5, 0, 0])
    assert low <= np.sqrt(1.75) and high >= np.sqrt(2)


def test_rays_meet_at_the_far_pole():
    # Parallel rays into a Luneburg ball meet at its far pole, with the optical length of the
    # central ray.
    scene = morgana.load_file(SCENES / "luneburg_fog.xml")
    y = np.linspace(-0.8, 0.8, 9)
    rays = morgana.trace(scene, np.stack([0 * y - 1.5, y, 0 * y], -1), [1, 0, 0], max_length=8.0)
    assert len(rays) == 9 and rays.points.shape == rays.tangents.shape == (rays.offsets[-1], 3)
    for ray in rays:
        nearest = np.linalg.norm(ray.points - [1, 0, 0], axis=1).min()
        assert nearest < 1e-3
        np.testing.assert_allclose(np.linalg.norm(ray.tangents, axis=1), 1, rtol=1e-12)
        assert (np.diff(ray.arc_length) >= 0).all() and (np.diff(ray.optical_length) >= 0).all()
    assert rays.end_points.shape == (9, 3)


def test_rays_are_those_of_the_program(program, tmp_path):
    path = SCENES / "luneburg_fog.xml"
    program("trace", path, "--from=-2,0.3,0.1", "--direction", "1,0,0", "-o", "rays.json")
    (expected,) = json.loads((tmp_path / "rays.json").read_text())["rays"]
    (ray,) = morgana.trace(morgana.load_file(path), [[-2, 0.3, 0.1]], [[1, 0, 0]])
    fields = {"x": ray.points, "direction": ray.tangents, "arc_length": ray.arc_length, "opl": ray.optical_length, "index": ray.n}
    for name, found in fields.items():
        np.testing.assert_array_equal(found, [point[name] for point in expected["points"]])
    assert (ray.end, ray.surface) == (expected["end"], expected["surface"])


def test_starts_that_are_none_are_refused():
    scene = load(small())
    with pytest.raises(ValueError, match=r"direction 1 is \[0, 0, 0\], which has no length"):
        morgana.trace(scene, np.zeros((2, 3)), [[1, 0, 0], [0, 0, 0]])
    with pytest.raises(ValueError, match=r"origin 0 is \[NaN, 0, 0\]"):
        morgana.trace(scene, [[np.nan, 0, 0]], [[1, 0, 0]])


def test_lengths_of_directions_do_not_matter():
    scene = load(small())
    direction = np.array([0.6, 0.0, 0.8])
    (expected,) = morgana.trace(scene, np.zeros((1, 3)), [direction])
    for length in (5e-324, 1e-200, 1e-160, 1e160, 1e200, 1e308):
        (ray,) = morgana.trace(scene, np.zeros((1, 3)), [direction * length])
        tolerance = 1e-14 if length > 1e-300 else 0.5
        np.testing.assert_allclose(ray.tangents[0], expected.tangents[0], atol=tolerance)
        np.testing.assert_allclose(np.linalg.norm(ray.tangents[0]), 1, rtol=1e-14)


def test_connections_are_those_of_the_program(program):
    path = SCENES / "luneburg_fog.xml"
    a, b = [-0.5, 0.2, 0], [0.7, 0, 0.1]
    expected = json.loads(program("connect", path, "--from=-0.5,0.2,0", "--to", "0.7,0,0.1", "--all"))
    found = morgana.connect(morgana.load_file(path), a, b, all=True)
    assert len(found.rays) == len(expected["branches"]) and found.failure is None
    for ray, branch in zip(found.rays, expected["branches"]):
        assert ray.optical_length == branch["optical_length"] and ray.jacobian == branch["jacobian"]
        assert ray.direction_out == branch["direction_out"] and ray.transmittance == branch["transmittance"]
    primary = morgana.connect(morgana.load_file(path), a, b)
    assert len(primary.rays) == 1 and primary.rays[0].primary


def test_a_connection_is_a_ray():
    scene = load(small())
    a, b = np.array([-0.5, 0.2, 0.1]), np.array([0.4, -0.3, 0.2])
    (ray,) = morgana.connect(scene, a, b).rays
    (path,) = morgana.trace(scene, a, ray.direction_out, max_length=ray.arc_length)
    np.testing.assert_allclose(path.points[-1], b, atol=1e-6)
    assert path.optical_length[-1] == pytest.approx(ray.optical_length, rel=1e-7)
    with pytest.raises(morgana.RenderError, match="two points"):
        morgana.connect(scene, np.zeros((2, 3)), b)


def test_rays_through_a_field_are_parabolas():
    # n² = n0² + s·z: x(σ) = x0 + n0 d σ + s σ²/4 ẑ with dσ = ds/n.
    field = morgana.load_field({"type": "linear_square", "n0": 1.5, "slope": [0, 0, 0.4]})
    directions = RNG.normal(size=(20, 3))
    rays = morgana.trace(field, [0, 0, 0], directions, max_length=0.8)
    assert set(rays.end) == {"maximum length"} and len(rays) == 20
    np.testing.assert_allclose(rays.arc_length[rays.offsets[1:] - 1], 0.8, rtol=1e-9)
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    for ray, d in zip(rays, unit):
        # Two components are unaffected by the gradient.
        across = np.linalg.norm(d[:2])
        sigma = np.linalg.norm(ray.points[:, :2], axis=1) / (1.5 * across)
        np.testing.assert_allclose(ray.points[:, 2], 1.5 * d[2] * sigma + 0.1 * sigma**2, atol=1e-6)
    with pytest.raises(ValueError, match="give max_length"):
        morgana.trace(field, [0, 0, 0], [0, 0, 1])
    with pytest.raises(ValueError, match="max_length is -1"):
        morgana.trace(field, [0, 0, 0], [0, 0, 1], max_length=-1)
    (lost,) = morgana.trace(field, [0, 0, -6.0], [0, 0, 1], max_length=1)
    assert lost.end == "lost"


def test_optical_path_differences_are_good_to_a_share_of_the_contrast():
    # A weak Gaussian bump has W = Δ√(2π) w exp(−b²/2w²) to first order, at a contrast too small for
    # lengths in single precision.
    delta, width, b = 1e-8, 0.2, np.linspace(0, 0.6, 7)
    field = morgana.load_field({"type": "gaussian", "n0": 1.0, "delta": delta, "width": width})
    starts = np.stack([b, 0 * b, 0 * b - 2], -1)
    rays = morgana.trace(field, starts, [0, 0, 1], max_length=4.0, reference_index=1.0)
    peak = delta * np.sqrt(2 * np.pi) * width
    expected = peak * np.exp(-(b**2) / (2 * width**2))
    np.testing.assert_allclose(rays.total_optical_path_difference, expected, atol=1e-6 * peak)
    assert rays[2].optical_path_difference[-1] == rays.total_optical_path_difference[2]
    # The default reference is the index at the start, which is 1 here except for the bump's tail.
    default = morgana.trace(field, starts, [0, 0, 1], max_length=4.0)
    np.testing.assert_allclose(default.total_optical_path_difference, expected, atol=1e-6 * peak)
    # Compare with a reference field that bends rays strongly: the bump, with the small contrast, is
    # a weak addition to it.
    bump = {"type": "gaussian", "n0": 1.0, "delta": delta, "width": width}
    rod = {"type": "selfoc", "n0": 1.5, "alpha": 0.3}
    reference = morgana.load_field(rod)
    both = morgana.load_field({"type": "sum", "reference": 1.0, "a": rod, "b": bump})
    weak = morgana.trace(both, starts, [0, 0, 1], max_length=4.0, reference_index=reference)
    # To first order it is the integral of the contrast, bump/n, over s, ds = n dσ, along rays x = b
    # cos(n₀ α σ) of the rod.
    sigma = np.linspace(0, 2.6, 20001)[:, None]
    x, z = b * np.cos(0.45 * sigma), np.sqrt(1.5**2 - (0.45 * b) ** 2) * sigma - 2
    expected = delta * np.exp(-(x**2 + z**2) / (2 * width**2)).sum(0) * (sigma[1] - sigma[0])
    np.testing.assert_allclose(weak.total_optical_path_difference, expected, rtol=1e-4)
    assert np.isnan(weak[2].optical_path_difference[:-1]).all()
    same = morgana.trace(reference, starts, [0, 0, 1], max_length=4.0, reference_index=reference)
    np.testing.assert_allclose(same.total_optical_path_difference, 0, atol=1e-11)
    with pytest.raises(ValueError, match="reference_index"):
        morgana.trace(field, starts, [0, 0, 1], max_length=4.0, reference_index=-1.0)


ENDS = ("end_points", "end_tangents", "end_n", "total_arc_length", "total_optical_length", "total_optical_path_difference", "end", "surface")


@pytest.mark.parametrize("name", ["luneburg_fog", "aquarium_laser", "mirage"])
@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_ends_are_those_of_whole_paths(name):
    # Trace more rays than fit in one batch; some start outside of everything.
    scene = morgana.load_file(SCENES / f"{name}.xml")
    origins = RNG.uniform(-3, 3, (5000, 3))
    directions = RNG.normal(size=(5000, 3))
    rays = morgana.trace(scene, origins, directions)
    ends = morgana.trace(scene, origins, directions, paths=False)
    assert len(ends) == len(rays) == 5000 and ends.stopped is None
    for array in ENDS:
        np.testing.assert_array_equal(getattr(ends, array), getattr(rays, array))
    last = rays.offsets[1:] - 1
    np.testing.assert_array_equal(ends.end_points, rays.points[last])
    np.testing.assert_array_equal(ends.end_tangents, rays.tangents[last])
    np.testing.assert_array_equal(ends.total_optical_length, rays.optical_length[last])
    np.testing.assert_array_equal(ends.total_optical_path_difference, rays.optical_path_difference[last])
    assert [ends.end[0], ends.surface[0]] == [rays[0].end, rays[0].surface]
    assert not hasattr(ends, "points") and morgana.trace(scene, origins[:0], directions[:0], paths=False).end_points.shape == (0, 3)


def test_a_million_rays_take_little_memory():
    # Ends of the rays take 85 MB; their paths would take several gigabytes.
    code = """
import resource
import morgana
import numpy as np
field = morgana.load_field({"type": "luneburg"})
angle = np.linspace(0, 1, 1_000_000)
directions = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
ends = morgana.trace(field, [0, 0, 0], directions, max_length=0.01, paths=False)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024, len(ends))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    megabytes, count = map(float, done.stdout.split())
    assert count == 1_000_000 and megabytes < 200


@pytest.mark.parametrize("paths", [True, False])
def test_time_ends_tracing(paths):
    # The rod confines rays for ever: tracing all of them would take far longer.
    field = morgana.load_field({"type": "selfoc", "n0": 1.5, "alpha": 1.0})
    directions = np.broadcast_to([0.1, 0.0, 1.0], (1_000_000, 3))
    started = time.monotonic()
    rays = morgana.trace(field, [0.1, 0, 0], directions, max_length=100, time=0.3, paths=paths)
    assert time.monotonic() - started < 20
    assert rays.stopped == "time" and len(rays) == 1_000_000
    left = rays.end == "not followed"
    assert 0 < left.sum() < 1_000_000
    assert np.isnan(rays.end_points[left]).all() and np.isfinite(rays.end_points[~left]).all()
    if paths:
        assert not len(rays[-1].points) and "not followed" in repr(rays[-1])
        np.testing.assert_array_equal(np.diff(rays.offsets) == 0, left)


def test_shapes_that_do_not_fit_are_named():
    scene = load(small())
    with pytest.raises(ValueError, match=r"origins must have shape \(\.\.\., 3\).*\(5, 2\)"):
        morgana.trace(scene, np.zeros((5, 2)), [0, 0, 1])
    with pytest.raises(ValueError, match=r"origins have shape \(5, 3\) but directions \(4, 3\)"):
        morgana.trace(scene, np.zeros((5, 3)), np.ones((4, 3)))
    with pytest.raises(TypeError, match="a Scene or a Field"):
        morgana.trace("scene.xml", [0, 0, 0], [0, 0, 1])
    grid = morgana.trace(scene, np.zeros((4, 5, 3)), [0, 0, 1], paths=False)
    assert grid.end_points.shape == (20, 3)
