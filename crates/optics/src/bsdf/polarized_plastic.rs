//! Mitsuba's `pplastic` for scalar renders (Baek et al. 2018). It reflects on the side of the
//! normal only.

use super::microfacet::Roughness;
use super::surface::{above, reflect};
use super::tint::{BsdfEvent, share};
use super::{BsdfError, BsdfSample, Surface, Tint, check_eta, factor, fresnel};
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Facets over a diffuse base, which light reaches and leaves through a smooth interface. With the
/// Fresnel reflectance F, f = F D G/(4 cosθₒ cosθᵢ) + (1 − F(θₒ)) (1 − F(θᵢ)) ρ/π. Light that the
/// interface reflects back to the base is lost.
#[derive(Clone, Debug)]
pub struct PolarizedPlastic {
    eta: f64,
    roughness: Roughness,
    diffuse_reflectance: Texture,
    specular_reflectance: Texture,
}

impl PolarizedPlastic {
    /// Creates the surface. `eta` is the index inside relative to the outside; the reflectances lie
    /// in [0, 1].
    ///
    /// # Errors
    /// Fails if the index is not positive and finite, or if a reflectance lies outside [0, 1].
    pub fn new(
        roughness: Roughness,
        eta: f64,
        diffuse_reflectance: impl Into<Texture>,
        specular_reflectance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        check_eta(eta)?;
        Ok(PolarizedPlastic {
            eta,
            roughness,
            diffuse_reflectance: factor("diffuse_reflectance", diffuse_reflectance)?,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
        })
    }

    /// Returns the colour `tint`.
    pub(super) fn tint(&self, tint: Tint) -> Option<&Texture> {
        match tint {
            Tint::DiffuseReflectance => Some(&self.diffuse_reflectance),
            Tint::SpecularReflectance => Some(&self.specular_reflectance),
            _ => None,
        }
    }

    pub(super) fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }

    /// Returns the probability of sampling the base.
    fn share_of_base(&self, s: &Surface) -> f64 {
        let base = self.diffuse_reflectance.at(&s.site).max();
        base / (1.0 + base)
    }

    fn reflectance(&self, cos: f64) -> f64 {
        fresnel::dielectric(cos.clamp(0.0, 1.0), 1.0, self.eta).reflectance
    }

    pub(super) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let frame = s.frame();
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        let i = if u < self.share_of_base(s) {
            cosine_hemisphere_sample([v, w])
        } else {
            let h = self.roughness.at(s).sample_visible(o, [v, w]);
            reflect(o, h, o.dot(h)).normalize()
        };
        let direction = frame.to_world(i).normalize();
        let pdf = self.pdf(s, toward, direction);
        let value = || self.eval(s, toward, direction);
        BsdfSample::reflected(direction, pdf, value)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let [specular, base] = self.parts(s, toward, direction);
        specular + base
    }

    /// Returns the light scattered by the facets and by the base.
    fn parts(&self, s: &Surface, toward: DVec3, direction: DVec3) -> [Spectrum; 2] {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return [Spectrum::ZERO; 2];
        };
        let facets = self.roughness.at(s);
        let specular = self.reflectance(o.dot(h)) * facets.g1(i) * facets.pdf_reflected(o, h);
        let [enters, leaves] = [i.z, o.z].map(|cos| 1.0 - self.reflectance(cos));
        [
            self.specular_reflectance.at(&s.site) * specular,
            self.diffuse_reflectance.at(&s.site) * (enters * leaves * cosine_hemisphere_pdf(i)),
        ]
    }

    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let [specular, base] = self.parts(s, event.toward, event.direction);
        let (part, colour) = match tint {
            Tint::SpecularReflectance => (specular, &self.specular_reflectance),
            _ => (base, &self.diffuse_reflectance),
        };
        share(part, (specular + base) * colour.at(&s.site))
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return 0.0;
        };
        let base = self.share_of_base(s);
        (1.0 - base) * self.roughness.at(s).pdf_reflected(o, h) + base * cosine_hemisphere_pdf(i)
    }
}
