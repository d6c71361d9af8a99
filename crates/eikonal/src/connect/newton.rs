//! One step of Newton's method.

use super::connection::Failure;
use super::launch::Launch;
use crate::ray::{Node, Tangents};
use glam::{DMat3, DVec3};

/// Where a shot ended, with its tangents.
pub(super) type Landing = Node<Tangents>;

/// The three unknowns: two of the launch, and the optical path length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Iterate {
    pub launch: Launch,
    pub length: f64,
}

/// Growth of the damping from trial to trial, beginning at the first, and the number of trials.
const DAMPINGS: (f64, f64, usize) = (1e-4, 4.0, 20);

impl Iterate {
    /// The next iterate, and the size of the step: Newton's, damped in the manner of Levenberg and Marquardt until its size is at
    /// most `radius`. That is the change of the launch over the `longest`, or of the length over itself, whichever is larger.
    pub fn stepped(
        &self,
        landing: &Landing,
        y: DVec3,
        (radius, longest): (f64, f64),
    ) -> Result<(Iterate, f64), Failure> {
        let matrix = system(landing);
        let miss = y - landing.x;
        let normal = matrix.transpose() * matrix;
        let scale = normal.diagonal();
        let regular = matrix.determinant().abs() > 1e-12 * scale.element_product().sqrt();
        let mut step = if regular {
            matrix.inverse() * miss
        } else {
            // At least a trace of damping: near a caustic the plain system is singular.
            damped(&normal, 1e-8) * (matrix.transpose() * miss)
        };
        let (mut damping, growth, trials) = DAMPINGS;
        for _ in 0..trials {
            if self.size(step, longest) <= radius {
                break;
            }
            step = damped(&normal, damping) * (matrix.transpose() * miss);
            damping *= growth;
        }
        if !step.is_finite() {
            return Err(Failure::Caustic);
        }
        let size = self.size(step, longest);
        let step = step * (radius / size.max(1e-300)).min(1.0);
        let next = Iterate {
            launch: self.launch.moved(step.truncate()),
            length: self.length + self.change(step),
        };
        Ok((next, size.min(radius)))
    }

    /// By how much a step changes the length.
    fn change(&self, step: DVec3) -> f64 {
        step.z.clamp(-0.5 * self.length, self.length)
    }

    fn size(&self, step: DVec3, longest: f64) -> f64 {
        let sideways = step.truncate().length() / longest;
        sideways.max(self.change(step).abs() / self.length)
    }
}

fn damped(normal: &DMat3, damping: f64) -> DMat3 {
    (*normal + DMat3::from_diagonal(normal.diagonal() * damping)).inverse()
}

/// Derivative of the end of the ray with respect to the launch's parameters and the optical path
/// length: at equal optical length the tangents are perpendicular to the ray (Malus and Dupin).
pub(super) fn system(landing: &Landing) -> DMat3 {
    let n2 = landing.v.length_squared();
    let across = |dx: DVec3| dx - landing.v * (landing.v.dot(dx) / n2);
    let [a, b] = landing.variation.dx.map(across);
    DMat3::from_cols(a, b, landing.v / n2)
}
