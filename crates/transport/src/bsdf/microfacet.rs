//! The GGX distribution of microfacets, isotropic (Walter et al. 2007).
//!
//! Vectors are local: z along the macroscopic normal on the side of the viewer. Masking and
//! shadowing are Smith's, as the separable product G₁(o)·G₁(i): single scattering, so energy that would
//! bounce between facets is lost.

use super::error::factor;
use super::{BsdfError, Surface};
use crate::texture::Texture;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Smallest roughness: below it a lobe is narrower than the rounding of its half vector allows.
pub const MIN_ALPHA: f64 = 1e-4;

/// GGX with roughness `alpha`.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    alpha: f64,
}

impl Ggx {
    /// `alpha` finite and at least [`MIN_ALPHA`].
    pub fn new(alpha: f64) -> Result<Self, BsdfError> {
        if alpha.is_finite() && alpha >= MIN_ALPHA {
            Ok(Ggx { alpha })
        } else {
            Err(BsdfError::Alpha { value: alpha })
        }
    }

    /// GGX with roughness `alpha`, or `least` if that is larger.
    pub(super) fn at_least(least: f64, alpha: f64) -> Self {
        Ggx {
            alpha: alpha.max(least),
        }
    }

    /// Its roughness.
    pub(super) fn alpha(&self) -> f64 {
        self.alpha
    }

    /// D(h): area of facets of normal `h` (unit, h.z ≥ 0), per steradian and macroscopic area.
    pub fn d(&self, h: DVec3) -> f64 {
        // cos⁴θ (α² + tan²θ)² without the tangent.
        let base = h.truncate().length_squared() / (self.alpha * self.alpha) + h.z * h.z;
        1.0 / (PI * self.alpha * self.alpha * base * base)
    }

    /// G₁(v): visible fraction of the facets that face `v`, on either side of the surface. Whether the
    /// facet in question does face it is for the caller to check.
    pub fn g1(&self, v: DVec3) -> f64 {
        v.z.abs() * self.g1_over_cos(v)
    }

    /// G₁(v)/|cosθ|, finite at grazing incidence.
    pub fn g1_over_cos(&self, v: DVec3) -> f64 {
        let slope = self.alpha * self.alpha * v.truncate().length_squared();
        2.0 / (v.z.abs() + (v.z * v.z + slope).sqrt())
    }

    /// Density per steradian of what facets reflect towards `o` whose normals are drawn by
    /// [`Ggx::sample_visible`]: visible normals D G₁(o) (o·h)/cosθₒ, times dω_h/dω_i = 1/(4 o·h).
    pub fn pdf_reflected(&self, o: DVec3, h: DVec3) -> f64 {
        0.25 * self.d(h) * self.g1_over_cos(o)
    }

    /// A facet normal with the density of those visible from `o` (o.z > 0), which is
    /// D(h)·G₁(o)·(o·h)/o.z. Spherical caps (Dupuy and Benyoub 2023): stretched to α = 1, a visible
    /// normal is the half vector of `o` and a uniform direction of the cap above −o.z.
    pub fn sample_visible(&self, o: DVec3, u: [f64; 2]) -> DVec3 {
        let o = DVec3::new(self.alpha * o.x, self.alpha * o.y, o.z).normalize();
        let height = (1.0 - u[1]) * (1.0 + o.z);
        let z = height - o.z;
        let sin = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let across = sin * DVec2::from_angle(TAU * u[0]) + o.truncate();
        (self.alpha * across).extend(height).normalize()
    }
}

/// GGX with a roughness that may vary over the surface.
#[derive(Clone, Debug)]
pub(super) struct Roughness(Texture);

impl Roughness {
    /// A number, at least [`MIN_ALPHA`], or a texture with values in [0, 1], of which those below [`MIN_ALPHA`]
    /// count as that.
    pub fn new(alpha: impl Into<Texture>) -> Result<Self, BsdfError> {
        let alpha = alpha.into();
        if let Texture::Uniform(value) = &alpha {
            Ggx::new(value[0])?;
            return Ok(Roughness(alpha));
        }
        factor("alpha", alpha).map(Roughness)
    }

    /// The distribution at a point.
    pub fn at(&self, s: &Surface) -> Ggx {
        Ggx::at_least(MIN_ALPHA, self.0.number_at(&s.site))
    }

    /// The least and the largest roughness that there can be.
    pub fn range(&self) -> [f64; 2] {
        if let Texture::Uniform(value) = &self.0 {
            return [value[0]; 2];
        }
        let numbers = || self.0.numbers().map(|v| v.max(MIN_ALPHA));
        [
            numbers().fold(1.0, f64::min),
            numbers().fold(MIN_ALPHA, f64::max),
        ]
    }
}
