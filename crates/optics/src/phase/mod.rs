//! Phase functions: the distribution of directions after a scattering event.
//!
//! Densities are per steradian and normalised over the sphere, so value and pdf are the same. The
//! cosine is the one between the propagation directions before and after: forward is +1. Phase functions may vary in
//! space: all take the place of the event.

mod blend;
mod by_label;
mod henyey_greenstein;
mod isotropic;
mod mie;
mod polar;
mod rayleigh;
mod tabulated;
mod von_mises_fisher;

pub use blend::BlendPhase;
pub use by_label::PhaseByLabel;
pub use henyey_greenstein::HenyeyGreenstein;
pub use isotropic::Isotropic;
pub use mie::{Mie, Spheres};
pub use rayleigh::Rayleigh;
pub use tabulated::Tabulated;
pub use von_mises_fisher::VonMisesFisher;

use crate::Spectrum;
use crate::mueller::PlaneMueller;
use crate::sampling::DistributionError;
use crate::shared::Shared;
use crate::volume::{LabelGrid, VolumeGrid, VolumeTexture};
use eikonal::Shown;
use glam::DVec3;
use polar::Polar;
use std::sync::Arc;

/// Tables of Mie scattering by the bits of their spheres' parameters.
static MIE_TABLES_IN_USE: Shared<[u64; 6], Mie> = Shared::new();

/// Why a phase function cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhaseError {
    /// Asymmetry out of range.
    #[error("the asymmetry g must lie in (-1, 1), got {}", Shown(*.0))]
    Asymmetry(f64),
    /// Concentration out of range.
    #[error("the concentration kappa must be finite and ≥ 0, got {}", Shown(*.0))]
    Concentration(f64),
    /// Weight out of range.
    #[error("the weight of the second phase function must lie in [0, 1], got {}", Shown(*.0))]
    Weight(f64),
    /// A table that does not span all angles.
    #[error("the cosines must run from -1 to 1, got {} to {}", Shown(*first), Shown(*last))]
    Span {
        /// First cosine given.
        first: f64,
        /// Last cosine given.
        last: f64,
    },
    /// A quantity of spheres that must be positive.
    #[error("the {name} must be finite and > 0, got {}", Shown(*value))]
    NotPositive {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// Geometric standard deviation out of range.
    #[error("the geometric standard deviation of radii must lie in [1, {}], got {}", Spheres::MOST_DEVIATION, Shown(*.0))]
    GeometricDeviation(f64),
    /// Complex index of spheres out of range.
    #[error(
        "the index n + ik of spheres must have n > 0 and k ≥ 0, both at most 100 times the index around, got {} + {}i",
        Shown(*n),
        Shown(*k)
    )]
    SphereIndex {
        /// Refractive index.
        n: f64,
        /// Its imaginary part.
        k: f64,
    },
    /// Spheres of the index around them.
    #[error("spheres of the index of the medium around scatter nothing")]
    Matched,
    /// Spheres that are too large.
    #[error("spheres have a size parameter 2πnr/λ of {}, and at most {} is computed", Shown(*found), Shown(*most))]
    SphereSize {
        /// The largest that counts.
        found: f64,
        /// The largest that may be.
        most: f64,
    },
    /// A table that is no density.
    #[error("phase function table: {0}")]
    Table(#[from] DistributionError),
}

/// A phase function.
#[derive(Clone, Debug)]
pub enum Phase {
    /// The same in all directions.
    Isotropic(Isotropic),
    /// Henyey–Greenstein.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Henyey–Greenstein whose mean cosine g is that of a grid's first channel.
    HenyeyGreensteinGrid(Arc<VolumeGrid>),
    /// Von Mises–Fisher.
    VonMisesFisher(VonMisesFisher),
    /// Rayleigh.
    Rayleigh(Rayleigh),
    /// Values over the cosine.
    Tabulated(Tabulated),
    /// Spheres of any size.
    Mie(Arc<Mie>),
    /// A mixture of two.
    Blend(Box<BlendPhase>),
    /// That of the label at each place.
    ByLabel(Box<PhaseByLabel>),
}

impl Phase {
    /// The isotropic phase function.
    pub fn isotropic() -> Self {
        Phase::Isotropic(Isotropic)
    }

    /// Henyey–Greenstein with mean cosine `g` in (−1, 1).
    ///
    /// # Errors
    /// A mean cosine outside (−1, 1).
    pub fn henyey_greenstein(g: f64) -> Result<Self, PhaseError> {
        HenyeyGreenstein::new(g).map(Phase::HenyeyGreenstein)
    }

    /// Henyey–Greenstein whose mean cosine is the first channel of a grid, in (−1, 1) everywhere.
    ///
    /// # Errors
    /// A mean cosine outside (−1, 1).
    pub fn henyey_greenstein_grid(g: Arc<VolumeGrid>) -> Result<Self, PhaseError> {
        let (low, high) = g.range();
        HenyeyGreenstein::new(low)?;
        HenyeyGreenstein::new(high)?;
        Ok(Phase::HenyeyGreensteinGrid(g))
    }

    /// Von Mises–Fisher with concentration `kappa` ≥ 0.
    ///
    /// # Errors
    /// A concentration that is negative or not finite.
    pub fn von_mises_fisher(kappa: f64) -> Result<Self, PhaseError> {
        VonMisesFisher::new(kappa).map(Phase::VonMisesFisher)
    }

    /// Rayleigh scattering of unpolarised light.
    pub fn rayleigh() -> Self {
        Phase::Rayleigh(Rayleigh)
    }

    /// Spheres of any size, by their [cross-sections and matrix](Mie).
    ///
    /// # Errors
    /// As [`Mie::new`].
    pub fn mie(spheres: &Spheres) -> Result<Self, PhaseError> {
        MIE_TABLES_IN_USE
            .try_get(spheres.key(), || Mie::new(spheres))
            .map(Phase::Mie)
    }

    /// (1 − `weight`) of the first phase function plus `weight`, in [0, 1], of the second.
    ///
    /// # Errors
    /// A weight outside [0, 1].
    pub fn blend(phases: [Phase; 2], weight: f64) -> Result<Self, PhaseError> {
        Phase::blend_by(phases, VolumeTexture::Uniform(Spectrum::splat(weight)))
    }

    /// The same with a weight that varies in space: the first channel of `weight`.
    ///
    /// # Errors
    /// A weight outside [0, 1].
    pub fn blend_by(phases: [Phase; 2], weight: VolumeTexture) -> Result<Self, PhaseError> {
        BlendPhase::new(phases, weight).map(|blend| Phase::Blend(Box::new(blend)))
    }

    /// Linear interpolation of `values` at increasing `cosines` from −1 to 1, normalised here.
    ///
    /// # Errors
    /// As [`Tabulated::new`].
    pub fn tabulated(cosines: Vec<f64>, values: &[f64]) -> Result<Self, PhaseError> {
        Tabulated::new(cosines, values).map(Phase::Tabulated)
    }

    /// The phase function of a label of a grid, if it is known.
    pub fn of_label(&self, labels: &Arc<LabelGrid>, label: usize) -> Option<&Phase> {
        match self {
            Phase::ByLabel(p) => p.of_label(labels, label),
            _ => Some(self),
        }
    }

    /// Density per steradian at `x`, at the cosine between the directions before and after.
    pub fn pdf(&self, x: DVec3, cos: f64) -> f64 {
        let cos = cos.clamp(-1.0, 1.0);
        match self {
            Phase::Isotropic(p) => p.pdf(),
            Phase::HenyeyGreenstein(p) => p.pdf(cos),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).pdf(cos),
            Phase::VonMisesFisher(p) => p.pdf(cos),
            Phase::Rayleigh(p) => p.pdf(cos),
            Phase::Tabulated(p) => p.pdf(cos),
            Phase::Mie(p) => p.pdf(cos),
            Phase::Blend(p) => p.pdf(x, cos),
            Phase::ByLabel(p) => p.at(x).pdf(x, cos),
        }
    }

    /// What scattering at `x` does to polarisation, at the cosine between the directions before and after, in frames whose first axis is
    /// perpendicular to the plane of scattering. Phase functions that are not known to keep it depolarise.
    pub fn mueller(&self, x: DVec3, cos: f64) -> PlaneMueller {
        let cos = cos.clamp(-1.0, 1.0);
        match self {
            Phase::Rayleigh(_) => Rayleigh::mueller(cos),
            Phase::Mie(p) => p.mueller(cos),
            Phase::Blend(p) => p.mueller(x, cos),
            Phase::ByLabel(p) => p.at(x).mueller(x, cos),
            Phase::Isotropic(_)
            | Phase::HenyeyGreenstein(_)
            | Phase::HenyeyGreensteinGrid(_)
            | Phase::VonMisesFisher(_)
            | Phase::Tabulated(_) => PlaneMueller::DEPOLARIZER,
        }
    }

    /// Whether whatever it scatters is taken as unpolarised, everywhere.
    pub fn depolarizes(&self) -> bool {
        matches!(
            self,
            Phase::Isotropic(_)
                | Phase::HenyeyGreenstein(_)
                | Phase::HenyeyGreensteinGrid(_)
                | Phase::VonMisesFisher(_)
                | Phase::Tabulated(_)
        )
    }

    /// Direction after scattering at `x` of the unit propagation direction `dir`, and its density.
    pub fn sample(&self, x: DVec3, dir: DVec3, u: [f64; 2]) -> (DVec3, f64) {
        let (angle, pdf) = self.angle(x, u[0]);
        (angle.around(dir, u[1]), pdf)
    }

    /// Whether it is the same everywhere.
    pub fn is_uniform(&self) -> bool {
        match self {
            Phase::Isotropic(_)
            | Phase::HenyeyGreenstein(_)
            | Phase::VonMisesFisher(_)
            | Phase::Rayleigh(_)
            | Phase::Tabulated(_)
            | Phase::Mie(_) => true,
            Phase::HenyeyGreensteinGrid(_) | Phase::ByLabel(_) => false,
            Phase::Blend(p) => p.is_uniform(),
        }
    }

    /// Direction after scattering of the unit propagation direction `dir`, if the phase function [is uniform](Phase::is_uniform), given the
    /// cosine and sine of the angle around it.
    #[inline]
    pub fn turn(&self, dir: DVec3, u: f64, around: [f64; 2]) -> DVec3 {
        let angle = match self {
            // Most, without the density.
            Phase::HenyeyGreenstein(p) => p.angle(u),
            _ => self.angle(DVec3::ZERO, u).0,
        };
        angle.turned(dir, around)
    }

    /// Angle of scattering, and the density of directions there.
    fn angle(&self, x: DVec3, u: f64) -> (Polar, f64) {
        match self {
            Phase::Isotropic(p) => p.sample(u),
            Phase::HenyeyGreenstein(p) => p.sample(u),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).sample(u),
            Phase::VonMisesFisher(p) => p.sample(u),
            Phase::Rayleigh(p) => p.sample(u),
            Phase::Tabulated(p) => p.sample(u),
            Phase::Mie(p) => p.sample(u),
            Phase::Blend(p) => p.sample(x, u),
            Phase::ByLabel(p) => p.at(x).angle(x, u),
        }
    }

    /// Mean of the cosine at `x`.
    pub fn mean_cosine(&self, x: DVec3) -> f64 {
        match self {
            Phase::Isotropic(_) | Phase::Rayleigh(_) => 0.0,
            Phase::HenyeyGreenstein(p) => p.mean_cosine(),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).mean_cosine(),
            Phase::VonMisesFisher(p) => p.mean_cosine(),
            Phase::Tabulated(p) => p.mean_cosine(),
            Phase::Mie(p) => p.mean_cosine(),
            Phase::Blend(p) => p.mean_cosine(x),
            Phase::ByLabel(p) => p.at(x).mean_cosine(x),
        }
    }

    /// The derivative of log p by the mean cosine g at `x`, of Henyey and Greenstein's functions, among which the isotropic one has g = 0; zero of others.
    pub fn log_derivative(&self, x: DVec3, cos: f64) -> f64 {
        match self {
            Phase::Isotropic(_) => HenyeyGreenstein::ISOTROPIC.log_derivative(cos),
            Phase::HenyeyGreenstein(p) => p.log_derivative(cos),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).log_derivative(cos),
            Phase::ByLabel(p) => p.at(x).log_derivative(x, cos),
            _ => 0.0,
        }
    }

    /// Whether it is Henyey and Greenstein's everywhere, so that g is a parameter; within a label it may be isotropic.
    pub fn has_mean_cosine(&self) -> bool {
        match self {
            Phase::HenyeyGreenstein(_) | Phase::HenyeyGreensteinGrid(_) => true,
            Phase::ByLabel(p) => p
                .phases()
                .iter()
                .all(|phase| matches!(phase, Phase::Isotropic(_) | Phase::HenyeyGreenstein(_))),
            _ => false,
        }
    }

    /// Bytes held by grids and by the tables of spheres.
    pub(crate) fn memory(&self) -> usize {
        match self {
            Phase::Mie(p) => p.memory(),
            Phase::HenyeyGreensteinGrid(g) => g.memory(),
            Phase::Blend(p) => p.memory(),
            Phase::ByLabel(p) => p.memory(),
            _ => 0,
        }
    }
}
