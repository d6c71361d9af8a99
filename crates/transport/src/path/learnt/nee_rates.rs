//! How often vertices are connected to emitters, and what speaks for more or fewer connections.
//!
//! Theory: docs/theory.md#next-event-rates.

use crate::emitter::Class;
use crate::path::segment::Vertex;
use serde::{Deserialize, Serialize};

/// Kinds of connections: by the class of the emitter, from media and from surfaces. None to volumes, the last class, which `path`
/// finds along its edges.
pub(crate) const SLOTS: usize = 2 * Class::Volume as usize;
/// Probabilities that are considered are 2⁻ᵏ with k below this.
const LEVELS: usize = 7;
/// And below this for emitters that only connections find.
const LEVELS_DELTA: usize = 3;
/// A share of the variance that is put down to connections of every kind, whatever the pilot saw: few samples may
/// miss what only connections find.
const DOUBT: f64 = 0.01;

/// For each kind of connections, from media and from surfaces to each of [`Class::ALL`] but the last in turn, the k < 7 of a probability 2⁻ᵏ.
pub type Levels = [usize; SLOTS];

/// A kind of connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NeeSlot(usize);

impl NeeSlot {
    /// That of connections from a medium to an emitter that cannot be hit.
    pub(crate) const IN_MEDIA_TO_DELTA: NeeSlot = NeeSlot(2 * Class::Delta as usize);

    /// That of connections from a vertex to an emitter of a class.
    pub(crate) fn new(class: Class, vertex: &Vertex) -> Self {
        NeeSlot(2 * class as usize + usize::from(vertex.object().is_some()))
    }
}

/// Probabilities with which vertices are connected to an emitter of each class. Light that is also found by
/// chance is weighed as befits a fractional number of connections (Veach 1997, §9.2.2), so that any values in
/// (0, 1] are unbiased.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NeeRates([f64; SLOTS]);

impl Default for NeeRates {
    fn default() -> Self {
        NeeRates([1.0; SLOTS])
    }
}

impl NeeRates {
    /// Those of levels.
    pub fn at(levels: &Levels) -> Self {
        NeeRates(levels.map(probability))
    }

    /// The probability of connections of a kind.
    pub(crate) fn of(&self, slot: NeeSlot) -> f64 {
        self.0[slot.0]
    }

    /// Sets it for connections from media and from surfaces to a class.
    pub fn with(mut self, class: Class, [volume, surface]: [f64; 2]) -> Self {
        self.0[2 * class as usize] = volume;
        self.0[2 * class as usize + 1] = surface;
        self
    }
}

/// What a pilot with all connections tells about fewer of them.
///
/// Let F be what a way is worth, D and c the densities with which a connection and chance find it. With a
/// connection made with probability q, both bring F/(qD + c): X/(1 − s + qs), where X = F/(D + c) is what the pilot found and s =
/// D/(D + c) the connection's share. The paths themselves do not depend on q, so that the pilot knows what each of its samples
/// would have brought, up to the choice of the connections that are made, whose mean and variance it knows.
#[derive(Clone, Debug, Default)]
pub struct NeeTraining {
    samples: Vec<ExpectedSample>,
    /// Work for all connections of a kind.
    work: [f64; SLOTS],
}

/// What a sample of the pilot would bring at each level of q, by the kinds of connections.
#[derive(Clone, Copy, Debug, Default)]
struct ExpectedSample {
    mean: [[f64; LEVELS]; SLOTS],
    /// Of the choice which connections are made.
    variance: [[f64; LEVELS]; SLOTS],
    /// What has nothing to do with connections.
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
    /// A sample begins: what follows belongs to it. Two in turn are of one pixel.
    pub fn begin(&mut self) {
        self.samples.push(ExpectedSample::default());
    }

    /// Takes note of light with which no connections compete.
    pub fn apart(&mut self, value: f64) {
        if let Some(sample) = self.samples.last_mut() {
            sample.apart += value;
        }
    }

    /// Takes note of light found by chance, and the share of it that was the connections' in the pilot.
    pub(crate) fn chance(&mut self, slot: NeeSlot, value: f64, share: f64) {
        if let Some(sample) = self.samples.last_mut() {
            for (level, mean) in sample.mean[slot.0].iter_mut().enumerate() {
                // Planted error "light found by chance taken for the same however rare connections are", found by morgana-transport/transport::connections::a_pilot_foretells_variances:
                // *mean += value;
                *mean += value / (1.0 - share + probability(level) * share);
            }
        }
    }

    /// Takes note of what a connection found along its branches, each with the share of it that was the connection's in
    /// the pilot.
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

    /// Takes note of work.
    pub(crate) fn work(&mut self, slot: NeeSlot, work: f64) {
        self.work[slot.0] += work;
    }

    /// The rates with the least variance × work, if the pilot had all this work and pixels have these weights.
    pub fn best(&self, work: f64, weights: &[f64]) -> NeeRates {
        let mut levels: Levels = [0; SLOTS];
        let doubt = DOUBT * self.variance(&levels, weights);
        if !(doubt > 0.0 && work > 0.0) {
            return NeeRates::default();
        }
        // Two rounds suffice: kinds hardly influence one another.
        for slot in (0..2).flat_map(|_| 0..SLOTS) {
            let cost = |level: usize| {
                let mut levels = levels;
                levels[slot] = level;
                let rare = levels.map(|level| probability(level).recip() - 1.0);
                let variance = self.variance(&levels, weights) + doubt * rare.iter().sum::<f64>();
                variance * self.work_at(&levels, work)
            };
            let best = (0..levels_of(slot)).min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
            levels[slot] = best.unwrap_or(0);
        }
        NeeRates::at(&levels)
    }

    /// The variance of a sample that is to be expected at such levels, the weighted mean over the pixels.
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

/// The levels that are considered for a kind of connection.
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

    /// Of a hundred pairs of samples, one brings 2 or 0 apart from connections, the other light in so many equal parts, each by a
    /// connection of the given share.
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

    /// Connections are made seldom where they take much and bring little, and always where they bring all or
    /// take nothing.
    #[test]
    fn rates_weigh_work_against_variance() {
        assert_eq!(nee_training(1, 1.0, 0.4).of(SKY), 1.0);
        assert_eq!(nee_training(1, 0.1, 0.0).of(SKY), 1.0);
        assert!(nee_training(1, 0.1, 0.95).of(SKY) <= 1.0 / 8.0);
        let others = nee_training(1, 0.1, 0.95);
        assert_eq!(others.of(NeeSlot(0)), 1.0);
    }

    /// Where a sample's light comes in many small parts, it matters little which of them are found.
    #[test]
    fn parts_of_one_sample_make_up_for_one_another() {
        assert_eq!(nee_training(1, 1.0, 0.6).of(SKY), 1.0);
        assert!(nee_training(50, 1.0, 0.6).of(SKY) <= 1.0 / 4.0);
    }
}
