//! What a connection is, and why there is none.

use super::pattern::Pattern;
use glam::DVec3;

/// A ray between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectingRay {
    /// Start of the ray; the point asked for, or the point of the plane that was found.
    pub start: DVec3,
    /// Unit direction in which the ray leaves its start.
    pub direction_out: DVec3,
    /// Unit direction in which it arrives at the target.
    pub direction_in: DVec3,
    /// The index at the start and at the target, to the tolerance of the ray.
    pub indices: [f64; 2],
    /// Geometric arc length.
    pub arc_length: f64,
    /// Optical path length ∫n ds.
    pub optical_length: f64,
    /// Span of σ = ∫ds/n.
    pub sigma: f64,
    /// Ray-tube cross section at the target: J = dA⊥/dΩ for a point family, A = dA⊥/dA for a plane.
    pub jacobian: f64,
    /// How far from the target the ray passes for which the lengths and the Jacobian hold.
    pub miss: f64,
    /// The ray's reflections where it could have been refracted.
    pub pattern: Pattern,
    /// Rays shot.
    pub shots: u32,
}

impl ConnectingRay {
    /// Whether two connections between the same ends are the same ray.
    ///
    /// Their directions (radians) at the start and their starts, seen from the distance of the arc
    /// length, must agree to `angle`, and their optical path lengths to the relative `length`. Rays
    /// from one point differ in the first, rays from a plane in the second.
    pub fn same_branch(&self, other: &ConnectingRay, angle: f64, length: f64) -> bool {
        self.direction_out.distance(other.direction_out) <= angle
            && self.start.distance(other.start) <= angle * self.arc_length
            && (self.optical_length - other.optical_length).abs()
                <= length * self.optical_length.max(other.optical_length)
    }
}

/// Why there is no connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The two points coincide.
    #[error("the two points coincide")]
    Coincident,
    /// The square of the distance of the two points is too large for a number, or not a number.
    #[error("the two points are too far apart")]
    TooFar,
    /// Newton's method did not converge within its budget of shots.
    #[error("the iteration did not converge")]
    NotConverged,
    /// A shot left every region's field.
    #[error("a ray left the field")]
    RayLost,
    /// A shot, or all together, took more steps than they [may](crate::budget).
    #[error("rays took more steps than their budget allows")]
    OverBudget,
    /// The target lies on a caustic: the ray tube has no cross section there.
    #[error("the target lies on a caustic")]
    Caustic,
}
