//! Training of adjoint estimates with the paths of a pilot.
//!
//! Let paths continue in a cell with throughputs T, contribute X per unit of throughput from there
//! and take work C. If they survive with probability vT, their variance grows by Σ T X²/v and their
//! work is Σ vTC. Let one unit of work in the whole image reduce the variance by w. Variance × work
//! is then least for v² = Σ T X² / (w Σ T C) (docs/theory.md#russian-roulette).

use super::adjoint::{AXES, AdjointEstimate, Node, PhaseSpacePoint, place};
use crate::path::segment::Start;

/// Largest number of stored samples: enough for an estimate, and little memory where paths are
/// long.
const MAX_SAMPLES: usize = 1 << 16;
/// Smallest number of training samples in each half of a divided cell.
const MIN_SAMPLES: usize = 64;
/// Largest number of successive divisions.
const MAX_DIVISIONS: u32 = 8;
/// Weight of the parent cell's mean in the mean of a cell, in training samples. Few samples alone
/// may miss important paths. The root's mean is averaged with a mean for which v = 1.
const PRIOR_SAMPLES: f64 = 64.0;

/// Contribution and work of a path up to some moment.
#[derive(Clone, Copy, Debug)]
pub struct PathTally {
    /// Contribution, summed over channels.
    pub light: f64,
    /// Work, in units of [`Stats::cost`](crate::stats::Stats::cost).
    pub work: f64,
}

/// A path that continued. `tally` counts from the start of the path, and from this point once the
/// path has ended.
#[derive(Clone, Copy, Debug)]
struct TrainingSample {
    place: PhaseSpacePoint,
    throughput: f64,
    tally: PathTally,
}

/// Training samples, one for each edge along which a path of the pilot continued.
#[derive(Clone, Debug, Default)]
pub struct AdjointTraining {
    all: Vec<TrainingSample>,
    /// Number of samples with paths that have ended.
    ended: usize,
}

impl AdjointTraining {
    /// Records that the current path continues along an edge from `start`. `throughput` is its
    /// throughput there, summed over channels. `tally` holds its contribution and work so far.
    pub fn record(&mut self, start: &Start, throughput: f64, tally: PathTally) {
        if self.all.len() < MAX_SAMPLES {
            self.all.push(TrainingSample {
                place: place(start),
                throughput,
                tally,
            });
        }
    }

    /// Records the end of the current path. `end` holds its contribution and work. A path with a
    /// contribution that is not finite is discarded.
    pub fn end(&mut self, end: PathTally) {
        if !end.light.is_finite() {
            self.all.truncate(self.ended);
        }
        for sample in &mut self.all[self.ended..] {
            // Planted error "adjoint estimates learnt from what paths brought before, not after", found by morgana-transport/transport::roulette::adjoint_estimates_are_worth_what_paths_brought:
            // sample.tally.light *= 1.0;
            sample.tally.light = end.light - sample.tally.light;
            sample.tally.work = end.work - sample.tally.work;
        }
        self.ended = self.all.len();
    }

    /// Returns the estimate for other paths. `worth` is the variance that a unit of work removes:
    /// the variance of a sample over its work.
    pub fn estimate(mut self, worth: f64) -> AdjointEstimate {
        let mut nodes = Vec::new();
        if worth > 0.0 && worth.is_finite() && !self.all.is_empty() {
            let own = Mean::of(&self.all);
            let square = worth * own.work;
            let mean = own.blended(Mean { square, ..own }, self.all.len());
            divide(&mut nodes, &mut self.all, mean, worth, MAX_DIVISIONS);
        }
        AdjointEstimate(nodes)
    }
}

/// Means over training samples, weighted by throughput.
#[derive(Clone, Copy, Debug)]
struct Mean {
    /// Mean of X².
    square: f64,
    /// Mean of C.
    work: f64,
}

impl Mean {
    fn of(samples: &[TrainingSample]) -> Self {
        let (weight, square, work) = sums(samples);
        Mean {
            square: square / weight,
            work: work / weight,
        }
    }

    /// Returns the weighted average of this mean of `count` training samples and another mean,
    /// which has the weight of [`PRIOR_SAMPLES`] samples.
    fn blended(self, other: Mean, count: usize) -> Self {
        let prior = PRIOR_SAMPLES / (PRIOR_SAMPLES + count as f64);
        Mean {
            square: self.square + (other.square - self.square) * prior,
            work: self.work + (other.work - self.work) * prior,
        }
    }
}

/// Returns Σ T, Σ T X² and Σ T C.
fn sums(samples: &[TrainingSample]) -> (f64, f64, f64) {
    let add = |(weight, square, work): (f64, f64, f64), d: &TrainingSample| {
        let t = d.throughput;
        let light = d.tally.light;
        (
            weight + t,
            square + light * light / t,
            work + t * d.tally.work,
        )
    };
    samples.iter().fold((0.0, 0.0, 0.0), add)
}

/// Adds the nodes of a cell with the mean `mean`. The cell is halved along the axis with the least
/// cost.
fn divide(
    nodes: &mut Vec<Node>,
    samples: &mut [TrainingSample],
    mean: Mean,
    worth: f64,
    divisions: u32,
) {
    let half = samples.len() / 2;
    let index = nodes.len();
    nodes.push(Node::Cell((mean.square / (worth * mean.work)).sqrt()));
    if divisions == 0 || half < MIN_SAMPLES {
        return;
    }
    let costs: [f64; AXES] = std::array::from_fn(|axis| halved(samples, axis));
    let best = (0..AXES).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let Some(axis) = best.filter(|&axis| costs[axis] < f64::INFINITY) else {
        return;
    };
    halved(samples, axis);
    let cut = samples[half].place[axis];
    let (below, above) = samples.split_at_mut(half);
    let means = [&*below, &*above].map(|part| Mean::of(part).blended(mean, part.len()));
    divide(nodes, below, means[0], worth, divisions - 1);
    nodes[index] = Node::Cut {
        axis: axis as u8,
        cut,
        above: nodes.len() as u32,
    };
    divide(nodes, above, means[1], worth, divisions - 1);
}

/// Sorts training samples into halves along an axis. Returns a number in proportion to the square
/// root of the least variance × work: the sum of √(Σ T X² Σ T C) over the halves. Returns infinity
/// if all samples have one coordinate.
fn halved(samples: &mut [TrainingSample], axis: usize) -> f64 {
    let half = samples.len() / 2;
    samples.select_nth_unstable_by(half, |a, b| a.place[axis].total_cmp(&b.place[axis]));
    let (below, above) = samples.split_at(half);
    let cut = above[0].place[axis];
    if below.iter().all(|d| d.place[axis] == cut) {
        return f64::INFINITY;
    }
    let cost = |part| {
        let (_, square, work) = sums(part);
        (square * work).sqrt()
    };
    cost(below) + cost(above)
}
