//! When no two points of a medium can be connected by more than one ray (docs/theory.md#certificate).

use crate::bounds::{Aabb, FieldBounds};
use crate::field::Field;
use glam::DVec3;
use std::f64::consts::PI;

/// A convex medium and what is known of its field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uniqueness {
    /// A convex region that contains the medium.
    region: Aabb,
    /// Largest distance between two points of the medium.
    diameter: f64,
    /// Bounds over the region with a margin around it.
    bounds: FieldBounds,
}

impl Uniqueness {
    /// For a medium of the given diameter inside `region`. `bounds` must hold over the region and a
    /// margin around it, into which the field continues.
    pub fn new(region: Aabb, diameter: f64, bounds: FieldBounds) -> Self {
        Uniqueness {
            region,
            diameter,
            bounds,
        }
    }

    /// Bounds of the field over the medium.
    pub fn bounds(&self) -> &FieldBounds {
        &self.bounds
    }

    /// Longest arc that a ray inside the medium can have; infinite if the bound says nothing.
    pub fn longest_ray(&self) -> f64 {
        longest_arc(self.bounds.kappa(), self.diameter)
    }

    /// Whether every pair of points of the medium is connected by at most one ray that stays inside.
    pub fn whole_medium(&self) -> bool {
        self.criterion() < 1.0
    }

    /// n_max·ℓ·√K/π of the whole medium: below one it is certified, and the less the weaker its field
    /// is. Infinite if nothing is known.
    pub fn criterion(&self) -> f64 {
        criterion(&self.bounds, self.longest_ray())
    }

    /// Whether the pair `x`, `y` is connected by at most one ray that stays inside.
    ///
    /// No ray of the medium is longer than π/κ (by [`Uniqueness::longest_ray`]), so Schur's
    /// comparison bounds the rays of this pair by its own distance. The curvature then needs to be
    /// bounded only where geodesics no longer than that can get from `x` or `y`.
    pub fn pair(&self, field: &Field, x: DVec3, y: DVec3) -> bool {
        if !self.longest_ray().is_finite() {
            return false;
        }
        let length = longest_arc(self.bounds.kappa(), x.distance(y));
        let radius = length * (self.bounds.n2_max / self.bounds.n2_min).sqrt();
        let around = |p: DVec3| Aabb::new(p, p).grown(radius);
        let reachable = around(x).union(around(y)).intersection(self.region);
        criterion(&field.bounds(&reachable), length) < 1.0
    }
}

/// Schur's comparison: an arc of curvature at most κ over a chord `d` is no longer than the circle's,
/// provided that κd < 2.
fn longest_arc(kappa: f64, d: f64) -> f64 {
    if kappa == 0.0 {
        d
    } else if kappa * d < 2.0 {
        2.0 / kappa * (0.5 * kappa * d).asin()
    } else {
        f64::INFINITY
    }
}

/// Klingenberg's criterion n_max·ℓ < π/√K for the optical metric, as the ratio of the two sides. Its
/// sectional curvature K is at most 2·max(0, −λ_min(Hess ln n))/n².
fn criterion(bounds: &FieldBounds, longest: f64) -> f64 {
    if !(bounds.n2_min > 0.0 && longest.is_finite()) {
        return f64::INFINITY;
    }
    let curvature = 2.0 * bounds.neg_hess_ln_n() / bounds.n2_min;
    bounds.n_max() * longest * curvature.sqrt() / PI
}
