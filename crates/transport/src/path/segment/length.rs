//! Origins of optical path lengths.
//!
//! The optical length of a path counts from the position of a point-like emitter, or from the
//! surface of an area light. For beams it counts from the plane of the aperture, for fibres and
//! volumes from the sampled point. Light from outside has no origin in the scene. Its length counts
//! from a plane perpendicular to its direction. The plane touches the ball around the scene
//! ([`Surroundings`](crate::emitter::Surroundings)) on the side where the light enters.
//!
//! At the sensor, the length counts to the pinhole, the sampled point of the lens, or the plane on
//! which the rays of a parallel view start.
//!
//! Theory: docs/theory.md#layers.

use crate::scene::{AMBIENT, Scene};
use glam::DVec3;

/// Returns the optical length from an end at an emitter to the origin of path lengths. The length
/// is zero except for light from outside, with ends on planes two radii from the centre of the
/// ball.
pub fn lead_in(scene: &Scene, emitter: usize) -> f64 {
    if !scene.emitters()[emitter].is_at_infinity() {
        return 0.0;
    }
    let around = scene.around();
    // Planted error "optical length of light from outside counted from its end", found by morgana-transport/transport::layers::lengths::light_from_outside_counts_from_the_ball_around_the_scene:
    // 0.0 * around.radius * scene.n(AMBIENT, around.center)
    around.radius * scene.n(AMBIENT, around.center)
}

/// Returns the optical length from `x`, in surroundings of index `n`, to the plane where light from
/// the unit direction `toward` enters the ball. The light is parallel, so its phase is constant on
/// the plane.
pub(in crate::path) fn to_entrance(scene: &Scene, n: f64, x: DVec3, toward: DVec3) -> f64 {
    let around = scene.around();
    n * (around.radius - (x - around.center).dot(toward))
}
