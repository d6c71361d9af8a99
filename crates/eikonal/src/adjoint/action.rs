//! The optical path length as the action of the discrete scheme.

use crate::field::Field;
use crate::ray::Variation;
use glam::DVec3;

/// Integral ∫(n² − x·a) dσ, summed over the kicks of the scheme. With Σ c h v² = [x·v] − Σ b h x·a
/// over drifts, the action of the discrete map is
///
/// ```text
/// S = Σ ½ c h |v|² + Σ ½ b h n² = ½ ([x·v] + Σ b h (n² − x·a))
/// ```
///
/// The action is the generating function of the map: its derivatives at fixed ends are exactly this
/// sum over derivatives of n².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Action(pub(super) f64);

impl Variation for Action {
    /// Value n² − x·a.
    type Local = f64;

    fn local(field: &Field, x: DVec3) -> (f64, DVec3, f64) {
        let (n2, grad) = field.gradient(x);
        let a = grad * 0.5;
        (n2, a, n2 - x.dot(a))
    }

    fn kick(&mut self, local: &f64, h: f64) {
        self.0 += local * h;
    }

    fn drift(&mut self, _: f64) {}

    fn straight(&mut self, local: &f64, h: f64) {
        self.kick(local, h);
    }

    /// Interpolates by the cubic that has the local data as slopes.
    fn interpolate(start: &Self, first: &f64, end: &Self, last: &f64, h: f64, t: f64) -> Self {
        let (whole, first, last) = (end.0 - start.0, first * h, last * h);
        let (b, c) = (3.0 * whole - 2.0 * first - last, first + last - 2.0 * whole);
        Action(start.0 + t * (first + t * (b + t * c)))
    }
}
