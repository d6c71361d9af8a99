//! Distributions of microfacets (Walter et al. 2007, Heitz 2014): Beckmann and GGX.
//!
//! Vectors are local: z along the macroscopic normal on the side of the viewer, x along the
//! direction of roughness α_u, y along the direction of roughness α_v. Masking and shadowing are
//! Smith's, as the separable product G₁(o)·G₁(i). The model covers single scattering only, so
//! energy that would be reflected between facets is lost.
//!
//! Theory: docs/theory.md#interfaces.

use super::error::factor;
use super::{BsdfError, Surface, beckmann, ggx};
use crate::texture::Texture;
use glam::{DVec2, DVec3};

/// Smallest roughness. Below it, a lobe is narrower than the rounding of its half vector.
pub const MIN_ALPHA: f64 = 1e-4;

/// Distribution of the slopes of facets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Distribution {
    /// Slopes of a Gaussian random surface: `alpha` is √2 times the standard deviation of a slope.
    Beckmann,
    /// Trowbridge–Reitz distribution, with long tails.
    Ggx,
}

/// Facets of a distribution, with a roughness for each of two directions.
#[derive(Clone, Copy, Debug)]
pub struct Microfacets {
    distribution: Distribution,
    alphas: DVec2,
}

impl Microfacets {
    /// Creates facets with roughness `alpha` in all directions, finite and at least [`MIN_ALPHA`].
    ///
    /// # Errors
    /// Fails if `alpha` is smaller or not finite.
    pub fn new(distribution: Distribution, alpha: f64) -> Result<Self, BsdfError> {
        Self::anisotropic(distribution, [alpha; 2])
    }

    /// Creates facets with roughness α_u in x and α_v in y, both finite and at least [`MIN_ALPHA`].
    ///
    /// # Errors
    /// Fails if a roughness is smaller or not finite.
    pub fn anisotropic(distribution: Distribution, alphas: [f64; 2]) -> Result<Self, BsdfError> {
        let refused = |alpha: &f64| !(alpha.is_finite() && *alpha >= MIN_ALPHA);
        match alphas.into_iter().find(refused) {
            Some(value) => Err(BsdfError::Alpha { value }),
            None => Ok(Self::at_least(distribution, MIN_ALPHA, alphas)),
        }
    }

    /// Creates facets with roughness `alphas`, raised to `least` where it is smaller.
    pub(super) fn at_least(distribution: Distribution, least: f64, alphas: [f64; 2]) -> Self {
        Microfacets {
            distribution,
            alphas: DVec2::from(alphas).max(DVec2::splat(least)),
        }
    }

    /// Returns the roughness along and across; both are equal for isotropic facets.
    pub(super) fn alphas(&self) -> [f64; 2] {
        self.alphas.to_array()
    }

    /// Returns (x/y) v_x² + (y/x) v_y²: sin²θ of a unit vector where x = y.
    fn sin2(v: DVec3, [x, y]: [f64; 2]) -> f64 {
        let aspect = x / y;
        aspect * v.x * v.x + v.y * v.y / aspect
    }

    /// Returns D(h): the area of facets of normal `h` (unit, h.z ≥ 0), per steradian and
    /// macroscopic area.
    pub fn d(&self, h: DVec3) -> f64 {
        let [u, v] = self.alphas();
        // Planted error "brushed facets as steep along the grooves as others are across them", found by morgana-transport/transport::bsdf::facets::anisotropic_facets_as_published:
        // let sin2 = Self::sin2(h, [u, v]);
        let sin2 = Self::sin2(h, [v, u]);
        match self.distribution {
            Distribution::Beckmann => beckmann::d([u, v], h.z, sin2),
            Distribution::Ggx => ggx::d([u, v], h.z, sin2),
        }
    }

    /// Returns G₁(v): the visible fraction of the facets that face `v`, on either side of the
    /// surface. The caller must check that the facet in question faces `v`.
    pub fn g1(&self, v: DVec3) -> f64 {
        v.z.abs() * self.g1_over_cos(v)
    }

    /// Returns G₁(v)/|cosθ|, finite at grazing incidence.
    pub(crate) fn g1_over_cos(&self, v: DVec3) -> f64 {
        let mean = (self.alphas.x * self.alphas.y).sqrt();
        let stretched = mean * Self::sin2(v, self.alphas()).sqrt();
        let cos = v.z.abs();
        match self.distribution {
            Distribution::Beckmann => beckmann::g1_over_cos(cos, stretched),
            Distribution::Ggx => ggx::g1_over_cos(cos, stretched),
        }
    }

    /// Returns the density per steradian of the directions that facets reflect towards `o`, with
    /// facet normals sampled by [`Microfacets::sample_visible`]. It is the density of visible
    /// normals, D G₁(o) (o·h)/cosθₒ, times dω_h/dω_i = 1/(4 o·h).
    pub(crate) fn pdf_reflected(&self, o: DVec3, h: DVec3) -> f64 {
        0.25 * self.d(h) * self.g1_over_cos(o)
    }

    /// Samples a facet normal with the density D(h)·G₁(o)·(o·h)/o.z of normals visible from `o`
    /// (o.z > 0). Facets of any roughness are stretched facets of roughness 1 (Heitz and d'Eon
    /// 2014).
    pub fn sample_visible(&self, o: DVec3, u: [f64; 2]) -> DVec3 {
        let o = self.stretched(o);
        self.relaxed(match self.distribution {
            Distribution::Beckmann => beckmann::visible(o, u),
            Distribution::Ggx => ggx::visible(o, u),
        })
    }

    /// Returns the normals that [`Microfacets::sample_visible`] gives for the centres of `points`²
    /// equal squares.
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

    /// Transforms a direction to facets of roughness 1.
    fn stretched(&self, o: DVec3) -> DVec3 {
        (self.alphas * o.truncate()).extend(o.z).normalize()
    }

    /// Transforms a facet normal from roughness 1 back.
    pub(super) fn relaxed(&self, h: DVec3) -> DVec3 {
        (self.alphas * h.truncate()).extend(h.z).normalize()
    }
}

/// Facets with a roughness that may vary over the surface.
#[derive(Clone, Debug)]
pub struct Roughness {
    distribution: Distribution,
    alpha: Texture,
    /// Roughness across the first tangent, if it differs from `alpha` along the tangent.
    across: Option<Texture>,
}

impl Roughness {
    /// Creates isotropic roughness. `alpha` is a number of at least [`MIN_ALPHA`], or a texture
    /// with values in [0, 1]. Texture values below [`MIN_ALPHA`] are raised to it.
    ///
    /// # Errors
    /// Fails if a number is smaller or not finite, or if a texture has other values.
    pub fn new(distribution: Distribution, alpha: impl Into<Texture>) -> Result<Self, BsdfError> {
        Ok(Roughness {
            distribution,
            alpha: checked("alpha", alpha.into())?,
            across: None,
        })
    }

    /// Creates a roughness along ∂x/∂u and a roughness across it on the surface. Both have the
    /// range of [`Roughness::new`].
    ///
    /// # Errors
    /// Fails like [`Roughness::new`].
    pub fn anisotropic(
        distribution: Distribution,
        alpha_u: impl Into<Texture>,
        alpha_v: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        let alpha = checked("alpha_u", alpha_u.into())?;
        let across = checked("alpha_v", alpha_v.into())?;
        let equal = match (&alpha, &across) {
            (Texture::Uniform(u), Texture::Uniform(v)) => u[0] == v[0],
            _ => false,
        };
        Ok(Roughness {
            distribution,
            alpha,
            across: (!equal).then_some(across),
        })
    }

    /// Returns true if the roughness may depend on the direction.
    pub(super) fn is_anisotropic(&self) -> bool {
        self.across.is_some()
    }

    /// Returns the roughness if it is isotropic, as an `outer` surface requires.
    pub(super) fn isotropic(self, outer: &'static str) -> Result<Self, BsdfError> {
        if self.is_anisotropic() {
            Err(BsdfError::Anisotropic { outer })
        } else {
            Ok(self)
        }
    }

    /// Returns the facets at a point.
    pub(super) fn at(&self, s: &Surface) -> Microfacets {
        let alpha = self.alpha.number_at(&s.site);
        let across = self.across.as_ref().map_or(alpha, |t| t.number_at(&s.site));
        Microfacets::at_least(self.distribution, MIN_ALPHA, [alpha, across])
    }

    /// Returns the distribution of the slopes of the facets.
    pub(super) fn distribution(&self) -> Distribution {
        self.distribution
    }

    /// Returns facets of a given isotropic roughness.
    pub(super) fn facets(&self, alpha: f64) -> Microfacets {
        Microfacets::at_least(self.distribution, MIN_ALPHA, [alpha; 2])
    }

    /// Returns the smallest and largest possible roughness of isotropic facets.
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

/// Checks the values of a roughness.
fn checked(name: &'static str, alpha: Texture) -> Result<Texture, BsdfError> {
    if let Texture::Uniform(value) = &alpha {
        Microfacets::new(Distribution::Ggx, value[0])?;
        return Ok(alpha);
    }
    factor(name, alpha)
}
