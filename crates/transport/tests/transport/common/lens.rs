//! The lens scene: a refracting ball of fog whose sampled index decreases from the centre, a light
//! inside, and a camera outside.

use super::fan::RadialBall;
use super::{camera, container, fog, glass, parts, vacuum};
use eikonal::field::{Bspline, Placement};
use eikonal::{Aabb, Field};
use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::emitter::Emitter;
use morgana_transport::scene::Parts;
use morgana_transport::shape::Sphere;

/// Radius of the ball.
pub const RADIUS: f64 = 0.3;
/// Width of the bump of the index.
const WIDTH: f64 = 0.15;
/// Distance of the camera from the centre.
pub const DISTANCE: f64 = 1.2;

/// Returns n at a radius.
pub fn index(r: f64) -> f64 {
    1.3 + 0.1 * (-(r / WIDTH).powi(2)).exp()
}

/// The ball with the index in closed form, without a grid.
pub fn ball() -> RadialBall {
    RadialBall {
        radius: RADIUS,
        n2: |r| index(r).powi(2),
        slope: |r| -4.0 * index(r) * (index(r) - 1.3) * r / (WIDTH * WIDTH),
    }
}

/// The sampled index.
pub fn field() -> Field {
    field_of(64)
}

/// The index from `samples` samples along an edge.
pub fn field_of(samples: usize) -> Field {
    grid_of(samples).into()
}

/// The index condensed to as few samples as represent it, as scenes hold it. Returns the field and
/// the number of samples along an edge.
pub fn condensed(samples: usize) -> (Field, usize) {
    // Tolerance: the rounding of coefficients, whose range is 0.27.
    let field = grid_of(samples)
        .condensed(6.4e-8)
        .expect("finer than the field");
    let held = field.dims()[0];
    (field.into(), held)
}

fn grid_of(samples: usize) -> Bspline {
    let half = DVec3::splat(1.02 * RADIUS);
    let cube = Aabb::new(-half, half);
    let grid = Bspline::from_fn([samples; 3], cube, Placement::Nodes, |x| index(x.length()));
    grid.unwrap()
}

/// Position of the camera.
pub fn eye() -> DVec3 {
    DVec3::Z * DISTANCE
}

/// Builds the lens scene.
pub fn scene() -> Parts {
    let light = Emitter::Point {
        position: DVec3::new(0.05, 0.08, -0.06),
        intensity: Spectrum::ONE,
    };
    parts(
        vec![container(
            Sphere::around(DVec3::ZERO, RADIUS).unwrap(),
            glass(),
        )],
        vec![vacuum(), fog(field(), 5.0, 0.9, 0.5)],
        vec![light],
        camera(eye(), DVec3::ZERO),
    )
}
