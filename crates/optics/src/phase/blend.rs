//! A mixture of two phase functions.

use super::polar::Polar;
use super::{Phase, PhaseError};
use crate::mueller::PlaneMueller;
use crate::volume::VolumeTexture;
use glam::DVec3;

/// (1 − w) of one phase function plus w of another; w may vary in space.
#[derive(Clone, Debug)]
pub struct BlendPhase {
    phases: [Phase; 2],
    weight: VolumeTexture,
}

impl BlendPhase {
    /// `weight` is that of the second: its first channel, in [0, 1].
    ///
    /// # Errors
    /// A weight outside [0, 1].
    pub fn new(phases: [Phase; 2], weight: VolumeTexture) -> Result<Self, PhaseError> {
        let (low, high) = weight.range();
        match [low, high].into_iter().find(|w| !(0.0..=1.0).contains(w)) {
            Some(wrong) => Err(PhaseError::Weight(wrong)),
            None => Ok(BlendPhase { phases, weight }),
        }
    }

    /// Density per steradian at `x`.
    pub fn pdf(&self, x: DVec3, cos: f64) -> f64 {
        self.mean(x, |phase| phase.pdf(x, cos))
    }

    /// What scattering does to polarisation: each phase function's part of it.
    pub(super) fn mueller(&self, x: DVec3, cos: f64) -> PlaneMueller {
        let [first, second] = &self.phases;
        let part = self.weight.at(x)[0] * second.pdf(x, cos);
        let whole = self.pdf(x, cos);
        let weight = if whole > 0.0 { part / whole } else { 0.0 };
        first.mueller(x, cos).mixed(&second.mueller(x, cos), weight)
    }

    /// One of the two by chance, with what is left of the random number for its angle.
    pub(super) fn sample(&self, x: DVec3, u: f64) -> (Polar, f64) {
        let weight = self.weight.at(x)[0];
        let [first, second] = &self.phases;
        let (chosen, other, share, u) = if u < weight {
            (second, first, weight, u / weight)
        } else {
            let share = 1.0 - weight;
            (first, second, share, (u - weight) / share)
        };
        // Rounding may make it 1.
        let (angle, pdf) = chosen.angle(x, u.min(1.0f64.next_down()));
        (
            angle,
            share * pdf + (1.0 - share) * other.pdf(x, angle.cos()),
        )
    }

    /// Mean of the cosine at `x`.
    pub fn mean_cosine(&self, x: DVec3) -> f64 {
        self.mean(x, |phase| phase.mean_cosine(x))
    }

    /// Whether it is the same everywhere.
    pub(super) fn is_uniform(&self) -> bool {
        self.weight.uniform().is_some() && self.phases.iter().all(Phase::is_uniform)
    }

    /// Bytes held by grids.
    pub(super) fn memory(&self) -> usize {
        self.weight.memory() + self.phases.iter().map(Phase::memory).sum::<usize>()
    }

    fn mean(&self, x: DVec3, of: impl Fn(&Phase) -> f64) -> f64 {
        let weight = self.weight.at(x)[0];
        let [first, second] = &self.phases;
        (1.0 - weight) * of(first) + weight * of(second)
    }
}
