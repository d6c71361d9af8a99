//! Surface with holes: some light passes straight through, and a nested surface scatters the rest.

use super::{Bsdf, BsdfError, PartialTransmission, factor};
use crate::shape::Site;
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use std::sync::Arc;

/// Surface that covers a fraction of its area.
///
/// Estimators first decide whether light passes ([`Bsdf::through`]). The nested surface scatters
/// the light that does not pass. Its values apply unchanged to the mask, because the covered
/// fraction cancels the probability of hitting it.
#[derive(Clone, Debug)]
pub struct Mask {
    opacity: Texture,
    nested: Arc<Bsdf>,
}

impl Mask {
    /// Creates the mask. `opacity`, a number in [0, 1], is the fraction that the opaque surface
    /// `nested` covers.
    ///
    /// # Errors
    /// Fails if the opacity lies outside [0, 1], or if the nested surface transmits light.
    pub fn new(opacity: impl Into<Texture>, nested: Bsdf) -> Result<Self, BsdfError> {
        Ok(Mask {
            opacity: factor("opacity", opacity)?,
            nested: Arc::new(nested.opaque("mask")?),
        })
    }

    pub(super) fn nested(&self) -> &Bsdf {
        &self.nested
    }

    pub(super) fn through(&self, site: &Site) -> PartialTransmission {
        PartialTransmission {
            probability: 1.0 - self.opacity.number_at(site),
            factor: Spectrum::ONE,
        }
    }
}
