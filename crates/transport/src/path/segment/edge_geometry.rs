//! What the two ends of an edge must know of the way between them.

use crate::Spectrum;
use glam::DVec3;

/// A ray tube between two points, or between a point and a plane: the same from either end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeGeometry {
    /// Geometry term G: 1/(J n²) between two points, with J and n at the end that the ray was followed
    /// to (1/(B n_a² n_b²) in docs/theory.md#densities-of-edges); 1/(A n²) between a plane and a point of index n.
    pub geometry_term: f64,
    /// Optical depth.
    pub depth: Spectrum,
    /// Probability that an edge sampled by chance makes the same choices at the interfaces on the way.
    pub choice: f64,
    /// Number of refractions and reflections on the way.
    pub events: u32,
    /// Number of reflections among them, total ones included.
    pub reflections: u32,
}

impl EdgeGeometry {
    /// No way at all yet.
    pub(in crate::path) fn new() -> Self {
        EdgeGeometry {
            geometry_term: 0.0,
            depth: Spectrum::ZERO,
            choice: 1.0,
            events: 0,
            reflections: 0,
        }
    }

    /// The probability that light or importance gets through without a collision, for channel
    /// probabilities `channel_pdf`.
    pub(crate) fn survival(&self, channel_pdf: Spectrum) -> f64 {
        (channel_pdf * self.depth.exp_neg()).sum()
    }

    /// Density with which sampling from one end finds the other, without the probability of what
    /// happens there.
    ///
    /// `pdf` is the density of the ray: per steradian from a point, per unit area from a plane. The
    /// result is per unit area across the ray at a point of index `n`, or per steradian at a plane where
    /// the index is `n`: p/J = p·G·n² from point to point, p/A = p·G·n² from plane to point, and
    /// p·dΩ/dΩ' = p·G·n² from point to plane.
    pub fn density(&self, pdf: f64, n: f64) -> f64 {
        pdf * self.choice * self.geometry_term * n * n
    }
}

/// G for a ray that ends at a point with velocity `v`, given the cross section of its tube there; `jump` is
/// ∏ n_after/n_before over declared index matches, whose jumps do not conserve étendue as refraction does.
#[inline]
pub(super) fn to_point(section: f64, v: DVec3, jump: f64) -> f64 {
    proper(jump / (section.abs() * v.length_squared()))
}

/// G for a ray from a point that ends at a plane across it, in a region of constant index, given
/// |δv₁ × δv₂| there. From dΩ'/dΩ = |δv₁ × δv₂|/n² follows A by étendue.
#[inline]
pub(super) fn to_plane(spread: f64, jump: f64) -> f64 {
    // Planted error "wrong ray tube from a point to a plane", found by morgana-transport/transport::furnace::bidirectional_estimators:
    // proper(jump * 0.25 / spread.abs())
    proper(jump / spread.abs())
}

/// A geometry term on a caustic, or after a grazing refraction, is none.
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
