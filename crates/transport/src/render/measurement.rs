//! Measurements: how they are done, and their results.

use crate::meter::{MeterProblem, Reading, RecordTable, Tally};
use crate::path::EnergyBalance;
use crate::sparse::Sparse;
use crate::stats::Stats;
use crate::sum::ReproducibleSum;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// How a measurement is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasureOptions {
    /// Number of the first particle, rounded up to a multiple of [`MeasureOptions::UNIT`]; not 0 if this measurement is
    /// part of a larger one.
    pub first: u64,
    /// Particles, for each group of channels; the last one's number is rounded likewise. A tally has room for the numbers
    /// below [`MeasureOptions::MOST`]: a measurement ends there.
    pub particles: u64,
    /// Seed: the same seed gives the same readings, bit for bit, for any number of threads.
    pub seed: u64,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
}

impl MeasureOptions {
    /// Particles per task. The sums of a task are rounded on their own, so tasks are always the same particles.
    pub const UNIT: u64 = 64;
    /// Most particles that can be followed.
    pub const MOST: u64 = Self::UNIT * ReproducibleSum::MOST;

    /// Numbers of the particles.
    pub fn range(&self) -> Range<u64> {
        let whole = |n: u64| n.min(Self::MOST).next_multiple_of(Self::UNIT);
        whole(self.first)..whole(self.first.saturating_add(self.particles))
    }
}

/// What a measurement gives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// For each meter, what it has measured, with the channels of all groups. Absolute: in the units of
    /// the emitters' power.
    pub readings: Vec<Vec<Reading>>,
    /// For each meter, the records of the light that it has accepted, if it keeps any.
    pub records: Vec<Option<RecordTable>>,
    /// Power of all emitters, per channel.
    pub emitted: Vec<f64>,
    /// Standard errors of `emitted`; zero unless a medium emits whose power had to be estimated.
    pub emitted_error: Vec<f64>,
    /// Where the light went, summed over channels.
    pub balance: EnergyBalance,
    /// What happened.
    pub stats: Stats,
    /// Particles followed, per channel group: fewer than asked for if the measurement was stopped.
    pub particles: u64,
}

/// Why nothing can be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// A meter cannot measure in the scene.
    #[error("meter {number}: {problem}")]
    Meter {
        /// Number of the meter, counted from 0.
        number: usize,
        /// What is wrong with it.
        problem: MeterProblem,
    },
    /// No emitter has any power.
    #[error("the scene emits no light: there is nothing to measure")]
    Dark,
    /// There is no room for the sums.
    #[error("the meters need {0} bytes of memory, or more than {max} bins", max = Tally::MOST_SLOTS)]
    Memory(usize),
}

/// Puts the channels of all groups side by side.
pub(super) fn join(mut groups: Vec<(Vec<Vec<Reading>>, usize)>) -> Vec<Vec<Reading>> {
    if groups.len() == 1 {
        return groups.remove(0).0;
    }
    let Some((first, _)) = groups.first() else {
        return Vec::new();
    };
    let joined = |(meter, readings): (usize, &Vec<Reading>)| {
        let each = readings.iter().enumerate().map(|(k, reading)| {
            let parts = groups.iter().map(|(r, n)| (&r[meter][k], *n));
            let parts: Vec<(&Reading, usize)> = parts.collect();
            Reading {
                mean: interleave(&parts, |r| &r.mean),
                error: interleave(&parts, |r| &r.error),
                effective: interleave(&parts, |r| &r.effective),
                few: interleave(&parts, |r| &r.few),
                ..reading.clone()
            }
        });
        each.collect()
    };
    first.iter().enumerate().map(joined).collect()
}

/// Values of the readings of several groups, each with its number of channels, cell by cell.
fn interleave<T: Copy>(
    groups: &[(&Reading, usize)],
    values: impl Fn(&Reading) -> &Sparse<T>,
) -> Sparse<T> {
    let all = groups.iter().map(|(reading, _)| values(reading).len());
    let channels: usize = groups.iter().map(|(_, n)| n).sum();
    let mut joined = Sparse::new(all.sum(), values(groups[0].0).rest());
    let mut first = 0;
    for (reading, n) in groups {
        let values = values(reading);
        for (i, value) in values.written(0..values.len()) {
            *joined.get_mut(i / n * channels + first + i % n) = value;
        }
        first += n;
    }
    joined
}
