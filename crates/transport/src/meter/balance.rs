//! Where the light went.

use super::tally::{Scores, Tally};
use std::ops::AddAssign;

/// What became of the power of one particle, summed over channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Absorbed by media.
    pub media: f64,
    /// Absorbed by surfaces.
    pub surfaces: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Still on its way at the largest depth.
    pub cut: f64,
    /// On rays that were lost: counted failures.
    pub lost: f64,
}

/// An amount of power, summed over channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Mean over particles.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

/// The account of a whole run. What the entries leave of the emitted power is what Russian roulette and
/// spectral sampling, which are fair but by chance, have added or taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// Power of all emitters, exactly.
    pub emitted: f64,
    /// Absorbed by media.
    pub media: Share,
    /// Absorbed by surfaces.
    pub surfaces: Share,
    /// Left the scene.
    pub escaped: Share,
    /// Still on its way at the largest depth.
    pub cut: Share,
    /// On rays that were lost: counted failures.
    pub lost: Share,
    /// What particles started with, less all of the above: zero within its error.
    pub residual: Share,
}

impl Ledger {
    /// Number of slots that the account takes.
    pub const SLOTS: usize = 6;

    fn entries(&self) -> [f64; Ledger::SLOTS - 1] {
        [self.media, self.surfaces, self.escaped, self.cut, self.lost]
    }

    /// Scores the account of a particle that started with the given power, from slot `first`.
    pub fn score(&self, initial: f64, first: usize, scores: &mut Scores) {
        let entries = self.entries();
        for (i, value) in entries.into_iter().enumerate() {
            scores.add(first + i, value);
        }
        scores.add(first + entries.len(), initial - entries.iter().sum::<f64>());
    }
}

impl Balance {
    /// The account in a tally, from slot `first`.
    pub fn of(tally: &Tally, first: usize, emitted: f64) -> Self {
        let share = |i: usize| Share {
            mean: tally.mean(first + i),
            error: tally.error(first + i),
        };
        Balance {
            emitted,
            media: share(0),
            surfaces: share(1),
            escaped: share(2),
            cut: share(3),
            lost: share(4),
            residual: share(5),
        }
    }
}

impl AddAssign for Share {
    /// Independent amounts.
    fn add_assign(&mut self, o: Self) {
        self.mean += o.mean;
        self.error = self.error.hypot(o.error);
    }
}

impl AddAssign for Balance {
    /// Other channels, with particles of their own.
    fn add_assign(&mut self, o: Self) {
        self.emitted += o.emitted;
        self.media += o.media;
        self.surfaces += o.surfaces;
        self.escaped += o.escaped;
        self.cut += o.cut;
        self.lost += o.lost;
        self.residual += o.residual;
    }
}
