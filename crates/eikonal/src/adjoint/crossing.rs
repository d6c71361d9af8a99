//! Surfaces between two flights, in reverse mode
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::reverse::Adjoint;
use crate::interface::{Interface, Rule};
use glam::DVec3;

/// A surface that refracts, passes or reflects a path.
#[derive(Clone, Copy, Debug)]
pub struct FlightCrossing {
    /// Point where the path meets the surface.
    pub x: DVec3,
    /// Surface with the fields on either side.
    pub interface: Interface,
    /// Event at the surface.
    pub rule: Rule,
    /// Velocity before the surface.
    pub before: DVec3,
    /// Velocity after the surface.
    pub after: DVec3,
}

impl FlightCrossing {
    /// Takes the derivatives of a loss back through the surface, from the flight after it to the
    /// flight before it. `by_x` and `by_v` are derivatives with respect to position and velocity
    /// after the surface. Returns derivatives with respect to position and velocity before the
    /// surface, where the flight ends on the surface. Also returns derivatives with respect to n²
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
