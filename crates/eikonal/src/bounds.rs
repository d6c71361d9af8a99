//! Boxes, and conservative bounds of a field over a box.

use glam::DVec3;

/// Axis-aligned box, `min <= max` in every component unless empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Aabb {
    /// The box that contains nothing; the identity of [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// The box between two opposite corners, given in any order.
    pub fn new(a: DVec3, b: DVec3) -> Self {
        Aabb {
            min: a.min(b),
            max: a.max(b),
        }
    }

    /// The smallest box around some points; [`Aabb::EMPTY`] for none.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Aabb::EMPTY, Aabb::include)
    }

    /// This box grown to include `p`.
    pub fn include(self, p: DVec3) -> Self {
        Aabb {
            min: self.min.min(p),
            max: self.max.max(p),
        }
    }

    /// The smallest box that contains both.
    pub fn union(self, other: Aabb) -> Self {
        Aabb {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The common part, empty if there is none.
    pub fn intersection(self, other: Aabb) -> Self {
        Aabb {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// Whether no point lies inside.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Whether `p` lies inside or on the boundary.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// Whether the two boxes share a point.
    pub fn overlaps(&self, other: &Aabb) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// This box grown by `margin` on every side.
    pub fn grown(&self, margin: f64) -> Self {
        Aabb {
            min: self.min - DVec3::splat(margin),
            max: self.max + DVec3::splat(margin),
        }
    }

    /// Midpoint.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Edge lengths.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the space diagonal.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// The eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    /// The point of the box nearest to `p`.
    pub fn clamp(&self, p: DVec3) -> DVec3 {
        p.clamp(self.min, self.max)
    }

    /// Largest distance from `p` to a point of the box.
    pub fn farthest_distance(&self, p: DVec3) -> f64 {
        (p - self.min).abs().max((p - self.max).abs()).length()
    }
}

/// Conservative bounds of a field over a box: every value in the box lies within them.
///
/// They are kept on n², which is what fields supply and what adds up; the quantities that the
/// uniqueness certificate uses (theory §5) follow by [`FieldBounds::kappa`] and
/// [`FieldBounds::neg_hess_ln_n`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldBounds {
    /// Lower bound of n² (not positive if the field is invalid somewhere, or if the bound is loose).
    pub n2_min: f64,
    /// Upper bound of n².
    pub n2_max: f64,
    /// Upper bound of |∇n²|.
    pub grad_max: f64,
    /// Lower bound of the smallest eigenvalue of Hess n².
    pub hess_min: f64,
    /// Upper bound of the largest eigenvalue of Hess n².
    pub hess_max: f64,
}

impl FieldBounds {
    /// Bounds of the constant field n² = `n2`.
    pub fn constant(n2: f64) -> Self {
        FieldBounds {
            n2_min: n2,
            n2_max: n2,
            grad_max: 0.0,
            hess_min: 0.0,
            hess_max: 0.0,
        }
    }

    /// Bounds that hold wherever either holds.
    pub fn union(self, o: Self) -> Self {
        FieldBounds {
            n2_min: self.n2_min.min(o.n2_min),
            n2_max: self.n2_max.max(o.n2_max),
            grad_max: self.grad_max.max(o.grad_max),
            hess_min: self.hess_min.min(o.hess_min),
            hess_max: self.hess_max.max(o.hess_max),
        }
    }

    /// Smallest index n; NaN where the lower bound of n² is negative.
    pub fn n_min(&self) -> f64 {
        self.n2_min.sqrt()
    }

    /// Largest index n.
    pub fn n_max(&self) -> f64 {
        self.n2_max.sqrt()
    }

    /// κ ≥ max |∇ ln n| = max |∇n²| / (2n²), the largest curvature a ray can have; infinite if
    /// n² is not bounded away from zero.
    pub fn kappa(&self) -> f64 {
        match self.grad_max {
            0.0 => 0.0,
            g if self.n2_min > 0.0 => g / (2.0 * self.n2_min),
            _ => f64::INFINITY,
        }
    }

    /// Upper bound (≥ 0) of the largest eigenvalue of
    /// −Hess ln n = −Hess n²/(2n²) + ∇n²⊗∇n²/(2n⁴).
    pub fn neg_hess_ln_n(&self) -> f64 {
        let kappa = self.kappa();
        let bend = if self.hess_min < 0.0 {
            -self.hess_min / (2.0 * self.n2_min.max(0.0))
        } else {
            0.0
        };
        bend + 2.0 * kappa * kappa
    }
}
