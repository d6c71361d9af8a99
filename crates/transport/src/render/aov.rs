//! Arbitrary output variables: each sample traces one ray, which gives the values of all channels.
//! They replace the light, or accompany it.

use super::pixels::PIXELS_PER_TASK;
use super::source::{SampledRay, Source, finite};
use crate::Spectrum;
use crate::aov::AovTracer;
use crate::film::{Film, FilmShape, Scores};
use crate::path::Workspace;
use crate::stats::Stats;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Quantities of the sensor rays of a render of light. These rays are traced in addition to the
/// render's paths.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Quantities {
    /// Film of the quantities, in the order of [`AovTracer::channels`].
    pub film: Film,
    /// Counts of events and failures of these rays.
    pub stats: Stats,
}

impl Quantities {
    /// Creates quantities without samples.
    pub(super) fn new(shape: FilmShape) -> Self {
        Quantities {
            film: Film::of(shape),
            stats: Stats::default(),
        }
    }

    /// Adds the result of a pass.
    pub(super) fn add(&mut self, (found, stats): (Found, Stats)) {
        add(&mut self.film, found);
        self.stats += stats;
    }

    pub(super) fn merge(&mut self, other: &Quantities) {
        self.film.merge(&other.film);
        self.stats += other.stats;
    }
}

/// Scores of all groups of channels, in runs of [`PIXELS_PER_TASK`] pixels.
pub(super) type Found = Vec<Vec<Scores>>;

/// Takes a range of samples of every pixel of a film. Calls `count` with the numbers of samples
/// taken.
pub(super) fn pass(
    source: &Source,
    tracer: &AovTracer,
    samples: Range<u64>,
    film: &Film,
    count: impl Fn(u64) + Sync,
) -> (Found, Stats) {
    let (pixels, groups) = (film.width() * film.height(), film.groups());
    let size = source.replicates.size();
    let task = |task: usize| {
        let mut ws = source.workspace();
        let first = task * PIXELS_PER_TASK;
        let run = first..pixels.min(first + PIXELS_PER_TASK);
        let taken = run.len() as u64 * (samples.end - samples.start);
        let new = || Scores::with_capacity(run.len(), (taken / size) as usize);
        let mut scores: Vec<Scores> = (0..groups).map(|_| new()).collect();
        for pixel in run {
            scores.iter_mut().for_each(Scores::begin_pixel);
            for first in samples.clone().step_by(size as usize) {
                if source.is_stopped() {
                    return (scores, ws.stats());
                }
                let values = mean(source, tracer, pixel, first..first + size, &mut ws);
                for (scores, values) in scores.iter_mut().zip(values.chunks(Spectrum::CHANNELS)) {
                    scores.add(finite(spectrum(values), &mut ws.stats.not_finite));
                }
            }
        }
        count(taken);
        (scores, ws.stats())
    };
    let tasks = (0..pixels.div_ceil(PIXELS_PER_TASK)).into_par_iter();
    let runs: Vec<(Vec<Scores>, Stats)> = tasks.with_max_len(1).map(task).collect();
    let mut found: Found = (0..groups)
        .map(|_| Vec::with_capacity(runs.len()))
        .collect();
    let mut stats = Stats::default();
    for (run, counts) in runs {
        stats += counts;
        found
            .iter_mut()
            .zip(run)
            .for_each(|(group, scores)| group.push(scores));
    }
    (found, stats)
}

/// Adds the result of a pass to a film.
pub(super) fn add(film: &mut Film, found: Found) {
    for (group, scores) in found.into_iter().enumerate() {
        film.add_scores(group, PIXELS_PER_TASK, scores);
    }
}

/// Returns the means over the rays of a replicate.
fn mean(
    source: &Source,
    tracer: &AovTracer,
    pixel: usize,
    replicate: Range<u64>,
    ws: &mut Workspace,
) -> Vec<f64> {
    // A power of two, so that products are exact.
    let share = 1.0 / (replicate.end - replicate.start) as f64;
    let mut mean = Vec::new();
    let mut values = Vec::new();
    for sample in replicate {
        let SampledRay { ray, weight, .. } = source.ray(pixel, sample);
        ws.stats.paths += 1;
        values.clear();
        tracer.sample(source.scene.at(sample), ray, ws, &mut values);
        mean.resize(values.len(), 0.0);
        for (mean, value) in mean.iter_mut().zip(&values) {
            *mean += value * weight * share;
        }
    }
    mean
}

fn spectrum(values: &[f64]) -> Spectrum {
    Spectrum(std::array::from_fn(|c| {
        values.get(c).copied().unwrap_or(0.0)
    }))
}
