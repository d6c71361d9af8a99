//! Random choice among finitely many entries.

use super::cdf::Cdf;
use super::{DistributionError, check_values};

/// Distribution over indices with probabilities proportional to weights, for example over emitters
/// by power.
#[derive(Clone, Debug)]
pub struct Discrete(Cdf);

/// Result of [`Discrete::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Chosen entry; its probability is never zero.
    pub index: usize,
    /// Probability of the entry.
    pub probability: f64,
    /// Remaining random number: uniform in [0, 1) and independent of the index.
    pub u: f64,
}

impl Discrete {
    /// Creates the distribution from weights that are finite, ≥ 0 and not all zero.
    ///
    /// # Errors
    /// Fails if there are no weights, or if a weight is negative or not finite. Fails if the
    /// weights are all zero or too large to be added.
    pub fn new(weights: &[f64]) -> Result<Self, DistributionError> {
        check_values(weights)?;
        Cdf::new(weights.iter().copied()).map(Discrete)
    }

    /// Samples an entry.
    pub fn sample(&self, u: f64) -> Pick {
        let (index, u) = self.0.locate(u);
        Pick {
            index,
            probability: self.0.probability(index),
            u,
        }
    }

    /// Returns the random number for which [`Discrete::sample`] picks `index` and leaves `u`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn inverse(&self, index: usize, u: f64) -> f64 {
        self.0.unlocate(index, u)
    }

    /// Returns the probability of `index`; 0 out of range.
    pub fn pdf(&self, index: usize) -> f64 {
        if index < self.0.len() {
            self.0.probability(index)
        } else {
            0.0
        }
    }

    /// Returns the sum of the weights.
    pub fn total(&self) -> f64 {
        self.0.total()
    }
}
