//! Mixture of two phase functions.

use super::polar::Polar;
use super::{Phase, PhaseError};
use crate::mueller::PlaneMueller;
use crate::volume::VolumeTexture;
use glam::DVec3;

/// Sum of (1 − w) times one phase function and w times another; w may vary in space.
#[derive(Clone, Debug)]
pub struct BlendPhase {
    phases: [Phase; 2],
    weight: VolumeTexture,
}

impl BlendPhase {
    /// Creates the mixture. The first channel of `weight`, in [0, 1], is the weight of the second
    /// phase function.
    ///
    /// # Errors
    /// Fails if a weight lies outside [0, 1], or if a phase function is of flakes.
    pub fn new(phases: [Phase; 2], weight: VolumeTexture) -> Result<Self, PhaseError> {
        if phases.iter().any(|phase| phase.flakes().is_some()) {
            return Err(PhaseError::MixedFlakes);
        }
        let (low, high) = weight.range();
        match [low, high].into_iter().find(|w| !(0.0..=1.0).contains(w)) {
            Some(wrong) => Err(PhaseError::Weight(wrong)),
            None => Ok(BlendPhase { phases, weight }),
        }
    }

    /// Returns the density per steradian at `x`.
    pub fn pdf(&self, x: DVec3, cos: f64) -> f64 {
        self.mean(x, |phase| phase.pdf_at_cosine(x, cos))
    }

    /// Returns the matrix of scattering: the mean of both matrices, weighted by the contributions
    /// of the two phase functions.
    pub(super) fn mueller(&self, x: DVec3, cos: f64) -> PlaneMueller {
        let [first, second] = &self.phases;
        let part = self.weight.at(x)[0] * second.pdf_at_cosine(x, cos);
        let whole = self.pdf(x, cos);
        let weight = if whole > 0.0 { part / whole } else { 0.0 };
        first.mueller(x, cos).mixed(&second.mueller(x, cos), weight)
    }

    /// Chooses one of the two phase functions at random, and samples its angle with the rest of the
    /// random number.
    pub(super) fn sample(&self, x: DVec3, u: f64) -> (Polar, f64) {
        let weight = self.weight.at(x)[0];
        let [first, second] = &self.phases;
        let (chosen, other, share, u) = if u < weight {
            (second, first, weight, u / weight)
        } else {
            let share = 1.0 - weight;
            (first, second, share, (u - weight) / share)
        };
        // Clamp the number, which rounding may increase to 1.
        let (angle, pdf) = chosen.angle(x, u.min(1.0f64.next_down()));
        (
            angle,
            share * pdf + (1.0 - share) * other.pdf_at_cosine(x, angle.cos()),
        )
    }

    /// Returns the mean cosine at `x`.
    pub fn mean_cosine(&self, x: DVec3) -> Option<f64> {
        let weight = self.weight.at(x)[0];
        let [first, second] = &self.phases;
        Some((1.0 - weight) * first.mean_cosine(x)? + weight * second.mean_cosine(x)?)
    }

    /// Returns true if the mixture is uniform in space.
    pub(super) fn is_uniform(&self) -> bool {
        self.weight.uniform().is_some() && self.phases.iter().all(Phase::is_uniform)
    }

    /// Returns the memory of grids in bytes.
    pub(super) fn memory(&self) -> usize {
        self.weight.memory() + self.phases.iter().map(Phase::memory).sum::<usize>()
    }

    fn mean(&self, x: DVec3, of: impl Fn(&Phase) -> f64) -> f64 {
        let weight = self.weight.at(x)[0];
        let [first, second] = &self.phases;
        (1.0 - weight) * of(first) + weight * of(second)
    }
}
