//! The opaque part of the "principled" surface (Burley, "Physically Based Shading at Disney", 2012), as
//! Mitsuba's `principled`: a diffuse base, and facets that are dielectric or metallic. Reflects on the side of
//! the normal only.

use super::microfacet::{Distribution, Microfacets};
use super::surface::{above, reflect};
use super::{BsdfError, BsdfSample, Surface, factor, fresnel};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::f64::consts::FRAC_1_PI;

/// Facets are no smoother than this.
const LEAST_ALPHA: f64 = 1e-3;

/// Base colour, roughness, metallic and specular.
///
/// With b the base colour, r the roughness, m the share of metal, α = r², θ_d the angle between a direction and
/// the half vector h, and w(c) = (1 − c)⁵:
///
/// f = (1 − m) b/π [(1 − wₒ/2)(1 − wᵢ/2) + ρ (wₒ + wᵢ + wₒ wᵢ (ρ − 1))], ρ = 2r cos²θ_d,
/// + [(1 − m) F + m (b + (1 − b) w(cos θ_d))] D G/(4 cosθₒ cosθᵢ), D and G those of [`Distribution::Ggx`], F Fresnel's
///   reflectance for the index (2/(1 − √(0.08 `specular`))) − 1.
#[derive(Clone, Debug)]
pub struct Principled {
    base_color: Texture,
    roughness: Texture,
    metallic: Texture,
    eta: f64,
}

/// The parameters at a point.
struct Local {
    base: Spectrum,
    roughness: f64,
    metallic: f64,
    facets: Microfacets,
}

impl Principled {
    /// All parameters lie in [0, 1].
    pub fn new(
        base_color: impl Into<Texture>,
        roughness: impl Into<Texture>,
        metallic: impl Into<Texture>,
        specular: f64,
    ) -> Result<Self, BsdfError> {
        factor("specular", Spectrum::splat(specular))?;
        Ok(Principled {
            base_color: factor("base_color", base_color)?,
            roughness: factor("roughness", roughness)?,
            metallic: factor("metallic", metallic)?,
            eta: 2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0,
        })
    }

    fn local(&self, s: &Surface) -> Local {
        let roughness = self.roughness.number_at(&s.site);
        Local {
            base: self.base_color.at(&s.site),
            roughness,
            metallic: self.metallic.number_at(&s.site),
            facets: Microfacets::at_least(Distribution::Ggx, LEAST_ALPHA, roughness * roughness),
        }
    }

    pub(super) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let (frame, local) = (Frame::from_normal(s.normal), self.local(s));
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        let i = if u < local.share_of_facets() {
            let h = local.facets.sample_visible(o, [v, w]);
            reflect(o, h, o.dot(h)).normalize()
        } else {
            cosine_hemisphere_sample([v, w])
        };
        let direction = frame.to_world(i).normalize();
        let pdf = self.pdf(s, toward, direction);
        (pdf > 0.0).then(|| BsdfSample {
            direction,
            weight: self.eval(s, toward, direction) / pdf,
            pdf,
            delta: false,
            transmitted: false,
        })
    }

    pub(super) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return Spectrum::ZERO;
        };
        let (local, cos) = (self.local(s), o.dot(h).clamp(0.0, 1.0));
        let dielectric = fresnel::dielectric(cos, 1.0, self.eta).reflectance;
        let [facets, diffuse] = [local.metallic, 1.0 - local.metallic];
        let schlick = local.base.map(|b| b + (1.0 - b) * grazing(cos));
        let specular = schlick * facets + Spectrum::splat(diffuse * dielectric);
        let base = local.base * (diffuse * local.diffuse(o.z, i.z, cos) * FRAC_1_PI * i.z);
        base + specular * (local.facets.g1(i) * local.facets.pdf_reflected(o, h))
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return 0.0;
        };
        let local = self.local(s);
        let share = local.share_of_facets();
        share * local.facets.pdf_reflected(o, h) + (1.0 - share) * cosine_hemisphere_pdf(i)
    }
}

impl Local {
    /// Probability with which a facet is sampled rather than the base.
    fn share_of_facets(&self) -> f64 {
        0.5 + 0.5 * self.metallic
    }

    /// π times the base's value over its colour.
    fn diffuse(&self, o: f64, i: f64, cos: f64) -> f64 {
        let (wo, wi) = (grazing(o), grazing(i));
        let back = 2.0 * self.roughness * cos * cos;
        (1.0 - 0.5 * wo) * (1.0 - 0.5 * wi) + back * (wo + wi + wo * wi * (back - 1.0))
    }
}

/// Schlick's weight of grazing angles.
fn grazing(cos: f64) -> f64 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}
