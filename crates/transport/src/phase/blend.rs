//! A mixture of two phase functions.

use super::polar::Polar;
use super::{Phase, PhaseError};

/// (1 − w) of one phase function plus w of another.
#[derive(Clone, Debug)]
pub struct BlendPhase {
    phases: [Phase; 2],
    weight: f64,
}

impl BlendPhase {
    /// `weight` in [0, 1] is that of the second.
    pub fn new(phases: [Phase; 2], weight: f64) -> Result<Self, PhaseError> {
        if (0.0..=1.0).contains(&weight) {
            Ok(BlendPhase { phases, weight })
        } else {
            Err(PhaseError::Weight(weight))
        }
    }

    /// Density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.mean(|phase| phase.pdf(cos))
    }

    /// One of the two by chance, with what is left of the random number for its angle.
    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        let [first, second] = &self.phases;
        let (chosen, other, share, u) = if u < self.weight {
            (second, first, self.weight, u / self.weight)
        } else {
            let share = 1.0 - self.weight;
            (first, second, share, (u - self.weight) / share)
        };
        // Rounding may make it 1.
        let (angle, pdf) = chosen.angle(u.min(1.0f64.next_down()));
        (angle, share * pdf + (1.0 - share) * other.pdf(angle.cos()))
    }

    /// Mean of the cosine.
    pub fn mean_cosine(&self) -> f64 {
        self.mean(Phase::mean_cosine)
    }

    fn mean(&self, of: impl Fn(&Phase) -> f64) -> f64 {
        let [first, second] = &self.phases;
        (1.0 - self.weight) * of(first) + self.weight * of(second)
    }
}
