//! Arbitrary output variables: one ray a sample gives the values of all channels.

use super::source::{SampledRay, Source, add};
use crate::Spectrum;
use crate::aov::AovTracer;
use crate::film::{Film, Pixel};
use crate::path::Workspace;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per unit of work.
const PIXELS_PER_TASK: usize = 64;

/// Adds a range of samples to every pixel, in all groups of channels.
pub(super) fn pass(
    source: &Source,
    tracer: &AovTracer,
    samples: Range<u64>,
    film: &mut Film,
) -> Stats {
    let tasks = (film.width() * film.height()).div_ceil(PIXELS_PER_TASK);
    let mut parts: Vec<Vec<&mut [Pixel]>> = (0..tasks).map(|_| Vec::new()).collect();
    for group in film.groups_mut() {
        let chunks = group.chunks_mut(PIXELS_PER_TASK);
        parts.iter_mut().zip(chunks).for_each(|(p, c)| p.push(c));
    }
    let task = |(task, mut groups): (usize, Vec<&mut [Pixel]>)| {
        let mut ws = source.workspace();
        let pixels = groups[0].len();
        for i in 0..pixels {
            for sample in samples.clone() {
                if source.is_stopped() {
                    return ws.stats();
                }
                let pixel = task * PIXELS_PER_TASK + i;
                let values = values(source, tracer, pixel, sample, &mut ws);
                for (group, values) in groups.iter_mut().zip(values.chunks(Spectrum::CHANNELS)) {
                    add(&mut group[i], spectrum(values), &mut ws.stats.not_finite);
                }
            }
        }
        let taken = pixels as u64 * (samples.end - samples.start);
        source.handle.count(taken);
        ws.stats()
    };
    let tasks = parts.into_par_iter().enumerate().with_max_len(1).map(task);
    tasks.reduce(Stats::default, |mut a, b| {
        a += b;
        a
    })
}

fn values(
    source: &Source,
    tracer: &AovTracer,
    pixel: usize,
    sample: u64,
    ws: &mut Workspace,
) -> Vec<f64> {
    let SampledRay { ray, weight, .. } = source.ray(pixel, sample);
    ws.stats.paths += 1;
    let mut values = Vec::new();
    tracer.sample(source.scene.at(sample), ray, ws, &mut values);
    values.iter_mut().for_each(|value| *value *= weight);
    values
}

fn spectrum(values: &[f64]) -> Spectrum {
    Spectrum(std::array::from_fn(|c| {
        values.get(c).copied().unwrap_or(0.0)
    }))
}
