//! Diffuse base under a rough dielectric coat. It reflects on the side of the normal only.

use super::coat::Coats;
use super::microfacet::Roughness;
use super::plastic::Base;
use super::surface::{above, reflect};
use super::tint::{BsdfEvent, share};
use super::{BsdfError, BsdfSample, Surface, Tint, check_eta, factor, fresnel};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::sync::Arc;

/// Rough plastic. Light that the facets of the coat send to their neighbours is lost: on the way
/// in, out, and back to the base. Mitsuba's `roughplastic` loses it, too. A lossless coat transmits
/// to the base all light that it does not reflect. All light that the base reflects then leaves,
/// possibly after further reflections.
#[derive(Clone, Debug)]
pub struct RoughPlastic {
    eta: f64,
    roughness: Roughness,
    specular_reflectance: Texture,
    base: Base,
    coats: Arc<Coats>,
}

impl RoughPlastic {
    /// Creates the surface. `roughness` must be isotropic. `lossless` applies to the coat. The
    /// other parameters are as for [`super::Plastic::new`].
    ///
    /// # Errors
    /// Fails like [`super::Plastic::new`], or if the roughness is anisotropic.
    pub fn new(
        roughness: Roughness,
        lossless: bool,
        eta: f64,
        diffuse_reflectance: impl Into<Texture>,
        specular_reflectance: impl Into<Texture>,
        nonlinear: bool,
    ) -> Result<Self, BsdfError> {
        check_eta(eta)?;
        let roughness = roughness.isotropic("roughplastic")?;
        Ok(RoughPlastic {
            eta,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
            base: Base::new(eta, diffuse_reflectance, nonlinear)?,
            coats: Arc::new(Coats::new(eta, &roughness, lossless)),
            roughness,
        })
    }

    pub(super) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let frame = Frame::from_normal(s.normal);
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        let facets = self.roughness.at(s);
        let i = if u < self.coats.at(&facets).passes(o.z) {
            cosine_hemisphere_sample([v, w])
        } else {
            let h = facets.sample_visible(o, [v, w]);
            reflect(o, h, o.dot(h)).normalize()
        };
        let direction = frame.to_world(i).normalize();
        let pdf = self.pdf(s, toward, direction);
        let value = || self.eval(s, toward, direction);
        BsdfSample::reflected(direction, pdf, value)
    }

    /// Returns the colour `tint`.
    pub(super) fn tint(&self, tint: Tint) -> Option<&Texture> {
        match tint {
            Tint::DiffuseReflectance => Some(&self.base.reflectance),
            Tint::SpecularReflectance => Some(&self.specular_reflectance),
            _ => None,
        }
    }

    pub(super) fn albedo(&self, s: &Surface) -> Spectrum {
        self.base.reflectance.at(&s.site)
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let [specular, base] = self.parts(s, toward, direction);
        specular + base
    }

    /// Returns the light scattered by the coat and by the base.
    fn parts(&self, s: &Surface, toward: DVec3, direction: DVec3) -> [Spectrum; 2] {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return [Spectrum::ZERO; 2];
        };
        let f = fresnel::dielectric(o.dot(h).clamp(0.0, 1.0), 1.0, self.eta).reflectance;
        let facets = self.roughness.at(s);
        let coat = self.coats.at(&facets);
        let specular = f * facets.g1(i) * facets.pdf_reflected(o, h);
        let base = coat.passes(o.z) * coat.passes(i.z) * cosine_hemisphere_pdf(i);
        [
            self.specular_reflectance.at(&s.site) * specular,
            self.base.value(s, coat.returned()) * base,
        ]
    }

    pub(super) fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let [specular, base] = self.parts(s, event.toward, event.direction);
        match tint {
            Tint::SpecularReflectance => share(
                specular,
                (specular + base) * self.specular_reflectance.at(&s.site),
            ),
            _ => {
                let back = self.coats.at(&self.roughness.at(s)).returned();
                share(base, specular + base) * self.base.derivative(s, back)
            }
        }
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return 0.0;
        };
        let facets = self.roughness.at(s);
        let passes = self.coats.at(&facets).passes(o.z);
        (1.0 - passes) * facets.pdf_reflected(o, h) + passes * cosine_hemisphere_pdf(i)
    }
}
