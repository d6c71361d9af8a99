//! A point that throws an image, as a slide projector does.

use super::slide::Slide;
use crate::sampling::grid2::PickedCell;
use crate::sampling::{DistributionError, Grid2};
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::PI;

/// A projector (Mitsuba's `projector`). A white diffuse screen across its axis at unit distance shows the image.
#[derive(Clone, Debug)]
pub struct Projector {
    position: DVec3,
    /// Local axes: +x to the left of the image, +y up, +z forwards.
    orientation: Orientation,
    /// Half extents of the image at unit distance.
    half: [f64; 2],
    slide: Slide,
    /// Cells between the centres of pixels, cut at the image's edges; pixels if the filter is `nearest`.
    distribution: Grid2,
}

impl Projector {
    /// An image that is `fov_x` wide, in radians in (0, π).
    pub fn new(
        position: DVec3,
        orientation: Orientation,
        fov_x: f64,
        slide: Slide,
    ) -> Result<Self, DistributionError> {
        let expected = slide.size[0].saturating_mul(slide.size[1]);
        if slide.pixels.len() != expected || expected == 0 {
            let got = slide.pixels.len();
            return Err(DistributionError::Length { expected, got });
        }
        let weights: Vec<f64> = slide
            .cells()
            .map(|cell| slide.values(cell).mean() * slide.area(cell))
            .collect();
        let [columns, rows] = slide.counts();
        let half = (0.5 * fov_x).tan();
        Ok(Projector {
            position,
            orientation,
            half: [half, half * slide.size[1] as f64 / slide.size[0] as f64],
            distribution: Grid2::new(columns, rows, &weights)?,
            slide,
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
        self.slide.at(uv) * (PI / cos.powi(3))
    }

    /// Total power: π times the image's mean times the area of the screen.
    pub fn power(&self) -> Spectrum {
        self.slide.mean() * (PI * self.area())
    }

    /// Area of the image at unit distance.
    fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1]
    }

    /// A direction in proportion to the image, summed over channels, on the screen.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let PickedCell { cell, within } = self.distribution.pick(u);
        let within = self.slide.values(cell).sample(within);
        let uv = self.slide.coordinates(cell, within);
        let [x, y] = [0, 1].map(|k| (1.0 - 2.0 * uv[k]) * self.half[k]);
        self.orientation.to_world(DVec3::new(x, y, 1.0).normalize())
    }

    /// Density of [`Projector::sample`] per steradian: dΩ = cos³θ dA.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        self.locate(direction).map_or(0.0, |(uv, cos)| {
            let (cell, within) = self.slide.locate(uv);
            let share = self.distribution.probability(cell) / self.slide.area(cell);
            share * self.slide.values(cell).pdf(within) / (self.area() * cos.powi(3))
        })
    }
}
