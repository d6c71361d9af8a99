//! A point that throws an image, as a slide projector does.

use crate::sampling::{DistributionError, Grid2};
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::PI;

/// A projector (Mitsuba's `projector`). A white diffuse screen across its axis at unit distance shows the image,
/// pixel by pixel.
#[derive(Clone, Debug)]
pub struct Projector {
    position: DVec3,
    /// Local axes: +x to the left of the image, +y up, +z forwards.
    orientation: Orientation,
    /// Half extents of the image at unit distance.
    half: [f64; 2],
    size: [usize; 2],
    pixels: Vec<Spectrum>,
    distribution: Grid2,
}

impl Projector {
    /// An image of `size` (width, height), row by row from the top, that is `fov_x` wide, in radians in
    /// (0, π). Pixels are radiances of the screen, ≥ 0, not all 0, and as many as `size` says.
    pub fn new(
        position: DVec3,
        orientation: Orientation,
        fov_x: f64,
        size: [usize; 2],
        pixels: Vec<Spectrum>,
    ) -> Result<Self, DistributionError> {
        let weights: Vec<f64> = pixels.iter().map(|p| p.sum()).collect();
        let half = (0.5 * fov_x).tan();
        Ok(Projector {
            position,
            orientation,
            half: [half, half * size[1] as f64 / size[0] as f64],
            size,
            distribution: Grid2::new(size[0], size[1], &weights)?,
            pixels,
        })
    }

    /// Where the light is.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Image coordinates in [0, 1]² from the top left of a unit direction, and its cosine to the axis; `None`
    /// beside the image.
    fn locate(&self, direction: DVec3) -> Option<([f64; 2], f64)> {
        let d = self.orientation.to_local(direction);
        if d.z <= 0.0 {
            return None;
        }
        let uv = [0, 1].map(|k| 0.5 * (1.0 - d[k] / (d.z * self.half[k])));
        uv.iter()
            .all(|c| (0.0..=1.0).contains(c))
            .then_some((uv, d.z))
    }

    /// Radiant intensity in a unit direction: at unit distance an irradiance of π times the pixel falls across
    /// the axis, so that I = π L/cos³θ.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let Some((uv, cos)) = self.locate(direction) else {
            return Spectrum::ZERO;
        };
        let [x, y] = [0, 1].map(|k| {
            let n = self.size[k];
            ((uv[k] * n as f64) as usize).min(n - 1)
        });
        self.pixels[y * self.size[0] + x] * (PI / cos.powi(3))
    }

    /// Total power: π times the pixels' mean times the area of the screen.
    pub fn power(&self) -> Spectrum {
        let sum = self.pixels.iter().fold(Spectrum::ZERO, |sum, p| sum + *p);
        sum * (PI * self.area() / self.pixels.len() as f64)
    }

    /// Area of the image at unit distance.
    fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1]
    }

    /// A direction in proportion to the image, summed over channels, on the screen.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let (uv, _) = self.distribution.sample(u);
        let [x, y] = [0, 1].map(|k| (1.0 - 2.0 * uv[k]) * self.half[k]);
        self.orientation.to_world(DVec3::new(x, y, 1.0).normalize())
    }

    /// Density of [`Projector::sample`] per steradian: dΩ = cos³θ dA.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        self.locate(direction).map_or(0.0, |(uv, cos)| {
            self.distribution.pdf(uv) / (self.area() * cos.powi(3))
        })
    }
}
