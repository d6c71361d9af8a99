//! Flights in reverse mode (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::flight::{FlightPoint, is_line};
use super::reverse::StartDerivative;
use crate::field::{Field, IndexDerivative};
use crate::ray::{DRIFT, KICK, STAGES};
use glam::DVec3;

/// Derivative of a loss with respect to a point of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightDerivative {
    /// Derivative with respect to the position.
    pub x: DVec3,
    /// Derivative with respect to the velocity.
    pub v: DVec3,
    /// Derivative with respect to the arc length from the start.
    pub length: f64,
}

/// A point of a flight in reverse mode, and the derivative of a loss with respect to it at equal σ.
#[derive(Clone, Copy, Debug)]
pub struct FlightAdjoint {
    /// Position.
    pub x: DVec3,
    /// Velocity.
    pub v: DVec3,
    /// Derivative of the loss.
    pub by: FlightDerivative,
}

impl FlightAdjoint {
    /// Creates the adjoint at the end of a flight that ends on a surface with this normal: the end
    /// moves along the surface when the field changes.
    pub fn on_surface(
        field: &Field,
        end: &FlightPoint,
        normal: DVec3,
        by: FlightDerivative,
    ) -> Self {
        let mut adjoint = FlightAdjoint {
            x: end.x,
            v: end.v,
            by,
        };
        let by_span = adjoint.by_span(field);
        adjoint.by.x -= normal * (by_span / normal.dot(end.v));
        adjoint
    }

    /// Creates the adjoint at the end of a flight of given arc length. Also returns the derivative
    /// with respect to this length.
    pub fn at_length(field: &Field, end: &FlightPoint, by: FlightDerivative) -> (Self, f64) {
        let mut adjoint = FlightAdjoint {
            x: end.x,
            v: end.v,
            by,
        };
        let by_length = adjoint.by_span(field) / field.n(end.x);
        // Planted error "collisions that stay at their span where the arc length changes", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
        // (no line)
        adjoint.by.length -= by_length;
        (adjoint, by_length)
    }

    /// Returns the derivative with respect to the span of σ up to this point.
    fn by_span(&self, field: &Field) -> f64 {
        let (n2, grad) = field.gradient(self.x);
        let by = &self.by;
        by.x.dot(self.v) + by.v.dot(grad) * 0.5 + by.length * n2.sqrt()
    }

    /// Goes back over the steps of a flight, starting with the last step. Passes derivatives with
    /// respect to the field to `sink`.
    pub fn back(
        &mut self,
        field: &Field,
        resolved: bool,
        spans: &[f64],
        sink: &mut impl FnMut(DVec3, IndexDerivative),
    ) {
        if is_line(field, resolved, [self.x, self.v]) {
            for &h in spans.iter().rev() {
                self.lengthen(field.n2(self.x), h, sink);
                self.drift(h);
            }
            return;
        }
        let mut kick = 0.0;
        for &h in spans.iter().rev() {
            for (drift, after) in STAGES.into_iter().rev() {
                self.kick(field, kick + KICK[after] * h, sink);
                kick = 0.0;
                self.drift(DRIFT[drift] * h);
            }
            kick = KICK[0] * h;
        }
        if !spans.is_empty() {
            self.kick(field, kick, sink);
        }
    }

    /// Goes back over x += h v.
    fn drift(&mut self, h: f64) {
        self.x -= self.v * h;
        self.by.v += self.by.x * h;
    }

    /// Goes back over an arc length of n h.
    fn lengthen(&self, n2: f64, h: f64, sink: &mut impl FnMut(DVec3, IndexDerivative)) {
        let n2 = self.by.length * h / (2.0 * n2.sqrt());
        let gradient = DVec3::ZERO;
        sink(self.x, IndexDerivative { n2, gradient });
    }

    /// Goes back over v += ½h∇n² and an arc length of n h.
    fn kick(&mut self, field: &Field, h: f64, sink: &mut impl FnMut(DVec3, IndexDerivative)) {
        let jet = field.jet(self.x);
        let by_n2 = self.by.length * h / (2.0 * jet.n2.sqrt());
        let by = IndexDerivative {
            n2: by_n2,
            gradient: self.by.v * (0.5 * h),
        };
        sink(self.x, by);
        self.v -= jet.grad * (0.5 * h);
        // Planted error "flights behind scattering that forget how forces vary", found by morgana-transport/lib::derivatives_of_paths_are_differences_of_replayed_ones:
        // self.by.x += jet.grad * by_n2;
        self.by.x += jet.hess * self.by.v * (0.5 * h) + jet.grad * by_n2;
    }

    /// Ends the sweep at the start of a flight in a unit direction, where v = n·direction. Returns
    /// the derivative with respect to position and direction.
    pub fn start(
        &self,
        field: &Field,
        direction: DVec3,
        sink: &mut impl FnMut(DVec3, IndexDerivative),
    ) -> StartDerivative {
        let (n2, grad) = field.gradient(self.x);
        let n = n2.sqrt();
        let along = direction.dot(self.by.v);
        let by_n2 = along / (2.0 * n);
        let gradient = DVec3::ZERO;
        sink(
            self.x,
            IndexDerivative {
                n2: by_n2,
                gradient,
            },
        );
        StartDerivative {
            x: self.by.x + grad * by_n2,
            direction: (self.by.v - direction * along) * n,
        }
    }
}
