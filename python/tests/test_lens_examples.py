"""Examples of lenses: published focal lengths and powers, and closed forms of whole rays."""

import math

import morgana
import numpy as np
import pytest
from morgana import lens, lens_examples


@pytest.mark.parametrize("radius", [0.5, 4.0])
def test_focal_lengths_of_graded_balls(radius):
    """Luneburg: R, with the focus on the ball. Maxwell: R/2 and −R/2. Half fisheye: R/2, at the pole."""
    cases = [(lens_examples.luneburg, 1.0, 0.0), (lens_examples.maxwell_fisheye, 0.5, -0.5), (lens_examples.half_fisheye, 0.5, 0.0)]
    for make, focal, back in cases:
        found = lens.paraxial(make(radius))
        assert found.focal_length == pytest.approx(focal * radius, rel=1e-8), make
        assert found.back_focal_length == pytest.approx(back * radius, abs=1e-8 * radius), make


def test_wide_bundles_meet_on_the_ball():
    """The image plane lies GAP behind the focus: rays of slope up to tan 60° spread by this distance."""
    for make in (lens_examples.luneburg, lens_examples.half_fisheye):
        for radius in (1.0, 10.0):
            rays = lens.trace(make(radius)._replace(entrance_pupil=1.6 * radius), count=6)
            assert rays.failures == {} and rays.geometric_radius < 10 * lens_examples.GAP * radius, make


def test_rays_leave_the_fisheye_at_the_opposite_height():
    """A ray of height h leaves at −h, with the angle −2 arcsin(h/R): arcs through opposite points."""
    radius, heights = 2.0, np.array([0.1, 0.8, 1.3])
    fisheye = lens_examples.maxwell_fisheye(radius)
    ball = fisheye.system()
    starts = np.column_stack([0 * heights, heights, 0 * heights - 1])
    ends = morgana.grad.Rays(starts, [0, 0, 1], exit=fisheye.image, tolerance=1e-11).forward(ball)
    angles = np.arctan2(ends.directions[:, 1], ends.directions[:, 2])
    np.testing.assert_allclose(angles, -2 * np.arcsin(heights / radius), atol=1e-8)
    # The exit is behind the ball: go back along the ray to its exit point.
    depth = radius + np.sqrt(radius**2 - heights**2)
    back = (ends.positions[:, 2] - depth) / ends.directions[:, 2]
    np.testing.assert_allclose(ends.positions[:, 1] - back * ends.directions[:, 1], -heights, atol=1e-8)


@pytest.mark.parametrize(("n0", "alpha", "thickness"), [(1.6, 0.2, 1.0), (1.5, 0.01, 0.5), (1.7, 0.3, 5.0)])
def test_the_focal_length_of_a_wood_lens(n0, alpha, thickness):
    plate = lens_examples.wood(n0, alpha, thickness)
    found = lens.paraxial(plate)
    assert found.focal_length == pytest.approx(1 / (n0 * alpha * math.sin(alpha * thickness)), rel=1e-9)
    assert found.image == pytest.approx(plate.vertices[-1], rel=1e-8)
    if thickness * alpha < 0.01:
        assert found.focal_length == pytest.approx(1 / (n0 * alpha**2 * thickness), rel=1e-4)


def test_the_power_of_an_eye():
    """The paper states 60.35 dioptres, and an axial length of 23.95 mm."""
    eye = lens_examples.liou_brennan()
    assert 1336 / lens.paraxial(eye).focal_length == pytest.approx(60.35, abs=0.01)
    assert eye.vertices[-1] == pytest.approx(23.95)
    assert lens.trace(eye, 5.0).failures == {} and lens_examples.liou_brennan(2.0).entrance_pupil == 2.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: lens_examples.luneburg(0.0), "radius is 0.0"),
        (lambda: lens_examples.wood(n0=0.9), "n0 is 0.9 but must be above 1"),
        (lambda: lens_examples.wood(alpha=0.5, thickness=4.0), r"thickness is 4.0 but must be below π/\(2 alpha\) = 3.14159"),
        (lambda: lens_examples.liou_brennan(-1.0), "entrance_pupil is -1.0"),
    ],
)
def test_mistakes_are_told(call, message):
    with pytest.raises((morgana.grad.GradError, morgana.RenderError), match=message):
        call()
