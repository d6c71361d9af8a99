//! Geometry of an edge, as the vertices at both of its ends need it.

use crate::Spectrum;
use glam::DVec3;

/// A ray tube between two points, or between a point and a plane, with equal values from either
/// end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeGeometry {
    /// Geometry term G. Between two points G is 1/(J n²), with J and n at the end to which the ray
    /// was followed. This equals 1/(B n_a² n_b²) in docs/theory.md#densities-of-edges. Between a
    /// plane and a point of index n, G is 1/(A n²).
    pub geometry_term: f64,
    /// Optical depth.
    pub depth: Spectrum,
    /// Probability that a randomly sampled edge makes the same choices at the interfaces along the
    /// edge.
    pub choice: f64,
    /// Number of refractions and reflections along the edge.
    pub events: u32,
    /// Number of reflections along the edge, including total reflections.
    pub reflections: u32,
}

impl EdgeGeometry {
    /// Makes the geometry of an edge of zero length.
    pub(in crate::path) fn new() -> Self {
        EdgeGeometry {
            geometry_term: 0.0,
            depth: Spectrum::ZERO,
            choice: 1.0,
            events: 0,
            reflections: 0,
        }
    }

    /// Returns the probability that light or importance passes without a collision, for channel
    /// probabilities `channel_pdf`.
    pub(crate) fn survival(&self, channel_pdf: Spectrum) -> f64 {
        (channel_pdf * self.depth.exp_neg()).sum()
    }

    /// Returns the density with which sampling from one end finds the other end. The probability of
    /// the event at the other end is not included.
    ///
    /// `pdf` is the density of the ray: per steradian from a point, per unit area from a plane. The
    /// result is per unit area across the ray at a point of index `n`, or per steradian at a plane
    /// where the index is `n`. It is p·G·n² in all cases: p/J from point to point, p/A from plane
    /// to point, and p·dΩ/dΩ' from point to plane.
    pub fn density(&self, pdf: f64, n: f64) -> f64 {
        pdf * self.choice * self.geometry_term * n * n
    }
}

/// Returns G for a ray that ends at a point with velocity `v`, given the cross section of the ray
/// tube there. `jump` is ∏ n_after/n_before over declared index matches; unlike refraction, these
/// do not conserve étendue.
#[inline]
pub(super) fn to_point(section: f64, v: DVec3, jump: f64) -> f64 {
    proper(jump / (section.abs() * v.length_squared()))
}

/// Returns G for a ray from a point that ends at a plane across it, in a region of constant index,
/// given
/// |δv₁ × δv₂| there. A follows from dΩ'/dΩ = |δv₁ × δv₂|/n² by étendue.
#[inline]
pub(super) fn to_plane(spread: f64, jump: f64) -> f64 {
    // Planted error "wrong ray tube from a point to a plane", found by morgana-transport/transport::furnace::bidirectional_estimators:
    // proper(jump * 0.25 / spread.abs())
    proper(jump / spread.abs())
}

/// Replaces an infinite geometry term, on a caustic or after a grazing refraction, by zero.
fn proper(term: f64) -> f64 {
    if term.is_finite() { term } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_tubes() {
        let (n, r) = (1.5, 2.0);
        let v = DVec3::Z * n;
        let geometry = EdgeGeometry {
            geometry_term: to_point(r * r, v, 1.0),
            ..EdgeGeometry::new()
        };
        assert!((geometry.density(1.0, n) * r * r - 1.0).abs() < 1e-12);
        let geometry = EdgeGeometry {
            geometry_term: to_plane(n * n, 1.0),
            ..geometry
        };
        assert!((geometry.density(1.0, n) - 1.0).abs() < 1e-12);
    }
}
