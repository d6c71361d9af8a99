//! Smooth metal. It reflects on the side of the normal only; the other side is black.

use super::surface::reflect;
use super::{BsdfError, BsdfSample, Surface, check_index, factor, fresnel};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use num_complex::Complex64;

/// Smooth conductor.
#[derive(Clone, Debug)]
pub struct Conductor {
    metal: Metal,
}

/// Complex index and tint of a metal, shared by smooth and rough conductors.
#[derive(Clone, Debug)]
pub(super) struct Metal {
    eta: Spectrum,
    k: Spectrum,
    specular_reflectance: Texture,
}

impl Metal {
    pub(super) fn new(
        eta: Spectrum,
        k: Spectrum,
        specular_reflectance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        check_index("eta", eta)?;
        check_index("k", k)?;
        Ok(Metal {
            eta,
            k,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
        })
    }

    pub(super) fn specular_reflectance(&self) -> &Texture {
        &self.specular_reflectance
    }

    /// Returns the complex index relative to the medium outside.
    pub(super) fn relative_index(&self, s: &Surface, channel: usize) -> Complex64 {
        Complex64::new(self.eta[channel], self.k[channel]) / s.n_outer
    }

    /// Returns the tinted reflectance under the medium outside, which depends on the ratio of the
    /// indices.
    pub(super) fn reflectance(&self, cos: f64, s: &Surface) -> Spectrum {
        let n = s.n_outer;
        let fresnel = self
            .eta
            .zip(self.k, |eta, k| fresnel::conductor(cos, eta / n, k / n));
        fresnel * self.specular_reflectance.at(&s.site)
    }
}

impl Conductor {
    /// Creates the conductor. `eta` + i`k` is the index of the metal relative to vacuum, both parts
    /// ≥ 0. `specular_reflectance` in [0, 1] tints it; its physical value is 1.
    ///
    /// # Errors
    /// Fails if a part of the index is negative or not finite, or if the reflectance lies outside
    /// [0, 1].
    pub fn new(
        eta: Spectrum,
        k: Spectrum,
        specular_reflectance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        Metal::new(eta, k, specular_reflectance).map(|metal| Conductor { metal })
    }

    pub(super) fn metal(&self) -> &Metal {
        &self.metal
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3) -> Option<BsdfSample> {
        let cos = s.normal.dot(toward);
        (cos > 0.0).then(|| BsdfSample {
            direction: reflect(toward, s.normal, cos).normalize(),
            weight: self.metal.reflectance(cos, s),
            pdf: 1.0,
            delta: true,
            transmitted: false,
        })
    }
}
