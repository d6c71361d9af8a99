//! Participating media: extinction, albedo, phase function, emission
//! (docs/theory.md#media-that-emit) and refractive index.

mod attenuation;
mod fluorescence;
mod labels;
mod velocity;

pub use attenuation::Attenuation;
pub use fluorescence::Fluorescence;
pub use labels::{MediumLabel, MediumLabels};
pub use velocity::Velocity;

use crate::Spectrum;
use crate::phase::Phase;
use crate::volume::VolumeTexture;
use eikonal::Field;
use glam::DVec3;

/// Medium that fills a region of space.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Name used in messages.
    pub name: String,
    /// Refractive index.
    pub index: Field,
    /// Extinction σ_t per unit length, before multiplication by `scale`. It is zero outside its
    /// grid. If the phase function is of flakes, light along a direction has the extinction σ_t
    /// times the projected area of the flakes.
    pub sigma_t: VolumeTexture,
    /// Factor of `sigma_t`.
    pub scale: f64,
    /// Albedo σ_s/σ_t, in [0, 1].
    pub albedo: VolumeTexture,
    /// Phase function.
    pub phase: Phase,
    /// Radiance B, in a vacuum, of a black body at the temperature of the medium. The medium emits
    /// σ_a n² B per unit length and steradian (Kirchhoff's law). `None` if it does not emit.
    pub emission: Option<VolumeTexture>,
    /// Velocity of the scatterers, unless given by labels; `None` if they rest.
    pub velocity: Option<Velocity>,
    /// Fluorescence, unless given by labels; `None` if the medium does not fluoresce. Meters measure
    /// fluorescent light; pictures leave it out.
    pub fluorescence: Option<Fluorescence>,
    /// Labels that compose the medium, if records of detected light distinguish them.
    pub labels: Option<MediumLabels>,
}

impl Medium {
    /// Creates a medium that neither scatters nor absorbs.
    pub fn transparent(name: impl Into<String>, index: impl Into<Field>) -> Self {
        Medium::homogeneous(name, index, Spectrum::ZERO, Spectrum::ZERO)
    }

    /// Creates a medium with uniform extinction σ_t (per unit length, finite and not negative) and
    /// uniform albedo (in [0, 1]). It scatters isotropically.
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
            fluorescence: None,
            labels: None,
        }
    }

    /// Returns the medium with another phase function.
    pub fn with_phase(self, phase: Phase) -> Self {
        Medium { phase, ..self }
    }

    /// Returns the medium with the emission of a black body of this radiance ≥ 0 in a vacuum. Seen
    /// from a vacuum, the medium has this radiance where it is optically thick, does not scatter,
    /// and its surface does not reflect.
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

    /// Returns B if it is uniform; zero if the medium does not emit or B varies.
    pub fn uniform_emission(&self) -> Spectrum {
        let emission = self.emission.as_ref();
        emission
            .and_then(VolumeTexture::uniform)
            .unwrap_or(Spectrum::ZERO)
    }

    /// Returns the light σ_a n² B emitted at `x`, per unit volume and steradian.
    pub fn emitted(&self, x: DVec3) -> Spectrum {
        let Some(emission) = &self.emission else {
            return Spectrum::ZERO;
        };
        let absorbed = self.albedo.at(x).map(|albedo| 1.0 - albedo);
        let n = self.index.n(x);
        self.extinction(x) * absorbed * emission.at(x) * (n * n)
    }

    /// Returns the extinction at `x` of light along the unit vector `direction` or against it
    /// (docs/theory.md#flakes).
    pub fn extinction_along(&self, x: DVec3, direction: DVec3) -> Spectrum {
        match self.phase.flakes() {
            Some(flakes) => self.extinction(x) * flakes.projected_area(x, direction),
            None => self.extinction(x),
        }
    }

    /// Returns the extinction σ_t at `x`, per projected area if the phase function is of flakes.
    pub fn extinction(&self, x: DVec3) -> Spectrum {
        match &self.sigma_t {
            VolumeTexture::Uniform(sigma) => *sigma * self.scale,
            VolumeTexture::Grid(grid) => grid.within(x) * self.scale,
        }
    }

    /// Returns the scattering coefficient σ_s at `x`.
    pub fn scattering(&self, x: DVec3) -> Spectrum {
        self.extinction(x) * self.albedo.at(x)
    }

    /// Returns true if light passes unattenuated everywhere.
    pub fn is_transparent(&self) -> bool {
        self.scale == 0.0 || self.sigma_t.is_zero()
    }

    /// Returns true if light is scattered anywhere.
    pub fn scatters(&self) -> bool {
        !self.is_transparent() && !self.albedo.is_zero()
    }

    /// Returns the extinction if it is uniform in space and equal in all directions.
    pub fn uniform_extinction(&self) -> Option<Spectrum> {
        if self.phase.flakes().is_some() {
            return None;
        }
        match &self.sigma_t {
            VolumeTexture::Uniform(sigma) => Some(*sigma * self.scale),
            VolumeTexture::Grid(_) => None,
        }
    }

    /// Returns the absorption coefficient μ_a if it is uniform in space and equal in all directions.
    pub fn uniform_absorption(&self) -> Option<Spectrum> {
        if self.is_transparent() {
            return Some(Spectrum::ZERO);
        }
        Some(self.uniform_extinction()? * self.albedo.uniform()?.map(|a| 1.0 - a))
    }

    /// Returns the velocity of the scatterers at `x`, in scene units per second.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        let velocity = match &self.labels {
            Some(labels) => &labels.list()[labels.at(x)].velocity,
            None => &self.velocity,
        };
        velocity.as_ref().map_or(DVec3::ZERO, |v| v.at(x))
    }

    /// Returns true if the scatterers flow anywhere.
    pub fn flows(&self) -> bool {
        match &self.labels {
            Some(labels) => labels.list().iter().any(|label| label.velocity.is_some()),
            None => self.velocity.is_some(),
        }
    }

    /// Returns the fluorescence at `x`.
    pub fn fluorescence_at(&self, x: DVec3) -> Option<&Fluorescence> {
        match &self.labels {
            Some(labels) => labels.list()[labels.at(x)].fluorescence.as_ref(),
            None => self.fluorescence.as_ref(),
        }
    }

    /// Returns all kinds of fluorescence of the medium.
    pub fn fluorescences(&self) -> impl Iterator<Item = &Fluorescence> {
        let labels = self.labels.iter().flat_map(MediumLabels::list);
        let of_labels = labels.filter_map(|label| label.fluorescence.as_ref());
        self.fluorescence.iter().chain(of_labels)
    }

    /// Returns the longest piece of a curve over which the extinction is integrated: half a voxel.
    pub fn spacing(&self) -> f64 {
        match &self.sigma_t {
            VolumeTexture::Uniform(_) => f64::INFINITY,
            VolumeTexture::Grid(grid) => 0.5 * grid.voxel(),
        }
    }

    /// Returns the memory of grids, including the index, in bytes.
    pub fn memory(&self) -> usize {
        let emission = self.emission.as_ref().map_or(0, VolumeTexture::memory);
        let velocity = self.velocity.as_ref().map_or(0, Velocity::memory);
        let coefficients = self.sigma_t.memory() + self.albedo.memory() + emission;
        self.index.memory() + coefficients + velocity + self.phase.memory()
    }
}
