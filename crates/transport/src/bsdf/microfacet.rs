//! Distributions of microfacets, isotropic (Walter et al. 2007): Beckmann's and GGX.
//!
//! Vectors are local: z along the macroscopic normal on the side of the viewer. Masking and
//! shadowing are Smith's, as the separable product G₁(o)·G₁(i): single scattering, so energy that would
//! bounce between facets is lost.
//!
//! Theory: docs/theory.md#interfaces.

use super::error::factor;
use super::{BsdfError, Surface, beckmann, ggx};
use crate::texture::Texture;
use glam::DVec3;

/// Smallest roughness: below it a lobe is narrower than the rounding of its half vector allows.
pub const MIN_ALPHA: f64 = 1e-4;

/// How the slopes of facets are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// As those of a Gaussian random surface: `alpha` is √2 times the standard deviation of a slope.
    Beckmann,
    /// Trowbridge–Reitz: with long tails.
    Ggx,
}

/// Facets of a distribution and a roughness.
#[derive(Clone, Copy, Debug)]
pub struct Microfacets {
    distribution: Distribution,
    alpha: f64,
}

impl Microfacets {
    /// Facets with roughness `alpha`, finite and at least [`MIN_ALPHA`].
    ///
    /// # Errors
    /// If it is not.
    pub fn new(distribution: Distribution, alpha: f64) -> Result<Self, BsdfError> {
        if alpha.is_finite() && alpha >= MIN_ALPHA {
            Ok(Self::at_least(distribution, MIN_ALPHA, alpha))
        } else {
            Err(BsdfError::Alpha { value: alpha })
        }
    }

    /// Facets with roughness `alpha`, or `least` if that is larger.
    pub(super) fn at_least(distribution: Distribution, least: f64, alpha: f64) -> Self {
        Microfacets {
            distribution,
            alpha: alpha.max(least),
        }
    }

    /// Their roughness.
    pub(super) fn alpha(&self) -> f64 {
        self.alpha
    }

    /// D(h): area of facets of normal `h` (unit, h.z ≥ 0), per steradian and macroscopic area.
    pub fn d(&self, h: DVec3) -> f64 {
        match self.distribution {
            Distribution::Beckmann => beckmann::d(self.alpha, h),
            Distribution::Ggx => ggx::d(self.alpha, h),
        }
    }

    /// G₁(v): visible fraction of the facets that face `v`, on either side of the surface. Whether the
    /// facet in question does face it is for the caller to check.
    pub fn g1(&self, v: DVec3) -> f64 {
        v.z.abs() * self.g1_over_cos(v)
    }

    /// G₁(v)/|cosθ|, finite at grazing incidence.
    pub(crate) fn g1_over_cos(&self, v: DVec3) -> f64 {
        let (cos, stretched) = (v.z.abs(), self.alpha * v.truncate().length());
        match self.distribution {
            Distribution::Beckmann => beckmann::g1_over_cos(cos, stretched),
            Distribution::Ggx => ggx::g1_over_cos(cos, stretched),
        }
    }

    /// Density per steradian of what facets reflect towards `o` whose normals are drawn by
    /// [`Microfacets::sample_visible`]: visible normals D G₁(o) (o·h)/cosθₒ, times dω_h/dω_i = 1/(4 o·h).
    pub(crate) fn pdf_reflected(&self, o: DVec3, h: DVec3) -> f64 {
        0.25 * self.d(h) * self.g1_over_cos(o)
    }

    /// A facet normal with the density of those visible from `o` (o.z > 0), which is
    /// D(h)·G₁(o)·(o·h)/o.z. Facets of any roughness are those of roughness 1, stretched (Heitz and d'Eon 2014).
    pub fn sample_visible(&self, o: DVec3, u: [f64; 2]) -> DVec3 {
        let o = self.stretched(o);
        self.relaxed(match self.distribution {
            Distribution::Beckmann => beckmann::visible(o, u),
            Distribution::Ggx => ggx::visible(o, u),
        })
    }

    /// The normals that [`Microfacets::sample_visible`] makes of the middles of `points`² equal squares.
    pub(super) fn visible_grid(&self, o: DVec3, points: usize) -> Vec<DVec3> {
        let o = self.stretched(o);
        let middles: Vec<f64> = (0..points)
            .map(|k| (k as f64 + 0.5) / points as f64)
            .collect();
        let normals = match self.distribution {
            Distribution::Beckmann => beckmann::visible_grid(o, &middles),
            Distribution::Ggx => {
                let row = |u| middles.iter().map(move |&v| ggx::visible(o, [u, v]));
                middles.iter().flat_map(|&u| row(u)).collect()
            }
        };
        normals.into_iter().map(|h| self.relaxed(h)).collect()
    }

    /// A direction as facets of roughness 1 see it.
    fn stretched(&self, o: DVec3) -> DVec3 {
        DVec3::new(self.alpha * o.x, self.alpha * o.y, o.z).normalize()
    }

    /// The normal here of a facet that has another one at roughness 1.
    fn relaxed(&self, h: DVec3) -> DVec3 {
        (self.alpha * h.truncate()).extend(h.z).normalize()
    }
}

/// Facets with a roughness that may vary over the surface.
#[derive(Clone, Debug)]
pub struct Roughness {
    distribution: Distribution,
    alpha: Texture,
}

impl Roughness {
    /// A number, at least [`MIN_ALPHA`], or a texture with values in [0, 1], of which those below [`MIN_ALPHA`]
    /// count as that.
    ///
    /// # Errors
    /// If a number is less or not finite, or a texture has other values.
    pub fn new(distribution: Distribution, alpha: impl Into<Texture>) -> Result<Self, BsdfError> {
        let mut alpha = alpha.into();
        match &alpha {
            Texture::Uniform(value) => drop(Microfacets::new(distribution, value[0])?),
            _ => alpha = factor("alpha", alpha)?,
        }
        Ok(Roughness {
            distribution,
            alpha,
        })
    }

    /// The facets at a point.
    pub(super) fn at(&self, s: &Surface) -> Microfacets {
        self.facets(self.alpha.number_at(&s.site))
    }

    /// The facets of some roughness.
    pub(super) fn facets(&self, alpha: f64) -> Microfacets {
        Microfacets::at_least(self.distribution, MIN_ALPHA, alpha)
    }

    /// The least and the largest roughness that there can be.
    pub(super) fn range(&self) -> [f64; 2] {
        if let Texture::Uniform(value) = &self.alpha {
            return [value[0]; 2];
        }
        let numbers = || self.alpha.numbers().map(|v| v.max(MIN_ALPHA));
        [
            numbers().fold(1.0, f64::min),
            numbers().fold(MIN_ALPHA, f64::max),
        ]
    }
}
