//! Derivatives of images and of what meters read: a pass over samples or particles, in which each path is worth what the weights of
//! what it adds to say.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use super::source::{Source, finite};
use super::{Handle, Prepared, RenderOptions, prepare, seed_of_group};
use crate::Spectrum;
use crate::derivative::{DerivativeError, Plan, RadiometricParameter, Sums, Tape};
use crate::film::Decomposition;
use crate::integrator::{Integrator, PathFinds, PathTracer};
use crate::meter::{Meter, Setup};
use crate::path::Workspace;
use crate::renderer::Renderer;
use crate::scene::Scene;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Bytes of sums that are made side by side, whatever the number of threads: so results do not depend on it.
const SUMS: usize = 256 << 20;
/// No more sums than these.
const MOST_SUMS: usize = 64;
/// The samples are taken in at most so many batches, whose spread gives the error.
const BATCHES: u64 = 32;
/// Changes the seed, so that a render of the same seed is independent.
const SEED: u64 = 0x5DEE_CE66_D1CE_4E5B;

/// The derivative of a loss by one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivative {
    /// Length along each axis: see [`RadiometricParameter::shape`]; the last is that of channels.
    pub shape: Vec<usize>,
    /// Values, the last axis running fastest.
    pub values: Vec<f64>,
    /// Their standard errors, from batches of samples.
    pub errors: Vec<f64>,
}

/// Derivatives, and what happened meanwhile.
#[derive(Clone, Debug)]
pub struct Derivatives {
    /// One for each parameter, in their order.
    pub by: Vec<Derivative>,
    /// What happened.
    pub stats: Stats,
}

/// How derivatives of an image are taken.
#[derive(Clone, Debug)]
pub struct DerivativeOptions<'a> {
    /// Which paths are followed.
    pub path: PathTracer,
    /// Samples per pixel, and the seed. A render of the same seed is independent of the derivatives, as losses
    /// that are not linear need it.
    pub samples: u64,
    /// See `samples`.
    pub seed: u64,
    /// How light is told apart, if weights do.
    pub decomposition: Decomposition,
    /// Whether light that comes straight from an emitter is left out of the image.
    pub hide_emitters: bool,
    /// What light is differentiated by.
    pub parameters: &'a [RadiometricParameter],
    /// The derivative of the loss by each value of the image: for each [layer](Decomposition::layers), row by row, channels interleaved.
    pub weights: &'a [f64],
}

/// The derivatives of Σ weight × image by parameters, unbiased, on the current thread pool. `scenes` are those of
/// [`render`](super::render()). `None` if the handle has ended it before it was complete. Equal seeds give equal bits, for any number of threads.
///
/// # Errors
/// Parameters that a scene does not have derivatives by, Stokes parameters, weights that do not fit or are not finite, fewer than two samples.
pub fn derivatives(
    scenes: &[Scene],
    options: &DerivativeOptions,
    handle: &Handle,
) -> Result<Option<Derivatives>, DerivativeError> {
    if options.decomposition.stokes {
        return Err(DerivativeError::Polarized);
    }
    let film = scenes[0].film();
    let pixels = film.width * film.height;
    let expected = options.decomposition.layers() * pixels * film.channels;
    check_weights(options.weights, expected)?;
    let plans = scenes
        .iter()
        .enumerate()
        .map(|(group, scene)| Plan::new(scene, options.parameters, film.channels_of(group)));
    let plans: Vec<Plan> = plans.collect::<Result<_, _>>()?;
    let render = render_options(options);
    let prepared = prepare(scenes, &render, None, handle);
    let mut found = Derivatives {
        by: blank(scenes, options.parameters),
        stats: Stats::default(),
    };
    for (group, plan) in plans.iter().enumerate() {
        let prepared = without_splitting(&prepared[group]);
        let source = Source::new(&scenes[group], group, &render, prepared, handle);
        let Some(moments) = Pass::new(&source, plan, options).moments(&mut found.stats)? else {
            return Ok(None);
        };
        moments.enter(plan, group * film.group_size, &mut found.by);
    }
    Ok(Some(found))
}

fn check_weights(weights: &[f64], expected: usize) -> Result<(), DerivativeError> {
    let found = weights.len();
    if found != expected {
        return Err(DerivativeError::Weights { expected, found });
    }
    match weights.iter().position(|w| !w.is_finite()) {
        Some(i) => Err(DerivativeError::NotFinite(i)),
        None => Ok(()),
    }
}

/// How an image would be rendered by the same paths.
fn render_options(options: &DerivativeOptions) -> RenderOptions {
    let renderer = Renderer::Light(Integrator::Path(options.path));
    RenderOptions {
        hide_emitters: options.hide_emitters,
        decomposition: options.decomposition,
        ..RenderOptions::new(renderer, options.samples, options.seed ^ SEED)
    }
}

/// Both ways of an edge that is split have factors of their own: one is followed at a time.
fn without_splitting(prepared: &Prepared) -> Prepared {
    let mut prepared = prepared.clone();
    prepared.first_vertex.splitting = false;
    prepared
}

fn blank(scenes: &[Scene], parameters: &[RadiometricParameter]) -> Vec<Derivative> {
    let of = |parameter: &RadiometricParameter| {
        let mut shape = parameter.shape(&scenes[0]);
        shape.push(scenes[0].film().channels);
        let count = shape.iter().product();
        Derivative {
            shape,
            values: vec![0.0; count],
            errors: vec![0.0; count],
        }
    };
    parameters.iter().map(of).collect()
}

/// The samples of one group of channels.
struct Pass<'a> {
    source: &'a Source<'a>,
    plan: &'a Plan,
    options: &'a DerivativeOptions<'a>,
    pixels: usize,
}

impl<'a> Pass<'a> {
    fn new(source: &'a Source<'a>, plan: &'a Plan, options: &'a DerivativeOptions<'a>) -> Self {
        let film = source.scene.film();
        Pass {
            source,
            plan,
            options,
            pixels: film.width * film.height,
        }
    }

    /// Takes all samples, batch by batch. `None` if it was stopped.
    fn moments(&self, stats: &mut Stats) -> Result<Option<BatchMoments>, DerivativeError> {
        let replicate = self.source.replicates.size();
        let units = Units {
            count: self.options.samples / replicate,
            size: replicate,
            sums: self.plan.len(),
        };
        units.moments(self.source.handle, |range| {
            self.source
                .handle
                .count(self.pixels as u64 * (range.end - range.start));
            self.batch(range, stats)
        })
    }

    /// The sums over a range of samples of all pixels: those of a number of parts that does not depend on that of threads, one after the other.
    fn batch(&self, samples: Range<u64>, stats: &mut Stats) -> Vec<f64> {
        side_by_side(self.plan.len(), self.pixels, stats, |pixels| {
            self.part(pixels, samples.clone())
        })
    }

    fn part(&self, pixels: Range<usize>, samples: Range<u64>) -> (Vec<f64>, Stats) {
        let source = self.source;
        let (mut ws, mut tape, mut found) = (source.workspace(), Tape::default(), Vec::new());
        let mut sums = Sums::new(source.scene, self.plan);
        for pixel in pixels {
            for sample in samples.clone() {
                if source.is_stopped() {
                    return (sums.into_values(), ws.stats());
                }
                let mut sampled = source.ray(pixel, sample);
                ws.stats.paths += 1;
                let (scene, channels) = (source.scene.at(sample), source.channels());
                let finds = PathFinds {
                    out: &mut found,
                    recorder: &mut tape,
                };
                let (ray, sampler) = (sampled.ray, &mut sampled.sampler);
                let path = &self.options.path;
                path.sample(scene, ray, channels, sampler, &mut ws, finds);
                let not_finite = &mut ws.stats.not_finite;
                let worths = found.iter().map(|c| {
                    let weights = self.weights(pixel, self.options.decomposition.layer(&c.path));
                    let shown = source.shows(&c.path);
                    let weight = if shown { sampled.weight } else { 0.0 };
                    finite(c.weighted(), not_finite) * weights * weight
                });
                sums.add(&tape, worths);
                found.clear();
                tape.clear();
            }
        }
        (sums.into_values(), ws.stats())
    }

    /// The weights of a pixel in a layer.
    fn weights(&self, pixel: usize, layer: usize) -> Spectrum {
        let film = self.source.scene.film();
        let first = (layer * self.pixels + pixel) * film.channels;
        let first = first + self.source.group * film.group_size;
        let used = self.source.channels();
        let weight = |c: usize| {
            if c < used {
                self.options.weights[first + c]
            } else {
                0.0
            }
        };
        Spectrum(std::array::from_fn(weight))
    }
}

/// How derivatives of what meters read are taken.
#[derive(Clone, Debug)]
pub struct MeterDerivativeOptions<'a> {
    /// Particles, for each group of channels, and the seed. A measurement of the same seed is independent of the derivatives.
    pub particles: u64,
    /// See `particles`.
    pub seed: u64,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
    /// What readings are differentiated by.
    pub parameters: &'a [RadiometricParameter],
    /// For each meter and each of its [readings](Meter::readings), the derivative of the loss by each bin and channel; an empty one counts nothing.
    pub weights: &'a [Vec<Vec<f64>>],
}

/// The derivatives of Σ weight × reading by parameters, unbiased, on the current thread pool. `scenes` and `meters` are those of
/// [`measure`](super::measure()). `None` if the handle has ended it before it was complete. Equal seeds give equal bits, for any number of threads.
///
/// # Errors
/// As [`derivatives`]; weights for fluence.
pub fn meter_derivatives(
    scenes: &[Scene],
    meters: &[Meter],
    options: &MeterDerivativeOptions,
    handle: &Handle,
) -> Result<Option<Derivatives>, DerivativeError> {
    let film = scenes[0].film();
    check_readings(meters, options.weights, film.channels)?;
    let mut found = Derivatives {
        by: blank(scenes, options.parameters),
        stats: Stats::default(),
    };
    let max_depth = options.max_depth.unwrap_or(u32::MAX);
    for (group, scene) in scenes.iter().enumerate() {
        let channels = film.channels_of(group);
        let plan = Plan::new(scene, options.parameters, channels)?;
        let setup = Setup::new(scene, meters, channels, max_depth, options.rr_depth);
        let setup = setup.ok_or(DerivativeError::Dark)?;
        let first = group * film.group_size;
        let weights = setup.slot_weights(options.weights, first, film.channels);
        let seed = seed_of_group(options.seed ^ SEED, group);
        let units = Units {
            count: options.particles,
            size: 1,
            sums: plan.len(),
        };
        let stats = &mut found.stats;
        let moments = units.moments(handle, |range| {
            let count = (range.end - range.start) as usize;
            handle.count(count as u64);
            side_by_side(plan.len(), count, stats, |part| {
                let mut ws = Workspace::new(scene.tolerance());
                ws.stop = handle.stop().clone();
                let mut sums = Sums::new(scene, &plan);
                let number = |i: usize| range.start + i as u64;
                let particles = number(part.start)..number(part.end);
                setup.differentiate(seed, particles, &weights, &mut sums, &mut ws);
                (sums.into_values(), ws.stats())
            })
        })?;
        let Some(moments) = moments else {
            return Ok(None);
        };
        moments.enter(&plan, first, &mut found.by);
    }
    Ok(Some(found))
}

fn check_readings(
    meters: &[Meter],
    weights: &[Vec<Vec<f64>>],
    channels: usize,
) -> Result<(), DerivativeError> {
    let all = meters.iter().flat_map(|meter| {
        let fluence = matches!(meter, Meter::Fluence(_));
        let readings = meter.readings().into_iter();
        readings.map(move |(_, axes)| (fluence, channels * axes.iter().product::<usize>()))
    });
    let all: Vec<_> = all.collect();
    let found = weights.iter().flatten().count();
    if found != all.len() {
        let expected = all.len();
        return Err(DerivativeError::Weights { expected, found });
    }
    for ((fluence, expected), weights) in all.into_iter().zip(weights.iter().flatten()) {
        if weights.is_empty() {
            continue;
        }
        if fluence {
            return Err(DerivativeError::Fluence);
        }
        check_weights(weights, expected)?;
    }
    Ok(())
}

/// Samples that are taken in batches.
struct Units {
    /// Number of replicates.
    count: u64,
    /// Samples of each.
    size: u64,
    /// Number of sums.
    sums: usize,
}

impl Units {
    /// The moments of all batches, each the sums over a range of samples. `None` if it was stopped.
    fn moments(
        &self,
        handle: &Handle,
        mut batch: impl FnMut(Range<u64>) -> Vec<f64>,
    ) -> Result<Option<BatchMoments>, DerivativeError> {
        if self.count < 2 {
            return Err(DerivativeError::Samples(self.size));
        }
        let each = self.count.div_ceil(BATCHES);
        let mut moments = BatchMoments::new(self.sums)?;
        for first in (0..self.count).step_by(each as usize) {
            let last = (first + each).min(self.count);
            let sums = batch(first * self.size..last * self.size);
            if handle.stop().is_raised() {
                return Ok(None);
            }
            moments.add(&sums, (last - first) as f64, self.size as f64);
        }
        Ok(Some(moments))
    }
}

/// So many sums over `count` things, those of a number of parts that does not depend on that of threads, added up one after the other.
fn side_by_side(
    sums: usize,
    count: usize,
    stats: &mut Stats,
    part: impl Fn(Range<usize>) -> (Vec<f64>, Stats) + Sync,
) -> Vec<f64> {
    let bytes = (sums * size_of::<f64>()).max(1);
    let parts = (SUMS / bytes).clamp(1, MOST_SUMS).min(count);
    let of = |i: usize| {
        let bound = |i: usize| i * count / parts;
        part(bound(i)..bound(i + 1))
    };
    let all: Vec<(Vec<f64>, Stats)> = (0..parts).into_par_iter().map(of).collect();
    let mut total = vec![0.0; sums];
    for (values, counts) in all {
        *stats += counts;
        total.iter_mut().zip(values).for_each(|(a, b)| *a += b);
    }
    total
}

/// Mean over replicates, and its variance from the spread of batches of them.
struct BatchMoments {
    replicates: f64,
    batches: f64,
    sums: Vec<f64>,
    /// Of squares of the sums of batches, over their numbers of replicates.
    squares: Vec<f64>,
}

impl BatchMoments {
    fn new(count: usize) -> Result<Self, DerivativeError> {
        let zeros = || {
            let mut zeros = Vec::new();
            let room = zeros.try_reserve_exact(count);
            room.map_err(|_| DerivativeError::Memory(count))?;
            zeros.resize(count, 0.0);
            Ok(zeros)
        };
        Ok(BatchMoments {
            replicates: 0.0,
            batches: 0.0,
            sums: zeros()?,
            squares: zeros()?,
        })
    }

    /// Adds the sums of a batch of so many replicates of a size.
    fn add(&mut self, batch: &[f64], replicates: f64, size: f64) {
        self.replicates += replicates;
        self.batches += 1.0;
        for (i, value) in batch.iter().enumerate() {
            let value = value / size;
            self.sums[i] += value;
            self.squares[i] += value * value / replicates;
        }
    }

    /// Enters means and errors, whose channels begin at `channel`.
    fn enter(&self, plan: &Plan, channel: usize, by: &mut [Derivative]) {
        for (derivative, bounds) in by.iter_mut().zip(plan.starts.windows(2)) {
            let all = derivative.shape.last().copied().unwrap_or(1);
            for (i, slot) in (bounds[0]..bounds[1]).enumerate() {
                let (number, c) = (i / plan.channels(), i % plan.channels());
                let mean = self.sums[slot] / self.replicates;
                let spread = self.squares[slot] - self.sums[slot] * mean;
                let variance = spread.max(0.0) / (self.batches - 1.0) / self.replicates;
                derivative.values[number * all + channel + c] = mean;
                derivative.errors[number * all + channel + c] = variance.sqrt();
            }
        }
    }
}
