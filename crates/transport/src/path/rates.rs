//! How often vertices are connected to emitters, and what speaks for more or fewer connections.

use super::vertex::Vertex;
use crate::emitter::Class;
use serde::{Deserialize, Serialize};

/// Kinds of connections: by the class of the emitter, from media and from surfaces.
pub const SLOTS: usize = 2 * Class::ALL.len();
/// Probabilities that are considered are 2⁻ᵏ with k below this.
const LEVELS: usize = 7;
/// And below this for emitters that only connections find.
const LEVELS_DELTA: usize = 3;
/// A share of the variance that is put down to connections of every kind, whatever the pilot saw: few samples may
/// miss what only connections find.
const DOUBT: f64 = 0.02;

/// A kind of connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot(usize);

impl Slot {
    /// That of connections from a medium to an emitter that cannot be hit.
    pub const IN_MEDIA_TO_DELTA: Slot = Slot(2 * Class::Delta as usize);

    /// That of connections from a vertex to an emitter of a class.
    pub fn new(class: Class, vertex: &Vertex) -> Self {
        Slot(2 * class as usize + usize::from(vertex.object().is_some()))
    }
}

/// Probabilities with which vertices are connected to an emitter of each class. Light that is also found by
/// chance is weighed as befits a fractional number of connections (Veach 1997, §9.2.2), so that any values in
/// (0, 1] are unbiased.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates([f64; SLOTS]);

impl Default for Rates {
    fn default() -> Self {
        Rates([1.0; SLOTS])
    }
}

impl Rates {
    /// The probability of connections of a kind.
    pub fn of(&self, slot: Slot) -> f64 {
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
/// connection made with probability q, both bring F/(qD + c), whose second moment is ∫ F²/(qD + c). A sample X = F/(D + c) of the
/// pilot, of density D + c, estimates it by X²/(1 − s + qs), where s = D/(D + c) is the connection's share.
#[derive(Clone, Copy, Debug, Default)]
pub struct Survey {
    /// Sums of X²/(1 − s + qs), for each kind and level of q.
    squares: [[f64; LEVELS]; SLOTS],
    /// Work for all connections of a kind.
    work: [f64; SLOTS],
}

impl Survey {
    /// Takes note of a contribution, and the share of it that was the connections' in the pilot.
    pub fn contribution(&mut self, slot: Slot, value: f64, share: f64) {
        for (level, sum) in self.squares[slot.0].iter_mut().enumerate() {
            *sum += value * value / (1.0 - share + probability(level) * share);
        }
    }

    /// Takes note of work.
    pub fn work(&mut self, slot: Slot, work: f64) {
        self.work[slot.0] += work;
    }

    /// The rates with the least variance × work, if the pilot had a variance and work in all of it, added up
    /// over its samples as the survey's.
    pub fn best(&self, variance: f64, work: f64) -> Rates {
        let mut levels = [0; SLOTS];
        if !(variance > 0.0 && work > 0.0) {
            return Rates::default();
        }
        // Two rounds suffice: kinds hardly influence one another.
        for slot in (0..2).flat_map(|_| 0..SLOTS) {
            let cost = |level: usize| {
                let mut levels = levels;
                levels[slot] = level;
                self.cost(&levels, (variance, work))
            };
            let best = (0..levels_of(slot)).min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
            levels[slot] = best.unwrap_or(0);
        }
        Rates(levels.map(probability))
    }

    fn cost(&self, levels: &[usize; SLOTS], (mut variance, mut work): (f64, f64)) -> f64 {
        let doubt = DOUBT * variance;
        for (slot, &level) in levels.iter().enumerate() {
            let q = probability(level);
            let squares = &self.squares[slot];
            variance += squares[level] - squares[0] + doubt * (1.0 / q - 1.0);
            work -= self.work[slot] * (1.0 - q);
        }
        variance * work
    }
}

/// The levels that are considered for a kind of connection.
fn levels_of(slot: usize) -> usize {
    match slot / 2 == Class::Delta as usize {
        true => LEVELS_DELTA,
        false => LEVELS,
    }
}

fn probability(level: usize) -> f64 {
    0.5f64.powi(level as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey(share: f64, work: f64) -> Rates {
        let mut survey = Survey::default();
        let slot = Slot(2 * Class::Sky as usize);
        for _ in 0..100 {
            survey.contribution(slot, 1.0, share);
        }
        survey.work(slot, work);
        survey.best(100.0, 1.0)
    }

    /// Connections are made seldom where they take much and bring little, and always where they bring all or
    /// take nothing.
    #[test]
    fn rates_weigh_work_against_variance() {
        let slot = Slot(2 * Class::Sky as usize);
        assert_eq!(survey(1.0, 0.4).of(slot), 1.0);
        assert_eq!(survey(0.1, 0.0).of(slot), 1.0);
        assert!(survey(0.1, 0.95).of(slot) <= 1.0 / 8.0);
        let others = survey(0.1, 0.95);
        assert_eq!(others.of(Slot(0)), 1.0);
    }
}
