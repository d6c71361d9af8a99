//! Derivatives of rays, compared with differences of rays and with closed forms
//! (docs/theory.md#derivatives-of-rays).

mod closed_forms;
mod failures;
mod grids;
mod parameters;
mod surfaces;

use glam::DVec3;
use morgana_eikonal::adjoint::*;
use morgana_eikonal::connect::World;
use morgana_eikonal::field::Gaussian;
use morgana_eikonal::{Field, Tolerance};

const TIGHT_TOLERANCE: f64 = 1e-10;

const PLANE: Receiver = Receiver::Plane {
    point: DVec3::new(0.0, 0.0, 1.2),
    normal: DVec3::Z,
};

/// Weights of a loss that is linear in the end of a ray: its position, direction and optical
/// length.
const LOSS: EndDerivative = EndDerivative {
    x: DVec3::new(0.3, -0.8, 0.1),
    v: DVec3::new(-0.6, 0.4, 0.2),
    optical_length: 0.5,
};

fn loss(end: &RayEnd) -> f64 {
    LOSS.x.dot(end.x) + LOSS.v.dot(end.v) + LOSS.optical_length * end.optical_length
}

fn gaussian(p: &[f64]) -> Field {
    let center = DVec3::new(p[2], p[3], p[4]);
    Gaussian::new(p[0], p[1], center, p[5]).unwrap().into()
}

fn vector(p: &[f64]) -> DVec3 {
    DVec3::from_slice(&p[..3])
}

fn start<R>(p: &[f64], region: R) -> RayStart<R> {
    let [x, d] = [&p[..3], &p[3..]].map(DVec3::from_slice);
    RayStart {
        x,
        direction: d.normalize(),
        region,
    }
}

fn follow<W: World>(
    world: &W,
    receiver: Receiver,
    tolerance: f64,
    start: RayStart<W::Region>,
) -> RayEnd {
    let mut ray = AdjointRay::new(world, receiver, Tolerance::new(tolerance), 10.0);
    ray.follow(start).unwrap()
}

/// Returns d/dp by a central difference, extrapolated once.
fn derivative(p: &[f64], i: usize, h: f64, f: impl Fn(&[f64]) -> f64) -> f64 {
    let at = |step: f64| {
        let mut q = p.to_vec();
        q[i] += step;
        f(&q)
    };
    let central = |h: f64| (at(h) - at(-h)) / (2.0 * h);
    (4.0 * central(h / 2.0) - central(h)) / 3.0
}
