//! Estimators whose samples contribute to the whole image.
//!
//! One sample of every pixel together make one sample of the whole image. Contributions to other
//! pixels are added up first. Then each pixel takes its sum as one sample, or as one sample of a
//! replicate. The samples of a pixel, or its replicates, are therefore independent of one another,
//! and the variance of their mean is known as for any other estimator. The sums of one sample are
//! formed in the order of pixels and paths, independent of threads: equal seeds give equal bits.
//!
//! Theory: docs/theory.md#film.

use super::Debiased;
use super::followed::{FollowedSamples, FoundPart};
use super::shared;
use super::source::{LightSamples, Source, finite};
use super::strategies::{Strategies, StrategyScores};
use crate::Spectrum;
use crate::film::{Decomposition, Film, Pending, PlacedValue, Scores, footprint};
use crate::integrator::{Contribution, Merging};
use crate::path::{BalanceSums, BalanceTotals};
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per task.
const PIXELS_PER_TASK: usize = 16;
/// Tasks per thread whose contributions are kept until they are added up: enough to keep all
/// threads busy, few enough to fit into memory.
const TASKS_PER_THREAD: usize = 1 << 7;
/// Assumed number of contributions to a pixel's sample. The true number depends on the scene.
const CONTRIBUTIONS: usize = 32;

/// Bytes of the contributions that are kept until they are added up, for a film of `pixels` pixels
/// and contributions of `parts` parts.
pub(super) fn waiting(pixels: usize, parts: usize) -> usize {
    let pixels = pixels.min(tasks_of_block() * PIXELS_PER_TASK);
    let parts = parts * size_of::<(usize, FoundPart)>();
    pixels * CONTRIBUTIONS * (size_of::<(usize, Contribution)>() + parts)
}

/// Number of tasks whose contributions are kept at the same time.
fn tasks_of_block() -> usize {
    TASKS_PER_THREAD * rayon::current_num_threads()
}

/// Results of one sample of a few neighbouring pixels.
#[derive(Default)]
struct SplatSamples {
    /// Contributions, each with the pixel whose sample found it.
    contributions: Vec<(usize, Contribution)>,
    /// Parts of their light, if the film keeps [parts](crate::film::LightParts).
    parts: Option<Vec<(usize, FoundPart)>>,
}

/// Films to which samples of the whole image are added.
pub(super) struct ImageFilms<'a> {
    pub film: &'a mut Film,
    /// Image without its known bias.
    pub debiased: Option<&'a mut Debiased>,
    /// Images of strategies.
    pub strategies: Option<&'a mut Strategies>,
}

/// Sample of the whole image, or a replicate of samples, for one group of channels.
pub(super) struct ImageScores {
    pub image: Scores,
    /// Single samples of the image without its known bias, if there is such an image.
    pub debiased: Vec<Vec<Spectrum>>,
    pub strategies: StrategyScores,
}

impl ImageScores {
    /// Adds the scores to films.
    pub(super) fn add(self, source: &Source, films: &mut ImageFilms) {
        films.film.add_image(source.group, self.image);
        if let Some(debiased) = &mut films.debiased {
            for values in self.debiased {
                let scores = Scores::of_image(values, Vec::new(), Vec::new());
                debiased.film.add_image(source.group, scores);
            }
        }
        if let Some(strategies) = &mut films.strategies {
            strategies.add(source, self.strategies);
        }
    }
}

/// Samples of the whole image of one group of channels, and the fate of the emitters' power.
pub(super) type FoundImages = (Vec<ImageScores>, BalanceTotals);

/// Task: some pixels of one sample.
#[derive(Clone, Debug)]
struct Task {
    sample: u64,
    pixels: Range<usize>,
}

/// Tasks in the order in which their results are added up.
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

    /// Divides the tasks of some samples into blocks. Each block belongs to one sample if pixels
    /// share light subpaths.
    fn blocks(&self, samples: Range<u64>, is_shared: bool) -> impl Iterator<Item = Range<u64>> {
        let run = if is_shared {
            1
        } else {
            samples.end - samples.start
        };
        let (per_sample, end) = (self.per_sample, samples.end);
        let block = tasks_of_block() as u64;
        let runs = samples.step_by(run.max(1) as usize);
        runs.flat_map(move |first| {
            let tasks = first * per_sample..end.min(first + run) * per_sample;
            let end = tasks.end;
            let starts = tasks.step_by(block as usize);
            starts.map(move |start| start..end.min(start + block))
        })
    }
}

/// Takes a range of samples of the whole image, whole replicates, for the source's channel group.
/// Makes images of strategies if they are `told_apart`.
pub(super) fn pass(
    light: &LightSamples,
    samples: Range<u64>,
    film: &Film,
    told_apart: bool,
) -> (FoundImages, Stats) {
    let (source, pixels) = (light.source, film.width() * film.height());
    let tasks = Tasks::over(pixels);
    let mut stats = Stats::default();
    let mut found = Vec::new();
    let mut balances = BalanceTotals::default();
    let blank = || vec![Spectrum::ZERO; pixels];
    // Sums of a sample, and of its part that is bias; allocated when the sample begins.
    let (mut image, mut bias) = (Vec::new(), Vec::new());
    // Sums of a replicate.
    let (mut replicate, mut debiased, mut sorted) = (Vec::new(), Vec::new(), Vec::new());
    let mut strategies = StrategyScores::default();
    let size = source.replicates.size();
    // A power of two, so that products are exact.
    let share = 1.0 / size as f64;
    let mut balance = BalanceSums::default();
    let decomposition = film.layers().map(|layers| *layers.decomposition());
    let mut layered = decomposition.map(|d| Layered::new(d, pixels));
    let decomposition = decomposition.unwrap_or_default();
    let (blurs, sorts) = (
        light.integrator.blurs(),
        film.outliers(source.group).is_some(),
    );
    let is_shared = light.integrator.shares_light_paths();
    let mut shared = None;
    for block in tasks.blocks(samples, is_shared) {
        if source.is_stopped() {
            break;
        }
        if is_shared && block.start.is_multiple_of(tasks.per_sample) {
            // Free the old map first: there is no room for two.
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
            .map(|number| part(light, tasks.get(number), shared.as_ref(), &decomposition))
            .collect();
        for (number, (part, counts, particles)) in block.zip(parts) {
            stats += counts;
            balance += particles;
            if image.is_empty() {
                image = blank();
                bias = if blurs { blank() } else { Vec::new() };
            }
            for (own, contribution) in &part.contributions {
                let value = contribution.weighted();
                splat(source, *own, contribution.image, |pixel, filter| {
                    // Planted error "filter of the light image not normalised", found by morgana-transport/transport::agreement::estimators_agree_quickly:
                    // image[pixel] += value * filter.ceil();
                    image[pixel] += value * filter;
                });
                if blurs {
                    // Only light that a pixel's own sample finds is blurred.
                    bias[*own] += contribution.bias * contribution.weight;
                }
            }
            if let Some(layered) = &mut layered {
                layered.splat(source, &part, share);
            }
            if told_apart {
                strategies.splat(source, &part.contributions, share);
            }
            let Task {
                sample,
                pixels: done,
            } = tasks.get(number);
            if done.end < pixels {
                continue;
            }
            balances.enter(&std::mem::take(&mut balance));
            if blurs {
                let values = image.iter().zip(&bias);
                let values = values.map(|(value, bias)| finite(*value - *bias, &mut 0));
                debiased.push(values.collect());
            }
            for value in &mut image {
                *value = finite(*value, &mut stats.not_finite);
            }
            if sorts {
                sorted.extend(image.iter().copied().enumerate());
            }
            image.iter_mut().for_each(|value| *value *= share);
            if replicate.is_empty() {
                replicate = std::mem::take(&mut image);
            } else {
                let values = replicate.iter_mut().zip(image.drain(..));
                values.for_each(|(mean, value)| *mean += value);
            }
            if !(sample + 1).is_multiple_of(size) {
                continue;
            }
            let layers = layered.as_mut().map_or(Vec::new(), Layered::finish);
            found.push(ImageScores {
                image: Scores::of_image(
                    std::mem::take(&mut replicate),
                    layers,
                    std::mem::take(&mut sorted),
                ),
                debiased: std::mem::take(&mut debiased),
                strategies: std::mem::take(&mut strategies),
            });
        }
    }
    ((found, balances), stats)
}

fn part(
    light: &LightSamples,
    task: Task,
    shared: Option<&Merging>,
    decomposition: &Decomposition,
) -> (SplatSamples, Stats, BalanceSums) {
    let mut ws = light.source.workspace();
    let mut balance = BalanceSums::default();
    let (mut found, mut part) = (Vec::new(), SplatSamples::default());
    let mut followed = FollowedSamples::of(light, decomposition);
    part.parts = followed.is_some().then(Vec::new);
    let taken = task.pixels.len() as u64;
    for pixel in task.pixels {
        match &mut followed {
            Some(followed) => followed.take([pixel as u64, task.sample], &mut ws, &mut found),
            None => shared::take(light, shared, pixel, task.sample, &mut ws, &mut found),
        }
        balance.add(
            &std::mem::take(&mut ws.particle_balance),
            &mut ws.stats.not_finite,
        );
        for contribution in found.drain(..) {
            if contribution.is_finite() {
                part.contributions.push((pixel, contribution));
            } else {
                ws.stats.not_finite += 1;
            }
        }
        if let (Some(parts), Some(followed)) = (&mut part.parts, &followed) {
            let found = followed.parts().filter(|part| !part.value.is_zero());
            parts.extend(found.map(|part| {
                let value = finite(part.value, &mut ws.stats.not_finite);
                (pixel, FoundPart { value, ..part })
            }));
        }
    }
    light.source.handle.count(taken);
    (part, ws.stats(), balance)
}

/// Passes to `count` each pixel to which a contribution counts, with its factor: the pixel of its
/// own sample, or the pixels around its position on the image.
pub(super) fn splat(
    source: &Source,
    own: usize,
    image: Option<[f64; 2]>,
    mut count: impl FnMut(usize, f64),
) {
    let spec = source.scene.film();
    let Some(image) = image else {
        return count(own, 1.0);
    };
    // A pixel's filter per unit of the image's area is the filter per pixel times the number of
    // pixels of the whole image. There are as many paths as pixels of the film.
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

/// Layers of a sample of the whole image that is being added up.
struct Layered {
    decomposition: Decomposition,
    /// Sums by pixel and layer.
    pending: Pending,
}

impl Layered {
    fn new(decomposition: Decomposition, pixels: usize) -> Self {
        Layered {
            decomposition,
            pending: Pending::new(pixels * decomposition.layers()),
        }
    }

    /// Adds samples, times `share`.
    fn splat(&mut self, source: &Source, samples: &SplatSamples, share: f64) {
        let layers = self.decomposition.layers();
        let pending = &mut self.pending;
        let mut add = |own: usize, part: &FoundPart| {
            splat(source, own, part.image, |pixel, filter| {
                pending.add(pixel * layers + part.layer, part.value * (filter * share));
            });
        };
        if let Some(parts) = &samples.parts {
            return parts.iter().for_each(|(own, part)| add(*own, part));
        }
        for (own, contribution) in &samples.contributions {
            let part = FoundPart {
                layer: self.decomposition.layer(&contribution.path),
                image: contribution.image,
                value: contribution.weighted(),
            };
            add(*own, &part);
        }
    }

    /// Returns the non-zero values with their places, pixel × number of layers + layer, and resets
    /// them.
    fn finish(&mut self) -> Vec<PlacedValue> {
        let mut values = Vec::new();
        self.pending
            .take(|place, value| values.push((place, value)));
        values
    }
}
