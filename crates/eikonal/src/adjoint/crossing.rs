//! Surfaces between two flights, on the way back (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::reverse::Adjoint;
use crate::interface::{Interface, Rule};
use glam::DVec3;

/// A surface that a path passes, or that reflects it.
#[derive(Clone, Copy, Debug)]
pub struct FlightCrossing {
    /// Where it is met.
    pub x: DVec3,
    /// The surface, and the fields on either side.
    pub interface: Interface,
    /// What it does.
    pub rule: Rule,
    /// Velocity before.
    pub before: DVec3,
    /// Velocity after.
    pub after: DVec3,
}

impl FlightCrossing {
    /// From the derivative of a loss by position and velocity after the surface, that by those before it, of rays that end on it; and those by n²
    /// on the near and on the far side.
    pub fn back(&self, by_x: DVec3, by_v: DVec3) -> (DVec3, DVec3, [f64; 2]) {
        let after = Adjoint {
            x: self.x,
            v: self.after,
            by_x,
            by_v,
            by_length: 0.0,
        };
        let by_n2 = after.by_indices(&self.interface, self.rule, self.before, self.after);
        let (by_x, by_v) = after.transposed(&self.interface, self.rule, self.before);
        (by_x, by_v, by_n2)
    }
}
