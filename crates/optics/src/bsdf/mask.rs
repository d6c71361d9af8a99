//! A surface with holes: part of the light passes straight through, the rest meets another surface.

use super::{Bsdf, BsdfError, PartialTransmission, factor};
use crate::shape::Site;
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use std::sync::Arc;

/// A surface that covers a share of its area.
///
/// Whether light passes is decided first ([`Bsdf::through`]). What does not pass meets the nested surface:
/// its scattering is that of the mask, as the share that it covers cancels the probability of meeting it.
#[derive(Clone, Debug)]
pub struct Mask {
    opacity: Texture,
    nested: Arc<Bsdf>,
}

impl Mask {
    /// `opacity`, a number in [0, 1], is the share that the opaque surface `nested` covers.
    ///
    /// # Errors
    /// An opacity outside [0, 1]; a nested surface that lets light through.
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
