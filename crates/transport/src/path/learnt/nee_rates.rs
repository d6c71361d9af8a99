//! Rates of connections from vertices to emitters, and their training.
//!
//! Theory: docs/theory.md#next-event-rates.

use crate::emitter::Class;
use crate::path::segment::Vertex;
use serde::{Deserialize, Serialize};

/// Number of kinds of connections: for each class of emitters, from media and from surfaces.
/// Volumes, the last class, have none, because `path` finds their light along its edges.
pub(crate) const SLOTS: usize = 2 * Class::Volume as usize;
/// Number of levels: rates are 2⁻ᵏ with k below this.
const LEVELS: usize = 7;
/// Number of levels for emitters that only connections find.
const LEVELS_DELTA: usize = 3;
/// Fraction of the variance that is attributed to connections of every kind, whatever the pilot
/// found. Few samples may miss light that only connections find.
const PRIOR_FRACTION: f64 = 0.01;

/// Level k of each kind of connections, 0 to 6: connections are made with probability 2⁻ᵏ, the
/// rate. There are two kinds for each class of emitters in [`Class::ALL`] except the last:
/// connections from media, then connections from surfaces.
pub type Levels = [usize; SLOTS];

/// A kind of connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NeeSlot(usize);

impl NeeSlot {
    /// Connections from a medium to an emitter that cannot be hit.
    pub(crate) const IN_MEDIA_TO_DELTA: NeeSlot = NeeSlot(2 * Class::Delta as usize);

    /// Returns the kind of connections from a vertex to an emitter of a class.
    pub(crate) fn new(class: Class, vertex: &Vertex) -> Self {
        NeeSlot(2 * class as usize + usize::from(vertex.object().is_some()))
    }
}

/// Probabilities with which vertices are connected to an emitter of each class. Light that random
/// walks also find is weighted for a fractional number of connections (Veach 1997, §9.2.2). Any
/// values in (0, 1] are unbiased.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NeeRates([f64; SLOTS]);

impl Default for NeeRates {
    fn default() -> Self {
        NeeRates([1.0; SLOTS])
    }
}

impl NeeRates {
    /// Returns the rates 2⁻ᵏ for given levels k.
    pub fn at(levels: &Levels) -> Self {
        NeeRates(levels.map(probability))
    }

    /// Returns the probability of connections of a kind.
    pub(crate) fn of(&self, slot: NeeSlot) -> f64 {
        self.0[slot.0]
    }

    /// Returns these rates with other probabilities of connections to emitters of a class: from
    /// media, and from surfaces.
    pub fn with(mut self, class: Class, [volume, surface]: [f64; 2]) -> Self {
        self.0[2 * class as usize] = volume;
        self.0[2 * class as usize + 1] = surface;
        self
    }
}

/// Estimates of variance and work for reduced rates, from a pilot that makes all connections.
///
/// Let F be the contribution of a path, and D and c the densities with which a connection and a
/// random walk find it. With a connection made with probability q, both contribute F/(qD + c) =
/// X/(1 − s + qs). Here X = F/(D + c) is the contribution in the pilot and s = D/(D + c) the
/// connection's fraction of the density. The paths themselves do not depend on q. The pilot
/// therefore knows the contribution of each sample up to the random choice of connections, and
/// knows the mean and variance of this choice.
#[derive(Clone, Debug, Default)]
pub struct NeeTraining {
    samples: Vec<ExpectedSample>,
    /// Work for all connections of each kind.
    work: [f64; SLOTS],
}

/// Expected contribution of a pilot's sample at each level of q, by kind of connection.
#[derive(Clone, Copy, Debug, Default)]
struct ExpectedSample {
    mean: [[f64; LEVELS]; SLOTS],
    /// Variance from the random choice of connections.
    variance: [[f64; LEVELS]; SLOTS],
    /// Contribution that does not depend on connections.
    apart: f64,
}

impl ExpectedSample {
    fn mean(&self, levels: &Levels) -> f64 {
        let kinds = self.mean.iter().zip(levels);
        self.apart + kinds.map(|(kind, &level)| kind[level]).sum::<f64>()
    }

    fn variance(&self, levels: &Levels) -> f64 {
        let kinds = self.variance.iter().zip(levels);
        kinds.map(|(kind, &level)| kind[level]).sum()
    }
}

impl NeeTraining {
    /// Begins a sample. The following records belong to it. Samples come in pairs, with one pixel
    /// for each pair.
    pub fn begin(&mut self) {
        self.samples.push(ExpectedSample::default());
    }

    /// Records light that does not depend on connections.
    pub fn apart(&mut self, value: f64) {
        if let Some(sample) = self.samples.last_mut() {
            sample.apart += value;
        }
    }

    /// Records light found by random walks, and the fraction `share` of its density that
    /// connections had in the pilot.
    pub(crate) fn chance(&mut self, slot: NeeSlot, value: f64, share: f64) {
        if let Some(sample) = self.samples.last_mut() {
            for (level, mean) in sample.mean[slot.0].iter_mut().enumerate() {
                // Planted error "light found by chance taken for the same however rare connections are", found by morgana-transport/transport::connections::a_pilot_foretells_variances:
                // *mean += value;
                *mean += value / (1.0 - share + probability(level) * share);
            }
        }
    }

    /// Records the light that a connection found along its branches, each with the fraction of its
    /// density that the connection had in the pilot.
    pub(crate) fn connection(
        &mut self,
        slot: NeeSlot,
        branches: impl Iterator<Item = (f64, f64)> + Clone,
    ) {
        let Some(sample) = self.samples.last_mut() else {
            return;
        };
        for level in 0..LEVELS {
            let q = probability(level);
            let brought = |(value, share): (f64, f64)| value / (1.0 - share + q * share);
            let value: f64 = branches.clone().map(brought).sum();
            sample.mean[slot.0][level] += q * value;
            sample.variance[slot.0][level] += q * (1.0 - q) * value * value;
        }
    }

    /// Records work.
    pub(crate) fn work(&mut self, slot: NeeSlot, work: f64) {
        self.work[slot.0] += work;
    }

    /// Returns the rates with the least variance × work. `work` is the total work of the pilot.
    /// `weights` are the weights of the pixels, one for each pair of samples.
    pub fn best(&self, work: f64, weights: &[f64]) -> NeeRates {
        let mut levels: Levels = [0; SLOTS];
        let prior = PRIOR_FRACTION * self.variance(&levels, weights);
        if !(prior > 0.0 && work > 0.0) {
            return NeeRates::default();
        }
        // Two rounds suffice, because kinds hardly influence each other.
        for slot in (0..2).flat_map(|_| 0..SLOTS) {
            let cost = |level: usize| {
                let mut levels = levels;
                levels[slot] = level;
                let rare = levels.map(|level| probability(level).recip() - 1.0);
                let variance = self.variance(&levels, weights) + prior * rare.iter().sum::<f64>();
                variance * self.work_at(&levels, work)
            };
            let best = (0..levels_of(slot)).min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
            levels[slot] = best.unwrap_or(0);
        }
        NeeRates::at(&levels)
    }

    /// Returns the expected variance of a sample at the given levels: the mean over the pixels,
    /// weighted by `weights`.
    pub fn variance(&self, levels: &Levels, weights: &[f64]) -> f64 {
        let pair = |(pair, weight): (&[ExpectedSample], &f64)| {
            let [a, b] = [&pair[0], &pair[1]];
            let apart = a.mean(levels) - b.mean(levels);
            weight * (apart * apart + a.variance(levels) + b.variance(levels))
        };
        let pairs = self.samples.chunks_exact(2).zip(weights);
        pairs.map(pair).sum::<f64>() / (2.0 * weights.iter().sum::<f64>())
    }

    fn work_at(&self, levels: &Levels, work: f64) -> f64 {
        let kinds = self.work.iter().zip(levels);
        work - kinds
            .map(|(work, &level)| work * (1.0 - probability(level)))
            .sum::<f64>()
    }
}

/// Returns the number of levels for a kind of connection.
fn levels_of(slot: usize) -> usize {
    if slot / 2 == Class::Delta as usize {
        LEVELS_DELTA
    } else {
        LEVELS
    }
}

fn probability(level: usize) -> f64 {
    0.5f64.powi(level as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKY: NeeSlot = NeeSlot(2 * Class::Sky as usize);

    /// Trains on a hundred pairs of samples. Apart from connections, both samples of a pair
    /// contribute 1 in every other pair, else 0. The second sample of a pair also contributes light
    /// in `parts` equal parts, each with a connection of the given share.
    fn nee_training(parts: usize, share: f64, work: f64) -> NeeRates {
        let mut nee_training = NeeTraining::default();
        for i in 0..200 {
            nee_training.begin();
            nee_training.apart(if i % 4 < 2 { 1.0 } else { 0.0 });
            let value = (i % 2) as f64 / parts as f64;
            for _ in 0..parts {
                nee_training.connection(SKY, [(value * share, share)].into_iter());
                nee_training.chance(SKY, value * (1.0 - share), share);
            }
        }
        nee_training.work(SKY, work);
        nee_training.best(1.0, &[1.0; 100])
    }

    /// Rates are low for connections with much work and little benefit. Rates are 1 for connections
    /// that find all the light or take no work.
    #[test]
    fn rates_weigh_work_against_variance() {
        assert_eq!(nee_training(1, 1.0, 0.4).of(SKY), 1.0);
        assert_eq!(nee_training(1, 0.1, 0.0).of(SKY), 1.0);
        assert!(nee_training(1, 0.1, 0.95).of(SKY) <= 1.0 / 8.0);
        let others = nee_training(1, 0.1, 0.95);
        assert_eq!(others.of(NeeSlot(0)), 1.0);
    }

    /// If the light of a sample comes in many small parts, it matters little which of them are
    /// found.
    #[test]
    fn parts_of_one_sample_make_up_for_one_another() {
        assert_eq!(nee_training(1, 1.0, 0.6).of(SKY), 1.0);
        assert!(nee_training(50, 1.0, 0.6).of(SKY) <= 1.0 / 4.0);
    }
}
