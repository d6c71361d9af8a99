//! Choice among finitely many entries.

use super::cdf::Cdf;
use super::{DistributionError, check_values};

/// Picks an index with probability proportional to its weight, for example an emitter by its power.
#[derive(Clone, Debug)]
pub struct Discrete(Cdf);

/// One pick of [`Discrete::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Chosen entry; its probability is never zero.
    pub index: usize,
    /// Its probability.
    pub probability: f64,
    /// What is left of the random number: uniform in [0, 1) and independent of the index.
    pub u: f64,
}

impl Discrete {
    /// From weights that are finite, ≥ 0 and not all zero.
    ///
    /// # Errors
    /// No weights; weights that are negative or not finite, all zero, or too large to be added.
    pub fn new(weights: &[f64]) -> Result<Self, DistributionError> {
        check_values(weights)?;
        Cdf::new(weights.iter().copied()).map(Discrete)
    }

    /// Picks an entry.
    pub fn sample(&self, u: f64) -> Pick {
        let (index, u) = self.0.locate(u);
        Pick {
            index,
            probability: self.0.probability(index),
            u,
        }
    }

    /// The random number that picks `index` and leaves `u`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn inverse(&self, index: usize, u: f64) -> f64 {
        self.0.unlocate(index, u)
    }

    /// Probability of `index`; 0 out of range.
    pub fn pdf(&self, index: usize) -> f64 {
        if index < self.0.len() {
            self.0.probability(index)
        } else {
            0.0
        }
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.0.total()
    }
}
