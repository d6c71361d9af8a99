//! Rough metal. It reflects on the side of the normal only; the other side is black.

use super::conductor::Metal;
use super::microfacet::Roughness;
use super::surface::{above, reflect};
use super::{BsdfError, BsdfSample, Surface};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Rough conductor, sampled by visible facet normals.
#[derive(Clone, Debug)]
pub struct RoughConductor {
    roughness: Roughness,
    metal: Metal,
}

impl RoughConductor {
    /// Creates the conductor. `eta` + i`k` is the index of the metal relative to vacuum, both parts
    /// ≥ 0. `specular_reflectance` in [0, 1] tints it; its physical value is 1.
    ///
    /// # Errors
    /// Fails if a part of the index is negative or not finite, or if the reflectance lies outside
    /// [0, 1].
    pub fn new(
        roughness: Roughness,
        eta: Spectrum,
        k: Spectrum,
        specular_reflectance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        let metal = Metal::new(eta, k, specular_reflectance)?;
        Ok(RoughConductor { roughness, metal })
    }

    pub(super) fn metal(&self) -> &Metal {
        &self.metal
    }

    pub(super) fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }

    pub(super) fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        let frame = s.frame();
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        let facets = self.roughness.at(s);
        let h = facets.sample_visible(o, [u[1], u[2]]);
        let cos = o.dot(h);
        let i = reflect(o, h, cos).normalize();
        if cos <= 0.0 || i.z <= 0.0 {
            return None;
        }
        Some(BsdfSample {
            direction: frame.to_world(i).normalize(),
            weight: self.metal.reflectance(cos, s) * facets.g1(i),
            pdf: facets.pdf_reflected(o, h),
            delta: false,
            transmitted: false,
        })
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return Spectrum::ZERO;
        };
        // The value is F D G₁(o) G₁(i)/(4 cosθₒ cosθᵢ), times cosθᵢ.
        let facets = self.roughness.at(s);
        self.metal.reflectance(o.dot(h), s) * (facets.g1(i) * facets.pdf_reflected(o, h))
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        above(s, toward, direction)
            .map_or(0.0, |[o, _, h]| self.roughness.at(s).pdf_reflected(o, h))
    }
}
