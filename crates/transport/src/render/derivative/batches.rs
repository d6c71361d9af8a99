//! Sums over samples in batches, whose spread gives the errors.

use super::{Derivative, DerivativeError, Stats};
use crate::derivative::Plan;
use crate::render::Handle;
use rayon::prelude::*;
use std::ops::Range;

/// Bytes of sums that are made side by side, whatever the number of threads: so results do not depend on it.
const SUMS: usize = 256 << 20;
/// No more sums than these,
const MOST_SUMS: usize = 64;
/// and no fewer, if they fit.
const LEAST_SUMS: usize = 8;
/// Numbers that are added up for each path, at most: little work beside following it.
const PER_PATH: usize = 512;
/// The samples are taken in at most so many batches, whose spread gives the error.
const BATCHES: u64 = 32;

/// Finds out whether there is room for so many derivatives, with errors and all sums.
pub(super) fn check_room(numbers: usize) -> Result<(), DerivativeError> {
    // Values, errors, moments and batches; and the sums of parts beside them.
    let all = numbers.saturating_mul(6);
    let mut room: Vec<f64> = Vec::new();
    let found = room.try_reserve_exact(all.saturating_add(SUMS / size_of::<f64>()));
    found.map_err(|_| DerivativeError::Memory(numbers))
}

/// Samples that are taken in batches.
pub(super) struct Units {
    /// Number of replicates.
    pub count: u64,
    /// Samples of each.
    pub size: u64,
    /// Number of sums.
    pub sums: usize,
}

impl Units {
    /// The moments of all batches, each the sums over a range of samples. `None` if it was stopped.
    pub(super) fn moments(
        &self,
        handle: &Handle,
        mut batch: impl FnMut(Range<u64>) -> Vec<f64>,
    ) -> Result<Option<BatchMoments>, DerivativeError> {
        if self.count < 2 {
            return Err(DerivativeError::Samples(self.size));
        }
        let each = self.count.div_ceil(BATCHES);
        let mut moments = BatchMoments::new(self.sums);
        for first in (0..self.count).step_by(each as usize) {
            let last = (first + each).min(self.count);
            let sums = batch(first * self.size..last * self.size);
            if handle.stop().is_raised() {
                return Ok(None);
            }
            moments.add(&sums, (last - first) as f64, self.size as f64);
        }
        Ok(Some(moments))
    }
}

/// So many sums over `count` things, those of a number of parts that does not depend on that of threads, added up one after the other.
pub(super) fn side_by_side(
    sums: usize,
    count: usize,
    stats: &mut Stats,
    part: impl Fn(Range<usize>) -> (Vec<f64>, Stats) + Sync,
) -> Vec<f64> {
    let bytes = (sums * size_of::<f64>()).max(1);
    // Sums that are large for what adds to them are made in fewer parts: adding those up would take longer than the paths.
    let wanted = (count * PER_PATH / sums.max(1)).clamp(LEAST_SUMS, MOST_SUMS);
    let parts = (SUMS / bytes).clamp(1, wanted).min(count);
    let of = |i: usize| {
        let bound = |i: usize| i * count / parts;
        part(bound(i)..bound(i + 1))
    };
    let all: Vec<(Vec<f64>, Stats)> = (0..parts).into_par_iter().map(of).collect();
    let mut total = vec![0.0; sums];
    for (values, counts) in all {
        *stats += counts;
        total.iter_mut().zip(values).for_each(|(a, b)| *a += b);
    }
    total
}

/// Mean over replicates, and its variance from the spread of batches of them.
pub(super) struct BatchMoments {
    replicates: f64,
    batches: f64,
    sums: Vec<f64>,
    /// Of squares of the sums of batches, over their numbers of replicates.
    squares: Vec<f64>,
}

impl BatchMoments {
    fn new(count: usize) -> Self {
        BatchMoments {
            replicates: 0.0,
            batches: 0.0,
            sums: vec![0.0; count],
            squares: vec![0.0; count],
        }
    }

    /// Adds the sums of a batch of so many replicates of a size.
    fn add(&mut self, batch: &[f64], replicates: f64, size: f64) {
        self.replicates += replicates;
        self.batches += 1.0;
        for (i, value) in batch.iter().enumerate() {
            let value = value / size;
            self.sums[i] += value;
            self.squares[i] += value * value / replicates;
        }
    }

    /// Enters means and errors, whose channels begin at `channel`, row by row.
    pub(super) fn enter(&self, plan: &Plan, channel: usize, by: &mut [Derivative]) {
        let rows = self.sums.len().checked_div(plan.len()).unwrap_or(0);
        for (derivative, bounds) in by.iter_mut().zip(plan.starts.windows(2)) {
            let all = derivative.shape.last().copied().unwrap_or(1);
            let count = bounds[1] - bounds[0];
            for i in 0..rows * count {
                let (row, i) = (i / count, i % count);
                let number = row * count / plan.channels() + i / plan.channels();
                let at = number * all + channel + i % plan.channels();
                let slot = row * plan.len() + bounds[0] + i;
                (derivative.values[at], derivative.errors[at]) = self.mean(slot);
            }
        }
    }

    /// The mean of a sum, and its standard error.
    pub(super) fn mean(&self, slot: usize) -> (f64, f64) {
        let mean = self.sums[slot] / self.replicates;
        let spread = self.squares[slot] - self.sums[slot] * mean;
        let variance = spread.max(0.0) / (self.batches - 1.0) / self.replicates;
        (mean, variance.sqrt())
    }
}
