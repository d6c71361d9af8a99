//! Cumulative sums shared by the tabulated distributions.

use super::DistributionError;

/// Normalised cumulative sums of non-negative weights: c₀ = 0, …, cₙ = 1.
#[derive(Clone, Debug)]
pub(super) struct Cdf {
    cumulative: Vec<f64>,
    total: f64,
}

impl Cdf {
    /// Sums weights that are known to be finite and ≥ 0.
    pub(super) fn new(weights: impl Iterator<Item = f64>) -> Result<Self, DistributionError> {
        let mut cumulative = vec![0.0];
        let mut total = 0.0;
        for w in weights {
            total += w;
            cumulative.push(total);
        }
        if cumulative.len() < 2 {
            return Err(DistributionError::Empty);
        }
        if !(total > 0.0 && f64::is_finite(total)) {
            return Err(DistributionError::Total { total });
        }
        // Division is monotone and total/total is exactly 1, so the last entries are exact.
        cumulative.iter_mut().for_each(|c| *c /= total);
        Ok(Cdf { cumulative, total })
    }

    /// Returns the sum of the weights.
    pub(super) fn total(&self) -> f64 {
        self.total
    }

    /// Returns the memory of the sums in bytes.
    pub(super) fn memory(&self) -> usize {
        size_of_val(&*self.cumulative)
    }

    /// Returns the number of weights.
    pub(super) fn len(&self) -> usize {
        self.cumulative.len() - 1
    }

    /// Returns the probability of entry `i`.
    pub(super) fn probability(&self, i: usize) -> f64 {
        self.cumulative[i + 1] - self.cumulative[i]
    }

    /// Returns the entry that contains `u`, never one of probability zero, and the position in it,
    /// in [0, 1).
    pub(super) fn locate(&self, u: f64) -> (usize, f64) {
        // cᵢ ≤ u < cᵢ₊₁ implies that entry i is wider than zero; u < 1 = cₙ bounds the search.
        let u = u.clamp(0.0, 1.0 - f64::EPSILON / 2.0);
        let i = self.cumulative.partition_point(|&c| c <= u) - 1;
        (
            i,
            ((u - self.cumulative[i]) / self.probability(i)).min(1.0 - f64::EPSILON / 2.0),
        )
    }

    /// Returns the `u` that [`Cdf::locate`] maps to entry `i` and fraction `t`.
    pub(super) fn unlocate(&self, i: usize, t: f64) -> f64 {
        self.cumulative[i] + t * self.probability(i)
    }
}
