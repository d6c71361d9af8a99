//! Options and results of measurements.

use crate::device::DeviceError;
use crate::meter::{CyclicFluorescence, MeterProblem, Reading, RecordTable, Tally};
use crate::path::EnergyBalance;
use crate::sparse::Sparse;
use crate::stats::Stats;
use crate::sum::ReproducibleSum;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Options of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasureOptions {
    /// Number of the first particle, rounded up to a multiple of [`MeasureOptions::UNIT`]. It is
    /// not 0 if this measurement is part of a larger one.
    pub first: u64,
    /// Number of particles for each group of channels. The end of their range is rounded up to a
    /// multiple of [`MeasureOptions::UNIT`]. The measurement ends at particle number
    /// [`MeasureOptions::MAX_PARTICLES`], because tallies have no room for more.
    pub particles: u64,
    /// Seed. Equal seeds give equal readings, bit for bit, for any number of threads.
    pub seed: u64,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
}

impl MeasureOptions {
    /// Particles per task. The sums of a task are rounded on their own, so a task always has the
    /// same particles.
    pub const UNIT: u64 = 64;
    /// Maximum number of particles.
    pub const MAX_PARTICLES: u64 = Self::UNIT * ReproducibleSum::MAX_NUMBERS;

    /// Returns the range of the particles' numbers.
    pub fn range(&self) -> Range<u64> {
        self.range_by(Self::UNIT)
    }

    /// Returns the range of the particles' numbers, rounded up to multiples of `unit` instead of
    /// [`MeasureOptions::UNIT`].
    pub(super) fn range_by(&self, unit: u64) -> Range<u64> {
        let whole = |n: u64| n.min(Self::MAX_PARTICLES).next_multiple_of(unit);
        whole(self.first)..whole(self.first.saturating_add(self.particles))
    }
}

/// Result of a measurement.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// Readings of each meter, with the channels of all groups. They are absolute, in the units of
    /// the emitters' power.
    pub readings: Vec<Vec<Reading>>,
    /// Records of the light that each meter accepted, if it keeps records.
    pub records: Vec<Option<RecordTable>>,
    /// Power of all emitters, per channel. For a fluorescent channel it includes the emitters of
    /// the channels that excite the fluorescence.
    pub emitted: Vec<f64>,
    /// Standard errors of `emitted`; zero unless a medium emits whose power had to be estimated.
    pub emitted_error: Vec<f64>,
    /// Energy balance, summed over channels.
    pub balance: EnergyBalance,
    /// Counts of events and failures.
    pub stats: Stats,
    /// Particles followed per channel group; fewer than requested if the measurement was stopped.
    pub particles: u64,
}

/// Reason why a measurement is impossible.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// A meter cannot measure in the scene.
    #[error("meter {number}: {problem}")]
    Meter {
        /// Number of the meter, counted from 0.
        number: usize,
        /// Problem of the meter.
        problem: MeterProblem,
    },
    /// No emitter has any power.
    #[error(
        "the scene emits no light, so there is nothing to measure: add an emitter, or make its light brighter than 0"
    )]
    Dark,
    /// Fluorescence of channels that excite each other.
    #[error(transparent)]
    CyclicFluorescence(#[from] CyclicFluorescence),
    /// Channels of a fluorescent scene share paths.
    #[error("fluorescence needs one scene for each channel: use a film with the group size 1")]
    SharedPaths,
    /// The device failed, or does not suit the scene.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// Memory is insufficient for the sums.
    #[error("the meters need {0} bytes of memory, or more than {max} bins: use fewer bins", max = Tally::MAX_SLOTS)]
    Memory(usize),
}

/// Interleaves the channels of all groups.
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

/// Interleaves the values of several groups, each with its number of channels, cell by cell.
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
