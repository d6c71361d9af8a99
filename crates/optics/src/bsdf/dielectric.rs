//! Smooth interface between two dielectrics, with the local indices of the two sides.

use super::surface::{reflect, refract};
use super::{BsdfError, BsdfSample, Surface, Tint, factor, fresnel};
use crate::spectrum::Spectrum;
use glam::DVec3;

/// Smooth dielectric: reflects with probability F, transmits with 1 − F.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    specular_reflectance: Spectrum,
    specular_transmittance: Spectrum,
}

impl Default for Dielectric {
    fn default() -> Self {
        Dielectric {
            specular_reflectance: Spectrum::ONE,
            specular_transmittance: Spectrum::ONE,
        }
    }
}

impl Dielectric {
    /// Creates an interface with factors in [0, 1] for reflection and transmission. Physically,
    /// both are 1 ([`Dielectric::default`]).
    ///
    /// # Errors
    /// Fails if a factor lies outside [0, 1].
    pub fn new(
        specular_reflectance: Spectrum,
        specular_transmittance: Spectrum,
    ) -> Result<Self, BsdfError> {
        factor("specular_reflectance", specular_reflectance)?;
        factor("specular_transmittance", specular_transmittance)?;
        Ok(Dielectric {
            specular_reflectance,
            specular_transmittance,
        })
    }

    /// Returns the colour `tint`.
    pub(super) fn tint(&self, tint: Tint) -> Option<Spectrum> {
        match tint {
            Tint::SpecularReflectance => Some(self.specular_reflectance),
            Tint::SpecularTransmittance => Some(self.specular_transmittance),
            _ => None,
        }
    }

    /// Returns true if the interface preserves the power of light in the first `channels` channels.
    pub fn is_clear(&self, channels: usize) -> bool {
        let transmits = &self.specular_transmittance.0[..channels];
        self.reflects_all(channels) && transmits.iter().all(|f| *f == 1.0)
    }

    /// Returns true if the reflectance factor is 1 in the first `channels` channels.
    pub fn reflects_all(&self, channels: usize) -> bool {
        self.specular_reflectance.0[..channels]
            .iter()
            .all(|f| *f == 1.0)
    }

    /// Samples reflection or transmission. If the indices are equal, nothing is reflected and
    /// `direction` is exactly −`toward`.
    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: f64) -> BsdfSample {
        let side = s.facing(toward);
        let cos = side.normal.dot(toward).min(1.0);
        let interface = fresnel::dielectric(cos, side.n_near, side.n_far);
        let f = interface.reflectance;
        if u < f {
            return BsdfSample {
                direction: reflect(toward, side.normal, cos).normalize(),
                weight: self.specular_reflectance,
                pdf: f,
                delta: true,
                transmitted: false,
            };
        }
        let eta = side.n_near / side.n_far;
        let direction = if eta == 1.0 {
            -toward
        } else {
            refract(toward, side.normal, cos, interface.cos_far, eta).normalize()
        };
        BsdfSample {
            direction,
            // The weight is (1 − F) L̃ᵢ/(1 − F): basic radiance crosses without the factor η².
            weight: self.specular_transmittance,
            pdf: 1.0 - f,
            delta: true,
            transmitted: true,
        }
    }

    /// Returns the factor of a connection that the interface transmits or reflects, and the
    /// probability with which [`Bsdf::sample`](super::Bsdf::sample) chooses the same event. The
    /// factor does not include this probability. `cos` is the cosine of the angle of incidence.
    pub fn crossing(
        &self,
        cos: f64,
        n_near: f64,
        n_far: f64,
        transmitted: bool,
    ) -> (Spectrum, f64) {
        let f = fresnel::dielectric(cos.min(1.0), n_near, n_far).reflectance;
        if transmitted {
            // Planted error "share of a transmission not in its contribution", found by morgana-transport/transport::slabs::mcml_mismatched_half_space:
            // (self.specular_transmittance, 1.0)
            (self.specular_transmittance, 1.0 - f)
        } else {
            (self.specular_reflectance, f)
        }
    }
}
