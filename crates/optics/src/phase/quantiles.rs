//! Phase function from the quantiles of the cosine.

use super::PhaseError;
use super::polar::Polar;
use crate::sampling::PiecewiseConstant;
use std::f64::consts::TAU;

/// Phase function with a density of cosθ that is constant between quantiles.
#[derive(Clone, Debug)]
pub struct Quantiles {
    distribution: PiecewiseConstant,
    mean_cosine: f64,
}

impl Quantiles {
    /// Creates the phase function. Light is as often scattered to cosines between any two
    /// neighbouring `quantiles`, which increase strictly from −1 to 1.
    ///
    /// # Errors
    /// Fails if there are fewer than two quantiles, or if they do not increase from −1 to 1.
    pub fn new(quantiles: Vec<f64>) -> Result<Self, PhaseError> {
        if let [first, .., last] = quantiles[..]
            && (first != -1.0 || last != 1.0)
        {
            return Err(PhaseError::Span { first, last });
        }
        let pairs = quantiles.windows(2);
        let (densities, middles): (Vec<f64>, Vec<f64>) = pairs
            .map(|pair| (1.0 / (pair[1] - pair[0]), 0.5 * (pair[0] + pair[1])))
            .unzip();
        let mean_cosine = middles.iter().sum::<f64>() / middles.len() as f64;
        Ok(Quantiles {
            distribution: PiecewiseConstant::new(quantiles, &densities)?,
            mean_cosine,
        })
    }

    /// Returns the density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.distribution.pdf(cos) / TAU
    }

    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        let (cos, density) = self.distribution.sample(u);
        (Polar::from_cos(cos), density / TAU)
    }

    /// Returns the mean cosine.
    pub fn mean_cosine(&self) -> f64 {
        self.mean_cosine
    }
}
