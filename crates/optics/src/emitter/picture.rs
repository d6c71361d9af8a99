//! Projected image, with the distribution of its light.

use super::slide::Slide;
use crate::Spectrum;
use crate::sampling::grid2::PickedCell;
use crate::sampling::{DistributionError, Grid2};

/// Slide, and a density over it proportional to the sum of its channels.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    slide: Slide,
    /// Distribution over the cells between the centres of pixels, cut at the edges of the image. If
    /// the filter is `nearest`, the cells are the pixels.
    distribution: Grid2,
}

impl Picture {
    pub(super) fn new(slide: Slide) -> Result<Self, DistributionError> {
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
        Ok(Picture {
            distribution: Grid2::new(columns, rows, &weights)?,
            slide,
        })
    }

    /// Returns the image.
    pub(super) fn slide(&self) -> &Slide {
        &self.slide
    }

    /// Returns the value at image coordinates in [0, 1]² from the top left.
    pub(super) fn at(&self, uv: [f64; 2]) -> Spectrum {
        self.slide.at(uv)
    }

    /// Returns the mean value.
    pub(super) fn mean(&self) -> Spectrum {
        self.slide.mean()
    }

    /// Samples image coordinates with density proportional to the values, summed over channels.
    pub(super) fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        let PickedCell { cell, within } = self.distribution.pick(u);
        let within = self.slide.values(cell).sample(within);
        self.slide.coordinates(cell, within)
    }

    /// Returns the density of [`Picture::sample`] over the unit square.
    pub(super) fn pdf(&self, uv: [f64; 2]) -> f64 {
        let (cell, within) = self.slide.locate(uv);
        let share = self.distribution.probability(cell) / self.slide.area(cell);
        share * self.slide.values(cell).pdf(within)
    }
}
