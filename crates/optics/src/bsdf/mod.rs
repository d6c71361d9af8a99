//! Scattering at surfaces.
//!
//! **Directions** are unit vectors in world space that point away from the surface. `toward` leads
//! to the previous vertex of the path, so radiance leaves along it. `direction` leads to the source
//! of the light. Subscripts in the comments: o is the side of `toward`, i the side of `direction`.
//!
//! **Basic radiance.** Estimators transport L̃ = L/n² (docs/theory.md#radiance), so values are f̃ =
//! f·nᵢ²/nₒ²: a smooth transmission has weight 1, without η². κ = f̃/nᵢ² is symmetric in the two
//! directions, so radiance and importance use the same code. The only exception is a null boundary
//! whose indices differ, see [`null`].
//!
//! For unit vectors, including grazing directions, all functions return finite numbers, never NaN.

mod albedo;
mod beckmann;
mod blend;
mod coat;
mod coating;
mod conductor;
mod dielectric;
mod diffuse;
mod error;
mod facts;
mod filter;
pub mod fresnel;
mod ggx;
mod glossy_diffuse;
mod mask;
pub mod microfacet;
mod normal_map;
pub mod null;
mod plastic;
pub mod polarization;
mod polarized_plastic;
mod principled;
mod rough_conductor;
mod rough_dielectric;
mod rough_diffuse;
mod rough_plastic;
mod shading;
mod surface;
mod thin_dielectric;
mod tint;
mod two_sided;

pub use blend::BlendBsdf;
pub use coating::{Coating, CoatingParameters};
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use error::BsdfError;
pub use filter::FilterMueller;
pub use filter::{FilterElement, PolarizingFilter};
pub use glossy_diffuse::{GlossyDiffuse, GlossyLobe};
pub use mask::Mask;
pub use microfacet::{Distribution, Microfacets, Roughness};
pub use normal_map::{NormalMap, NormalSource};
pub use plastic::Plastic;
pub use polarized_plastic::PolarizedPlastic;
pub use principled::{Principled, PrincipledParameters, PrincipledThin, PrincipledThinParameters};
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use rough_diffuse::RoughDiffuse;
pub use rough_plastic::RoughPlastic;
pub use surface::Surface;
pub use thin_dielectric::ThinDielectric;
pub use tint::BsdfEvent;
pub use tint::Tint;
pub use two_sided::TwoSided;

use crate::shape::Site;
use crate::spectrum::Spectrum;
use error::{check_eta, check_index, factor};
use glam::DVec3;
use std::slice;

/// Direction sampled from a BSDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit vector towards the source of the light.
    pub direction: DVec3,
    /// Value of f̃·|cosθ| / pdf.
    pub weight: Spectrum,
    /// Density per steradian, > 0; for a delta event its discrete probability.
    pub pdf: f64,
    /// True for a delta event, for which `eval` and `pdf` are zero.
    pub delta: bool,
    /// True if light crosses the surface.
    pub transmitted: bool,
}

impl BsdfSample {
    /// Creates the sample of a direction on the side of the viewer that one of several lobes
    /// generated. `pdf` is the density of all lobes together, `value` computes their value
    /// f̃·|cosθ|. Returns `None` if the density is 0.
    fn reflected(direction: DVec3, pdf: f64, value: impl FnOnce() -> Spectrum) -> Option<Self> {
        (pdf > 0.0).then(|| BsdfSample {
            direction,
            weight: value() / pdf,
            pdf,
            delta: false,
            transmitted: false,
        })
    }
}

/// Light that passes a surface undeflected, while the surface scatters the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialTransmission {
    /// Fraction of the light that passes: the probability of passing.
    pub probability: f64,
    /// Transmittance of the passing light, per channel.
    pub factor: Spectrum,
}

impl PartialTransmission {
    /// Full transmission.
    pub const ALL: Self = PartialTransmission {
        probability: 1.0,
        factor: Spectrum::ONE,
    };

    /// Multiplies by the transmission of another surface.
    pub fn times(&mut self, other: &Self) {
        self.probability *= other.probability;
        self.factor *= other.factor;
    }
}

/// Scattering distribution of a surface.
#[derive(Clone, Debug)]
pub enum Bsdf {
    /// Boundary that light passes straight through.
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
    /// Diffuse base under a smooth coat.
    Plastic(Plastic),
    /// Diffuse base under a rough coat.
    RoughPlastic(RoughPlastic),
    /// Principled surface: diffuse base with facets of a dielectric or a metal.
    Principled(Box<Principled>),
    /// Principled sheet without thickness.
    PrincipledThin(Box<PrincipledThin>),
    /// Facets, and a diffuse base that light reaches through a smooth interface.
    PolarizedPlastic(PolarizedPlastic),
    /// Rough diffuse surface: cavities with Lambertian walls.
    RoughDiffuse(RoughDiffuse),
    /// Sum of Phong's or Ward's reflection and a diffuse one.
    GlossyDiffuse(Box<GlossyDiffuse>),
    /// Dielectric layer over another surface.
    Coating(Box<Coating>),
    /// Mixture of two surfaces.
    Blend(BlendBsdf),
    /// Pair of surfaces, one for each side.
    TwoSided(TwoSided),
    /// Surface with holes.
    Mask(Mask),
    /// Thin pane of a dielectric.
    ThinDielectric(ThinDielectric),
    /// Thin filter of polarised light.
    Filter(Box<PolarizingFilter>),
    /// Surface with perturbed normals.
    NormalMap(Box<NormalMap>),
}

/// Evaluates an expression on whichever bsdf this is. Masks and bsdfs whose events are all deltas
/// have arms of their own.
macro_rules! each {
    ($self:expr, $b:ident => $e:expr, { $($arms:tt)* }) => {
        match $self {
            Bsdf::Diffuse($b) => $e,
            Bsdf::RoughDielectric($b) => $e,
            Bsdf::RoughConductor($b) => $e,
            Bsdf::Plastic($b) => $e,
            Bsdf::RoughPlastic($b) => $e,
            Bsdf::Principled($b) => $e,
            Bsdf::PrincipledThin($b) => $e,
            Bsdf::PolarizedPlastic($b) => $e,
            Bsdf::RoughDiffuse($b) => $e,
            Bsdf::GlossyDiffuse($b) => $e,
            Bsdf::Coating($b) => $e,
            Bsdf::Blend($b) => $e,
            Bsdf::TwoSided($b) => $e,
            Bsdf::NormalMap($b) => $e,
            $($arms)*
        }
    };
}

impl Bsdf {
    /// Samples like [`Bsdf::sample`], by the geometric normal.
    fn sample_by_normal(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        each!(self, b => b.sample(s, toward, u), {
            Bsdf::Null => Some(null::sample(s, toward)),
            Bsdf::Dielectric(b) => Some(b.sample(s, toward, u[0])),
            Bsdf::Conductor(b) => b.sample(s, toward),
            Bsdf::ThinDielectric(b) => Some(b.sample(s, toward)),
            Bsdf::Filter(_) => None,
            Bsdf::Mask(b) => b.nested().sample(s, toward, u),
        })
    }

    /// Evaluates like [`Bsdf::eval`], by the geometric normal.
    fn eval_by_normal(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        each!(self, b => b.eval(s, toward, direction), {
            Bsdf::Null | Bsdf::Dielectric(_) => Spectrum::ZERO,
            Bsdf::Conductor(_) | Bsdf::ThinDielectric(_) | Bsdf::Filter(_) => Spectrum::ZERO,
            Bsdf::Mask(b) => b.nested().eval(s, toward, direction),
        })
    }

    /// Returns the density like [`Bsdf::pdf`], by the geometric normal.
    fn pdf_by_normal(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        each!(self, b => b.pdf(s, toward, direction), {
            Bsdf::Null | Bsdf::Dielectric(_) => 0.0,
            Bsdf::Conductor(_) | Bsdf::ThinDielectric(_) | Bsdf::Filter(_) => 0.0,
            Bsdf::Mask(b) => b.nested().pdf(s, toward, direction),
        })
    }

    /// Returns the light that passes the surface at `site` undeflected, for an angle of the given
    /// cosine to the normal. Returns `None` for surfaces that transmit no undeflected light.
    /// Estimators first decide whether light passes. [`Bsdf::sample`], [`Bsdf::eval`] and
    /// [`Bsdf::pdf`] then describe only light that does not pass (docs/theory.md#masks-and-panes).
    pub fn through(&self, site: &Site, cos: f64) -> Option<PartialTransmission> {
        match self {
            Bsdf::Mask(b) => Some(b.through(site)),
            Bsdf::ThinDielectric(b) => Some(b.through(site, cos.abs())),
            Bsdf::Filter(b) => Some(b.through(site)),
            Bsdf::NormalMap(b) => b.nested().through(site, cos),
            _ => None,
        }
    }

    /// Returns the nested bsdfs of a mask, normal map, coating, blend or two-sided surface; empty
    /// for others.
    pub fn children(&self) -> &[Bsdf] {
        match self {
            Bsdf::Mask(b) => slice::from_ref(b.nested()),
            Bsdf::NormalMap(b) => slice::from_ref(b.nested()),
            Bsdf::Coating(b) => slice::from_ref(b.nested()),
            Bsdf::Blend(b) => b.pair(),
            Bsdf::TwoSided(b) => b.sides(),
            _ => &[],
        }
    }
}
