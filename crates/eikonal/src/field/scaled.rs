//! A field times a constant (docs/theory.md#dispersion).

use super::error::{FieldError, positive};
use super::{Field, IndexDerivative, Jet};
use crate::bounds::{Aabb, FieldBounds};
use glam::DVec3;

/// Index n(x) = s n_0(x): a medium at another wavelength, if all parts of it have equal relative
/// dispersion.
///
/// ∇ ln n does not change, so that rays within the medium keep their shape. Refraction at the
/// boundary of the medium and optical lengths change.
#[derive(Clone, Debug)]
pub struct Scaled {
    field: Box<Field>,
    /// Squared factor s².
    square: f64,
}

impl Scaled {
    /// Creates the index of `field` times `factor` > 0.
    ///
    /// # Errors
    ///
    /// A factor that is not positive and finite.
    pub fn new(field: Field, factor: f64) -> Result<Self, FieldError> {
        let factor = positive("factor of a refractive index", factor)?;
        Ok(Scaled {
            field: Box::new(field),
            square: factor * factor,
        })
    }

    /// Returns the unscaled field.
    pub(super) fn inner(&self) -> &Field {
        &self.field
    }

    /// Returns s².
    pub(super) fn square(&self) -> f64 {
        self.square
    }

    /// Converts a derivative with respect to n² and ∇n² to a derivative with respect to n² and ∇n²
    /// of the unscaled field.
    pub(super) fn unscaled(&self, by: IndexDerivative) -> IndexDerivative {
        IndexDerivative {
            n2: by.n2 * self.square,
            gradient: by.gradient * self.square,
        }
    }

    /// Returns another field scaled by this factor.
    pub(super) fn over(&self, field: Field) -> Self {
        Scaled {
            field: Box::new(field),
            square: self.square,
        }
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.field.n2(x) * self.square
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (n2, grad) = self.field.gradient(x);
        (n2 * self.square, grad * self.square)
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let jet = self.field.jet(x);
        Jet {
            n2: jet.n2 * self.square,
            grad: jet.grad * self.square,
            hess: jet.hess * self.square,
        }
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let bounds = self.field.bounds(region);
        FieldBounds {
            n2_min: bounds.n2_min * self.square,
            n2_max: bounds.n2_max * self.square,
            grad_max: bounds.grad_max * self.square,
            hess_min: bounds.hess_min * self.square,
            hess_max: bounds.hess_max * self.square,
        }
    }

    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        self.field.length_scale(x)
    }

    pub(super) fn is_constant(&self) -> bool {
        self.field.is_constant()
    }
}
