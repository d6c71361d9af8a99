//! Participating media: extinction, albedo, phase function and refractive index.

mod attenuation;
mod labels;

pub(crate) use attenuation::Attenuation;
pub use labels::{MediumLabel, MediumLabels};

use crate::Spectrum;
use crate::phase::Phase;
use crate::volume::VolumeTexture;
use eikonal::Field;
use glam::DVec3;

/// What fills a region of space.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Name used in messages.
    pub name: String,
    /// Refractive index.
    pub index: Field,
    /// Extinction σ_t per unit length, before `scale`; zero where its grid ends.
    pub sigma_t: VolumeTexture,
    /// Multiplies `sigma_t`.
    pub scale: f64,
    /// Albedo σ_s/σ_t, in [0, 1].
    pub albedo: VolumeTexture,
    /// Phase function.
    pub phase: Phase,
    /// Labels of which it is made, if records of detected light tell them apart.
    pub labels: Option<MediumLabels>,
}

impl Medium {
    /// A medium that neither scatters nor absorbs.
    pub fn transparent(name: impl Into<String>, index: impl Into<Field>) -> Self {
        Medium::homogeneous(name, index, Spectrum::ZERO, Spectrum::ZERO)
    }

    /// A medium with the same extinction σ_t (per unit length, finite and not negative) and albedo (in [0, 1]) everywhere, which
    /// scatters isotropically.
    pub fn homogeneous(
        name: impl Into<String>,
        index: impl Into<Field>,
        sigma_t: impl Into<Spectrum>,
        albedo: impl Into<Spectrum>,
    ) -> Self {
        Medium {
            name: name.into(),
            index: index.into(),
            sigma_t: VolumeTexture::Uniform(sigma_t.into()),
            scale: 1.0,
            albedo: VolumeTexture::Uniform(albedo.into()),
            phase: Phase::isotropic(),
            labels: None,
        }
    }

    /// The medium with another phase function.
    pub fn with_phase(self, phase: Phase) -> Self {
        Medium { phase, ..self }
    }

    /// Extinction σ_t at `x`.
    pub fn extinction(&self, x: DVec3) -> Spectrum {
        match &self.sigma_t {
            VolumeTexture::Uniform(sigma) => *sigma * self.scale,
            VolumeTexture::Grid(grid) => grid.within(x) * self.scale,
        }
    }

    /// Scattering coefficient σ_s at `x`.
    pub fn scattering(&self, x: DVec3) -> Spectrum {
        self.extinction(x) * self.albedo.at(x)
    }

    /// Whether light passes unattenuated everywhere.
    pub fn is_transparent(&self) -> bool {
        self.scale == 0.0 || self.sigma_t.is_zero()
    }

    /// Whether light is scattered anywhere.
    pub fn scatters(&self) -> bool {
        !self.is_transparent() && !self.albedo.is_zero()
    }

    /// The extinction if it is the same everywhere.
    pub fn uniform_extinction(&self) -> Option<Spectrum> {
        match &self.sigma_t {
            VolumeTexture::Uniform(sigma) => Some(*sigma * self.scale),
            VolumeTexture::Grid(_) => None,
        }
    }

    /// The absorption coefficient μ_a, if it is the same everywhere.
    pub fn uniform_absorption(&self) -> Option<Spectrum> {
        if self.is_transparent() {
            return Some(Spectrum::ZERO);
        }
        Some(self.uniform_extinction()? * self.albedo.uniform()?.map(|a| 1.0 - a))
    }

    /// Longest piece of a curve over which the extinction is integrated: half a voxel.
    pub fn spacing(&self) -> f64 {
        match &self.sigma_t {
            VolumeTexture::Uniform(_) => f64::INFINITY,
            VolumeTexture::Grid(grid) => 0.5 * grid.voxel(),
        }
    }

    /// Bytes held by grids, of the index included.
    pub fn memory(&self) -> usize {
        self.index.memory() + self.sigma_t.memory() + self.albedo.memory() + self.phase.memory()
    }
}
