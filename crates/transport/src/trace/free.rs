//! Single ray in an unbounded field.

use super::line::Line;
use super::{Path, TraceEnding};
use crate::budget::STEPS_PER_RAY;
use crate::scene::MediumId;
use eikonal::field::Field;
use eikonal::ray::{Flow, Node, Work};
use eikonal::{Reference, Tolerance};
use glam::DVec3;

/// Maximum distance of a ray; the polynomials of longer arcs would overflow.
const MAX_DISTANCE: f64 = 1e100;

/// Follows a ray of the given length from `x` through a field without surfaces, in a direction of
/// any length except zero. Its medium has the number 0. The ray is lost where the field has no real
/// index, or if it takes more than [`STEPS_PER_RAY`] steps. With a length of zero or less it ends
/// where it starts. Without a `reference`, optical path differences are relative to the index at
/// the start.
pub fn follow_field(
    field: &Field,
    tolerance: Tolerance,
    x: DVec3,
    direction: DVec3,
    length: f64,
    reference: Option<Reference<'_>>,
) -> Path {
    let medium: MediumId = 0;
    let n = field.n(x);
    let direction = direction.normalize();
    let v = direction * n;
    let mut line = Line::new(reference.unwrap_or(Reference::Index(n)), direction);
    line.record(x, v, medium);
    if !v.is_finite() {
        return line.end(TraceEnding::Lost);
    }
    if length.is_nan() || length <= 0.0 {
        return line.end(TraceEnding::Length);
    }
    let length = length.min(MAX_DISTANCE);
    let mut flow = Flow::new(field, Node::new(field, x, v, ()), tolerance);
    for _ in 0..STEPS_PER_RAY {
        let left = length - line.length;
        let sigma = left / flow.node().v.length();
        let step = flow.advance(sigma, &mut Work::default());
        if !step.end.x.is_finite() {
            break;
        }
        // Shorten the step: for the remaining σ it may be longer than the remaining length where
        // the index grows.
        let end = step.arc.theta_at_length(left);
        line.advance(field, &step, end.min(1.0), medium);
        if end < 1.0 || line.reaches(length) {
            return line.end(TraceEnding::Length);
        }
    }
    line.end(TraceEnding::Lost)
}
