//! Sums over the samples of a run, with the numbers of these samples: a run can be continued later,
//! or merged from parts.
//!
//! Sums do not depend on the order of the samples ([`Sum`](crate::sum::Sum)), and a sample depends
//! only on its number and the seed. A run that is continued, or merged from parts, therefore has
//! the bits of a run in one piece.

use super::passes::Passes;
use super::{Handle, Ranges};
use crate::path::BalanceTotals;
use crate::stats::Stats;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::{ControlFlow, Range};

/// Sums that a run accumulates: [`Films`](super::Films) of a picture, or
/// [`Readings`](super::Readings) of meters.
pub trait Accumulated: Clone + Debug + Serialize + DeserializeOwned {
    /// Data about a group of channels that a pilot finds before the first sample.
    type Learnt: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns true if `self` and `other` are sums of the same quantities.
    fn is_like(&self, other: &Self) -> bool;

    /// Adds other sums of the same quantities.
    fn merge(&mut self, other: &Self);
}

/// Takes the samples of a run, in all groups of channels.
pub(super) trait Sampling {
    /// Sums that the samples are added to.
    type Sums: Accumulated;
    /// Result of a pass.
    type Found;

    /// Prepares for the pass that starts with sample `at`. Breaks if the run ends before that pass.
    fn prepare_pass(
        &self,
        _state: &mut Accumulator<Self::Sums>,
        _at: u64,
        _on_pass: impl FnMut(&Accumulator<Self::Sums>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Returns the number of samples of the pass that starts with sample `at`, if `next` samples
    /// take the right time.
    fn pass_size(&self, state: &Accumulator<Self::Sums>, at: u64, next: u64) -> u64;

    /// Takes the samples of a pass.
    fn pass(&self, sums: &Self::Sums, samples: Range<u64>) -> Self::Found;

    /// Adds the result of a pass that is complete.
    fn add(&self, state: &mut Accumulator<Self::Sums>, found: Self::Found);
}

/// Sums over the samples of a run, with the numbers of these samples.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Accumulator<T: Accumulated> {
    pub(super) done: Ranges,
    pub(super) stats: Stats,
    /// Energy balance of each group of channels.
    pub(super) balances: Vec<BalanceTotals>,
    /// Results of the pilots of each group of channels; empty before the pilots.
    pub(super) learnt: Vec<T::Learnt>,
    pub(super) sums: T,
}

/// Reason why two states cannot be merged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// Samples that both states contain, so that they would be added twice.
    #[error("both have samples {} to {}", .0.start, .0.end - 1)]
    Overlap(Range<u64>),
    /// The states keep different quantities, or have different pixels.
    #[error("they are of different renders")]
    Different,
}

impl<T: Accumulated> Accumulator<T> {
    /// Creates an accumulator without samples.
    pub(super) fn empty(groups: usize, sums: T) -> Self {
        Accumulator {
            done: Ranges::default(),
            stats: Stats::default(),
            balances: vec![BalanceTotals::default(); groups],
            learnt: Vec::new(),
            sums,
        }
    }

    /// Returns the numbers of the samples, or particles, taken so far.
    pub fn done(&self) -> &Ranges {
        &self.done
    }

    /// Returns true if the state has this number of channel groups.
    pub(super) fn has_groups(&self, groups: usize) -> bool {
        let is_new = self.done.count() == 0 && self.learnt.is_empty();
        self.balances.len() == groups && (is_new || self.learnt.len() == groups)
    }

    /// Adds the samples of another state of the same run: the scenes, meters, seed and options are
    /// equal, except for the range of samples.
    ///
    /// # Errors
    /// If both states have a sample, or if they obviously belong to different runs. Nothing is
    /// added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        let is_new = self.learnt.is_empty() || other.learnt.is_empty();
        let learnt = is_new || self.learnt == other.learnt;
        let groups = self.balances.len() == other.balances.len();
        if !(learnt && groups && self.sums.is_like(&other.sums)) {
            return Err(MergeError::Different);
        }
        if let Some(range) = self.done.overlap(&other.done) {
            return Err(MergeError::Overlap(range));
        }
        other.done.iter().for_each(|range| self.done.insert(range));
        if self.learnt.is_empty() {
            self.learnt.clone_from(&other.learnt);
        }
        self.stats += other.stats;
        for (balances, other) in self.balances.iter_mut().zip(&other.balances) {
            *balances += *other;
        }
        self.sums.merge(&other.sums);
        Ok(())
    }

    /// Runs the pilot, unless an earlier one has been completed. Breaks if the handle ends the
    /// pilot.
    pub(super) fn run_pilot(
        &mut self,
        handle: &Handle,
        pilot: impl FnOnce() -> Vec<T::Learnt>,
    ) -> ControlFlow<()> {
        if self.learnt.is_empty() {
            let learnt = pilot();
            if handle.stop().is_raised() {
                return ControlFlow::Break(());
            }
            self.learnt = learnt;
        }
        ControlFlow::Continue(())
    }

    /// Takes the missing samples of a range, in passes. Calls `on_pass` after each pass and ends
    /// when it breaks. If the handle ends a pass, the state stays as it was before that pass.
    pub(super) fn take<S: Sampling<Sums = T>>(
        &mut self,
        range: Range<u64>,
        sampling: &S,
        handle: &Handle,
        mut on_pass: impl FnMut(&Self) -> ControlFlow<()>,
    ) {
        let mut passes = Passes::over(self.done.gaps(range));
        while let Some(at) = passes.at() {
            if sampling.prepare_pass(self, at, &mut on_pass).is_break() {
                return;
            }
            let samples = passes.begin(|next| sampling.pass_size(self, at, next));
            let found = sampling.pass(&self.sums, samples.clone());
            if handle.stop().is_raised() {
                return;
            }
            self.done.insert(samples);
            sampling.add(self, found);
            if on_pass(self).is_break() {
                return;
            }
            passes.end();
        }
    }
}
