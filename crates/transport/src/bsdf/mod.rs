//! Scattering at surfaces.
//!
//! **Directions** are unit vectors in world space that point away from the surface. `toward` leads to
//! where the path came from (radiance leaves along it), `direction` to where the light comes from.
//! Subscripts in the comments: o is the side of `toward`, i the side of `direction`.
//!
//! **Basic radiance.** Estimators transport L̃ = L/n² (theory §2), so values are
//! f̃ = f·nᵢ²/nₒ²: a smooth transmission has weight 1, without η². κ = f̃/nᵢ² is symmetric in the two
//! directions, so radiance and importance use the same code. The one exception is a null boundary
//! whose indices differ, see [`null`].
//!
//! Unit vectors in, finite numbers out: grazing directions included, nothing here returns NaN.

mod conductor;
mod dielectric;
mod diffuse;
pub mod fresnel;
pub mod microfacet;
pub mod null;
mod rough_conductor;
mod rough_dielectric;
mod surface;

pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use surface::Surface;

use crate::spectrum::Spectrum;
use glam::DVec3;

/// Why a BSDF cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BsdfError {
    /// A reflectance or transmittance outside [0, 1].
    #[error("{name} must lie in [0, 1] in every channel, got {value}")]
    Factor {
        /// Which parameter.
        name: &'static str,
        /// First offending channel.
        value: f64,
    },
    /// A roughness that the microfacet model cannot take.
    #[error("alpha must be finite and at least {min}, got {value}", min = microfacet::MIN_ALPHA)]
    Alpha {
        /// The roughness given.
        value: f64,
    },
    /// A complex index with a part that is negative or not finite.
    #[error("{name} must be finite and ≥ 0 in every channel, got {value}")]
    Index {
        /// Which part, `eta` or `k`.
        name: &'static str,
        /// First offending channel.
        value: f64,
    },
}

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit vector towards where the light comes from.
    pub direction: DVec3,
    /// f̃·|cosθ| / pdf.
    pub weight: Spectrum,
    /// Density per steradian, > 0; for a delta event its discrete probability.
    pub pdf: f64,
    /// Whether this is a delta event, for which `eval` and `pdf` are zero.
    pub delta: bool,
    /// Whether light crosses the surface.
    pub transmitted: bool,
}

/// A surface's scattering distribution.
#[derive(Clone, Debug)]
pub enum Bsdf {
    /// Light passes straight through.
    Null,
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// Smooth interface between the two media.
    Dielectric(Dielectric),
    /// Rough interface between the two media.
    RoughDielectric(RoughDielectric),
    /// Smooth metal.
    Conductor(Conductor),
    /// Rough metal.
    RoughConductor(RoughConductor),
}

impl Bsdf {
    /// Draws a direction; `None` where light is absorbed or the model loses it.
    pub fn sample(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        match self {
            Bsdf::Null => Some(null::sample(s, toward)),
            Bsdf::Diffuse(b) => b.sample(s, toward, [u[1], u[2]]),
            Bsdf::Dielectric(b) => Some(b.sample(s, toward, u[0])),
            Bsdf::RoughDielectric(b) => b.sample(s, toward, u),
            Bsdf::Conductor(b) => b.sample(s, toward),
            Bsdf::RoughConductor(b) => b.sample(s, toward, [u[1], u[2]]),
        }
    }

    /// f̃·|cosθ| with θ the angle of `direction`; zero for delta events.
    pub fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        match self {
            Bsdf::Null | Bsdf::Dielectric(_) | Bsdf::Conductor(_) => Spectrum::ZERO,
            Bsdf::Diffuse(b) => b.eval(s, toward, direction),
            Bsdf::RoughDielectric(b) => b.eval(s, toward, direction),
            Bsdf::RoughConductor(b) => b.eval(s, toward, direction),
        }
    }

    /// Density per steradian with which [`Bsdf::sample`] draws `direction`; zero for delta events.
    pub fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        match self {
            Bsdf::Null | Bsdf::Dielectric(_) | Bsdf::Conductor(_) => 0.0,
            Bsdf::Diffuse(b) => b.pdf(s, toward, direction),
            Bsdf::RoughDielectric(b) => b.pdf(s, toward, direction),
            Bsdf::RoughConductor(b) => b.pdf(s, toward, direction),
        }
    }

    /// Whether every event is a delta. A rough dielectric is none, though where its two indices match
    /// its samples are: go by [`BsdfSample::delta`] there.
    pub fn is_delta(&self) -> bool {
        matches!(self, Bsdf::Null | Bsdf::Dielectric(_) | Bsdf::Conductor(_))
    }

    /// Whether light passes undeflected.
    pub fn is_null(&self) -> bool {
        matches!(self, Bsdf::Null)
    }

    /// Whether no light passes from one side to the other.
    pub fn is_opaque(&self) -> bool {
        matches!(
            self,
            Bsdf::Diffuse(_) | Bsdf::Conductor(_) | Bsdf::RoughConductor(_)
        )
    }
}

/// Checks that every channel lies in [0, 1].
fn check_factor(name: &'static str, s: Spectrum) -> Result<(), BsdfError> {
    match s.0.into_iter().find(|v| !(0.0..=1.0).contains(v)) {
        Some(value) => Err(BsdfError::Factor { name, value }),
        None => Ok(()),
    }
}

/// Checks one part of a complex index.
fn check_index(name: &'static str, s: Spectrum) -> Result<(), BsdfError> {
    match s.0.into_iter().find(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(value) => Err(BsdfError::Index { name, value }),
        None => Ok(()),
    }
}
