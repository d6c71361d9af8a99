//! Boxes, and conservative bounds of a field over a box.

use glam::{DMat3, DVec3};

/// Axis-aligned box, `min <= max` in every component unless empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Aabb {
    /// Empty box; the identity of [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// Returns the box between two opposite corners, given in any order.
    pub fn new(a: DVec3, b: DVec3) -> Self {
        Aabb {
            min: a.min(b),
            max: a.max(b),
        }
    }

    /// Returns the smallest box around some points; [`Aabb::EMPTY`] for none.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Aabb::EMPTY, Aabb::include)
    }

    /// Returns this box grown to include `p`.
    pub fn include(self, p: DVec3) -> Self {
        Aabb {
            min: self.min.min(p),
            max: self.max.max(p),
        }
    }

    /// Returns the smallest box that contains both boxes.
    pub fn union(self, other: Aabb) -> Self {
        Aabb {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Returns the common part of both boxes, empty if there is none.
    pub fn intersection(self, other: Aabb) -> Self {
        Aabb {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// Returns true if no point lies inside.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Returns true if `p` lies inside or on the boundary.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// Returns true if the two boxes share a point.
    pub fn overlaps(&self, other: &Aabb) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Returns this box grown by `margin` on every side.
    pub fn grown(&self, margin: f64) -> Self {
        Aabb {
            min: self.min - DVec3::splat(margin),
            max: self.max + DVec3::splat(margin),
        }
    }

    /// Returns the midpoint of the box.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Returns the lengths of the edges.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Returns the length of the box's space diagonal.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// Returns the eight corners of the box.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    /// Returns the point of the box nearest to `p`.
    pub fn clamp(&self, p: DVec3) -> DVec3 {
        p.clamp(self.min, self.max)
    }

    /// Returns the range [min, max] of d·x over the points x of the box; exact, also for unbounded
    /// boxes.
    pub fn project(&self, d: DVec3) -> [f64; 2] {
        (0..3).fold([0.0; 2], |[low, high], i| {
            let (a, b) = (mul(d[i], self.min[i]), mul(d[i], self.max[i]));
            [low + a.min(b), high + a.max(b)]
        })
    }

    /// Returns the smallest distance from `p` to a point of the box.
    pub fn nearest_distance(&self, p: DVec3) -> f64 {
        (p - self.clamp(p)).length()
    }

    /// Returns the largest distance from `p` to a point of the box.
    pub(crate) fn farthest_distance(&self, p: DVec3) -> f64 {
        (p - self.min).abs().max((p - self.max).abs()).length()
    }
}

/// Conservative bounds of a field over a box: every value in the box lies within them.
///
/// The bounds are of n², because fields supply n² and sums of fields add n². [`FieldBounds::kappa`]
/// and [`FieldBounds::neg_hess_ln_n`] compute from them the quantities of the uniqueness
/// certificate (docs/theory.md#bounds).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldBounds {
    /// Lower bound of n²; not positive if the field is invalid somewhere, or if the bound is loose.
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
    /// Returns the bounds of the constant field n² = `n2`.
    pub fn constant(n2: f64) -> Self {
        FieldBounds {
            n2_min: n2,
            n2_max: n2,
            grad_max: 0.0,
            hess_min: 0.0,
            hess_max: 0.0,
        }
    }

    /// Returns bounds that hold wherever either of two bounds holds.
    pub fn union(self, o: Self) -> Self {
        FieldBounds {
            n2_min: self.n2_min.min(o.n2_min),
            n2_max: self.n2_max.max(o.n2_max),
            grad_max: self.grad_max.max(o.grad_max),
            hess_min: self.hess_min.min(o.hess_min),
            hess_max: self.hess_max.max(o.hess_max),
        }
    }

    /// Returns the smallest index n; NaN where the lower bound of n² is negative.
    pub fn n_min(&self) -> f64 {
        self.n2_min.sqrt()
    }

    /// Returns the largest index n.
    pub fn n_max(&self) -> f64 {
        self.n2_max.sqrt()
    }

    /// Returns κ ≥ max |∇ ln n| = max |∇n²| / (2n²), the largest possible curvature of a ray. κ is
    /// infinite if n² is not bounded away from zero.
    pub fn kappa(&self) -> f64 {
        match self.grad_max {
            0.0 => 0.0,
            g if self.n2_min > 0.0 => g / (2.0 * self.n2_min),
            _ => f64::INFINITY,
        }
    }

    /// Returns an upper bound (≥ 0) of the largest eigenvalue of −Hess ln n = −Hess n²/(2n²) +
    /// ∇n²⊗∇n²/(2n⁴).
    pub fn neg_hess_ln_n(&self) -> f64 {
        let kappa = self.kappa();
        // Keep NaN, instead of zero, if nothing is known of the Hessian.
        let bend = if self.hess_min >= 0.0 {
            0.0
        } else {
            -self.hess_min / (2.0 * self.n2_min.max(0.0))
        };
        bend + 2.0 * kappa * kappa
    }
}

/// Bounds of n and its derivatives over a box, for fields with a closed form of n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexBounds {
    /// Lower bound of n.
    pub n_min: f64,
    /// Upper bound of n.
    pub n_max: f64,
    /// Upper bound of |∇n|.
    pub grad_max: f64,
    /// Lower bound of the smallest eigenvalue of Hess n.
    pub hess_min: f64,
    /// Upper bound of the largest eigenvalue of Hess n.
    pub hess_max: f64,
}

impl IndexBounds {
    /// Converts to bounds of n² by ∇n² = 2n∇n and Hess n² = 2n Hess n + 2∇n⊗∇n. The last term has
    /// eigenvalues between 0 and 2|∇n|².
    pub fn squared(self) -> FieldBounds {
        let n = [self.n_min, self.n_max];
        let n_hess = product(n, [self.hess_min, self.hess_max]);
        let n_abs = self.n_min.abs().max(self.n_max.abs());
        let below = if self.n_min <= 0.0 && self.n_max >= 0.0 {
            0.0
        } else {
            self.n_min.abs().min(self.n_max.abs())
        };
        FieldBounds {
            n2_min: below * below,
            n2_max: n_abs * n_abs,
            grad_max: 2.0 * mul(n_abs, self.grad_max),
            hess_min: 2.0 * n_hess[0],
            hess_max: 2.0 * n_hess[1] + 2.0 * self.grad_max * self.grad_max,
        }
    }
}

/// Returns a·b with 0·∞ = 0, as bounds of products need it.
pub(crate) fn mul(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

/// Returns the range of a·b over two intervals.
fn product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let p = [
        mul(a[0], b[0]),
        mul(a[0], b[1]),
        mul(a[1], b[0]),
        mul(a[1], b[1]),
    ];
    [
        p.into_iter().fold(f64::INFINITY, f64::min),
        p.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Returns the eigenvalues of a symmetric matrix in ascending order, by cyclic Jacobi rotations.
/// Unlike the closed form, rotations keep full accuracy when eigenvalues coincide, as they do on
/// axes of symmetry.
pub fn symmetric_eigenvalues(m: DMat3) -> [f64; 3] {
    // Each sweep squares the relative size of the off-diagonal entries, so that six sweeps suffice.
    let mut a = m;
    for _ in 0..6 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            a = jacobi_rotation(a, p, q);
        }
    }
    let mut values = [a.x_axis.x, a.y_axis.y, a.z_axis.z];
    values.sort_by(f64::total_cmp);
    values
}

/// Returns RᵀaR with the rotation R in the plane (p, q) that makes the entry (p, q) vanish.
fn jacobi_rotation(a: DMat3, p: usize, q: usize) -> DMat3 {
    let off = a.col(q)[p];
    if off == 0.0 {
        return a;
    }
    let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * off);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let mut r = DMat3::IDENTITY;
    r.col_mut(p)[p] = c;
    r.col_mut(q)[q] = c;
    r.col_mut(q)[p] = t * c;
    r.col_mut(p)[q] = -t * c;
    r.transpose() * a * r
}

/// Returns a conservative range of the eigenvalues of all symmetric matrices with entries between
/// `low` and `high`. It consists of the eigenvalues of the middle matrix, widened by the largest
/// eigenvalue of the radius matrix (Weyl's inequality and Perron–Frobenius).
pub(crate) fn interval_eigenvalues(low: DMat3, high: DMat3) -> [f64; 2] {
    let [min, _, max] = symmetric_eigenvalues((low + high) * 0.5);
    let [_, _, radius] = symmetric_eigenvalues((high - low) * 0.5);
    // Cover the rounding of the rotations.
    let slack = 1e-14 * (min.abs() + max.abs() + radius);
    [min - radius - slack, max + radius + slack]
}
