"""Cameras compared with OpenCV, Tsai's formulas and renders; data of background-oriented schlieren
compared with traced rays; joined and averaged rays compared with their parts."""

import json

import morgana
import numpy as np
import pytest
from morgana import grad, schlieren

MATRIX = np.array([[800.0, 0, 310], [0, 790, 250], [0, 0, 1]])
POSE = {"rotation": (0.3, -0.2, 0.1), "translation": (0.1, -0.2, 5.0)}
POINTS = np.array([[-0.9, 0.7, 0.4], [0.8, -0.6, -0.5], [0.1, 0.9, 0.9]])
DISTORTION = (-0.2, 0.05, 1e-3, -2e-3, 0.01, 0.02, -0.01, 0.003, 1e-3, -5e-4, 2e-3, 1e-4)
PROJECTED = {
    0: [[170.441932, 291.5307], [494.868153, 151.570885], [299.596921, 300.318694]],
    4: [[171.195617, 291.316831], [492.036467, 153.07429], [299.597077, 300.288575]],
    5: [[171.195566, 291.316846], [492.037073, 153.073968], [299.597077, 300.288575]],
    8: [[171.286039, 291.289923], [491.794494, 153.203123], [299.597953, 300.284335]],
    12: [[171.312155, 291.342459], [491.847733, 153.312398], [299.601327, 300.291013]],
}
"""Pixels of POINTS by projectPoints of OpenCV 5.0.0, by the number of coefficients."""
BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def looking(**options):
    return grad.Camera.look_at((0, 0, -5), (0, 0, 0), **{"fov": 20, "size": (8, 6), **options})


@pytest.mark.parametrize("count", PROJECTED)
def test_pixels_are_those_of_opencv(count):
    camera = grad.Camera(MATRIX, (640, 480), distortion=DISTORTION[:count], **POSE)
    np.testing.assert_allclose(camera.project(POINTS), PROJECTED[count], atol=1e-6)
    origins, directions = camera.rays(camera.project(POINTS))
    np.testing.assert_allclose(origins, np.tile(camera.origin, (3, 1)), atol=1e-12)
    # Rays of the pixels meet the points: distortion is inverted to 1e-9 pixels.
    assert np.abs(np.cross(POINTS - origins, directions)).max() < 1e-11
    assert np.all(np.sum((POINTS - origins) * directions, axis=1) > 0)


def test_points_behind_a_camera_have_no_pixel():
    assert np.isnan(looking().project([[0, 0, -6], [0, 0, 0]])).tolist() == [[True, True], [False, False]]


def test_strong_distortion_has_no_inverse():
    camera = grad.Camera(MATRIX, (640, 480), distortion=(-2.0, 0, 0, 0))
    with pytest.raises(grad.GradError, match="no inverse at 1 pixels"):
        camera.rays([[310, 250], [2000, 250]])


YAML = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 800., 0., 310., 0., 790., 250., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.2, 0.05, 1.0e-03, -2.0e-03,
       0.01 ]
rvec: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ 0.3, -0.2, 0.1 ]
tvec: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ 0.1, -0.2, 5. ]
"""


def test_files_of_opencv(tmp_path):
    expected = grad.Camera(MATRIX, (640, 480), distortion=DISTORTION[:5], **POSE)
    (tmp_path / "left.yml").write_text(YAML)
    assert grad.Camera.read(tmp_path / "left.yml") == expected
    extrinsic = "extrinsic_parameters: !!opencv-matrix\n   rows: 2\n   cols: 6\n   dt: d\n   data: [ 1, 0, 0, 0, 0, 1, 0.3, -0.2, 0.1, 0.1, -0.2, 5. ]\n"
    (tmp_path / "views.yml").write_text(YAML[: YAML.index("rvec")] + extrinsic)
    assert grad.Camera.read(tmp_path / "views.yml", view=1) == expected
    with pytest.raises(grad.GradError, match="view is 2 but must be from 0 to 1"):
        grad.Camera.read(tmp_path / "views.yml", view=2)
    # ROS writes matrices without a type, and further keys around them.
    ros = "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [800, 0, 310, 0, 790, 250, 0, 0, 1]\n"
    ros += "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.2, 0.05, 0.001, -0.002, 0.01]\n"
    (tmp_path / "ros.yaml").write_text(ros)
    assert grad.Camera.read(tmp_path / "ros.yaml", **POSE) == expected
    matrix = {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d", "data": MATRIX.ravel().tolist()}
    values = {"camera_matrix": matrix, "distortion_coefficients": list(DISTORTION[:5]), "rvec": POSE["rotation"], "tvec": POSE["translation"]}
    (tmp_path / "left.json").write_text(json.dumps(values))
    assert grad.Camera.read(tmp_path / "left.json", size=(640, 480)) == expected
    with pytest.raises(grad.GradError, match=r"left.json has no size of the image: give size"):
        grad.Camera.read(tmp_path / "left.json")


TSAI = [752, 752, 0.0062, 0.0062, 0.0062, 0.0065, 380.0, 285.0, 1.02, 8.0, 2e-3, 20.0, -30.0, 900.0, 0.2, -0.3, 0.4]


def tsai(point):
    """Returns the pixel of a point by Tsai (1987), by bisection of the cubic for the distorted
    radius."""
    _, _, _, _, dpx, dpy, cx, cy, sx, f, kappa, *rest = TSAI
    shift, (rx, ry, rz) = np.array(rest[:3]), rest[3:]
    about = lambda axis, t: np.array([[1, 0, 0], [0, np.cos(t), -np.sin(t)], [0, np.sin(t), np.cos(t)]])[np.ix_(axis, axis)]  # noqa: E731
    turn = about([1, 2, 0], rz) @ about([2, 0, 1], ry) @ about([0, 1, 2], rx)
    x, y, z = turn @ point + shift
    ideal = f * np.array([x, y]) / z
    radius, low, high = np.hypot(*ideal), 0.0, np.hypot(*ideal)
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if middle * (1 + kappa * middle**2) < radius else (low, middle)
    distorted = ideal * low / radius
    return [sx * distorted[0] / dpx + cx, distorted[1] / dpy + cy]


def test_files_of_tsai(tmp_path):
    (tmp_path / "camera.cal").write_text("\n".join(f"{value:.10e}" for value in [*TSAI, 0.0, 0.0]))
    camera = grad.Camera.read(tmp_path / "camera.cal", size=(752, 576))
    points = np.array([[100.0, 80, 50], [-120, 40, -30], [10, -90, 0]])
    np.testing.assert_allclose(camera.project(points), [tsai(point) for point in points], atol=1e-7)
    origins, directions = camera.rays(camera.project(points))
    assert np.abs(np.cross(points - origins, directions)).max() < 1e-7


LOOK = {"lookat": {"origin": [0.5, -0.3, -6], "target": [0.5, -0.3, 4], "up": [0.2, 1, 0]}}
SENSORS = [
    {"type": "perspective", "fov": 30, "fov_axis": "y", "principal_point_offset_x": 0.1, "principal_point_offset_y": -0.2},
    {"type": "thinlens", "fov": 30, "fov_axis": "diagonal", "aperture_radius": 0.3, "focus_distance": 4.0, "to_world": [{"scale": 2}, LOOK]},
    {"type": "orthographic", "to_world": [{"scale": [3, 2, 1]}, LOOK]},
]


def board(sensor):
    """A wall at z = 5 before a camera of 6 × 4 pixels, whose rays end there."""
    film = {"type": "hdrfilm", "width": 6, "height": 4, "pixel_format": "luminance", "rfilter": {"type": "box"}}
    return {
        "type": "scene",
        "integrator": {"type": "aov", "aovs": "exit_position"},
        "sensor": {"to_world": [LOOK], **sensor, "film": film},
        "wall": {"type": "rectangle", "to_world": [{"scale": 50}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 5]}]},
        "sky": {"type": "constant"},
    }


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor["type"])
def test_cameras_of_scenes_see_what_is_rendered(sensor):
    # Rays of a render start at random places in a pixel: a mean over 4096 has a standard error of at
    # most 0.289/64 = 0.0045 pixels for stratified or independent samples, with 48 values below 5 of it.
    scene = morgana.load_dict(board(sensor))
    seen = morgana.render(scene, spp=4096, seed=1).layers["exit_position"].mean.astype(float)
    camera = grad.Camera.of_scene(scene)
    np.testing.assert_allclose(camera.project(seen), camera.pixels(), atol=0.023)
    rays = grad.Rays.from_sensor(scene, exit=grad.Plane((0, 0, 5), (0, 0, 1)), box=BOX, lens=32 if sensor["type"] == "thinlens" else 1)
    ends = rays.forward(np.ones((2, 2, 2)))
    assert len(rays) == 24 and ends.positions.shape == (24, 3)
    np.testing.assert_allclose(ends.positions, seen.reshape(-1, 3), atol=0.023 * np.abs(seen[0, 1] - seen[0, 0]).max())


def test_rays_through_a_lens_meet_in_the_plane_in_focus():
    camera = looking(aperture_radius=0.2, focus_distance=8.0)
    origins, directions = camera.rays([[1, 2], [5, 3]], lens=64)
    assert np.hypot(*(origins - camera.origin).T[:2]).max() == pytest.approx(0.2, rel=0.01)
    ends = origins + directions * (8 / directions[:, 2:])
    np.testing.assert_allclose(camera.project(ends), np.repeat([[1, 2], [5, 3]], 64, axis=0), atol=1e-10)


def flow(slope, samples=5):
    """n of the slab of test_schlieren, which is 1 + slope x/2 to second order."""
    x = np.linspace(-20, 20, samples)
    return np.broadcast_to(np.sqrt(1 + slope * x), (2, 2, samples))


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
@pytest.mark.parametrize("lens", [{}, {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 60.0}])
def test_data_of_a_rendered_pair_are_the_ends_of_rays(lens):
    from test_schlieren import SLOPE, slab

    scene = slab(8, **lens)
    pair = schlieren.bos(scene, still={"slope": 0}, spp=1, rays=16, seed=4)
    wall, box = grad.Plane((0, 0, 30), (0, 0, 1)), ((-20, -20, -1), (20, 20, 1))
    data = grad.BosData.of_camera(
        morgana.load_dict(scene), pair.displacement, background=wall, noise=0.01, box=box, mask=~pair.valid, lens=16 if lens else 1, tolerance=1e-8
    )
    # A pixel is 2 · 60 tan 4°/8 wide on the wall. The displacement, 0.0115 pixels, varies by 1 % over
    # the image: its mean over a pixel is its value at the centre to far less than 1e-4 pixels.
    pixel = 2 * 60 * np.tan(np.radians(4)) / 8
    np.testing.assert_allclose(data.position_noise, 0.01 * pixel, rtol=2e-2)
    ends = data.rays.forward(flow(SLOPE)).positions
    straight = data.rays.forward(flow(0)).positions
    assert np.abs(ends - straight)[:, 0].min() > 0.01 * pixel
    np.testing.assert_allclose(ends, data.positions, atol=1e-4 * pixel)


def test_displacements_of_either_picture_give_the_same_data():
    """A displacement d = A p + b that varies over the image: in the still picture it is a function of
    q = p − d, and between both pictures of (p + q)/2."""
    camera, wall = looking(size=(64, 48)), grad.Plane((0, 0, 3), (0.1, 0, 1))
    p = camera.pixels()[5:40:7, 5:60:9]
    moved = 0.02 * (p - [30, 20]) @ np.array([[1.0, 0.3], [-0.2, 0.8]]) + [0.5, -0.3]
    options = {"background": wall, "noise": 0.1, "box": BOX}
    given = [grad.BosData.of_camera(camera, moved, pixels=p - shift * moved, at=at, **options) for shift, at in ((0, "flow"), (1, "still"), (0.5, "middle"))]
    for data in given:
        np.testing.assert_allclose(data.pixels, p.reshape(-1, 2), atol=1e-12)
        np.testing.assert_allclose(camera.project(data.positions), (p - moved).reshape(-1, 2), atol=1e-9)
        np.testing.assert_allclose(data.rays.starts[1], camera.rays(p)[1], atol=1e-12)
        # The tilted wall is seen under an angle of about 84°.
        np.testing.assert_allclose(data.position_noise, 0.1 * 2 * 8 * np.tan(np.radians(10)) / 64, rtol=0.1)


VECTORS = [(15.5, 12.5, 0.5, 0.25, 0), (31.5, 12.5, -0.25, 0.5, 0), (15.5, 22.5, 1.5, -1.0, 1), (31.5, 22.5, 0.0, 0.75, 0)]
VECTORS += [(15.5, 32.5, 0.125, 0.0, 0), (31.5, 32.5, 2.0, -0.5, 2)]
"""Columns x, y, u, v and flags, downwards."""
UPWARDS = [(x, 45 - y, u, -v, flag) for x, y, u, v, flag in VECTORS]
"""The vectors after transform_coordinates of OpenPIV."""


@pytest.mark.parametrize("rows", [VECTORS, UPWARDS], ids=["downwards", "upwards"])
def test_files_of_openpiv(tmp_path, rows):
    """The format of openpiv.tools.save, version 0.26."""
    lines = ["\t".join(f"{value:.4e}" for value in (*row, 0)) for row in rows]
    (tmp_path / "field.txt").write_text("\n".join(["# x\ty\tu\tv\tflags\tmask", *lines, ""]))
    pixels, displacement, mask = grad.BosData.read_piv(tmp_path / "field.txt")
    expected = np.array(VECTORS)
    np.testing.assert_allclose(pixels, expected[:, :2])
    np.testing.assert_allclose(displacement, expected[:, 2:4])
    assert mask.tolist() == [False, False, True, False, False, True]
    (tmp_path / "words.txt").write_text("one two three four\n")
    with pytest.raises(grad.GradError, match="words.txt is not a table of vectors"):
        grad.BosData.read_piv(tmp_path / "words.txt")
    with pytest.raises(morgana.FileError, match="cannot read .*none.txt"):
        grad.BosData.read_piv(tmp_path / "none.txt")


def index(samples=8):
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, samples)], indexing="ij")
    return 1 + 0.02 * np.exp(-2 * ((x - 0.1) ** 2 + y**2 + (z + 0.2) ** 2))


def bundles():
    """Rays of two cameras, each before a background of its own."""
    first = grad.Rays.from_sensor(looking(), box=BOX, exit=grad.Plane((0, 0, 3), (0, 0, 1)), tolerance=1e-8)
    other = grad.Camera.look_at((5, 1, 0), (0, 0, 0), fov=25, size=(5, 4))
    return first, grad.Rays.from_sensor(other, box=BOX, exit=grad.Plane((-4, 0, 0), (1, 0.1, 0)), tolerance=1e-8)


def test_joined_rays_are_their_parts():
    parts, n = bundles(), index()
    whole = grad.Rays.join(parts)
    ends, each = whole.forward(n), [part.forward(n) for part in parts]
    assert len(whole) == 68
    for name in ("positions", "directions", "optical_lengths", "codes"):
        np.testing.assert_allclose(getattr(ends, name), np.concatenate([getattr(one, name) for one in each]), rtol=1e-12, atol=1e-12)
    rows = np.array([60, 3, 50, 1])
    np.testing.assert_array_equal(whole.select(rows).forward(n).positions, ends.positions[rows])
    rng = np.random.default_rng(2)
    by, change = rng.normal(size=(68, 3)), rng.normal(size=n.shape)
    found, expected = whole.vjp(n, positions=by), [part.vjp(n, positions=one) for part, one in zip(parts, (by[:48], by[48:]))]
    np.testing.assert_allclose(found.field, expected[0].field + expected[1].field, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.origins, np.concatenate([one.origins for one in expected]), rtol=1e-12, atol=1e-12)
    assert found.exit is None
    # Forward and reverse derivatives are transposes of one another.
    assert np.sum(whole.jvp(n, change).positions * by) == pytest.approx(np.sum(found.field * change), rel=1e-9)
    squares = whole.least_squares(n, positions=ends.positions + 0.1 * by, position_noise=0.1)
    assert squares.value == pytest.approx(0.5 * np.sum(by**2), rel=1e-9)
    np.testing.assert_allclose(squares.gradient, -10 * found.field, rtol=1e-6, atol=1e-6)


def test_averages_are_means_of_their_rays():
    camera = looking(aperture_radius=0.2, focus_distance=8.0)
    wall, n = grad.Plane((0, 0, 3), (0, 0, 1)), index()
    means = grad.Rays.from_sensor(camera, lens=5, box=BOX, exit=wall, tolerance=1e-8)
    single = grad.Rays(*camera.rays(lens=5), box=BOX, exit=wall, tolerance=1e-8, max_length=means._exits.options["max_length"])
    ends, each = means.forward(n), single.forward(n)
    assert (len(means), len(single)) == (48, 240)
    np.testing.assert_allclose(ends.positions, each.positions.reshape(48, 5, 3).mean(axis=1), atol=1e-14)
    np.testing.assert_array_equal(means.select([7, 2]).forward(n).positions, ends.positions[[7, 2]])
    rng = np.random.default_rng(3)
    by, change = rng.normal(size=(48, 3)), rng.normal(size=n.shape)
    found = means.vjp(n, positions=by)
    np.testing.assert_allclose(found.field, single.vjp(n, positions=np.repeat(by, 5, axis=0) / 5).field, rtol=1e-12, atol=1e-12)
    assert np.sum(means.jvp(n, change).positions * by) == pytest.approx(np.sum(found.field * change), rel=1e-9)
    squares = means.least_squares(n, positions=ends.positions + 0.1 * by, position_noise=0.1)
    assert squares.value == pytest.approx(0.5 * np.sum(by**2), rel=1e-9)
    np.testing.assert_allclose(squares.gradient, -10 * found.field, rtol=1e-9, atol=1e-9)


WALL = grad.Plane((0, 0, 3), (0, 0, 1))


def data(displacement=np.zeros((6, 8, 2)), camera=None, **options):
    return grad.BosData.of_camera(camera or looking(), displacement, **{"background": WALL, "noise": 0.1, "box": BOX, **options})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: data(np.zeros((8, 6, 2))), r"displacement has the shape \(8, 6, 2\) but must have \(6, 8, 2\) for this camera"),
        (lambda: data(np.full((6, 8, 2), np.nan)), "no displacement is valid"),
        (lambda: data(np.full((6, 8, 2), 9.0)), "more than the image: give them in pixels"),
        (lambda: data(mask=np.zeros((8, 6), bool)), r"mask has the shape \(8, 6\)"),
        (lambda: data(mask=np.zeros((6, 8))), "of bool, True for displacements that do not count"),
        (lambda: data(noise=0.0), "noise must be positive"),
        (lambda: data(noise=np.ones(3)), r"noise has the shape \(3,\)"),
        (lambda: data(at="end"), "at is 'end' but must be 'flow', 'still' or 'middle'"),
        (lambda: data(background=grad.Plane((0, 0, -8), (0, 0, 1))), "48 of 48 rays do not meet the background"),
        (lambda: data(lens=4), "the camera has no aperture"),
        (lambda: grad.Camera(MATRIX, (640, 480), distortion=(1, 2, 3)), "distortion has 3 coefficients"),
        (lambda: grad.Camera(-MATRIX, (640, 480)), "matrix must be finite numbers"),
        (lambda: grad.Camera(MATRIX * [[-1], [1], [1]], (640, 480)), "focal lengths in matrix are -800"),
        (lambda: grad.Camera(MATRIX, 640), r"size is 640 but must be \(width, height\)"),
        (lambda: grad.Camera(MATRIX, (640, 480), rotation=2 * np.eye(3)), "not the matrix of a rotation"),
        (lambda: grad.Camera(MATRIX, (640, 480), aperture_radius=1), "a lens needs focus_distance"),
        (lambda: grad.Camera(MATRIX, (640, 480), parallel=True, distortion=(1, 0, 0, 0)), "neither an aperture nor a distortion"),
        (lambda: looking(width=3), "give either fov for a perspective camera, or width"),
        (lambda: looking(up=(0, 0, 1)), "must not be along the view"),
        (lambda: looking().rays([[np.nan, 0]]), "1 pixels are not finite"),
        (lambda: looking().rays([1, 2, 3]), "column and row"),
        (lambda: grad.Rays.join([]), "no bundles"),
        (lambda: grad.Rays.join([data().rays, data(tolerance=1e-4).rays]), "bundles 1 and 2 differ in tolerance"),
        (lambda: data().rays.averaged(5), "48 rays do not form whole groups of 5"),
        (lambda: data().rays.averaged(2).averaged(2), "means over 2 rays already"),
        (lambda: data().rays.averaged(2).jax(), "jax does not support means"),
    ],
)
def test_mistakes_are_told(call, message):
    with pytest.raises(grad.GradError, match=message):
        call()


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.yml", "a: 3\n", "a.yml has no camera matrix: it has a, but needs camera_matrix"),
        ("a.yml", YAML.replace("0., 0., 1. ]", "0. ]"), "camera_matrix in .*a.yml has 7 numbers but must have 3 × 3"),
        ("a.yml", YAML[: YAML.index("tvec")], "a.yml has only one half of the pose"),
        ("a.json", "[1, 2]", "must have an object with camera_matrix"),
        ("a.json", "{", "a.json is not JSON"),
        ("a.cal", "1 2 3", "has 3 numbers, but a calibration by Tsai's program has Ncx"),
        ("a.cal", "one", "a.cal is not a calibration by Tsai's program"),
    ],
)
def test_mistakes_in_files_are_told(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(grad.GradError, match=message):
        grad.Camera.read(tmp_path / name)
    with pytest.raises(morgana.FileError, match="cannot read .*none.yml"):
        grad.Camera.read(tmp_path / "none.yml")


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_scenes_without_a_camera_are_told():
    for sensor in ({"type": "telecentric", "acceptance_angle": 1.0}, {"type": "perspective", "focal_length": "35mm"}):
        with pytest.raises(grad.GradError, match="must be perspective or thinlens with a fov, or orthographic"):
            grad.Camera.of_scene(morgana.load_dict(board(sensor)))
    cropped = board(SENSORS[0])
    cropped["sensor"]["film"].update({"crop_offset_x": 1, "crop_width": 3})
    with pytest.raises(grad.GradError, match="the film of the scene is cropped"):
        grad.Camera.of_scene(morgana.load_dict(cropped))
