//! Estimators whose samples belong to their own pixels.

use super::source::{Source, add};
use crate::Spectrum;
use crate::film::Film;
use crate::integrator::Contribution;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Pixels per unit of work: few enough to share out, enough not to matter.
const PIXELS_PER_TASK: usize = 64;

/// Adds a range of samples to every pixel of the source's channel group.
pub(super) fn pass(
    source: &Source,
    samples: Range<u64>,
    film: &mut Film,
    counter: &AtomicU64,
) -> Stats {
    film.group_mut(source.group)
        .par_chunks_mut(PIXELS_PER_TASK)
        .enumerate()
        .map(|(task, pixels)| {
            let mut ws = source.workspace();
            let mut found = Vec::new();
            for (i, pixel) in pixels.iter_mut().enumerate() {
                for sample in samples.clone() {
                    source.sample(task * PIXELS_PER_TASK + i, sample, &mut ws, &mut found);
                    let sum = |sum, c: Contribution| sum + c.weighted();
                    let value = found.drain(..).fold(Spectrum::ZERO, sum);
                    add(pixel, value, &mut ws.stats.not_finite);
                }
            }
            let taken = pixels.len() as u64 * (samples.end - samples.start);
            counter.fetch_add(taken, Ordering::Relaxed);
            ws.stats()
        })
        .reduce(Stats::default, |mut a, b| {
            a += b;
            a
        })
}
