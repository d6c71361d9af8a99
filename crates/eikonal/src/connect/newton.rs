//! A step of Newton's method (docs/theory.md#damping-and-trust-region).

use super::connection::Failure;
use super::family::RayFamily;
use crate::ray::{Node, Tangents};
use glam::{DMat3, DVec2, DVec3};

/// End of a traced ray, with its tangents.
pub(super) type EndState = Node<Tangents>;

/// The three unknowns: two parameters of the family, and the optical path length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Iterate {
    pub family: RayFamily,
    pub length: f64,
}

/// Damping of the first trial, its growth from trial to trial, and the number of trials.
const DAMPINGS: (f64, f64, usize) = (1e-4, 4.0, 20);

impl Iterate {
    /// Returns the next iterate, and the [size](Self::size) of the step. The step is Newton's, with
    /// Levenberg–Marquardt damping that increases until the family changes by no more than `radius`
    /// allows. The change of the length is clamped.
    pub(super) fn stepped(
        &self,
        end_state: &EndState,
        y: DVec3,
        radius: DVec2,
        longest: f64,
    ) -> Result<(Iterate, DVec2), Failure> {
        let matrix = system(end_state);
        let miss = y - end_state.x;
        let normal = matrix.transpose() * matrix;
        let scale = normal.diagonal();
        let regular = matrix.determinant().abs() > 1e-12 * scale.element_product().sqrt();
        let mut step = if regular {
            matrix.inverse() * miss
        } else {
            // Damp slightly: near a caustic the undamped system is singular.
            damped(&normal, 1e-8) * (matrix.transpose() * miss)
        };
        let (mut damping, growth, trials) = DAMPINGS;
        for _ in 0..trials {
            if step.truncate().length() <= radius.x * longest {
                break;
            }
            step = damped(&normal, damping) * (matrix.transpose() * miss);
            damping *= growth;
        }
        if !step.is_finite() {
            return Err(Failure::Caustic);
        }
        let sideways = step.truncate().length();
        let mut step = step * (radius.x * longest / sideways.max(1e-300)).min(1.0);
        let [back, forth] = [0.5, 1.0].map(|most| self.length * radius.y.min(most));
        step.z = step.z.clamp(-back, forth);
        let next = Iterate {
            family: self.family.moved(step.truncate()),
            length: self.length + step.z,
        };
        Ok((next, self.size(step, longest)))
    }

    /// Returns the change of the family relative to `longest`, and of the length relative to the
    /// length.
    fn size(&self, step: DVec3, longest: f64) -> DVec2 {
        DVec2::new(
            step.truncate().length() / longest,
            step.z.abs() / self.length,
        )
    }
}

fn damped(normal: &DMat3, damping: f64) -> DMat3 {
    (*normal + DMat3::from_diagonal(normal.diagonal() * damping)).inverse()
}

/// Returns the derivative of the ray's end with respect to the parameters of the family and the
/// optical path length. At equal optical length the tangents are perpendicular to the ray (Malus
/// and Dupin).
pub(super) fn system(end_state: &EndState) -> DMat3 {
    let n2 = end_state.v.length_squared();
    let across = |dx: DVec3| dx - end_state.v * (end_state.v.dot(dx) / n2);
    let [a, b] = end_state.variation.dx.map(across);
    DMat3::from_cols(a, b, end_state.v / n2)
}
