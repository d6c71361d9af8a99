//! Smooth metal; reflects on the side of the normal only, the other side is black.

use super::surface::reflect;
use super::{BsdfError, BsdfSample, Surface, check_factor, check_index, fresnel};
use crate::spectrum::Spectrum;
use glam::DVec3;

/// Smooth conductor.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    metal: Metal,
}

/// Complex index and tint of a metal, shared by the smooth and the rough one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Metal {
    eta: Spectrum,
    k: Spectrum,
    specular_reflectance: Spectrum,
}

impl Metal {
    pub(super) fn new(
        eta: Spectrum,
        k: Spectrum,
        specular_reflectance: Spectrum,
    ) -> Result<Self, BsdfError> {
        check_index("eta", eta)?;
        check_index("k", k)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        Ok(Metal {
            eta,
            k,
            specular_reflectance,
        })
    }

    /// Tinted reflectance under the medium of index `n`: only the ratio to it matters.
    pub(super) fn reflectance(&self, cos: f64, n: f64) -> Spectrum {
        let fresnel = self
            .eta
            .zip(self.k, |eta, k| fresnel::conductor(cos, eta / n, k / n));
        fresnel * self.specular_reflectance
    }
}

impl Conductor {
    /// `eta` + i`k` is the metal's index against vacuum, both parts ≥ 0; `specular_reflectance` in
    /// [0, 1] tints it, physically 1.
    pub fn new(
        eta: Spectrum,
        k: Spectrum,
        specular_reflectance: Spectrum,
    ) -> Result<Self, BsdfError> {
        Metal::new(eta, k, specular_reflectance).map(|metal| Conductor { metal })
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3) -> Option<BsdfSample> {
        let cos = s.normal.dot(toward);
        (cos > 0.0).then(|| BsdfSample {
            direction: reflect(toward, s.normal, cos).normalize(),
            weight: self.metal.reflectance(cos, s.n_outer),
            pdf: 1.0,
            delta: true,
            transmitted: false,
        })
    }
}
