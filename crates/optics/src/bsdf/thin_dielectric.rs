//! A thin pane of a dielectric: light passes straight through, or is reflected, with all that goes back and
//! forth inside.

use super::surface::reflect;
use super::{
    BsdfError, BsdfSample, PartialTransmission, Surface, Tint, check_eta, factor, fresnel,
};
use crate::shape::Site;
use crate::texture::Texture;
use glam::DVec3;

/// A pane of no thickness, the same medium on both sides.
///
/// As with a [`Mask`](super::Mask), whether light passes is decided first; what does not is reflected.
#[derive(Clone, Debug)]
pub struct ThinDielectric {
    eta: f64,
    specular_reflectance: Texture,
    specular_transmittance: Texture,
}

impl ThinDielectric {
    /// `eta` > 0 is the pane's index over that around it; factors in [0, 1] tint what is reflected and what
    /// passes, physically both are 1.
    ///
    /// # Errors
    /// An index that is not positive and finite; a factor outside [0, 1].
    pub fn new(
        eta: f64,
        specular_reflectance: impl Into<Texture>,
        specular_transmittance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        check_eta(eta)?;
        Ok(ThinDielectric {
            eta,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
            specular_transmittance: factor("specular_transmittance", specular_transmittance)?,
        })
    }

    /// The pane's index over that around it.
    pub(super) fn eta(&self) -> f64 {
        self.eta
    }

    /// The colour of that name.
    pub(super) fn tint(&self, tint: Tint) -> Option<&Texture> {
        match tint {
            Tint::SpecularReflectance => Some(&self.specular_reflectance),
            Tint::SpecularTransmittance => Some(&self.specular_transmittance),
            _ => None,
        }
    }

    /// One face reflects F. Summed over all reflections inside, the pane reflects
    /// R = F + (1 − F)² F/(1 − F²) = 2F/(1 + F).
    pub(super) fn through(&self, site: &Site, cos: f64) -> PartialTransmission {
        let f = fresnel::dielectric(cos.min(1.0), 1.0, self.eta).reflectance;
        PartialTransmission {
            probability: (1.0 - f) / (1.0 + f),
            factor: self.specular_transmittance.at(site),
        }
    }

    /// Reflection of what does not pass.
    pub(super) fn sample(&self, s: &Surface, toward: DVec3) -> BsdfSample {
        let side = s.facing(toward);
        BsdfSample {
            direction: reflect(toward, side.normal, side.normal.dot(toward)).normalize(),
            weight: self.specular_reflectance.at(&s.site),
            pdf: 1.0,
            delta: true,
            transmitted: false,
        }
    }
}
