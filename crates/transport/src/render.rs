//! Rendering: samples spread over threads, with results that depend on the seed alone.

use crate::film::{Film, Pixel};
use crate::integrator::Integrator;
use crate::path::Workspace;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::spectrum::Spectrum;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Pixels per unit of work: few enough to share out, enough not to matter.
const PIXELS_PER_TASK: usize = 64;
/// Passes grow until they take about this long: progress is seen and cancelling is quick, and
/// waiting for the last thread at the end of a pass costs little.
const PASS: Duration = Duration::from_millis(500);

/// How a render is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Estimator.
    pub integrator: Integrator,
    /// Samples per pixel.
    pub samples: u64,
    /// Seed: the same seed gives the same image, bit for bit, for any number of threads.
    pub seed: u64,
}

/// How far a render has got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples per pixel done.
    pub done: u64,
    /// Samples per pixel asked for.
    pub total: u64,
}

/// What a render gives.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The image.
    pub film: Film,
    /// What happened.
    pub stats: Stats,
    /// Samples per pixel done: fewer than asked for if the render was stopped.
    pub samples: u64,
}

/// Renders on the current thread pool: one scene for each group of up to four channels, alike but for
/// their spectra. A film's groups are in the same order.
///
/// `on_pass` is called between passes; when it breaks, the render stops with what it has. All pixels
/// then have the same number of samples, and the same values as a render of just that many.
pub fn render(
    scenes: &[Scene],
    options: &Options,
    on_pass: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Rendering {
    render_counted(scenes, options, &AtomicU64::new(0), on_pass)
}

/// As [`render`]. `counter` grows by one for each sample of each pixel (and each group of channels)
/// while the render runs, for other threads to see.
pub fn render_counted(
    scenes: &[Scene],
    options: &Options,
    counter: &AtomicU64,
    mut on_pass: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Rendering {
    let spec = scenes[0].film();
    let mut film = Film::new(spec.width, spec.height, spec.channels);
    let mut stats = Stats::default();
    let (mut done, mut next) = (0, 1);
    while done < options.samples {
        let started = Instant::now();
        next = next.min(options.samples - done);
        for (group, scene) in scenes.iter().enumerate() {
            let source = Source {
                scene,
                integrator: options.integrator,
                seed: group_seed(options.seed, group),
            };
            stats += pass(&source, done..done + next, group, (&mut film, counter));
        }
        done += next;
        let progress = Progress {
            done,
            total: options.samples,
        };
        if on_pass(&progress).is_break() {
            break;
        }
        next = longer_or_shorter(next, started.elapsed());
    }
    Rendering {
        film,
        stats,
        samples: done,
    }
}

/// Samples for the next pass after one of `samples` that took `elapsed`. Each pixel adds up its
/// samples in order, so the image does not depend on how they are divided into passes.
fn longer_or_shorter(samples: u64, elapsed: Duration) -> u64 {
    if 2 * elapsed <= PASS {
        samples.saturating_mul(2)
    } else if elapsed >= 2 * PASS {
        (samples / 2).max(1)
    } else {
        samples
    }
}

/// Each group's paths have an address space of their own.
fn group_seed(seed: u64, group: usize) -> u64 {
    seed.wrapping_add((group as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Where the samples of one channel group come from.
struct Source<'a> {
    scene: &'a Scene,
    integrator: Integrator,
    seed: u64,
}

/// Adds a range of samples to every pixel of a channel group.
fn pass(
    source: &Source,
    samples: std::ops::Range<u64>,
    group: usize,
    (film, counter): (&mut Film, &AtomicU64),
) -> Stats {
    let spec = *source.scene.film();
    let lanes = (spec.channels - group * Spectrum::LANES).min(Spectrum::LANES);
    film.group_mut(group)
        .par_chunks_mut(PIXELS_PER_TASK)
        .enumerate()
        .map(|(task, pixels)| {
            let mut ws = Workspace::new(source.scene.tolerance());
            for (i, pixel) in pixels.iter_mut().enumerate() {
                let index = task * PIXELS_PER_TASK + i;
                for sample in samples.clone() {
                    let mut sampler = Sampler::new(source.seed, index as u64, sample);
                    let value = one_sample(source, index, lanes, &mut sampler, &mut ws);
                    add(pixel, value, &mut ws);
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

fn one_sample(
    source: &Source,
    index: usize,
    lanes: usize,
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Spectrum {
    let scene = source.scene;
    let spec = scene.film();
    let [u, v] = sampler.next_2d();
    let lens = sampler.next_2d();
    let (column, row) = (index % spec.width, index / spec.width);
    let image = [
        (column as f64 + 0.5 + spec.filter.sample(u)) / spec.width as f64,
        (row as f64 + 0.5 + spec.filter.sample(v)) / spec.height as f64,
    ];
    let ray = scene.sensor().ray(image, lens);
    ws.stats.paths += 1;
    source.integrator.radiance(scene, ray, lanes, sampler, ws)
}

/// A sample that is not finite is counted and scored zero.
fn add(pixel: &mut Pixel, value: Spectrum, ws: &mut Workspace) {
    if value.is_finite() {
        pixel.add(value);
    } else {
        ws.stats.not_finite += 1;
        pixel.add(Spectrum::ZERO);
    }
}
