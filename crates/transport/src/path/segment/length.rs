//! Where the optical length of a path counts from.
//!
//! From the point of a point-like emitter, the surface of an area light, the plane of a beam's aperture, or the point of a fibre's or of a volume. Light
//! from outside has no such place: it counts from the plane across its direction that touches the ball
//! around the scene ([`Surroundings`](crate::emitter::Surroundings)) where the light enters it. At the other
//! end: from the pinhole, the point of the lens, or the plane on which the rays of a parallel view start.
//!
//! Theory: docs/theory.md#layers.

use crate::scene::{AMBIENT, Scene};
use glam::DVec3;

/// Optical length by which an end at an emitter lies behind the place where its paths count from:
/// the ends of light from outside are planes two radii from the centre of the ball.
pub fn lead_in(scene: &Scene, emitter: usize) -> f64 {
    if !scene.emitters()[emitter].is_at_infinity() {
        return 0.0;
    }
    let around = scene.around();
    // Planted error "optical length of light from outside counted from its end", found by morgana-transport/transport::layers::lengths::light_from_outside_counts_from_the_ball_around_the_scene:
    // 0.0 * around.radius * scene.n(AMBIENT, around.center)
    around.radius * scene.n(AMBIENT, around.center)
}

/// Optical length from `x`, in surroundings of index `n`, to the plane where light that comes from the
/// unit direction `toward` enters the ball. The light is parallel, so the plane is one of its phase.
pub(in crate::path) fn to_entrance(scene: &Scene, n: f64, x: DVec3, toward: DVec3) -> f64 {
    let around = scene.around();
    n * (around.radius - (x - around.center).dot(toward))
}
