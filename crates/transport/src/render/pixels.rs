//! Estimators whose samples belong to their own pixels (docs/theory.md#film).

use super::allocation::Allocation;
use super::followed::FollowedSamples;
use super::source::{LightSamples, finite};
use crate::Spectrum;
use crate::film::{CellsMut, Decomposition, Film, LevelsMut, PartsMut, Pending, Pixel};
use crate::integrator::Contribution;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per unit of work: few enough to share out, enough not to matter. Units are shared out one by one, so that no
/// thread is left alone with many of them at the end of a pass.
const PIXELS_PER_TASK: usize = 64;

/// A few neighbouring pixels, with their layers if light is told apart.
struct Task<'a> {
    first: usize,
    pixels: &'a mut [Pixel],
    layers: Option<(Decomposition, CellsMut<'a>)>,
    /// If samples are sorted by brightness.
    levels: Option<LevelsMut<'a>>,
}

/// Adds a range of samples of the image, whole replicates, to the source's channel group, of every pixel as many as it is allotted.
pub(super) fn pass(
    light: &LightSamples,
    samples: Range<u64>,
    allocation: &Allocation,
    film: &mut Film,
) -> Stats {
    tasks(film, light.source.group)
        .into_par_iter()
        .with_max_len(1)
        .map(|task| {
            let taken = task.pixels.len() as u64 * (samples.end - samples.start);
            let stats = run(light, samples.clone(), allocation, task);
            light.source.handle.count(taken);
            stats
        })
        .reduce(Stats::default, |mut a, b| {
            a += b;
            a
        })
}

fn tasks(film: &mut Film, group: usize) -> Vec<Task<'_>> {
    let PartsMut {
        pixels,
        layers,
        outliers,
    } = film.parts_mut(group);
    let mut levels = outliers.map(|outliers| outliers.chunks_mut(PIXELS_PER_TASK));
    let mut layers = layers.map(|layers| {
        let decomposition = layers.decomposition();
        let chunks = layers.chunks_mut(PIXELS_PER_TASK);
        chunks.map(move |cells| (decomposition, cells))
    });
    let chunks = pixels.chunks_mut(PIXELS_PER_TASK).enumerate();
    chunks
        .map(|(task, pixels)| Task {
            first: task * PIXELS_PER_TASK,
            pixels,
            layers: layers.as_mut().and_then(Iterator::next),
            levels: levels.as_mut().and_then(Iterator::next),
        })
        .collect()
}

fn run(
    light: &LightSamples,
    samples: Range<u64>,
    allocation: &Allocation,
    mut task: Task,
) -> Stats {
    let source = light.source;
    let mut ws = source.workspace();
    let mut found = Vec::new();
    let layers = task.layers.as_ref().map_or(0, |(d, _)| d.layers());
    let decomposition = task.layers.as_ref().map(|(d, _)| *d).unwrap_or_default();
    let mut followed = FollowedSamples::of(light, &decomposition);
    let mut pending = Pending::new(layers);
    let size = source.replicates.size();
    // A power of two, so that nothing is rounded.
    let share = 1.0 / size as f64;
    for (i, pixel) in task.pixels.iter_mut().enumerate() {
        let number = task.first + i;
        let replicates = samples.clone().step_by(size as usize);
        for first in replicates.flat_map(|replicate| allocation.samples(number, replicate)) {
            if source.is_stopped() {
                return ws.stats();
            }
            let mut mean = Spectrum::ZERO;
            for sample in first..first + size {
                match &mut followed {
                    Some(followed) => followed.take([number as u64, sample], &mut ws, &mut found),
                    None => light.take(number, sample, &mut ws, &mut found),
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
                        Some(followed) => followed.parts().for_each(|(layer, parts)| {
                            for (k, value) in parts.iter().enumerate() {
                                let value = finite(*value, &mut ws.stats.not_finite);
                                pending.add(layer + k, value * share);
                            }
                        }),
                    }
                }
                if let Some(levels) = &mut task.levels {
                    levels.add(i, value);
                }
                found.clear();
            }
            pixel.add(mean);
            if let Some((_, cells)) = &mut task.layers {
                pending.take(|layer, value| cells.add(i, layer, value));
            }
        }
    }
    ws.stats()
}
