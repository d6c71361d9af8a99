//! Connections, and why they fail.

use super::pattern::Pattern;
use glam::DVec3;

/// A ray between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectingRay {
    /// Start of the ray: the given point, or the point found on the plane.
    pub start: DVec3,
    /// Unit direction in which the ray leaves its start.
    pub direction_out: DVec3,
    /// Unit direction in which the ray arrives at the target.
    pub direction_in: DVec3,
    /// Refractive indices at the start and at the target, to the tolerance of the ray.
    pub indices: [f64; 2],
    /// Geometric arc length.
    pub arc_length: f64,
    /// Optical path length ∫n ds.
    pub optical_length: f64,
    /// Span of σ = ∫ds/n.
    pub sigma: f64,
    /// Ray-tube cross section at the target: J = dA⊥/dΩ for a point family, A = dA⊥/dA for a plane.
    pub jacobian: f64,
    /// Distance from the target at which the traced ray passes. Directions and lengths are
    /// corrected for this miss to first order; the Jacobian belongs to the traced ray.
    pub miss: f64,
    /// Reflections of the ray where it could have been refracted.
    pub pattern: Pattern,
    /// Number of rays traced.
    pub shots: u32,
}

impl ConnectingRay {
    /// Returns true if two connections between the same ends are the same ray.
    ///
    /// Their directions at the start must agree to `angle` (radians), and so must their starts,
    /// seen from the distance of the arc length. Their optical path lengths must agree to the
    /// relative `length`. Rays from one point differ in direction, rays from a plane in their
    /// starts.
    pub fn same_branch(&self, other: &ConnectingRay, angle: f64, length: f64) -> bool {
        self.direction_out.distance(other.direction_out) <= angle
            && self.start.distance(other.start) <= angle * self.arc_length
            && (self.optical_length - other.optical_length).abs()
                <= length * self.optical_length.max(other.optical_length)
    }
}

/// Reason why there is no connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The two points coincide.
    #[error("the two points coincide")]
    Coincident,
    /// The square of the distance between the two points overflows or is not a number.
    #[error("the two points are too far apart")]
    TooFar,
    /// Newton's method did not converge within its budget of rays.
    #[error("the iteration did not converge")]
    NotConverged,
    /// A ray left every region's field.
    #[error("a ray left the field")]
    RayLost,
    /// A ray, or all rays together, took more steps than the [budget](crate::budget) allows.
    #[error("rays took more steps than their budget allows")]
    OverBudget,
    /// The target lies on a caustic: the ray tube has no cross section there.
    #[error("the target lies on a caustic")]
    Caustic,
}
