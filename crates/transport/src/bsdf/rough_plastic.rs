//! A diffuse base under a rough coat of a dielectric (GGX); reflects on the side of the normal only.

use super::microfacet::Ggx;
use super::plastic::Base;
use super::surface::{above, reflect};
use super::{BsdfError, BsdfSample, Surface, check_eta, factor, fresnel};
use crate::sampling::Frame;
use crate::sampling::sphere::{cosine_hemisphere_pdf, cosine_hemisphere_sample};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::sync::Arc;

/// Rough plastic: what the coat does not reflect reaches the base, and what the base returns comes out, now or
/// later. (Mitsuba's `roughplastic` loses what facets reflect into each other's shadows below the coat.)
#[derive(Clone, Debug)]
pub struct RoughPlastic {
    eta: f64,
    facets: Ggx,
    specular_reflectance: Texture,
    base: Base,
    /// What the coat does not reflect, at cosines spread evenly over [0, 1].
    transmittance: Arc<[f64]>,
}

/// Cosines at which the coat's reflectance is integrated, and points along each of the two numbers from which
/// facets are drawn.
const COSINES: usize = 65;
const POINTS: usize = 64;

impl RoughPlastic {
    /// `alpha` ≥ [`super::microfacet::MIN_ALPHA`]; the rest as for [`super::Plastic::new`].
    pub fn new(
        alpha: f64,
        eta: f64,
        diffuse_reflectance: impl Into<Texture>,
        specular_reflectance: impl Into<Texture>,
        nonlinear: bool,
    ) -> Result<Self, BsdfError> {
        check_eta(eta)?;
        let facets = Ggx::new(alpha)?;
        let cosines = (0..COSINES).map(|k| k as f64 / (COSINES - 1) as f64);
        let transmittance: Arc<[f64]> = cosines
            .map(|cos| transmittance(&facets, eta, cos))
            .collect();
        // By reciprocity: as much light comes out of the coat as would go in, over η².
        let from_below = 1.0 - mean(&transmittance) / (eta * eta);
        Ok(RoughPlastic {
            eta,
            facets,
            specular_reflectance: factor("specular_reflectance", specular_reflectance)?,
            base: Base::new(eta, from_below, diffuse_reflectance, nonlinear)?,
            transmittance,
        })
    }

    /// Linear between the cosines of the table.
    fn passes(&self, cos: f64) -> f64 {
        let x = cos.clamp(0.0, 1.0) * (COSINES - 1) as f64;
        let i = (x as usize).min(COSINES - 2);
        let [a, b] = [self.transmittance[i], self.transmittance[i + 1]];
        a + (b - a) * (x - i as f64)
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
        let i = match u < self.passes(o.z) {
            true => cosine_hemisphere_sample([v, w]),
            false => {
                let h = self.facets.sample_visible(o, [v, w]);
                reflect(o, h, o.dot(h)).normalize()
            }
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
        let f = fresnel::dielectric(o.dot(h).clamp(0.0, 1.0), 1.0, self.eta).reflectance;
        let coat = f * self.facets.g1(i) * self.density(o, h);
        let base = self.passes(o.z) * self.passes(i.z) * cosine_hemisphere_pdf(i);
        self.specular_reflectance.at(&s.site) * coat + self.base.value(s) * base
    }

    pub(super) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let Some([o, i, h]) = above(s, toward, direction) else {
            return 0.0;
        };
        let passes = self.passes(o.z);
        (1.0 - passes) * self.density(o, h) + passes * cosine_hemisphere_pdf(i)
    }

    /// Visible normals D G₁(o) (o·h)/cosθₒ, times dω_h/dω_i = 1/(4 o·h).
    fn density(&self, o: DVec3, h: DVec3) -> f64 {
        0.25 * self.facets.d(h) * self.facets.g1_over_cos(o)
    }
}

/// One less the mean of F G₁(i) over the facets that are visible at a cosine.
fn transmittance(facets: &Ggx, eta: f64, cos: f64) -> f64 {
    // From the horizon itself no facet would be seen.
    let cos = cos.max(1e-4);
    let o = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let at = |k: usize| (k as f64 + 0.5) / POINTS as f64;
    let reflected = |k: usize| {
        let h = facets.sample_visible(o, [at(k % POINTS), at(k / POINTS)]);
        let i = reflect(o, h, o.dot(h));
        let f = fresnel::dielectric(o.dot(h).clamp(0.0, 1.0), 1.0, eta).reflectance;
        if i.z > 0.0 { f * facets.g1(i) } else { 0.0 }
    };
    let all = POINTS * POINTS;
    1.0 - (0..all).map(reflected).sum::<f64>() / all as f64
}

/// 2∫T cosθ d(cosθ) of the table, linear between its cosines.
fn mean(table: &[f64]) -> f64 {
    let h = 1.0 / (table.len() - 1) as f64;
    let cell = |(k, pair): (usize, &[f64])| {
        let (low, rise) = (k as f64 * h, pair[1] - pair[0]);
        // ∫₀¹ (a + rise t)(low + h t) dt
        pair[0] * (low + 0.5 * h) + rise * (0.5 * low + h / 3.0)
    };
    2.0 * h * table.windows(2).enumerate().map(cell).sum::<f64>()
}
