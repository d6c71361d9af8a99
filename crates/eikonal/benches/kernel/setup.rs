//! Fields used in the measurements.

use glam::DVec3;
use morgana_eikonal::field::{Acoustic, AcousticMode, Bspline, Gaussian, Luneburg, Placement, Sum};
use morgana_eikonal::{Aabb, Field};
use testkit::Rng;

/// Radius of the ball in which [`ball_grid`] is used.
pub const BALL: f64 = 0.3;

/// n = 1.3 + 0.1 exp(−(r/0.15)²) sampled 64³ over a ball of radius 0.3.
pub fn ball_grid() -> Field {
    let half = DVec3::splat(BALL);
    let index = |x: DVec3| 1.3 + 0.1 * (-x.length_squared() / (0.15 * 0.15)).exp();
    let grid = Bspline::from_fn([64; 3], Aabb::new(-half, half), Placement::Nodes, index);
    grid.unwrap().into()
}

/// The bump sampled over the unit ball, with `samples` samples along each edge.
pub fn bump_grid(samples: usize) -> Field {
    let (bump, cube) = (bump(), Aabb::new(-DVec3::ONE, DVec3::ONE));
    let grid = Bspline::from_fn([samples; 3], cube, Placement::Nodes, |x| bump.n(x));
    grid.unwrap().into()
}

pub fn bump() -> Field {
    Gaussian::new(1.33, 0.1, DVec3::ZERO, 0.4).unwrap().into()
}

pub fn luneburg() -> Field {
    Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into()
}

/// A cylindrical wave of three periods over the unit ball.
pub fn acoustic(delta: f64) -> Field {
    let mode = AcousticMode::new(delta, 3, 10.0, 0.3).unwrap();
    Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode])
        .unwrap()
        .into()
}

/// A strong wave, ten wavelengths over the unit ball.
pub fn strong_sound() -> Field {
    let mode = AcousticMode::new(0.05, 3, 30.0, 0.3).unwrap();
    Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode])
        .unwrap()
        .into()
}

/// Twelve bumps and dips at random positions in the unit ball, with a total contrast of about
/// `delta`.
pub fn lumps(delta: f64, rng: &mut Rng) -> Field {
    let terms = (0..12).map(|_| {
        let center = in_ball(rng, 1.0);
        let change = delta * rng.range(-1.0, 1.0);
        Gaussian::new(1.33, change, center, rng.range(0.3, 0.6))
            .unwrap()
            .into()
    });
    Sum::new(1.33, terms.collect()).unwrap().into()
}

/// A uniformly distributed point of a ball around the origin.
pub fn in_ball(rng: &mut Rng, radius: f64) -> DVec3 {
    DVec3::from_array(rng.direction()) * (radius * rng.next_1d().cbrt())
}
