"""Pictures on screens and of backgrounds compared with closed forms, central differences, and
gradients by JAX and PyTorch."""

import numpy as np
import pytest
from morgana import grad

RNG = np.random.default_rng(7)
BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
INDEX = 1.0 + 0.05 * RNG.random((4, 5, 6))
KERNELS = ("linear", "cubic")


def screen(kernel="linear", **options):
    """A screen with columns along x and rows along −y, and an oblique axis."""
    return grad.Screen(**{"center": (0.05, 0, 3), "right": (2.4, 0, 0), "down": (0.3, -2, 0), "size": (9, 7), "kernel": kernel, **options})


def wall(kernel="linear", **options):
    return grad.Background(**{"center": (0.05, 0, 3), "right": (2.4, 0, 0), "down": (0.3, -2, 0), "size": (9, 7), "kernel": kernel, **options})


def collimated(plane, count=12, half=0.8):
    """Parallel rays along z through the box."""
    x, y = np.meshgrid(*2 * [half * (2 * np.arange(count) + 1 - count) / count])
    return grad.Rays(np.stack([x, y, np.full(x.shape, -2.0)], axis=-1).reshape(-1, 3), (0, 0, 1), box=BOX, exit=plane, tolerance=1e-10)


def points_on(raster, count=40, margin=1.5):
    """Random points of a screen, off its edges by ``margin`` pixels."""
    width, height = raster.size
    at = np.column_stack([RNG.uniform(margin, width - 1 - margin, count), RNG.uniform(margin, height - 1 - margin, count)])
    u, v = (at + 0.5).T / np.array([[width], [height]]) - 0.5
    return np.array([0.05, 0, 3]) + u[:, None] * [2.4, 0, 0] + v[:, None] * [0.3, -2, 0]


def difference(function, at, direction, step=1e-6):
    """Central difference of a function along a direction."""
    return (function(at + step * direction) - function(at - step * direction)) / (2 * step)


def in_plane(count):
    return RNG.normal(size=(count, 3)) * [1, 1, 0]


def test_pixels_are_points_of_the_plane():
    raster = screen()
    np.testing.assert_allclose(raster.project(raster.points()), np.stack(np.meshgrid(np.arange(9.0), np.arange(7.0)), axis=-1), atol=1e-12)
    np.testing.assert_allclose(np.abs(raster.plane.normal), [0, 0, 1], atol=1e-15)
    assert raster.pixel_area == pytest.approx(2.4 * 2 / 63)
    assert np.isnan(raster.project([[0, np.nan, 3], [0, 0, 3]])).tolist() == [[True, True], [False, False]]


@pytest.mark.parametrize("kernel", KERNELS)
def test_power_on_a_screen_is_conserved(kernel):
    raster = screen(kernel)
    power = RNG.random((40, 3))
    caustic = raster.picture(points_on(raster, margin={"linear": 0, "cubic": 1}[kernel]), power)
    assert caustic.values.shape == (7, 9, 3) and (caustic.lost, caustic.missed) == (0, 0)
    np.testing.assert_allclose(caustic.values.sum(axis=(0, 1)) * raster.pixel_area, power.sum(axis=0), rtol=1e-12)
    # The centre of power is the mean of the ends.
    points = points_on(raster)
    light = raster.picture(points).values * raster.pixel_area / 40
    np.testing.assert_allclose(np.sum(light[..., None] * raster.points(), axis=(0, 1)), points.mean(axis=0), atol=1e-12)
    assert np.all(light >= 0)


def test_rays_that_miss_are_counted():
    raster, points = screen(), points_on(screen())
    points[0], points[1], points[2] = np.nan, (1e300, 0, 3), (30, 0, 3)
    caustic = raster.picture(points, 1.0)
    assert (caustic.lost, caustic.missed) == (1, 2)
    assert caustic.values.sum() * raster.pixel_area == pytest.approx(37, rel=1e-12)
    assert not raster.vjp(points, 1.0, np.ones((7, 9))).positions[:3].any()
    seen = wall().picture(points, np.ones((7, 9)))
    assert (seen.lost, seen.missed) == (1, 2) and np.isnan(seen.values[:3]).all()
    np.testing.assert_allclose(seen.values[3:], 1, rtol=1e-12)
    pairs = wall(lens=2).picture(points, np.ones((7, 9))).values
    assert np.isnan(pairs[:2]).all() and np.isfinite(pairs[2:]).all()


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_background_reproduces_its_image(kernel):
    image = RNG.random((7, 9, 2))
    back = wall(kernel)
    np.testing.assert_allclose(back.picture(back.points().reshape(-1, 3), image).values, image.reshape(-1, 2), atol=1e-12)
    # Interpolation reproduces a linear image, and continues it by a constant beyond the outer pixels.
    points = points_on(back)
    columns = np.tile(np.arange(9.0), (7, 1))
    np.testing.assert_allclose(back.picture(points, columns).values, back.project(points)[:, 0], atol=1e-12)
    corner = back.points()[0, 0] - 0.4 * np.array([2.4 / 9, 0, 0])
    assert back.picture([corner], columns).values[0] == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("kernel", KERNELS)
def test_derivatives_are_those_of_central_differences(kernel):
    points = points_on(screen(), margin=-0.4)
    for raster, values in ((screen(kernel), RNG.random((40, 2))), (wall(kernel, lens=2), RNG.random((7, 9, 2)))):
        by = RNG.normal(size=raster.picture(points, values).values.shape)
        found = raster.vjp(points, values, by)
        step, change = in_plane(40), RNG.normal(size=values.shape)
        loss = lambda x, v: np.sum(by * raster.picture(x, v).values)  # noqa: B023, E731
        assert np.sum(found.positions * step) == pytest.approx(difference(lambda x: loss(x, values), points, step, 1e-7), rel=1e-6)  # noqa: B023
        assert np.sum(found.values * change) == pytest.approx(difference(lambda v: loss(points, v), values, change), rel=1e-8)  # noqa: B023
    # Derivatives by one power for all rays.
    by = RNG.normal(size=(7, 9))
    assert screen(kernel).vjp(points, 2.0, by).values == pytest.approx(np.sum(by * screen(kernel).picture(points).values), rel=1e-12)


def test_screens_and_backgrounds_are_transposes():
    points, image, power = points_on(screen(), margin=0.5), RNG.random((7, 9)), RNG.random(40)
    light, seen = screen().picture(points, power).values * screen().pixel_area, wall().picture(points, image).values
    assert np.sum(light * image) == pytest.approx(np.sum(power * seen), rel=1e-12)


def test_an_unknown_image_solves_a_sparse_system():
    pytest.importorskip("scipy")
    points, image, back = points_on(screen(), margin=0.5), RNG.random((7, 9)), wall("cubic", lens=4)
    to_picture = back.matrix(points)
    np.testing.assert_allclose(to_picture @ image.ravel(), back.picture(points, image).values, atol=1e-14)
    points[5] = np.nan
    lost = back.matrix(points).toarray()
    assert not lost[1].any() and np.array_equal(np.delete(lost, 1, axis=0), np.delete(to_picture.toarray(), 1, axis=0))


def test_a_uniform_index_gives_the_unbent_picture():
    raster, back = screen(size=(24, 20)), wall(size=(24, 20))
    uniform, image = np.full((3, 3, 3), 1.0), RNG.random((20, 24))
    camera = grad.Camera.look_at((0, 0, -4), (0, 0, 0), fov=14, size=(10, 8))
    rays = grad.Rays.from_sensor(camera, box=BOX, exit=back.plane)
    seen = back.picture(rays.forward(uniform).positions, image)
    origins, directions = rays.starts
    straight = origins + (7 / directions[:, 2:]) * directions
    np.testing.assert_allclose(seen.values, back.picture(straight, image).values, atol=1e-12)
    parallel = collimated(raster.plane)
    np.testing.assert_allclose(
        raster.picture(parallel.forward(uniform).positions).values, raster.picture(parallel.starts[0] + [0, 0, 5]).values, atol=1e-12
    )


def test_a_parabolic_slab_makes_a_small_spot_at_its_focus():
    """A slab with n = n₀ − s r²/2 and the thickness d, in a liquid of index n₀, has the focal
    length n₀/(s d), for d much below it."""
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 33)], indexing="ij")
    strength, sizes = 0.1, []
    index = 1.5 - 0.5 * strength * (x**2 + y**2)
    focus = 1.5 / (2 * strength)
    for distance in (0.5 * focus, focus, 1.5 * focus):
        raster = grad.Screen((0, 0, distance), (2, 0, 0), (0, -2, 0), (80, 80))
        rays = grad.Rays(collimated(raster.plane, 16).starts[0], (0, 0, 1), box=BOX, ambient=1.5, exit=raster.plane, tolerance=1e-6)
        caustic = raster.picture(rays.forward(index).positions, 1 / len(rays)).values * raster.pixel_area
        sizes.append(np.sqrt(np.sum(caustic * np.sum(raster.points()[..., :2] ** 2, axis=-1))))
    unbent = np.sqrt(np.mean(rays.starts[0][:, 0] ** 2 + rays.starts[0][:, 1] ** 2))
    # Thin lens: the size falls linearly to the focus, and grows linearly behind it.
    np.testing.assert_allclose(sizes, [0.5 * unbent, 0, 0.5 * unbent], atol=0.06 * unbent)


def minimal(raster, rays, values, noise=1.0):
    """Checks derivatives of least squares by the index and by values."""
    target = raster.picture(rays.forward(np.full((2, 2, 2), 1.0)).positions, values).values
    target[np.isfinite(target)] += 0.3
    loss = raster.least_squares(rays, INDEX, target, values, noise=noise)
    bent, changed = RNG.normal(size=INDEX.shape), RNG.normal(size=np.shape(values))
    value = lambda n, v: raster.least_squares(rays, n, target, v, noise=noise).value  # noqa: E731
    assert np.sum(loss.gradient * bent) == pytest.approx(difference(lambda n: value(n, values), INDEX, bent, 2e-5), rel=1e-4)
    assert np.sum(loss.values * changed) == pytest.approx(difference(lambda v: value(INDEX, v), values, changed), rel=1e-6)
    return loss


def test_losses_have_derivatives_by_index_power_and_image():
    raster = screen("cubic")
    minimal(raster, collimated(raster.plane), RNG.random(144), noise=RNG.uniform(1, 2, (7, 9)))
    camera = grad.Camera.look_at((0, 0, -4), (0, 0, 0), fov=14, size=(6, 5), aperture_radius=0.2, focus_distance=6)
    back = wall("cubic", lens=4)
    rays = grad.Rays(*camera.rays(lens=4), box=BOX, exit=back.plane, tolerance=1e-10)
    loss = minimal(back, rays, RNG.random((7, 9)))
    assert loss.values.shape == (7, 9) and loss.picture.values.shape == (30,)


def test_unknown_pixels_are_ignored():
    raster = screen()
    rays = collimated(raster.plane)
    target = np.zeros((7, 9))
    target[2, 3] = np.nan
    loss = raster.least_squares(rays, INDEX, target, 1.0)
    assert loss.value == pytest.approx(0.5 * (np.sum(loss.picture.values**2) - loss.picture.values[2, 3] ** 2))
    camera = grad.Camera.look_at((0, 0, -4), (0, 0, 0), fov=50, size=(6, 5))
    seeing = grad.Rays.from_sensor(camera, box=BOX, exit=wall().plane)
    wide = wall().least_squares(seeing, INDEX, np.zeros((5, 6)), np.ones((7, 9)))
    assert 0 < wide.picture.missed < 30 and wide.value == pytest.approx(0.5 * (30 - wide.picture.missed))


def test_focal_stacks_blur_what_is_out_of_focus():
    """A disc of radius a at the distance f from the lens blurs a background at the distance D over
    a radius a |D − f|/f."""
    stripes = np.tile(np.arange(160) % 8 < 4, (16, 1)).astype(float)
    back = grad.Background((0, 0, 3), (-4, 0, 0), (0, -0.4, 0), (160, 16), lens=64)
    contrast = []
    for focus in (7.0, 6.0, 4.0):
        camera = grad.Camera.look_at((0, 0, -4), (0, 0, 0), fov=25, size=(120, 1), aperture_radius=0.15, focus_distance=focus)
        rays = grad.Rays(*camera.rays(lens=64), box=BOX, exit=back.plane)
        contrast.append(np.std(back.picture(rays.forward(np.full((2, 2, 2), 1.0)).positions, stripes).values))
    assert contrast[0] > 0.4 and contrast[0] > contrast[1] > 2 * contrast[2]


def gradients_of(raster, values, target, rays):
    """Derivatives of the sum of squares by the index and the values, without JAX or PyTorch."""
    loss = raster.least_squares(rays, INDEX, target, values)
    return 2 * loss.gradient, 2 * loss.values


def cases():
    image = RNG.random((7, 9))
    yield screen(), RNG.random(144), RNG.random((7, 9))
    yield wall(lens=2), image, RNG.random(72)


@pytest.mark.parametrize(("raster", "values", "target"), list(cases()), ids=("screen", "background"))
def test_jax(raster, values, target):
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    try:
        rays = collimated(raster.plane)
        follow, picture = rays.jax(), raster.jax()
        loss = lambda n, v: jax.numpy.sum((picture(follow(n)[0], v) - target) ** 2)  # noqa: E731
        for run in (jax.grad(loss, argnums=(0, 1)), jax.jit(jax.grad(loss, argnums=(0, 1)))):
            for found, exact in zip(run(INDEX, values), gradients_of(raster, values, target, rays)):
                np.testing.assert_allclose(found, exact, rtol=1e-10, atol=1e-12)
        # Rays without an end must not send zero times NaN back.
        lost = jax.numpy.asarray(points_on(raster)).at[0].set(np.nan)
        by = jax.grad(lambda x: jax.numpy.nansum(picture(x, image_or_one(raster))))(lost)
        assert np.isfinite(by).all() and not by[0].any() and by.shape == (40, 3)
        with pytest.raises(grad.GradError, match="positions have the shape"):
            picture(np.zeros(3), values)
    finally:
        jax.config.update("jax_enable_x64", False)


def image_or_one(raster):
    return RNG.random((7, 9)) if isinstance(raster, grad.Background) else 1.0


@pytest.mark.parametrize(("raster", "values", "target"), list(cases()), ids=("screen", "background"))
def test_torch(raster, values, target):
    torch = pytest.importorskip("torch")
    rays = collimated(raster.plane)
    index, given = (torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (INDEX, values))
    ((raster.torch()(rays.torch()(index)[0], given) - torch.tensor(target)) ** 2).sum().backward()
    for tensor, exact in zip((index, given), gradients_of(raster, values, target, rays)):
        np.testing.assert_allclose(tensor.grad.numpy(), exact, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: screen(size=9), "size is 9 but must be"),
        (lambda: screen(right=(0, 0, 0)), "both must have a length"),
        (lambda: screen(down=(1, 0, 0)), "different directions"),
        (lambda: screen("quintic"), "kernel is 'quintic' but must be 'linear' or 'cubic'"),
        (lambda: screen().picture(np.zeros((3, 2))), r"positions have the shape \(3, 2\)"),
        (lambda: screen().picture(points_on(screen()), np.ones(39)), "power has the shape .* a row for each of 40 rays"),
        (lambda: screen().picture(points_on(screen()), np.nan), "1 numbers of the power are not finite"),
        (lambda: screen().picture(points_on(screen()) - [0, 0, 2]), "up to 2 beside the plane .* exit=screen.plane"),
        (lambda: screen().vjp(points_on(screen()), 1.0, np.ones((9, 7))), r"derivatives by the picture have the shape \(9, 7\)"),
        (lambda: screen().vjp(points_on(screen()), 1.0, np.full((7, 9), np.nan)), "63 derivatives by the picture are not finite"),
        (lambda: wall().picture(points_on(screen()), np.ones((9, 7))), r"must have \(7, 9\), rows and columns"),
        (lambda: wall(lens=7).picture(points_on(screen()), np.ones((7, 9))), "40 rays do not form whole groups of lens=7"),
        (lambda: wall().vjp([[np.nan] * 3], np.ones((7, 9)), [1.0]), "depends on 1 rays that do not meet the background"),
        (lambda: least(np.zeros((9, 7))), "measured has the shape"),
        (lambda: least(np.zeros((7, 9)), noise=0), "noise must be positive"),
        (lambda: least(np.zeros((7, 9)), noise=np.ones(3)), "noise has the shape"),
        (lambda: least(np.full((7, 9), np.nan)), "there is no value to compare: 0 of 144 rays have no end"),
    ],
)
def test_errors_say_what_to_do(wrong, message):
    with pytest.raises(grad.GradError, match=message):
        wrong()


def least(target, **options):
    return screen().least_squares(collimated(screen().plane), INDEX, target, 1.0, **options)
