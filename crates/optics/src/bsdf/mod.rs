//! Scattering at surfaces.
//!
//! **Directions** are unit vectors in world space that point away from the surface. `toward` leads to
//! where the path came from (radiance leaves along it), `direction` to where the light comes from.
//! Subscripts in the comments: o is the side of `toward`, i the side of `direction`.
//!
//! **Basic radiance.** Estimators transport L̃ = L/n² (docs/theory.md#radiance), so values are
//! f̃ = f·nᵢ²/nₒ²: a smooth transmission has weight 1, without η². κ = f̃/nᵢ² is symmetric in the two
//! directions, so radiance and importance use the same code. The one exception is a null boundary
//! whose indices differ, see [`null`].
//!
//! Unit vectors in, finite numbers out: grazing directions included, nothing here returns NaN.

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

impl BsdfSample {
    /// A direction on the side of the viewer that one or other part of a bsdf drew, by the density of all parts and their
    /// value f̃·|cosθ|; `None` if the density is 0.
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

/// The light that passes a surface straight on, where the rest meets something else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialTransmission {
    /// Share of the light: the probability of passing.
    pub probability: f64,
    /// What of this share is left, per channel.
    pub factor: Spectrum,
}

impl PartialTransmission {
    /// All light passes.
    pub const ALL: Self = PartialTransmission {
        probability: 1.0,
        factor: Spectrum::ONE,
    };

    /// What is left behind another surface.
    pub fn times(&mut self, other: &Self) {
        self.probability *= other.probability;
        self.factor *= other.factor;
    }
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
    /// A diffuse base under a smooth coat.
    Plastic(Plastic),
    /// A diffuse base under a rough coat.
    RoughPlastic(RoughPlastic),
    /// A diffuse base and facets of a dielectric or a metal.
    Principled(Box<Principled>),
    /// A sheet of such matter, without thickness.
    PrincipledThin(Box<PrincipledThin>),
    /// A diffuse base that light reaches through a smooth surface, under facets.
    PolarizedPlastic(PolarizedPlastic),
    /// Cavities with Lambertian walls.
    RoughDiffuse(RoughDiffuse),
    /// Phong's or Ward's reflection, and a diffuse one.
    GlossyDiffuse(Box<GlossyDiffuse>),
    /// A layer over another surface.
    Coating(Box<Coating>),
    /// A mixture of two surfaces.
    Blend(BlendBsdf),
    /// A surface on either side.
    TwoSided(TwoSided),
    /// A surface with holes.
    Mask(Mask),
    /// A thin pane.
    ThinDielectric(ThinDielectric),
    /// A filter of polarised light.
    Filter(Box<PolarizingFilter>),
    /// A surface with turned normals.
    NormalMap(Box<NormalMap>),
}

impl Bsdf {
    /// [`Bsdf::sample`] by the geometric normal.
    fn sample_by_normal(&self, s: &Surface, toward: DVec3, u: [f64; 3]) -> Option<BsdfSample> {
        match self {
            Bsdf::Null => Some(null::sample(s, toward)),
            Bsdf::Diffuse(b) => b.sample(s, toward, [u[1], u[2]]),
            Bsdf::Dielectric(b) => Some(b.sample(s, toward, u[0])),
            Bsdf::RoughDielectric(b) => b.sample(s, toward, u),
            Bsdf::Conductor(b) => b.sample(s, toward),
            Bsdf::RoughConductor(b) => b.sample(s, toward, [u[1], u[2]]),
            Bsdf::Plastic(b) => b.sample(s, toward, u),
            Bsdf::RoughPlastic(b) => b.sample(s, toward, u),
            Bsdf::Principled(b) => b.sample(s, toward, u),
            Bsdf::PrincipledThin(b) => b.sample(s, toward, u),
            Bsdf::PolarizedPlastic(b) => b.sample(s, toward, u),
            Bsdf::RoughDiffuse(b) => b.sample(s, toward, [u[1], u[2]]),
            Bsdf::GlossyDiffuse(b) => b.sample(s, toward, u),
            Bsdf::Coating(b) => b.sample(s, toward, u),
            Bsdf::Blend(b) => b.sample(s, toward, u),
            Bsdf::TwoSided(b) => b.sample(s, toward, u),
            Bsdf::Mask(b) => b.nested().sample(s, toward, u),
            Bsdf::ThinDielectric(b) => Some(b.sample(s, toward)),
            Bsdf::Filter(_) => None,
            Bsdf::NormalMap(b) => b.sample(s, toward, u),
        }
    }

    /// [`Bsdf::eval`] by the geometric normal.
    fn eval_by_normal(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        match self {
            Bsdf::Null | Bsdf::Dielectric(_) => Spectrum::ZERO,
            Bsdf::Conductor(_) | Bsdf::ThinDielectric(_) | Bsdf::Filter(_) => Spectrum::ZERO,
            Bsdf::Diffuse(b) => b.eval(s, toward, direction),
            Bsdf::RoughDielectric(b) => b.eval(s, toward, direction),
            Bsdf::RoughConductor(b) => b.eval(s, toward, direction),
            Bsdf::Plastic(b) => b.eval(s, toward, direction),
            Bsdf::RoughPlastic(b) => b.eval(s, toward, direction),
            Bsdf::Principled(b) => b.eval(s, toward, direction),
            Bsdf::PrincipledThin(b) => b.eval(s, toward, direction),
            Bsdf::PolarizedPlastic(b) => b.eval(s, toward, direction),
            Bsdf::RoughDiffuse(b) => b.eval(s, toward, direction),
            Bsdf::GlossyDiffuse(b) => b.eval(s, toward, direction),
            Bsdf::Coating(b) => b.eval(s, toward, direction),
            Bsdf::Blend(b) => b.eval(s, toward, direction),
            Bsdf::TwoSided(b) => b.eval(s, toward, direction),
            Bsdf::Mask(b) => b.nested().eval(s, toward, direction),
            Bsdf::NormalMap(b) => b.eval(s, toward, direction),
        }
    }

    /// [`Bsdf::pdf`] by the geometric normal.
    fn pdf_by_normal(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        match self {
            Bsdf::Null | Bsdf::Dielectric(_) => 0.0,
            Bsdf::Conductor(_) | Bsdf::ThinDielectric(_) | Bsdf::Filter(_) => 0.0,
            Bsdf::Diffuse(b) => b.pdf(s, toward, direction),
            Bsdf::RoughDielectric(b) => b.pdf(s, toward, direction),
            Bsdf::RoughConductor(b) => b.pdf(s, toward, direction),
            Bsdf::Plastic(b) => b.pdf(s, toward, direction),
            Bsdf::RoughPlastic(b) => b.pdf(s, toward, direction),
            Bsdf::Principled(b) => b.pdf(s, toward, direction),
            Bsdf::PrincipledThin(b) => b.pdf(s, toward, direction),
            Bsdf::PolarizedPlastic(b) => b.pdf(s, toward, direction),
            Bsdf::RoughDiffuse(b) => b.pdf(s, toward, direction),
            Bsdf::GlossyDiffuse(b) => b.pdf(s, toward, direction),
            Bsdf::Coating(b) => b.pdf(s, toward, direction),
            Bsdf::Blend(b) => b.pdf(s, toward, direction),
            Bsdf::TwoSided(b) => b.pdf(s, toward, direction),
            Bsdf::Mask(b) => b.nested().pdf(s, toward, direction),
            Bsdf::NormalMap(b) => b.pdf(s, toward, direction),
        }
    }

    /// The light that passes the surface at `site` straight on, for an angle of the given cosine to the normal;
    /// `None` if that is not how the surface works. It is decided first whether light passes:
    /// [`Bsdf::sample`], [`Bsdf::eval`] and [`Bsdf::pdf`] are then about light that does not (docs/theory.md#masks-and-panes).
    pub fn through(&self, site: &Site, cos: f64) -> Option<PartialTransmission> {
        match self {
            Bsdf::Mask(b) => Some(b.through(site)),
            Bsdf::ThinDielectric(b) => Some(b.through(site, cos.abs())),
            Bsdf::Filter(b) => Some(b.through(site)),
            Bsdf::NormalMap(b) => b.nested().through(site, cos),
            _ => None,
        }
    }

    /// The bsdfs of which it is made; none unless it is a mask, a normal map, a coating, a blend or two-sided.
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
