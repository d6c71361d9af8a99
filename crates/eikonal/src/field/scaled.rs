//! A field at another wavelength (docs/theory.md#dispersion).

use super::error::{FieldError, positive};
use super::{BoundsOf, Bspline, Field, IndexChange, IndexDerivative, Jet, outer};
use crate::bounds::{Aabb, FieldBounds, mul};
use glam::DVec3;

/// Index n(x) = n_b + s (n_0(x) − n_b): a medium at another wavelength, if dispersion changes the
/// excess over n_b by one factor everywhere. n_b is zero, or the index of a background without
/// dispersion.
///
/// With n_b = 0, ∇ ln n does not change, so that rays within the medium keep their shape.
/// Refraction at the boundary of the medium and optical lengths change.
#[derive(Clone, Debug)]
pub struct Scaled {
    field: Box<Field>,
    /// Factor s.
    factor: f64,
    /// Index n_b of the background.
    background: f64,
    /// Factor of length scales.
    lengths: f64,
}

/// Squared index n² as a function of the squared index n_0² of the unscaled field.
struct Square {
    value: f64,
    /// First derivative with respect to n_0²; `second` is the second derivative.
    first: f64,
    second: f64,
}

impl Scaled {
    /// Creates the index of `field` times `factor` > 0.
    ///
    /// # Errors
    ///
    /// A factor that is not positive and finite.
    pub fn new(field: Field, factor: f64) -> Result<Self, FieldError> {
        Ok(Scaled {
            field: Box::new(field),
            factor: positive("factor of a refractive index", factor)?,
            background: 0.0,
            lengths: 1.0,
        })
    }

    /// Creates the index `background` + `factor` (n − `background`) of a grid with the index n. The
    /// new index must be positive, like `factor` and `background`.
    ///
    /// # Errors
    ///
    /// A factor or a background that is not positive and finite.
    pub fn excess(grid: Bspline, background: f64, factor: f64) -> Result<Self, FieldError> {
        Ok(Scaled {
            background: positive("refractive index of the background", background)?,
            // Derivatives of n² grow by the factor, and length scales with their square root.
            lengths: factor.max(1.0).sqrt().recip(),
            ..Scaled::new(grid.into(), factor)?
        })
    }

    /// Returns the unscaled field.
    pub(super) fn inner(&self) -> &Field {
        &self.field
    }

    /// Returns s.
    pub(super) fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns another field scaled like this one.
    pub(super) fn over(&self, field: Field) -> Self {
        Scaled {
            field: Box::new(field),
            ..*self
        }
    }

    fn square(&self, n2: f64) -> Square {
        let (s, background) = (self.factor, self.background);
        if background == 0.0 {
            let first = s * s;
            return Square {
                value: n2 * first,
                first,
                second: 0.0,
            };
        }
        let n = n2.sqrt();
        let scaled = background + s * (n - background);
        Square {
            // Keep the sign, so that bounds show where the index is not positive.
            value: scaled * scaled.abs(),
            first: s * scaled / n,
            second: s * (s - 1.0) * background / (2.0 * n * n2),
        }
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.square(self.field.n2(x)).value
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (n2, grad) = self.field.gradient(x);
        let square = self.square(n2);
        (square.value, grad * square.first)
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let jet = self.field.jet(x);
        let square = self.square(jet.n2);
        Jet {
            n2: square.value,
            grad: jet.grad * square.first,
            hess: jet.hess * square.first + outer(jet.grad) * square.second,
        }
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        self.bounds_by(region, Field::bounds)
    }

    /// Computes bounds from `inner`, the bounds of the unscaled field. The derivatives of n² with
    /// respect to n_0² are monotonic. The second derivative times ∇n_0² ⊗ ∇n_0² has eigenvalues from
    /// 0 to the second derivative times |∇n_0²|².
    pub(super) fn bounds_by(&self, region: &Aabb, inner: BoundsOf) -> FieldBounds {
        let bounds = inner(&self.field, region);
        let is_index = bounds.n2_min > 0.0;
        if self.background > 0.0 && !is_index {
            return FieldBounds {
                n2_min: f64::NEG_INFINITY,
                n2_max: f64::INFINITY,
                grad_max: f64::INFINITY,
                hess_min: f64::NEG_INFINITY,
                hess_max: f64::INFINITY,
            };
        }
        let [a, b] = [bounds.n2_min, bounds.n2_max].map(|n2| self.square(n2));
        let (least, most) = (a.first.min(b.first), a.first.max(b.first));
        let outward = |hess: f64, grows: bool| mul(hess, if grows { most } else { least });
        let turn = |second: f64| mul(second, bounds.grad_max * bounds.grad_max);
        FieldBounds {
            n2_min: a.value,
            n2_max: b.value,
            grad_max: mul(bounds.grad_max, most),
            hess_min: outward(bounds.hess_min, bounds.hess_min < 0.0)
                + turn(a.second.min(b.second).min(0.0)),
            hess_max: outward(bounds.hess_max, bounds.hess_max > 0.0)
                + turn(a.second.max(b.second).max(0.0)),
        }
    }

    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        self.field.length_scale(x) * self.lengths
    }

    pub(super) fn step_scale(&self, x: DVec3, v: DVec3) -> f64 {
        self.field.step_scale(x, v) * self.lengths
    }

    pub(super) fn is_constant(&self) -> bool {
        self.field.is_constant()
    }

    /// Returns the change of n² and ∇n² at a point per change of s.
    pub(super) fn by_factor(&self, x: DVec3) -> IndexChange {
        let (n2, grad) = self.field.gradient(x);
        let n = n2.sqrt();
        let excess = self.factor * (n - self.background);
        let scaled = self.background + excess;
        IndexChange {
            n2: 2.0 * scaled * (n - self.background),
            gradient: grad * ((scaled + excess) / n),
        }
    }

    /// Converts a derivative with respect to n² and ∇n² at a point to a derivative with respect to
    /// n² and ∇n² of the unscaled field.
    pub(super) fn unscaled(&self, x: DVec3, by: IndexDerivative) -> IndexDerivative {
        let (n2, grad) = self.field.gradient(x);
        let square = self.square(n2);
        IndexDerivative {
            n2: by.n2 * square.first + by.gradient.dot(grad) * square.second,
            gradient: by.gradient * square.first,
        }
    }

    /// Converts a change of n² and ∇n² of the unscaled field at a point to their change in this
    /// field: the transpose of [`Scaled::unscaled`].
    pub(super) fn change(&self, x: DVec3, unscaled: IndexChange) -> IndexChange {
        let (n2, grad) = self.field.gradient(x);
        let square = self.square(n2);
        IndexChange {
            n2: unscaled.n2 * square.first,
            gradient: unscaled.gradient * square.first + grad * (unscaled.n2 * square.second),
        }
    }
}
