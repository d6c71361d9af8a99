//! Arbitrary output variables: one ray a sample gives the values of all channels, in place of light or beside it.

use super::source::{SampledRay, Source, add};
use crate::Spectrum;
use crate::aov::AovTracer;
use crate::film::{Film, Pixel};
use crate::path::Workspace;
use crate::sampling::Replicates;
use crate::scene::FilmSpec;
use crate::stats::Stats;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Pixels per unit of work.
const PIXELS_PER_TASK: usize = 64;

/// What is found of the sensor rays of a render of light, which are followed once more.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Quantities {
    /// The quantities, in the order of [`AovTracer::channels`].
    pub film: Film,
    /// What happened to these rays.
    pub stats: Stats,
}

impl Quantities {
    /// Nothing yet.
    pub(super) fn new(tracer: &AovTracer, spec: &FilmSpec, replicates: Replicates) -> Self {
        let film = Film::new(spec.width, spec.height, tracer.channels().count());
        Quantities {
            film: film.in_replicates(replicates),
            stats: Stats::default(),
        }
    }

    /// Adds a range of samples to every pixel: the rays are those of light, sample by sample.
    pub(super) fn pass(&mut self, source: &Source, tracer: &AovTracer, samples: Range<u64>) {
        self.stats += rays(source, tracer, samples, &mut self.film, |_| ());
    }

    pub(super) fn merge(&mut self, other: &Quantities) {
        self.film.merge(&other.film);
        self.stats += other.stats;
    }
}

/// Adds a range of samples to every pixel, in all groups of channels.
pub(super) fn pass(
    source: &Source,
    tracer: &AovTracer,
    samples: Range<u64>,
    film: &mut Film,
) -> Stats {
    rays(source, tracer, samples, film, |taken| {
        source.handle.count(taken)
    })
}

/// As [`pass`]; `count` hears of the samples that have been taken.
fn rays(
    source: &Source,
    tracer: &AovTracer,
    samples: Range<u64>,
    film: &mut Film,
    count: impl Fn(u64) + Sync,
) -> Stats {
    let tasks = (film.width() * film.height()).div_ceil(PIXELS_PER_TASK);
    let mut parts: Vec<Vec<&mut [Pixel]>> = (0..tasks).map(|_| Vec::new()).collect();
    for group in film.groups_mut() {
        let chunks = group.chunks_mut(PIXELS_PER_TASK);
        parts.iter_mut().zip(chunks).for_each(|(p, c)| p.push(c));
    }
    let size = source.replicates.size();
    let task = |(task, mut groups): (usize, Vec<&mut [Pixel]>)| {
        let mut ws = source.workspace();
        let pixels = groups[0].len();
        for i in 0..pixels {
            for first in samples.clone().step_by(size as usize) {
                if source.is_stopped() {
                    return ws.stats();
                }
                let pixel = task * PIXELS_PER_TASK + i;
                let values = mean(source, tracer, pixel, first..first + size, &mut ws);
                for (group, values) in groups.iter_mut().zip(values.chunks(Spectrum::CHANNELS)) {
                    add(&mut group[i], spectrum(values), &mut ws.stats.not_finite);
                }
            }
        }
        let taken = pixels as u64 * (samples.end - samples.start);
        count(taken);
        ws.stats()
    };
    let tasks = parts.into_par_iter().enumerate().with_max_len(1).map(task);
    tasks.reduce(Stats::default, |mut a, b| {
        a += b;
        a
    })
}

/// The means over the rays of a replicate.
fn mean(
    source: &Source,
    tracer: &AovTracer,
    pixel: usize,
    replicate: Range<u64>,
    ws: &mut Workspace,
) -> Vec<f64> {
    // A power of two, so that nothing is rounded.
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
