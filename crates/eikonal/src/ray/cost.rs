//! Cost of a ray, estimated before it is traced.

use super::flow::{Tolerance, expected_step};
use crate::field::Field;
use glam::DVec3;

/// Number of places along the line at which the field is evaluated.
const PLACES: usize = 512;

/// Estimates the number of steps of a ray between two points, as if it were straight. The estimate
/// integrates the reciprocal of the step expected from the field's length scale. The estimate is
/// off where the scale varies on less than a five-hundredth of the line, but seldom by much.
pub fn steps_between(field: &Field, [from, to]: [DVec3; 2], tolerance: Tolerance) -> f64 {
    let line = to - from;
    let (length, direction) = (line.length(), line.normalize_or_zero());
    if field.is_constant() || !(length > 0.0 && length.is_finite()) {
        return 1.0;
    }
    let piece = length / PLACES as f64;
    let steps = |i: usize| {
        let x = from + line * ((i as f64 + 0.5) / PLACES as f64);
        let n = field.n(x);
        let homogeneous = field.homogeneous_span(x, direction * n) * n;
        piece / (expected_step(tolerance) * field.step_scale(x, direction)).max(homogeneous)
    };
    (0..PLACES).map(steps).sum::<f64>().max(1.0)
}
