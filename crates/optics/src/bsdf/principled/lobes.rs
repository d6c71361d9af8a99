//! Lobes that `principled` and `principledthin` share (Burley 2012 and 2015).

use crate::bsdf::microfacet::{Distribution, Microfacets};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;
use std::f64::consts::{FRAC_1_PI, PI};

/// Smallest roughness of the facets.
const MIN_ALPHA: f64 = 1e-3;
/// Difference from 1 of the squared ratio of the smaller roughness to the larger, at full
/// anisotropy.
const ANISOTROPY: f64 = 0.9;

/// Creates the facets of a roughness r: α_u = r²/a along ∂x/∂u, α_v = r² a across, with a² = 1 −
/// 0.9 `anisotropic`.
pub(super) fn facets(roughness: f64, anisotropic: f64) -> Microfacets {
    let (alpha, aspect) = (
        roughness * roughness,
        (1.0 - ANISOTROPY * anisotropic).sqrt(),
    );
    Microfacets::at_least(
        Distribution::Ggx,
        MIN_ALPHA,
        [alpha / aspect, alpha * aspect],
    )
}

/// Returns Schlick's weight (1 − cosθ)⁵ of grazing angles.
pub(super) fn grazing(cos: f64) -> f64 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// Returns the weight of Schlick's approximation for a facet at cosine `cos` from outside. `eta` is
/// the index inside relative to the outside.
pub(super) fn schlick_weight(cos: f64, eta: f64) -> f64 {
    if eta > 1.0 {
        return grazing(cos);
    }
    // Use the angle on the side of the smaller index.
    let cos2 = 1.0 - (1.0 - cos * cos) / (eta * eta);
    grazing(cos2.max(0.0).sqrt())
}

/// Returns Schlick's reflectance, from the reflectance at normal incidence and a weight.
pub(super) fn schlick(normal: f64, weight: f64) -> f64 {
    normal + (1.0 - normal) * weight
}

/// Returns a colour over its luminance; white if the luminance is 0.
pub(super) fn tint(base: Spectrum, luminance: f64) -> Spectrum {
    if luminance > 0.0 {
        base / luminance
    } else {
        Spectrum::ONE
    }
}

/// Returns true if neither the facets nor the sheen have a fraction of the base's [tint].
pub(super) fn is_untinted([spec_tint, sheen, sheen_tint]: [&Texture; 3]) -> bool {
    let is_zero = |texture: &Texture| texture.numbers().all(|v| v == 0.0);
    is_zero(spec_tint) && (is_zero(sheen) || is_zero(sheen_tint))
}

/// Diffuse base at a point.
pub(super) struct Base {
    pub colour: Spectrum,
    pub roughness: f64,
    /// Fraction that approximates subsurface scattering.
    pub flatness: f64,
    /// Sheen, including its colour.
    pub sheen: Spectrum,
}

impl Base {
    /// Returns f cosθᵢ of `share` times the base plus `sheen_share` times the sheen.
    pub(super) fn value(&self, [o, i, h]: &[DVec3; 3], share: f64, sheen_share: f64) -> Spectrum {
        let cos = o.dot(*h).clamp(0.0, 1.0);
        let base = self.colour * (share * self.diffuse(o.z, i.z, cos) * FRAC_1_PI * i.z);
        base + self.sheen * (sheen_share * grazing(cos) * i.z)
    }

    /// Returns π times the value of the base, over its colour.
    fn diffuse(&self, o: f64, i: f64, cos: f64) -> f64 {
        let (wo, wi) = (grazing(o), grazing(i));
        let back = 2.0 * self.roughness * cos * cos;
        let retro = back * (wo + wi + wo * wi * (back - 1.0));
        let plain = (1.0 - 0.5 * wo) * (1.0 - 0.5 * wi) + retro;
        if self.flatness == 0.0 {
            return plain;
        }
        let towards = |w: f64| 1.0 + (0.5 * back - 1.0) * w;
        let flat = 1.25 * (towards(wo) * towards(wi) * (1.0 / (o + i) - 0.5) + 0.5);
        plain + (flat - plain) * self.flatness
    }
}

/// Facets of the clear coat, with the GTR distribution of exponent 1.
pub(super) struct ClearCoat {
    alpha2: f64,
}

/// Roughness of a clear coat without gloss, and of a clear coat with full gloss.
const COAT_ALPHAS: [f64; 2] = [0.1, 0.001];
/// Roughness for the masking of clear coats.
const COAT_MASKING: f64 = 0.25;
/// Reflectance of clear coats at normal incidence.
const COAT_REFLECTANCE: f64 = 0.04;

impl ClearCoat {
    pub(super) fn new(gloss: f64) -> Self {
        let alpha = COAT_ALPHAS[0] + (COAT_ALPHAS[1] - COAT_ALPHAS[0]) * gloss;
        ClearCoat {
            alpha2: alpha * alpha,
        }
    }

    /// Returns the area of facets per steradian.
    fn d(&self, h: DVec3) -> f64 {
        let a = self.alpha2;
        // Evaluate 1 + (α² − 1) cos² without cancellation.
        let base = h.truncate().length_squared() + a * h.z * h.z;
        (a - 1.0) / (PI * a.ln() * base)
    }

    /// Samples a normal with density D cosθ.
    pub(super) fn sample(&self, [u, v]: [f64; 2]) -> DVec3 {
        let cos2 = ((1.0 - self.alpha2.powf(1.0 - v)) / (1.0 - self.alpha2)).clamp(0.0, 1.0);
        let (sin, cos) = (u * 2.0 * PI).sin_cos();
        (glam::DVec2::new(cos, sin) * (1.0 - cos2).sqrt()).extend(cos2.sqrt())
    }

    /// Returns the density of directions that the sampled normals reflect towards `o`.
    pub(super) fn pdf(&self, o: DVec3, h: DVec3) -> f64 {
        self.d(h) * h.z / (4.0 * o.dot(h)).max(1e-300)
    }

    /// Returns f cosθᵢ of a coat with weight 1.
    pub(super) fn value(&self, [o, i, h]: &[DVec3; 3], eta: f64) -> f64 {
        let weight = schlick_weight(o.dot(*h).clamp(0.0, 1.0), eta);
        let fresnel = schlick(COAT_REFLECTANCE, weight);
        let masking = |v: &DVec3| {
            let stretched = COAT_MASKING * v.truncate().length();
            2.0 * v.z / (v.z + v.z.hypot(stretched))
        };
        fresnel * self.d(*h) * masking(o) * masking(i) * i.z
    }
}
