//! Smooth metal; reflects on the side of the normal only, the other side is black.

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

/// Complex index and tint of a metal, shared by the smooth and the rough one.
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

    /// Complex index relative to that of the medium outside.
    pub(super) fn relative_index(&self, s: &Surface, channel: usize) -> Complex64 {
        Complex64::new(self.eta[channel], self.k[channel]) / s.n_outer
    }

    /// Tinted reflectance under the medium outside: only the ratio to its index matters.
    pub(super) fn reflectance(&self, cos: f64, s: &Surface) -> Spectrum {
        let n = s.n_outer;
        let fresnel = self
            .eta
            .zip(self.k, |eta, k| fresnel::conductor(cos, eta / n, k / n));
        fresnel * self.specular_reflectance.at(&s.site)
    }
}

impl Conductor {
    /// `eta` + i`k` is the metal's index against vacuum, both parts ≥ 0; `specular_reflectance` in
    /// [0, 1] tints it, physically 1.
    ///
    /// # Errors
    /// A part of the index that is negative or not finite; a reflectance outside [0, 1].
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
