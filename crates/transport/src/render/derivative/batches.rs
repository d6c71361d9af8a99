//! Sums over samples in batches. The spread of the batches gives the errors.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use super::{Derivative, DerivativeError, Stats};
use crate::derivative::Plan;
use crate::render::Handle;
use rayon::prelude::*;
use std::ops::Range;

/// Maximum number of bytes of sums that are kept at one time. It does not depend on the number of
/// threads, so results do not depend on it, either.
const MAX_SUM_BYTES: usize = 256 << 20;
/// Maximum number of parts of a batch. Each part has its own sums.
const MAX_PARTS: usize = 64;
/// Number of parts that are computed in parallel, of one batch or of several, if they fit.
const PARALLEL_PARTS: usize = 8;
/// Maximum number of additions per path: little work compared with following the path.
const MAX_ADDITIONS_PER_PATH: usize = 512;
/// Maximum number of batches. The spread of the batches gives the error.
const MAX_BATCHES: u64 = 32;

/// Checks that memory suffices for `numbers` derivatives, with their errors and all sums.
pub(super) fn check_room(numbers: usize) -> Result<(), DerivativeError> {
    // Values, errors, moments and batches, and the sums of parts in addition.
    let all = numbers.saturating_mul(6);
    let mut room: Vec<f64> = Vec::new();
    let found = room.try_reserve_exact(all.saturating_add(MAX_SUM_BYTES / size_of::<f64>()));
    found.map_err(|_| DerivativeError::Memory(numbers))
}

/// Samples of a computation in batches.
pub(super) struct Units {
    /// Number of replicates.
    pub count: u64,
    /// Samples per replicate.
    pub size: u64,
    /// Paths per sample.
    pub paths: usize,
    /// Number of sums.
    pub sums: usize,
    /// Number of values that are computed from the sums.
    pub values: usize,
}

/// Part of a batch.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// The samples of the batch.
    pub samples: Range<u64>,
    number: usize,
    parts: usize,
}

impl Part {
    /// Returns the range of the part's items if `things` items are divided among the parts.
    pub(super) fn of(&self, things: usize) -> Range<usize> {
        let bound = |i: usize| i * things / self.parts;
        bound(self.number)..bound(self.number + 1)
    }
}

impl Units {
    /// Computes the moments of all batches, each a sum over a range of samples. Batches and their
    /// parts do not depend on the number of threads, and are added up in order. `part` adds its
    /// sums to zeros; `values` computes values from the sums of a batch. Returns `None` if it was
    /// stopped.
    pub(super) fn moments(
        &self,
        handle: &Handle,
        stats: &mut Stats,
        part: impl Fn(&Part, &mut [f64]) -> Stats + Sync,
        values: impl Fn(&[f64], &mut [f64]),
    ) -> Result<Option<BatchMoments>, DerivativeError> {
        if self.count < 2 {
            return Err(DerivativeError::Samples(self.size));
        }
        let each = self.count.div_ceil(MAX_BATCHES);
        let batches: Vec<Range<u64>> = (0..self.count)
            .step_by(each as usize)
            .map(|first| first..(first + each).min(self.count))
            .collect();
        let sums = self.sums;
        let parts = self.parts(each, batches.len());
        let abreast = (PARALLEL_PARTS / parts).clamp(1, room(sums).max(1));
        let mut moments = BatchMoments::new(self.values);
        let mut of_batch = vec![0.0; self.values];
        // Keep the sums from batch to batch: new memory costs more than paths do.
        let mut all_sums = vec![vec![0.0; sums]; abreast.min(batches.len()) * parts];
        for batches in batches.chunks(abreast) {
            let split = |batch: &Range<u64>| self.split(batch, parts);
            let all: Vec<Part> = batches.iter().flat_map(split).collect();
            let found = all.par_iter().zip(&mut all_sums).with_max_len(1);
            let found: Vec<Stats> = found
                .map(|(of, sums)| {
                    sums.fill(0.0);
                    part(of, sums)
                })
                .collect();
            found.into_iter().for_each(|counts| *stats += counts);
            if handle.stop().is_raised() {
                return Ok(None);
            }
            for (batch, sums) in batches.iter().zip(all_sums.chunks_mut(parts)) {
                if let Some((total, others)) = sums.split_first_mut() {
                    others.iter().for_each(|part| add(total, part));
                    let replicates = (batch.end - batch.start) as f64;
                    values(total, &mut of_batch);
                    moments.add(&of_batch, replicates, self.size as f64);
                }
            }
        }
        Ok(Some(moments))
    }

    /// Returns the number of parts into which each batch of `replicates` replicates is split. If
    /// the sums are large compared with the paths that add to them, there are fewer parts: adding
    /// up parts would take longer than the paths.
    fn parts(&self, replicates: u64, batches: usize) -> usize {
        let sums = self.sums;
        let paths = self.paths.saturating_mul((replicates * self.size) as usize);
        let wanted = paths.saturating_mul(MAX_ADDITIONS_PER_PATH) / sums.max(1);
        let wanted = wanted.clamp(PARALLEL_PARTS.div_ceil(batches), MAX_PARTS);
        wanted.min(room(sums)).clamp(1, paths.max(1))
    }

    fn split(&self, batch: &Range<u64>, parts: usize) -> Vec<Part> {
        let part = |number| Part {
            samples: batch.start * self.size..batch.end * self.size,
            number,
            parts,
        };
        (0..parts).map(part).collect()
    }
}

/// Returns the number of times that `sums` sums fit into [`MAX_SUM_BYTES`].
fn room(sums: usize) -> usize {
    MAX_SUM_BYTES / (sums * size_of::<f64>()).max(1)
}

fn add(total: &mut [f64], part: &[f64]) {
    total.iter_mut().zip(part).for_each(|(a, b)| *a += b);
}

/// Computes derivatives, row by row, from sums. Sums that several parameters share are added to
/// each of these parameters.
pub(super) fn derivatives_of(plan: &Plan, sums: &[f64], values: &mut [f64]) {
    let rows = values.chunks_mut(plan.len().max(1));
    for (values, row) in rows.zip(sums.chunks(plan.stride().max(1))) {
        for parameter in 0..plan.starts.len() - 1 {
            let (own, shared) = plan.places(parameter);
            values[own.clone()].copy_from_slice(&row[own.clone()]);
            // Planted error "sums that parameters share left out of one of them", found by morgana-transport/transport::derivatives::identities::coefficients_obey_the_chain_rule:
            // if let Some(shared) = shared.filter(|_| parameter > 0) {
            if let Some(shared) = shared {
                add(&mut values[own], &row[shared]);
            }
        }
    }
}

/// Mean over replicates, and its variance from the spread of batches.
pub(super) struct BatchMoments {
    replicates: f64,
    batches: f64,
    sums: Vec<f64>,
    /// Sums of the squares of batch sums, each divided by its number of replicates.
    squares: Vec<f64>,
    /// Largest of the terms of `squares`.
    largest: Vec<f64>,
}

/// Fraction of the scatter above which one batch outweighs all others.
const MAX_SHARE: f64 = 0.9;
/// Minimum number of batches for a test whether one batch outweighs all others.
const MIN_BATCHES: f64 = 16.0;

impl BatchMoments {
    fn new(count: usize) -> Self {
        BatchMoments {
            replicates: 0.0,
            batches: 0.0,
            sums: vec![0.0; count],
            squares: vec![0.0; count],
            largest: vec![0.0; count],
        }
    }

    /// Adds the values of a batch of `replicates` replicates of `size` samples.
    fn add(&mut self, batch: &[f64], replicates: f64, size: f64) {
        self.replicates += replicates;
        self.batches += 1.0;
        let (per_sample, per_replicate) = (1.0 / size, 1.0 / replicates);
        let moments = self.sums.iter_mut().zip(&mut self.squares);
        for (((sum, square), largest), value) in moments.zip(&mut self.largest).zip(batch) {
            let value = value * per_sample;
            let of_batch = value * value * per_replicate;
            *sum += value;
            *square += of_batch;
            *largest = largest.max(of_batch);
        }
    }

    /// Writes means and errors, row by row; the group's channels begin at `channel`.
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

    /// Returns true if single batches, of many, make nearly all of the scatter. Sums with more than
    /// half of the total scatter must be affected; a few sums to which hardly any path adds do not
    /// matter.
    pub(super) fn is_dominated(&self, slots: Range<usize>) -> bool {
        let outweighs = |slot: &usize| self.largest[*slot] > MAX_SHARE * self.squares[*slot];
        let scatter = |slots: &mut dyn Iterator<Item = usize>| -> f64 {
            slots.map(|slot| self.squares[slot]).sum()
        };
        let all = scatter(&mut slots.clone());
        self.batches >= MIN_BATCHES && scatter(&mut slots.filter(outweighs)) > 0.5 * all
    }

    /// Returns the mean of a sum, and its standard error.
    pub(super) fn mean(&self, slot: usize) -> (f64, f64) {
        let mean = self.sums[slot] / self.replicates;
        let spread = self.squares[slot] - self.sums[slot] * mean;
        let variance = spread.max(0.0) / (self.batches - 1.0) / self.replicates;
        (mean, variance.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_that_outweighs_the_others_is_noticed() {
        let mut moments = BatchMoments::new(4);
        for i in 0..32 {
            let (spread, rare) = (f64::from(i % 5) - 2.0, if i == 8 { 40.0 } else { 1.0 });
            let large = 100.0 * spread;
            moments.add(&[spread, spread * rare, 1.0 + rare, large], 2.0, 8.0);
        }
        let found = [0..1, 1..2, 2..3, 0..3].map(|slots| moments.is_dominated(slots));
        assert_eq!(found, [false, true, true, true]);
        // Ignore sums dominated by single batches if another sum has much more scatter from all
        // batches.
        assert!(!moments.is_dominated(0..4));
    }
}
