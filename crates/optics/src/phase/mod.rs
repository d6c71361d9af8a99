//! Phase functions: the distribution of directions after a scattering event.
//!
//! Densities are per steradian and normalised over the sphere, so value and pdf are equal. The
//! cosine is between the propagation directions before and after: forward is +1. Phase functions
//! may vary in space, so all take the position of the event. Except for flakes ([`Sggx`]), they
//! depend only on the cosine.

mod blend;
mod by_label;
mod henyey_greenstein;
mod isotropic;
mod mie;
mod polar;
mod quantiles;
mod rayleigh;
mod sggx;
mod tabulated;
mod von_mises_fisher;

pub use blend::BlendPhase;
pub use by_label::PhaseByLabel;
pub use henyey_greenstein::HenyeyGreenstein;
pub use isotropic::Isotropic;
pub use mie::{Mie, Spheres};
pub use quantiles::Quantiles;
pub use rayleigh::Rayleigh;
pub use sggx::Sggx;
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

/// Cache of the tables of Mie scattering, by the bits of the parameters of spheres.
static MIE_TABLES_IN_USE: Shared<[u64; 6], Mie> = Shared::new();

/// Reason why a phase function cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhaseError {
    /// The asymmetry is out of range.
    #[error("the asymmetry g must lie in (-1, 1), got {}", Shown(*.0))]
    Asymmetry(f64),
    /// The concentration is out of range.
    #[error("the concentration kappa must be finite and ≥ 0, got {}", Shown(*.0))]
    Concentration(f64),
    /// The weight is out of range.
    #[error("the weight of the second phase function must lie in [0, 1], got {}", Shown(*.0))]
    Weight(f64),
    /// A table does not span all angles.
    #[error("the cosines must run from -1 to 1, got {} to {}", Shown(*first), Shown(*last))]
    Span {
        /// First cosine given.
        first: f64,
        /// Last cosine given.
        last: f64,
    },
    /// A quantity of spheres must be positive.
    #[error("the {name} must be finite and > 0, got {}", Shown(*value))]
    NotPositive {
        /// Name of the quantity.
        name: &'static str,
        /// Value of the quantity.
        value: f64,
    },
    /// The geometric standard deviation is out of range.
    #[error("the geometric standard deviation of radii must lie in [1, {}], got {}", Spheres::MAX_DEVIATION, Shown(*.0))]
    GeometricDeviation(f64),
    /// The complex index of spheres is out of range.
    #[error(
        "the index n + ik of spheres must have n > 0 and k ≥ 0, both at most 100 times the index around, got {} + {}i",
        Shown(*n),
        Shown(*k)
    )]
    SphereIndex {
        /// Refractive index.
        n: f64,
        /// Imaginary part of the index.
        k: f64,
    },
    /// The index of spheres equals the index around them.
    #[error("spheres with the index of the surrounding medium do not scatter")]
    Matched,
    /// Spheres are too large.
    #[error("spheres have a size parameter 2πnr/λ of {}, and at most {} is computed", Shown(*found), Shown(*most))]
    SphereSize {
        /// Size parameter of the largest spheres that contribute.
        found: f64,
        /// Largest allowed size parameter.
        most: f64,
    },
    /// The matrix of flakes is not positive definite.
    #[error(
        "the matrix S of flakes must be positive definite, and no flake thinner than 1e-3 of its width: increase the smallest of xx, yy and zz, or reduce xy, xz and yz; got {0} (xx, yy, zz, xy, xz, yz)"
    )]
    NotDefinite(String),
    /// Flakes cannot be part of a mixture.
    #[error(
        "flakes cannot be part of a mixture, because the extinction depends on their orientation: use 'sggx' alone"
    )]
    MixedFlakes,
    /// A table is not a density.
    #[error("phase function table: {0}")]
    Table(#[from] DistributionError),
}

/// Phase function.
#[derive(Clone, Debug)]
pub enum Phase {
    /// Isotropic scattering.
    Isotropic(Isotropic),
    /// Henyey–Greenstein phase function.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Henyey–Greenstein with a mean cosine g that is the first channel of a grid.
    HenyeyGreensteinGrid(Arc<VolumeGrid>),
    /// Von Mises–Fisher phase function.
    VonMisesFisher(VonMisesFisher),
    /// Rayleigh phase function.
    Rayleigh(Rayleigh),
    /// Table of values over the cosine.
    Tabulated(Tabulated),
    /// Quantiles of the cosine.
    Quantiles(Arc<Quantiles>),
    /// Mie scattering by spheres of any size.
    Mie(Arc<Mie>),
    /// Oriented flakes.
    Sggx(Box<Sggx>),
    /// Mixture of two phase functions.
    Blend(Box<BlendPhase>),
    /// Phase function of the label at each position.
    ByLabel(Box<PhaseByLabel>),
}

impl Phase {
    /// Creates the isotropic phase function.
    pub fn isotropic() -> Self {
        Phase::Isotropic(Isotropic)
    }

    /// Creates a Henyey–Greenstein phase function with mean cosine `g` in (−1, 1).
    ///
    /// # Errors
    /// Fails if the mean cosine lies outside (−1, 1).
    pub fn henyey_greenstein(g: f64) -> Result<Self, PhaseError> {
        HenyeyGreenstein::new(g).map(Phase::HenyeyGreenstein)
    }

    /// Creates a Henyey–Greenstein phase function whose mean cosine is the first channel of a grid,
    /// in (−1, 1) everywhere.
    ///
    /// # Errors
    /// Fails if a mean cosine lies outside (−1, 1).
    pub fn henyey_greenstein_grid(g: Arc<VolumeGrid>) -> Result<Self, PhaseError> {
        let (low, high) = g.range();
        HenyeyGreenstein::new(low)?;
        HenyeyGreenstein::new(high)?;
        Ok(Phase::HenyeyGreensteinGrid(g))
    }

    /// Creates a von Mises–Fisher phase function with concentration `kappa` ≥ 0.
    ///
    /// # Errors
    /// Fails if the concentration is negative or not finite.
    pub fn von_mises_fisher(kappa: f64) -> Result<Self, PhaseError> {
        VonMisesFisher::new(kappa).map(Phase::VonMisesFisher)
    }

    /// Creates Rayleigh scattering of unpolarised light.
    pub fn rayleigh() -> Self {
        Phase::Rayleigh(Rayleigh)
    }

    /// Creates the phase function of spheres of any size, from their [cross-sections and
    /// matrix](Mie).
    ///
    /// # Errors
    /// Fails like [`Mie::new`].
    pub fn mie(spheres: &Spheres) -> Result<Self, PhaseError> {
        MIE_TABLES_IN_USE
            .try_get(spheres.key(), || Mie::new(spheres))
            .map(Phase::Mie)
    }

    /// Creates the phase function of mirror-like flakes whose normals are distributed like the
    /// normals of an ellipsoid. `matrix` holds the elements xx, yy, zz, xy, xz, yz of the matrix S
    /// ([`Sggx`]).
    ///
    /// # Errors
    /// Fails if the matrix is not positive definite.
    pub fn sggx(matrix: [f64; 6]) -> Result<Self, PhaseError> {
        Sggx::new(matrix).map(|flakes| Phase::Sggx(Box::new(flakes)))
    }

    /// Creates (1 − `weight`) times the first phase function plus `weight`, in [0, 1], times the
    /// second.
    ///
    /// # Errors
    /// Fails if the weight lies outside [0, 1].
    pub fn blend(phases: [Phase; 2], weight: f64) -> Result<Self, PhaseError> {
        Phase::blend_by(phases, VolumeTexture::Uniform(Spectrum::splat(weight)))
    }

    /// Creates a mixture like [`Phase::blend`], with a weight that varies in space: the first
    /// channel of `weight`.
    ///
    /// # Errors
    /// Fails if a weight lies outside [0, 1].
    pub fn blend_by(phases: [Phase; 2], weight: VolumeTexture) -> Result<Self, PhaseError> {
        BlendPhase::new(phases, weight).map(|blend| Phase::Blend(Box::new(blend)))
    }

    /// Creates a phase function by linear interpolation of `values` at increasing `cosines` from −1
    /// to 1. It is normalised here.
    ///
    /// # Errors
    /// Fails like [`Tabulated::new`].
    pub fn tabulated(cosines: Vec<f64>, values: &[f64]) -> Result<Self, PhaseError> {
        Tabulated::new(cosines, values).map(Phase::Tabulated)
    }

    /// Creates a phase function that scatters as often to cosines between any two neighbouring
    /// `quantiles`, which increase strictly from −1 to 1. Between them its density is constant.
    ///
    /// # Errors
    /// Fails like [`Quantiles::new`].
    pub fn quantiles(quantiles: Vec<f64>) -> Result<Self, PhaseError> {
        Quantiles::new(quantiles).map(|phase| Phase::Quantiles(Arc::new(phase)))
    }

    /// Returns the phase function of a label of a grid, if it is known.
    pub fn of_label(&self, labels: &Arc<LabelGrid>, label: usize) -> Option<&Phase> {
        match self {
            Phase::ByLabel(p) => p.of_label(labels, label),
            _ => Some(self),
        }
    }

    /// Returns the flakes, if the phase function depends on their orientation. The extinction of
    /// the medium then depends on the direction.
    #[inline]
    pub fn flakes(&self) -> Option<&Sggx> {
        match self {
            Phase::Sggx(flakes) => Some(flakes),
            _ => None,
        }
    }

    /// Returns the density per steradian at `x` of scattering from one unit propagation direction
    /// into another.
    pub fn pdf(&self, x: DVec3, [from, to]: [DVec3; 2]) -> f64 {
        match self {
            Phase::Sggx(p) => p.pdf(x, [from, to]),
            _ => self.pdf_at_cosine(x, from.dot(to)),
        }
    }

    /// Returns the density per steradian at `x`, at the cosine between the directions before and
    /// after, for phase functions without flakes.
    fn pdf_at_cosine(&self, x: DVec3, cos: f64) -> f64 {
        let cos = cos.clamp(-1.0, 1.0);
        match self {
            Phase::Isotropic(p) => p.pdf(),
            Phase::HenyeyGreenstein(p) => p.pdf(cos),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).pdf(cos),
            Phase::VonMisesFisher(p) => p.pdf(cos),
            Phase::Rayleigh(p) => p.pdf(cos),
            Phase::Tabulated(p) => p.pdf(cos),
            Phase::Quantiles(p) => p.pdf(cos),
            Phase::Mie(p) => p.pdf(cos),
            Phase::Sggx(_) => Isotropic.pdf(),
            Phase::Blend(p) => p.pdf(x, cos),
            Phase::ByLabel(p) => p.at(x).pdf_at_cosine(x, cos),
        }
    }

    /// Returns the Mueller matrix of scattering at `x`. `cos` is the cosine between the directions
    /// before and after. The first axis of the frames is perpendicular to the plane of scattering.
    /// Phase functions without a known effect on polarisation depolarise.
    pub fn mueller(&self, x: DVec3, cos: f64) -> PlaneMueller {
        let cos = cos.clamp(-1.0, 1.0);
        match self {
            Phase::Rayleigh(_) => Rayleigh::mueller(cos),
            Phase::Mie(p) => p.mueller(cos),
            Phase::Blend(p) => p.mueller(x, cos),
            Phase::ByLabel(p) => p.at(x).mueller(x, cos),
            _ => PlaneMueller::DEPOLARIZER,
        }
    }

    /// Returns true if all scattered light counts as unpolarised.
    pub fn depolarizes(&self) -> bool {
        !matches!(
            self,
            Phase::Rayleigh(_) | Phase::Mie(_) | Phase::Blend(_) | Phase::ByLabel(_)
        )
    }

    /// Samples the direction after scattering at `x` of the unit propagation direction `dir`.
    /// Returns it with its density.
    pub fn sample(&self, x: DVec3, dir: DVec3, u: [f64; 2]) -> (DVec3, f64) {
        if let Phase::Sggx(flakes) = self {
            return flakes.sample(x, dir, u);
        }
        let (angle, pdf) = self.angle(x, u[0]);
        (angle.around(dir, u[1]), pdf)
    }

    /// Returns true if the scattering angle has one distribution, for all positions and directions.
    pub fn is_uniform(&self) -> bool {
        match self {
            Phase::HenyeyGreensteinGrid(_) | Phase::ByLabel(_) | Phase::Sggx(_) => false,
            Phase::Blend(p) => p.is_uniform(),
            _ => true,
        }
    }

    /// Samples the direction after scattering of the unit propagation direction `dir`, if the phase
    /// function [is uniform](Phase::is_uniform). `around` is the cosine and sine of the azimuth.
    #[inline]
    pub fn turn(&self, dir: DVec3, u: f64, around: [f64; 2]) -> DVec3 {
        let angle = match self {
            // Skip the density for the most common phase function.
            Phase::HenyeyGreenstein(p) => p.angle(u),
            _ => self.angle(DVec3::ZERO, u).0,
        };
        angle.turned(dir, around)
    }

    /// Samples the scattering angle of phase functions without flakes. Returns it with the density
    /// of directions there.
    fn angle(&self, x: DVec3, u: f64) -> (Polar, f64) {
        match self {
            Phase::Isotropic(p) => p.sample(u),
            Phase::HenyeyGreenstein(p) => p.sample(u),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).sample(u),
            Phase::VonMisesFisher(p) => p.sample(u),
            Phase::Rayleigh(p) => p.sample(u),
            Phase::Tabulated(p) => p.sample(u),
            Phase::Quantiles(p) => p.sample(u),
            Phase::Mie(p) => p.sample(u),
            Phase::Sggx(_) => Isotropic.sample(u),
            Phase::Blend(p) => p.sample(x, u),
            Phase::ByLabel(p) => p.at(x).angle(x, u),
        }
    }

    /// Returns the mean cosine at `x`; `None` for flakes, because it depends on the direction.
    pub fn mean_cosine(&self, x: DVec3) -> Option<f64> {
        Some(match self {
            Phase::Isotropic(_) | Phase::Rayleigh(_) => 0.0,
            Phase::HenyeyGreenstein(p) => p.mean_cosine(),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).mean_cosine(),
            Phase::VonMisesFisher(p) => p.mean_cosine(),
            Phase::Tabulated(p) => p.mean_cosine(),
            Phase::Quantiles(p) => p.mean_cosine(),
            Phase::Mie(p) => p.mean_cosine(),
            Phase::Sggx(_) => return None,
            Phase::Blend(p) => return p.mean_cosine(x),
            Phase::ByLabel(p) => return p.at(x).mean_cosine(x),
        })
    }

    /// Returns the derivative of log p with respect to the mean cosine g at `x`. It is non-zero for
    /// Henyey–Greenstein functions, including isotropic scattering with g = 0, and zero for others.
    pub fn log_derivative(&self, x: DVec3, cos: f64) -> f64 {
        match self {
            Phase::Isotropic(_) => HenyeyGreenstein::ISOTROPIC.log_derivative(cos),
            Phase::HenyeyGreenstein(p) => p.log_derivative(cos),
            Phase::HenyeyGreensteinGrid(g) => HenyeyGreenstein::of_grid(g, x).log_derivative(cos),
            Phase::ByLabel(p) => p.at(x).log_derivative(x, cos),
            _ => 0.0,
        }
    }

    /// Returns true if the phase function is Henyey–Greenstein everywhere, so that g is a
    /// parameter. Within a label, it may also be isotropic.
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

    /// Returns the memory of grids and of the tables of spheres, in bytes.
    pub(crate) fn memory(&self) -> usize {
        match self {
            Phase::Mie(p) => p.memory(),
            Phase::HenyeyGreensteinGrid(g) => g.memory(),
            Phase::Sggx(p) => p.memory(),
            Phase::Blend(p) => p.memory(),
            Phase::ByLabel(p) => p.memory(),
            _ => 0,
        }
    }
}
