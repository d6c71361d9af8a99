//! The radially graded rod.

use super::Jet;
use super::analytic::{Analytic, MAX_VALUES, difference, dot};
use super::axis::Axis;
use super::error::{FieldError, positive};
use super::formula::Number;
use crate::bounds::{Aabb, FieldBounds};
use glam::DVec3;

/// Squared index n²(x) = n₀² (1 − α²r²), with r the distance to an axis: a GRIN rod ("SELFOC") or
/// parabolic-profile fibre, in which meridional rays are sinusoidal (Ghatak and Thyagarajan,
/// *Optical Electronics*, §1.4).
///
/// The field is invalid from r = 1/α on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selfoc {
    n2_axis: f64,
    alpha: f64,
    axis: Axis,
}

impl Selfoc {
    /// Creates a rod of index `n0` > 0 on the axis through `origin` along `direction` (of any
    /// length); `alpha` > 0 in inverse scene units.
    ///
    /// # Errors
    ///
    /// An index or `alpha` that is not positive and finite; an origin or direction that is not
    /// finite, or a direction of zero.
    pub fn new(n0: f64, alpha: f64, origin: DVec3, direction: DVec3) -> Result<Self, FieldError> {
        let n0 = positive("refractive index on the axis", n0)?;
        Ok(Selfoc {
            n2_axis: n0 * n0,
            alpha: positive("alpha", alpha)?,
            axis: Axis::new(origin, direction)?,
        })
    }

    /// Returns n₀²α², minus the derivative of n² by r².
    fn fall(&self) -> f64 {
        self.n2_axis * self.alpha * self.alpha
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.n2_axis - self.fall() * self.axis.transverse(x).length_squared()
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let d = self.axis.transverse(x);
        (
            self.n2_axis - self.fall() * d.length_squared(),
            self.axis.vector(d * (-2.0 * self.fall())),
        )
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let (n2, grad) = self.gradient(x);
        Jet {
            n2,
            grad,
            hess: self.axis.projection() * (-2.0 * self.fall()),
        }
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let [near, far] = self.axis.radius_range(region);
        FieldBounds {
            n2_min: self.n2_axis - self.fall() * far * far,
            n2_max: self.n2_axis - self.fall() * near * near,
            grad_max: 2.0 * self.fall() * far,
            hess_min: -2.0 * self.fall(),
            hess_max: 0.0,
        }
    }

    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        1.0 / self.alpha
    }

    pub(super) fn is_constant(&self) -> bool {
        false
    }
}

impl Analytic for Selfoc {
    const PARAMETERS: &'static [(&'static str, usize)] =
        &[("n0", 1), ("alpha", 1), ("origin", 3), ("direction", 3)];

    fn numbers(&self) -> [f64; MAX_VALUES] {
        let [x, y, z] = self.axis.origin().to_array();
        let [u, v, w] = self.axis.direction().to_array();
        [self.n2_axis.sqrt(), self.alpha, x, y, z, u, v, w]
    }

    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N {
        let (d, along) = (difference(x, &p[2..5]), &p[5..8]);
        let length2 = dot(&d, along).square().div(&dot(along, along));
        let r2 = dot(&d, &d).sub(&length2);
        let fall = p[1].square().mul(&r2);
        p[0].square().mul(&fall.times(-1.0).plus(1.0))
    }
}
