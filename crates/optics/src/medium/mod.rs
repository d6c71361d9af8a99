//! Participating media: extinction, albedo, phase function, emission (docs/theory.md#media-that-emit) and refractive index.

mod attenuation;
mod labels;
mod velocity;

pub use attenuation::Attenuation;
pub use labels::{MediumLabel, MediumLabels};
pub use velocity::Velocity;

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
    /// Radiance B of a black body as warm as the medium, in a vacuum: the medium emits σ_a n² B per unit length and steradian (Kirchhoff's
    /// law). `None` if it is dark.
    pub emission: Option<VolumeTexture>,
    /// How fast what scatters light flows, unless labels say it; `None` if it rests.
    pub velocity: Option<Velocity>,
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
            emission: None,
            velocity: None,
            labels: None,
        }
    }

    /// The medium with another phase function.
    pub fn with_phase(self, phase: Phase) -> Self {
        Medium { phase, ..self }
    }

    /// The medium, emitting as a black body of this radiance ≥ 0 in a vacuum would: seen from there, it is as bright where it is thick, does
    /// not scatter, and nothing is reflected.
    ///
    /// ```
    /// use morgana_optics::medium::Medium;
    /// use morgana_optics::eikonal::field::Constant;
    ///
    /// let flame = Medium::homogeneous("flame", Constant::new(1.5), 2.0, 0.25).with_emission(3.0);
    /// // σ_a n² B
    /// assert_eq!(flame.emitted([0.0; 3].into())[0], 1.5 * 1.5f64.powi(2) * 3.0);
    /// ```
    pub fn with_emission(self, radiance: impl Into<Spectrum>) -> Self {
        Medium {
            emission: Some(VolumeTexture::Uniform(radiance.into())),
            ..self
        }
    }

    /// B, if it is the same everywhere; zero if the medium is dark or B varies.
    pub fn uniform_emission(&self) -> Spectrum {
        let emission = self.emission.as_ref();
        emission
            .and_then(VolumeTexture::uniform)
            .unwrap_or(Spectrum::ZERO)
    }

    /// The light σ_a n² B that leaves `x`, per unit volume and steradian.
    pub fn emitted(&self, x: DVec3) -> Spectrum {
        let Some(emission) = &self.emission else {
            return Spectrum::ZERO;
        };
        let absorbed = self.albedo.at(x).map(|albedo| 1.0 - albedo);
        let n = self.index.n(x);
        self.extinction(x) * absorbed * emission.at(x) * (n * n)
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

    /// How fast what scatters light at `x` flows, in scene units per second.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        let velocity = match &self.labels {
            Some(labels) => &labels.list()[labels.at(x)].velocity,
            None => &self.velocity,
        };
        velocity.as_ref().map_or(DVec3::ZERO, |v| v.at(x))
    }

    /// Whether what scatters light flows anywhere.
    pub fn flows(&self) -> bool {
        match &self.labels {
            Some(labels) => labels.list().iter().any(|label| label.velocity.is_some()),
            None => self.velocity.is_some(),
        }
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
        let emission = self.emission.as_ref().map_or(0, VolumeTexture::memory);
        let velocity = self.velocity.as_ref().map_or(0, Velocity::memory);
        let coefficients = self.sigma_t.memory() + self.albedo.memory() + emission;
        self.index.memory() + coefficients + velocity + self.phase.memory()
    }
}
