//! Thin pane of a dielectric. Light passes straight through or is reflected, including all internal
//! reflections.

use super::surface::reflect;
use super::{
    BsdfError, BsdfSample, PartialTransmission, Surface, Tint, check_eta, factor, fresnel,
};
use crate::shape::Site;
use crate::texture::Texture;
use glam::DVec3;

/// Pane without thickness, with the same medium on both sides.
///
/// As with a [`Mask`](super::Mask), estimators first decide whether light passes. Light that does
/// not pass is reflected.
#[derive(Clone, Debug)]
pub struct ThinDielectric {
    eta: f64,
    specular_reflectance: Texture,
    specular_transmittance: Texture,
}

impl ThinDielectric {
    /// Creates the pane. `eta` > 0 is its index relative to its surroundings. The factors in [0, 1]
    /// tint reflected and transmitted light; physically, both are 1.
    ///
    /// # Errors
    /// Fails if the index is not positive and finite, or if a factor lies outside [0, 1].
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

    /// Returns the index of the pane relative to its surroundings.
    pub(super) fn eta(&self) -> f64 {
        self.eta
    }

    /// Returns the colour `tint`.
    pub(super) fn tint(&self, tint: Tint) -> Option<&Texture> {
        match tint {
            Tint::SpecularReflectance => Some(&self.specular_reflectance),
            Tint::SpecularTransmittance => Some(&self.specular_transmittance),
            _ => None,
        }
    }

    /// Returns the transmission. A face reflects F. Summed over all internal reflections, the pane
    /// reflects R = F + (1 − F)² F/(1 − F²) = 2F/(1 + F).
    pub(super) fn through(&self, site: &Site, cos: f64) -> PartialTransmission {
        let f = fresnel::dielectric(cos.min(1.0), 1.0, self.eta).reflectance;
        PartialTransmission {
            probability: (1.0 - f) / (1.0 + f),
            factor: self.specular_transmittance.at(site),
        }
    }

    /// Samples the reflection of light that does not pass.
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
