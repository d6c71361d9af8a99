//! The plain shooting method: Newton's method from the chord, along rays of equal steps. It uses
//! the classical Runge–Kutta–Nyström method of fourth order, differentiated.

use crate::published::Effort;
use glam::{DMat3, DVec3};
use morgana_eikonal::ray::perpendicular_basis;
use morgana_eikonal::{Field, Jet};

/// Parameters of the plain shooting method: steps of rays, and the accepted miss.
#[derive(Clone, Copy)]
pub struct Plain {
    /// Number of steps of every ray.
    pub steps: usize,
    /// Accepted miss, relative to the distance.
    pub tolerance: f64,
}

/// Maximum number of rays traced for one connection.
const MAX_SHOTS: usize = 20;

/// Position and velocity of a ray, and of its two tangents.
#[derive(Clone, Copy)]
struct State {
    x: [DVec3; 3],
    v: [DVec3; 3],
}

impl Plain {
    /// Returns the direction in which the ray from `x` to `y` starts.
    pub fn connect(&self, field: &Field, [x, y]: [DVec3; 2], effort: &mut Effort) -> Option<DVec3> {
        let n = field.n(x);
        let (mut direction, mut sigma) = ((y - x).normalize(), x.distance(y) / n);
        for _ in 0..MAX_SHOTS {
            let [t1, t2] = perpendicular_basis(direction);
            let start = State {
                x: [x, DVec3::ZERO, DVec3::ZERO],
                v: [direction * n, t1 * n, t2 * n],
            };
            let end = self.shoot(field, start, sigma, effort);
            let miss = y - end.x[0];
            if miss.length() <= self.tolerance * x.distance(y) {
                return Some(direction);
            }
            let step = DMat3::from_cols(end.x[1], end.x[2], end.v[0]).inverse() * miss;
            direction = (direction + t1 * step.x + t2 * step.y).normalize();
            sigma += step.z;
        }
        None
    }

    fn shoot(&self, field: &Field, start: State, sigma: f64, effort: &mut Effort) -> State {
        effort.shots += 1;
        effort.evaluations += 3 * self.steps as u64;
        let h = sigma / self.steps as f64;
        let mut s = start;
        for _ in 0..self.steps {
            let a = forces(&field.jet(s.x[0]), s.x);
            let x: [DVec3; 3] =
                std::array::from_fn(|i| s.x[i] + s.v[i] * (0.5 * h) + a[i] * (0.125 * h * h));
            let b = forces(&field.jet(x[0]), x);
            let x: [DVec3; 3] = std::array::from_fn(|i| s.x[i] + s.v[i] * h + b[i] * (0.5 * h * h));
            let c = forces(&field.jet(x[0]), x);
            s = State {
                x: std::array::from_fn(|i| {
                    s.x[i] + s.v[i] * h + (a[i] + b[i] * 2.0) * (h * h / 6.0)
                }),
                v: std::array::from_fn(|i| s.v[i] + (a[i] + b[i] * 4.0 + c[i]) * (h / 6.0)),
            };
        }
        s
    }
}

/// Returns ½∇n², and the products of ½Hess(n²) with the two tangents.
fn forces(jet: &Jet, x: [DVec3; 3]) -> [DVec3; 3] {
    [jet.grad * 0.5, jet.hess * x[1] * 0.5, jet.hess * x[2] * 0.5]
}
