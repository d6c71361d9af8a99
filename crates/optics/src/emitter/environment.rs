//! Light from all directions at infinity: constant, an image, or a disc.

use super::distant_disc::DistantDisc;
use super::environment_map::EnvironmentMap;
use crate::sampling::DistributionError;
use crate::sampling::sphere::{uniform_sphere_pdf, uniform_sphere_sample};
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// Reason why an image cannot serve as an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// The number of pixels is zero or differs from width × height.
    #[error("expected {width} × {height} pixels, found {found}")]
    Size {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Number of pixels given.
        found: usize,
    },
    /// A pixel is negative or not finite.
    #[error("pixel ({x}, {y}) is negative or not finite")]
    Pixel {
        /// Column of the pixel.
        x: usize,
        /// Row of the pixel.
        y: usize,
    },
    /// The image cannot be sampled.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

/// Radiance as a function of direction, in the ambient medium.
#[derive(Clone, Debug)]
pub enum Environment {
    /// Same radiance from all directions.
    Constant(Spectrum),
    /// Equirectangular image.
    Image(Arc<EnvironmentMap>),
    /// Disc with darkness around it.
    Disc(DistantDisc),
}

impl Environment {
    /// Creates an environment from an equirectangular image, row by row from the top, in Mitsuba's
    /// convention. Local +y is up. The left edge of the image is seen in local direction −z, and u
    /// = ¼ in local direction +x. Radiance is bilinear in longitude and colatitude between the
    /// centres of pixels. Pixels of the first row lie at the upper pole, pixels of the last row at
    /// the lower pole. Images of fewer than three rows repeat the last row.
    ///
    /// # Errors
    /// Fails if the number of pixels is zero or does not match. Fails if a pixel is negative or not
    /// finite, or if all are black.
    pub fn image(
        width: usize,
        height: usize,
        pixels: Vec<Spectrum>,
        orientation: Orientation,
    ) -> Result<Self, ImageError> {
        Ok(Environment::Image(Arc::new(EnvironmentMap::new(
            width,
            height,
            pixels,
            orientation,
        )?)))
    }

    /// Returns the radiance that arrives from the unit direction `toward`, opposite to the
    /// propagation of the light.
    pub fn radiance(&self, toward: DVec3) -> Spectrum {
        match self {
            Environment::Constant(radiance) => *radiance,
            Environment::Image(image) => image.radiance(toward),
            Environment::Disc(disc) => disc.radiance(toward),
        }
    }

    /// Returns the derivative of Σ weight × radiance over the channels with respect to the unit
    /// direction `toward`, perpendicular to it. Returns `None` if the radiance is discontinuous.
    pub fn gradient(&self, toward: DVec3, weights: Spectrum) -> Option<DVec3> {
        match self {
            Environment::Constant(_) => Some(DVec3::ZERO),
            Environment::Image(image) => Some(image.gradient(toward, weights)),
            Environment::Disc(_) => None,
        }
    }

    /// Samples a unit direction towards the environment, with density nearly proportional to its
    /// radiance. Returns it with its density per steradian. `u` is uniform in [0, 1)².
    pub fn sample(&self, u: [f64; 2]) -> (DVec3, f64) {
        match self {
            Environment::Constant(_) => (uniform_sphere_sample(u), uniform_sphere_pdf()),
            Environment::Image(image) => image.sample(u),
            Environment::Disc(disc) => disc.sample(u),
        }
    }

    /// Returns the density of [`Environment::sample`] per steradian in the unit direction `toward`.
    pub fn pdf(&self, toward: DVec3) -> f64 {
        match self {
            Environment::Constant(_) => uniform_sphere_pdf(),
            Environment::Image(image) => image.pdf(toward),
            Environment::Disc(disc) => disc.pdf(toward),
        }
    }

    /// Returns ∫ radiance over all directions.
    pub(super) fn integral(&self) -> Spectrum {
        match self {
            Environment::Constant(radiance) => *radiance * (4.0 * PI),
            Environment::Image(image) => image.integral(),
            Environment::Disc(disc) => disc.integral(),
        }
    }

    pub(super) fn kind(&self) -> &'static str {
        match self {
            Environment::Constant(_) => "constant",
            Environment::Image(_) => "envmap",
            Environment::Disc(_) => "disc",
        }
    }
}
