//! Estimators whose samples contribute all over the image.
//!
//! One sample of every pixel together make one sample of the whole image: contributions to other pixels
//! are added up first, and then each pixel takes its sum as one sample, or as one of a replicate. So pixels' samples, or replicates, are
//! independent of one another over their number, and the variance of their mean is known as
//! for any other estimator. The sums of one sample are formed in the order of pixels and paths, whatever thread
//! computed them: the same seed gives the same bits.
//!
//! Theory: docs/theory.md#film.

use super::Debiased;
use super::shared;
use super::source::{LightSamples, Source, finite};
use super::strategies::Strategies;
use crate::Spectrum;
use crate::film::{Decomposition, Film, LayerGroup, Pending, footprint};
use crate::integrator::{Contribution, Merging};
use crate::path::{BalanceSums, BalanceTotals};
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per unit of work.
const PIXELS_PER_TASK: usize = 16;
/// Units of work whose contributions are kept until they are added up: enough to keep all threads
/// busy, few enough to fit into memory.
const BLOCK: u64 = 1 << 10;

/// One sample of a few neighbouring pixels: contributions, and the pixel whose sample each is.
type SplatSamples = Vec<(usize, Contribution)>;

/// What samples are added to.
pub(super) struct SplatFilms<'a> {
    pub film: &'a mut Film,
    /// The image without known bias.
    pub debiased: Option<&'a mut Debiased>,
    /// Images of strategies.
    pub strategies: Option<&'a mut Strategies>,
}

/// A unit of work: some pixels of one sample.
#[derive(Clone, Debug)]
struct Task {
    sample: u64,
    pixels: Range<usize>,
}

/// Units of work in the order in which they are added up.
struct Tasks {
    pixels: usize,
    per_sample: u64,
}

impl Tasks {
    fn over(pixels: usize) -> Self {
        Tasks {
            pixels,
            per_sample: pixels.div_ceil(PIXELS_PER_TASK) as u64,
        }
    }

    fn get(&self, number: u64) -> Task {
        let from = (number % self.per_sample) as usize * PIXELS_PER_TASK;
        Task {
            sample: number / self.per_sample,
            pixels: from..self.pixels.min(from + PIXELS_PER_TASK),
        }
    }

    /// The blocks in which work for some samples is done: each is of one sample if light is shared there.
    fn blocks(&self, samples: Range<u64>, is_shared: bool) -> impl Iterator<Item = Range<u64>> {
        let run = if is_shared {
            1
        } else {
            samples.end - samples.start
        };
        let (per_sample, end) = (self.per_sample, samples.end);
        let runs = samples.step_by(run.max(1) as usize);
        runs.flat_map(move |first| {
            let tasks = first * per_sample..end.min(first + run) * per_sample;
            let end = tasks.end;
            let starts = tasks.step_by(BLOCK as usize);
            starts.map(move |start| start..end.min(start + BLOCK))
        })
    }
}

/// Adds a range of samples, whole replicates, to every pixel of the source's channel group.
pub(super) fn pass(
    light: &LightSamples,
    samples: Range<u64>,
    films: SplatFilms,
    balances: &mut BalanceTotals,
) -> Stats {
    let SplatFilms {
        film,
        mut debiased,
        mut strategies,
    } = films;
    let (source, pixels) = (light.source, film.width() * film.height());
    let tasks = Tasks::over(pixels);
    let mut stats = Stats::default();
    let mut image = vec![Spectrum::ZERO; pixels];
    let mut bias = debiased.as_ref().map(|_| image.clone());
    let mut replicate = vec![Spectrum::ZERO; pixels];
    let size = source.replicates.size();
    // A power of two, so that nothing is rounded.
    let share = 1.0 / size as f64;
    let mut balance = BalanceSums::default();
    let mut layered = Layered::new(film.parts_mut(source.group).layers, pixels);
    let decomposition = film.layers().map(|layers| *layers.decomposition());
    let decomposition = decomposition.unwrap_or_default();
    let is_shared = light.integrator.shares_light_paths();
    let mut shared = None;
    for block in tasks.blocks(samples, is_shared) {
        if source.is_stopped() {
            break;
        }
        if is_shared && block.start.is_multiple_of(tasks.per_sample) {
            // There is no room for two.
            drop(shared.take());
            let sample = block.start / tasks.per_sample;
            shared = shared::trace(light, sample, decomposition).map(|followed| {
                stats += followed.stats;
                balance += followed.balance;
                followed.found
            });
        }
        let numbers: Vec<u64> = block.clone().collect();
        let parts: Vec<(SplatSamples, Stats, BalanceSums)> = numbers
            .into_par_iter()
            .with_max_len(1)
            .map(|number| part(light, tasks.get(number), shared.as_ref()))
            .collect();
        for (number, (part, counts, particles)) in block.zip(parts) {
            stats += counts;
            balance += particles;
            for (own, contribution) in &part {
                let value = contribution.weighted();
                splat(source, *own, contribution, |pixel, filter| {
                    image[pixel] += value * filter;
                });
                if let Some(bias) = &mut bias {
                    // Only light that a pixel's own sample finds is blurred.
                    bias[*own] += contribution.bias * contribution.weight;
                }
            }
            if let Some(layered) = &mut layered {
                layered.splat(source, &part, share);
            }
            if let Some(strategies) = strategies.as_deref_mut() {
                strategies.splat(source, &part, share);
            }
            let Task {
                sample,
                pixels: done,
            } = tasks.get(number);
            if done.end < pixels {
                continue;
            }
            balances.enter(&std::mem::take(&mut balance));
            let mut parts = film.parts_mut(source.group);
            let mut levels = parts.outliers.as_mut().map(|c| c.levels_mut());
            if let (Some(debiased), Some(bias)) = (debiased.as_deref_mut(), &mut bias) {
                debiased.add(source.group, &image, bias);
            }
            for (i, (mean, value)) in replicate.iter_mut().zip(&mut image).enumerate() {
                let value = finite(std::mem::take(value), &mut stats.not_finite);
                *mean += value * share;
                if let Some(levels) = &mut levels {
                    levels.add(i, value);
                }
            }
            if !(sample + 1).is_multiple_of(size) {
                continue;
            }
            let sum = replicate.iter().fold(Spectrum::ZERO, |sum, v| sum + *v);
            for (pixel, mean) in parts.pixels.iter_mut().zip(&mut replicate) {
                pixel.add(std::mem::take(mean));
            }
            if let (Some(layered), Some(layers)) = (&mut layered, parts.layers) {
                layered.finish(layers);
            }
            if let Some(strategies) = strategies.as_deref_mut() {
                strategies.finish(source);
            }
            film.add_whole(source.group, sum / pixels as f64);
        }
    }
    stats
}

fn part(
    light: &LightSamples,
    task: Task,
    shared: Option<&Merging>,
) -> (SplatSamples, Stats, BalanceSums) {
    let mut ws = light.source.workspace();
    let mut balance = BalanceSums::default();
    let (mut found, mut part) = (Vec::new(), SplatSamples::new());
    let taken = task.pixels.len() as u64;
    for pixel in task.pixels {
        shared::take(light, shared, pixel, task.sample, &mut ws, &mut found);
        balance.add(
            &std::mem::take(&mut ws.particle_balance),
            &mut ws.stats.not_finite,
        );
        for contribution in found.drain(..) {
            if contribution.is_finite() {
                part.push((pixel, contribution));
            } else {
                ws.stats.not_finite += 1;
            }
        }
    }
    light.source.handle.count(taken);
    (part, ws.stats(), balance)
}

/// Tells `count` the pixels in which a contribution counts, its own or those around its place, and by
/// what factor.
pub(super) fn splat(
    source: &Source,
    own: usize,
    contribution: &Contribution,
    mut count: impl FnMut(usize, f64),
) {
    let spec = source.scene.film();
    let Some(image) = contribution.image else {
        return count(own, 1.0);
    };
    // A pixel's filter per unit of the image's area is the image's number of pixels times that per pixel, and
    // there are as many paths as pixels of the film.
    let share = spec
        .window
        .map_or(1.0, |w| w.pixels() / (spec.width * spec.height) as f64);
    let place = spec.position(image);
    footprint(
        spec.width,
        spec.height,
        &spec.filter,
        place,
        |pixel, value| {
            count(pixel, value * share);
        },
    );
}

/// The layers of a sample of the whole image, being added up.
pub(super) struct Layered {
    decomposition: Decomposition,
    pixels: usize,
    /// By pixel and layer.
    pending: Pending,
}

impl Layered {
    pub(super) fn new(layers: Option<&mut LayerGroup>, pixels: usize) -> Option<Self> {
        let decomposition = layers?.decomposition();
        Some(Layered {
            decomposition,
            pixels,
            pending: Pending::new(pixels * decomposition.layers()),
        })
    }

    /// Adds a `share` of contributions.
    fn splat(&mut self, source: &Source, part: &SplatSamples, share: f64) {
        for (own, contribution) in part {
            let layer = self.decomposition.layer(&contribution.path);
            let value = contribution.weighted() * share;
            splat(source, *own, contribution, |pixel, filter| {
                self.add(pixel, layer, value * filter);
            });
        }
    }

    /// Adds a value to a pixel's sample.
    pub(super) fn add(&mut self, pixel: usize, layer: usize, value: Spectrum) {
        self.pending
            .add(pixel * self.decomposition.layers() + layer, value);
    }

    /// Adds what was added up to the film, and starts anew.
    pub(super) fn finish(&mut self, group: &mut LayerGroup) {
        let layers = self.decomposition.layers();
        let mut sums = vec![Spectrum::ZERO; layers];
        let mut cells = group.cells_mut();
        self.pending.take(|place, value| {
            let (pixel, layer) = (place / layers, place % layers);
            cells.add(pixel, layer, value);
            sums[layer] += value;
        });
        let pixels = self.pixels as f64;
        group.add_whole(sums.into_iter().map(|sum| sum / pixels));
    }
}
