//! Arbitrary output variables: each sample traces one ray, which gives the values of all channels.
//! They replace the light, or accompany it.

use super::source::{SampledRay, Source, finite};
use super::splats::spread;
use crate::Spectrum;
use crate::aov::AovTracer;
use crate::film::{Film, FilmShape, Scores};
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
    /// Counts of events and failures of the rays that measured the quantities.
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

/// Scores of the whole image, by sample or replicate and group of channels.
pub(super) type Found = Vec<Vec<Scores>>;

/// Cells per task.
const CELLS_PER_TASK: usize = 64;

/// Takes a range of samples of every cell of a film. Calls `count` with the numbers of samples of
/// pixels taken.
pub(super) fn pass(
    source: &Source,
    tracer: &AovTracer,
    samples: Range<u64>,
    film: &Film,
    count: impl Fn(u64) + Sync,
) -> (Found, Stats) {
    let pixels = film.width() * film.height();
    let size = source.replicates.size();
    // A power of two, so that products are exact.
    let share = 1.0 / size as f64;
    let (mut found, mut stats) = (Found::new(), Stats::default());
    for first in samples.step_by(size as usize) {
        let mut images = vec![vec![Spectrum::ZERO; pixels]; film.groups()];
        for sample in first..first + size {
            if source.is_stopped() {
                return (found, stats);
            }
            let values = values_of_cells(source, tracer, sample, &count, &mut stats);
            let footprint = source.footprint(&source.image_sample(sample));
            for (group, image) in images.iter_mut().enumerate() {
                let value = |cell: usize| spectrum(&values[cell], group) * share;
                spread(source, &footprint, value, image);
            }
        }
        let scores = |mut image: Vec<Spectrum>| {
            let not_finite = &mut stats.not_finite;
            image
                .iter_mut()
                .for_each(|value| *value = finite(*value, not_finite));
            Scores::of_image(image, Vec::new(), Vec::new())
        };
        found.push(images.into_iter().map(scores).collect());
    }
    (found, stats)
}

/// Adds the result of a pass to a film.
pub(super) fn add(film: &mut Film, found: Found) {
    for (group, scores) in found.into_iter().flat_map(|s| s.into_iter().enumerate()) {
        film.add_image(group, scores);
    }
}

/// Returns the values of all channels in one sample of each cell; no values for a cell that
/// contributes to no pixel.
fn values_of_cells(
    source: &Source,
    tracer: &AovTracer,
    sample: u64,
    count: &(impl Fn(u64) + Sync),
    stats: &mut Stats,
) -> Vec<Vec<f64>> {
    let cells = source.cells.count();
    let image_sample = source.image_sample(sample);
    let footprint = source.footprint(&image_sample);
    let task = |task: usize| {
        let mut ws = source.workspace();
        let first = task * CELLS_PER_TASK;
        let run = first..cells.min(first + CELLS_PER_TASK);
        let values = run.clone().map(|cell| {
            let mut values = Vec::new();
            if source.cells.counts(&footprint, cell) && !source.is_stopped() {
                let SampledRay { ray, weight, .. } = source.ray(cell, &image_sample);
                ws.stats.paths += 1;
                tracer.sample(source.scene.at(sample), ray, &mut ws, &mut values);
                values.iter_mut().for_each(|value| *value *= weight);
            }
            values
        });
        let values: Vec<Vec<f64>> = values.collect();
        count(source.cells.pixels_among(run) as u64);
        (values, ws.stats())
    };
    let tasks = (0..cells.div_ceil(CELLS_PER_TASK)).into_par_iter();
    let runs: Vec<(Vec<Vec<f64>>, Stats)> = tasks.with_max_len(1).map(task).collect();
    let mut all = Vec::with_capacity(cells);
    for (values, counts) in runs {
        *stats += counts;
        all.extend(values);
    }
    all
}

/// Returns the values of a group of channels.
fn spectrum(values: &[f64], group: usize) -> Spectrum {
    let first = group * Spectrum::CHANNELS;
    Spectrum(std::array::from_fn(|channel| {
        values.get(first + channel).copied().unwrap_or(0.0)
    }))
}
