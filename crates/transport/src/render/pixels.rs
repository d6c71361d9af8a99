//! Estimators whose samples contribute to their own pixels only (docs/theory.md#film).

use super::allocation::Allocation;
use super::followed::FollowedSamples;
use super::source::{LightSamples, finite};
use crate::Spectrum;
use crate::film::{Decomposition, Film, Pending, Scores};
use crate::integrator::Contribution;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per task: few enough to distribute well, enough to keep the overhead low. Threads take
/// tasks one by one, so that no thread has many left at the end of a pass.
pub(super) const PIXELS_PER_TASK: usize = 64;

/// Quantities to compute from samples.
struct Wanted<'a> {
    samples: Range<u64>,
    allocation: &'a Allocation,
    /// Layers of the film, if it has any.
    decomposition: Option<Decomposition>,
    /// True if samples are sorted by brightness.
    sorts: bool,
}

/// Takes a range of samples of the image, whole replicates, for the source's channel group. Each
/// pixel takes as many as it is allotted. The scores come in runs of [`PIXELS_PER_TASK`] pixels.
pub(super) fn pass(
    light: &LightSamples,
    samples: Range<u64>,
    allocation: &Allocation,
    film: &Film,
) -> (Vec<Scores>, Stats) {
    let wanted = Wanted {
        allocation,
        decomposition: film.layers().map(|layers| *layers.decomposition()),
        sorts: film.outliers(light.source.group).is_some(),
        samples,
    };
    let pixels = film.width() * film.height();
    let tasks = pixels.div_ceil(PIXELS_PER_TASK);
    let mut scores: Vec<Scores> = (0..tasks).map(|_| Scores::default()).collect();
    let tasks = scores.par_iter_mut().enumerate().with_max_len(1);
    let task = |(task, scores): (usize, &mut Scores)| {
        let first = task * PIXELS_PER_TASK;
        let run = first..pixels.min(first + PIXELS_PER_TASK);
        let taken = run.len() as u64 * (wanted.samples.end - wanted.samples.start);
        let stats;
        (*scores, stats) = run_of_pixels(light, &wanted, run);
        light.source.handle.count(taken);
        stats
    };
    let stats = tasks.map(task).reduce(Stats::default, |mut a, b| {
        a += b;
        a
    });
    (scores, stats)
}

fn run_of_pixels(light: &LightSamples, wanted: &Wanted, run: Range<usize>) -> (Scores, Stats) {
    let source = light.source;
    let mut ws = source.workspace();
    let mut found = Vec::new();
    let layers = wanted.decomposition.map_or(0, |d| d.layers());
    let decomposition = wanted.decomposition.unwrap_or_default();
    let mut followed = FollowedSamples::of(light, &decomposition);
    let mut pending = Pending::new(layers);
    let size = source.replicates.size();
    // A power of two, so that products are exact.
    let share = 1.0 / size as f64;
    let replicates = || wanted.samples.clone().step_by(size as usize);
    let count = run.len() * replicates().count();
    let mut scores = Scores::with_capacity(run.len(), count);
    for (i, number) in run.enumerate() {
        scores.begin_pixel();
        for first in replicates().flat_map(|r| wanted.allocation.samples(number, r)) {
            if source.is_stopped() {
                return (scores, ws.stats());
            }
            let mut mean = Spectrum::ZERO;
            for sample in first..first + size {
                let sample = source.image_sample(sample);
                match &mut followed {
                    Some(followed) => followed.take(number, &sample, &mut ws, &mut found),
                    None => light.take(number, &sample, &mut ws, &mut found),
                }
                let sum = |sum, c: &Contribution| sum + c.weighted();
                let value = found.iter().fold(Spectrum::ZERO, sum);
                let value = finite(value, &mut ws.stats.not_finite);
                mean += value * share;
                if layers > 0 && !value.is_zero() {
                    match &followed {
                        None => found.iter().for_each(|c| {
                            pending.add(decomposition.layer(&c.path), c.weighted() * share);
                        }),
                        Some(followed) => followed.parts().for_each(|part| {
                            let value = finite(part.value, &mut ws.stats.not_finite);
                            pending.add(part.layer, value * share);
                        }),
                    }
                }
                if wanted.sorts {
                    scores.add_sample(i, value);
                }
                found.clear();
            }
            scores.add(mean);
            pending.take(|layer, value| scores.add_to_layer(i * layers + layer, value));
        }
    }
    scores.shrink();
    (scores, ws.stats())
}
