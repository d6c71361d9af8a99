//! Parallel transport of directions perpendicular to a ray along the ray.
//!
//! Theory: docs/theory.md#polarisation-along-rays.

use super::arc::{Arc, NODES, weighted};
use glam::{DQuat, DVec3};

impl Arc {
    /// Transports a unit vector perpendicular to the ray in parallel from θ = `from` to θ = `to`,
    /// in either direction. The vector turns with the tangent, but not about it, like the electric
    /// field of light. Its error is far below the error of the arc's directions.
    ///
    /// The tangent moves on the unit sphere. The shortest rotation from its first to its last
    /// position omits the solid angle between the great circle and the path of the tangent. By this
    /// angle the vector also turns about the tangent (Rytov).
    pub fn carried(&self, across: DVec3, from: f64, to: f64) -> DVec3 {
        if self.is_straight() {
            return across;
        }
        let first = self.velocity(from).normalize();
        let last = self.velocity(to).normalize();
        let turned = DQuat::from_rotation_arc(first, last) * across;
        // Planted error "polarisation that rays turn by the shortest way only", found by morgana-eikonal/eikonal::carried::turns_by_the_torsion_of_helices:
        // let (sin, cos) = (0.0 * self.solid_angle(first, from, to)).sin_cos();
        let (sin, cos) = self.solid_angle(first, from, to).sin_cos();
        let carried = turned * cos + last.cross(turned) * sin;
        carried.reject_from_normalized(last).normalize()
    }

    /// Returns the solid angle between the path of the tangent and the great circle between its
    /// ends: ∫ t₀·(t × dt)/(1 + t₀·t). It is positive where the path turns left, seen from outside.
    fn solid_angle(&self, first: DVec3, from: f64, to: f64) -> f64 {
        let rate = |node: f64| {
            let theta = from + node * (to - from);
            let (v, a) = (self.velocity(theta), self.acceleration(theta));
            let length = v.length();
            first.dot(v.cross(a)) / (length * (length + first.dot(v)))
        };
        weighted(NODES.map(rate)) * (to - from) * self.h()
    }
}
