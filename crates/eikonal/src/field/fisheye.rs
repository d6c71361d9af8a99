//! Maxwell's fisheye.

use super::analytic::{Analytic, MAX_VALUES, difference, dot};
use super::error::{FieldError, finite_vector, positive};
use super::formula::Number;
use super::{Jet, radial};
use crate::bounds::{Aabb, FieldBounds};
use glam::DVec3;

/// Index n(x) = n₀/(1 + r²/R²), r = |x − c|: every ray is a circle, and all rays from x meet again
/// at c − (x − c)R²/r² (J. C. Maxwell, 1854; Born and Wolf, *Principles of Optics*, §4.2.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fisheye {
    n2_center: f64,
    center: DVec3,
    radius: f64,
}

impl Fisheye {
    /// Creates a fisheye of index `n0` > 0 at the centre, and half of `n0` at distance `radius` >
    /// 0.
    ///
    /// # Errors
    ///
    /// An index or radius that is not positive and finite; a centre that is not finite.
    pub fn new(n0: f64, center: DVec3, radius: f64) -> Result<Self, FieldError> {
        let n0 = positive("refractive index at the center", n0)?;
        Ok(Fisheye {
            n2_center: n0 * n0,
            center: finite_vector("center", center)?,
            radius: positive("radius", radius)?,
        })
    }

    /// Returns x − c and q = 1 + r²/R².
    fn offset(&self, x: DVec3) -> (DVec3, f64) {
        let d = x - self.center;
        (d, 1.0 + d.length_squared() / (self.radius * self.radius))
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        let (_, q) = self.offset(x);
        self.n2_center / (q * q)
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (d, q) = self.offset(x);
        let f = self.n2_center / (q * q);
        (f, d * (-4.0 * f / (q * self.radius * self.radius)))
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let (d, q) = self.offset(x);
        let per_area = 1.0 / (q * self.radius * self.radius);
        let f = self.n2_center / (q * q);
        let f1 = -2.0 * f * per_area;
        radial::jet(d, [f, f1, -3.0 * f1 * per_area])
    }

    /// Computes bounds from single extrema, with u = r²/R². |∇n²| ∝ √u (1+u)⁻³ has a maximum at u =
    /// 1/5. The radial eigenvalue of the Hessian ∝ (5u − 1)(1+u)⁻⁴ has a maximum at u = 3/5. The
    /// tangential eigenvalue ∝ −(1+u)⁻³ increases.
    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let range = radial::distance_range(self.center, region);
        // Cap the radii, so that powers stay finite for an unbounded box.
        let [near, far] = range.map(|r| (r / self.radius).min(1e30).powi(2));
        let grad = |u: f64| 4.0 * u.sqrt() / (1.0 + u).powi(3);
        let across = |u: f64| -4.0 / (1.0 + u).powi(3);
        let along = |u: f64| 4.0 * (5.0 * u - 1.0) / (1.0 + u).powi(4);
        let per_area = self.n2_center / (self.radius * self.radius);
        let hess_min = across(near).min(along(near)).min(along(far));
        let hess_max = across(far).max(along(0.6_f64.clamp(near, far)));
        FieldBounds {
            n2_min: self.n2_center / (1.0 + far).powi(2),
            n2_max: self.n2_center / (1.0 + near).powi(2),
            grad_max: self.n2_center / self.radius * grad(0.2_f64.clamp(near, far)),
            hess_min: per_area * hess_min,
            hess_max: per_area * hess_max,
        }
    }

    /// Returns the length scale R; from 2R on, half the distance to the centre, because n ∝ r⁻²
    /// there.
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        self.radius.max(0.5 * (x - self.center).length())
    }

    pub(super) fn is_constant(&self) -> bool {
        false
    }
}

impl Analytic for Fisheye {
    const PARAMETERS: &'static [(&'static str, usize)] = &[("n0", 1), ("center", 3), ("radius", 1)];

    fn numbers(&self) -> [f64; MAX_VALUES] {
        let [x, y, z] = self.center.to_array();
        [self.n2_center.sqrt(), x, y, z, self.radius, 0.0, 0.0, 0.0]
    }

    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N {
        let d = difference(x, &p[1..4]);
        let share = dot(&d, &d).div(&p[4].square());
        p[0].div(&share.plus(1.0)).square()
    }
}
