//! Certificates that at most one ray connects any two points of a medium
//! (docs/theory.md#certificate).

use crate::bounds::{Aabb, FieldBounds};
use crate::field::Field;
use glam::DVec3;
use std::f64::consts::PI;

/// A convex medium with bounds of its field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uniqueness {
    /// Convex region that contains the medium.
    region: Aabb,
    /// Largest distance between two points of the medium.
    diameter: f64,
    /// Bounds of the field over the region with a margin around it.
    bounds: FieldBounds,
}

impl Uniqueness {
    /// Creates the certificate of a medium of the given diameter inside `region`. `bounds` must
    /// hold over the region and over a margin around it, into which the field continues.
    pub fn new(region: Aabb, diameter: f64, bounds: FieldBounds) -> Self {
        Uniqueness {
            region,
            diameter,
            bounds,
        }
    }

    /// Returns the bounds of the field over the medium.
    pub fn bounds(&self) -> &FieldBounds {
        &self.bounds
    }

    /// Returns the length of the longest possible arc of a ray inside the medium; infinite if the
    /// bounds do not limit it.
    pub fn longest_ray(&self) -> f64 {
        longest_arc(self.bounds.kappa(), self.diameter)
    }

    /// Returns true if every pair of points of the medium is connected by at most one ray that
    /// stays inside.
    pub fn whole_medium(&self) -> bool {
        self.criterion() < 1.0
    }

    /// Returns n_max·ℓ·√K/π of the whole medium. The medium is certified below one; weaker fields
    /// give smaller values. Returns infinity if the bounds do not limit the length of rays.
    pub fn criterion(&self) -> f64 {
        criterion(&self.bounds, self.longest_ray())
    }

    /// Returns true if at most one ray that stays inside connects `x` and `y`.
    ///
    /// No ray of the medium is longer than π/κ ([`Uniqueness::longest_ray`]). Schur's comparison
    /// therefore bounds the rays of this pair by the distance between `x` and `y`. Geodesics of at
    /// most this length reach only points near `x` or `y`, so the curvature is bounded only there.
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

/// Returns the maximum length of an arc of curvature at most `kappa` over a chord `d`, by Schur's
/// comparison: the length of the circular arc, provided that κd < 2. Returns infinity otherwise.
fn longest_arc(kappa: f64, d: f64) -> f64 {
    if kappa == 0.0 {
        d
    } else if kappa * d < 2.0 {
        2.0 / kappa * (0.5 * kappa * d).asin()
    } else {
        f64::INFINITY
    }
}

/// Returns the ratio of the two sides of Klingenberg's criterion n_max·ℓ < π/√K for the optical
/// metric. The sectional curvature K of the optical metric is at most 2·max(0, −λ_min(Hess ln
/// n))/n².
fn criterion(bounds: &FieldBounds, longest: f64) -> f64 {
    if !(bounds.n2_min > 0.0 && longest.is_finite()) {
        return f64::INFINITY;
    }
    let curvature = 2.0 * bounds.neg_hess_ln_n() / bounds.n2_min;
    bounds.n_max() * longest * curvature.sqrt() / PI
}
