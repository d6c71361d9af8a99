//! Light from all around: constant, or an image.

use crate::sampling::DistributionError;
use crate::sampling::Grid2;
use crate::sampling::sphere::{uniform_sphere_pdf, uniform_sphere_sample};
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Why an image cannot serve as an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// The number of pixels is not width × height, or one of them is zero.
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
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// The image cannot be sampled.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

/// Radiance as a function of direction, in the ambient medium.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same from everywhere.
    Constant(Spectrum),
    /// An equirectangular image.
    Image(Arc<Image>),
}

impl Environment {
    /// An environment from an equirectangular image, row by row from the top, in Mitsuba's
    /// convention: local +y is up, the left edge of the image is seen in local direction −z and u = ¼ in local
    /// direction +x. Pixels are constant over their area.
    pub fn image(
        width: usize,
        height: usize,
        pixels: Vec<Spectrum>,
        orientation: Orientation,
    ) -> Result<Self, ImageError> {
        Ok(Environment::Image(Arc::new(Image::new(
            width,
            height,
            pixels,
            orientation,
        )?)))
    }

    /// Radiance that arrives from the unit direction `toward`, against which the light travels.
    pub fn radiance(&self, toward: DVec3) -> Spectrum {
        match self {
            Environment::Constant(radiance) => *radiance,
            Environment::Image(image) => image.radiance(toward),
        }
    }

    /// A unit direction towards the environment, in proportion to its radiance but for the variation
    /// of sin θ over a pixel, and its density per steradian; `u` is uniform in [0, 1)².
    pub fn sample(&self, u: [f64; 2]) -> (DVec3, f64) {
        match self {
            Environment::Constant(_) => (uniform_sphere_sample(u), uniform_sphere_pdf()),
            Environment::Image(image) => image.sample(u),
        }
    }

    /// Density of [`Environment::sample`] per steradian in the unit direction `toward`.
    pub fn pdf(&self, toward: DVec3) -> f64 {
        match self {
            Environment::Constant(_) => uniform_sphere_pdf(),
            Environment::Image(image) => image.pdf(toward),
        }
    }

    /// ∫ radiance over all directions.
    pub(super) fn integral(&self) -> Spectrum {
        match self {
            Environment::Constant(radiance) => *radiance * (4.0 * PI),
            Environment::Image(image) => image.integral(),
        }
    }

    pub(super) fn kind(&self) -> &'static str {
        match self {
            Environment::Constant(_) => "constant",
            Environment::Image(_) => "envmap",
        }
    }
}

/// An equirectangular image that is sampled in proportion to its radiance.
#[derive(Clone, Debug)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<Spectrum>,
    orientation: Orientation,
    distribution: Grid2,
}

impl Image {
    fn new(
        width: usize,
        height: usize,
        pixels: Vec<Spectrum>,
        orientation: Orientation,
    ) -> Result<Self, ImageError> {
        if pixels.len() != width * height || pixels.is_empty() {
            return Err(ImageError::Size {
                width,
                height,
                found: pixels.len(),
            });
        }
        let bad = |p: &Spectrum| !(p.is_finite() && p.0.iter().all(|&v| v >= 0.0));
        if let Some(i) = pixels.iter().position(bad) {
            return Err(ImageError::Pixel {
                x: i % width,
                y: i / width,
            });
        }
        // The solid angle of a pixel shrinks towards the poles as sin θ.
        let weights: Vec<f64> = pixels
            .iter()
            .enumerate()
            .map(|(i, p)| p.sum() * (PI * ((i / width) as f64 + 0.5) / height as f64).sin())
            .collect();
        Ok(Image {
            width,
            height,
            pixels,
            orientation,
            distribution: Grid2::new(width, height, &weights)?,
        })
    }

    /// Image coordinates (u, v) in [0, 1]² of a direction, and sin θ. Sines and the arc tangent keep
    /// their digits near the poles, where the cosine loses them.
    fn locate(&self, toward: DVec3) -> ([f64; 2], f64) {
        let d = self.orientation.to_local(toward);
        let u = d.x.atan2(-d.z) / TAU;
        let sin = d.x.hypot(d.z);
        ([u - u.floor(), sin.atan2(d.y) / PI], sin)
    }

    fn radiance(&self, toward: DVec3) -> Spectrum {
        let ([u, v], _) = self.locate(toward);
        let x = ((u * self.width as f64) as usize).min(self.width - 1);
        let y = ((v * self.height as f64) as usize).min(self.height - 1);
        self.pixels[y * self.width + x]
    }

    /// Pixels times their solid angles.
    fn integral(&self) -> Spectrum {
        let cos = |row: usize| (PI * row as f64 / self.height as f64).cos();
        let rows = self.pixels.chunks_exact(self.width).enumerate();
        let total = rows.fold(Spectrum::ZERO, |total, (row, pixels)| {
            let sum = pixels.iter().fold(Spectrum::ZERO, |sum, p| sum + *p);
            total + sum * (cos(row) - cos(row + 1))
        });
        total * (TAU / self.width as f64)
    }

    fn sample(&self, u: [f64; 2]) -> (DVec3, f64) {
        let ([u, v], pdf) = self.distribution.sample(u);
        let ((sin_phi, cos_phi), (sin, cos)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
        let local = DVec3::new(sin_phi * sin, cos, -cos_phi * sin);
        (
            self.orientation.to_world(local),
            pdf / (TAU * PI * sin.max(1e-300)),
        )
    }

    fn pdf(&self, toward: DVec3) -> f64 {
        let (uv, sin) = self.locate(toward);
        self.distribution.pdf(uv) / (TAU * PI * sin.max(1e-300))
    }
}
