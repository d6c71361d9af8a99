//! One step of Newton's method.

use super::connection::Failure;
use super::launch::Launch;
use crate::ray::{Node, Tangents};
use glam::{DMat3, DVec2, DVec3};

/// Where a shot ended, with its tangents.
pub(super) type Landing = Node<Tangents>;

/// The three unknowns: two of the launch, and the optical path length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Iterate {
    pub launch: Launch,
    pub length: f64,
}

impl Iterate {
    /// The next iterate: Newton's step, damped and capped.
    pub fn stepped(
        &self,
        landing: &Landing,
        y: DVec3,
        damping: f64,
        distance: f64,
    ) -> Result<Iterate, Failure> {
        let matrix = system(landing);
        let miss = y - landing.x;
        let normal = matrix.transpose() * matrix;
        let scale = normal.diagonal();
        let step = if damping == 0.0
            && matrix.determinant().abs() > 1e-12 * scale.element_product().sqrt()
        {
            matrix.inverse() * miss
        } else {
            // At least a trace of damping: near a caustic the plain system is singular.
            let damped = normal + DMat3::from_diagonal(scale * f64::max(damping, 1e-8));
            damped.inverse() * (matrix.transpose() * miss)
        };
        if !step.is_finite() {
            return Err(Failure::Caustic);
        }
        let sideways: DVec2 = step.truncate();
        let cap = self.launch.longest_step(distance);
        let shrink = (cap / sideways.length().max(1e-300)).min(1.0);
        Ok(Iterate {
            launch: self.launch.moved(sideways * shrink),
            length: self.length + (step.z * shrink).clamp(-0.5 * self.length, self.length),
        })
    }
}

/// Derivative of the end of the ray with respect to the launch's parameters and the optical path
/// length: at equal optical length the tangents are perpendicular to the ray (Malus and Dupin).
pub(super) fn system(landing: &Landing) -> DMat3 {
    let n2 = landing.v.length_squared();
    let across = |dx: DVec3| dx - landing.v * (landing.v.dot(dx) / n2);
    let [a, b] = landing.variation.dx.map(across);
    DMat3::from_cols(a, b, landing.v / n2)
}
