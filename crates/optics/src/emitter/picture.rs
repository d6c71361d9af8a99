//! An image that is thrown, with the distribution of its light.

use super::slide::Slide;
use crate::Spectrum;
use crate::sampling::grid2::PickedCell;
use crate::sampling::{DistributionError, Grid2};

/// A slide, and a density over it in proportion to the sum of its channels.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    slide: Slide,
    /// Cells between the centres of pixels, cut at the image's edges; pixels if the filter is `nearest`.
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

    /// The image.
    pub(super) fn slide(&self) -> &Slide {
        &self.slide
    }

    /// Value at image coordinates in [0, 1]² from the top left.
    pub(super) fn at(&self, uv: [f64; 2]) -> Spectrum {
        self.slide.at(uv)
    }

    /// Mean value.
    pub(super) fn mean(&self) -> Spectrum {
        self.slide.mean()
    }

    /// Image coordinates in proportion to the values, summed over channels.
    pub(super) fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        let PickedCell { cell, within } = self.distribution.pick(u);
        let within = self.slide.values(cell).sample(within);
        self.slide.coordinates(cell, within)
    }

    /// Density of [`Picture::sample`] over the unit square.
    pub(super) fn pdf(&self, uv: [f64; 2]) -> f64 {
        let (cell, within) = self.slide.locate(uv);
        let share = self.distribution.probability(cell) / self.slide.area(cell);
        share * self.slide.values(cell).pdf(within)
    }
}
