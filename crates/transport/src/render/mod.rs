//! Rendering: samples spread over threads, with results that depend on the seed alone.

mod aov;
mod bias;
mod measure;
mod memory;
mod photons;
mod pilot;
mod pixels;
mod source;
mod splats;
mod strategies;
mod target;

pub use bias::Debiased;
pub use measure::{MeasureError, MeasureOptions, Measurement, measure};
pub use memory::memory;
pub use strategies::StrategyImage;
pub use target::{Measure, Target};

use crate::film::{Decomposition, Film};
use crate::integrator::Integrator;
use crate::path::{Account, Balance};
use crate::scene::Scene;
use crate::stats::Stats;
use source::Source;
use std::ops::ControlFlow;
use std::sync::atomic::AtomicU64;
use std::time::{Duration, Instant};
use strategies::Strategies;
use target::Watch;

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
    /// Whether an image of each strategy of a bidirectional estimator is wanted.
    pub strategies: bool,
    /// How light is told apart on the film.
    pub decomposition: Decomposition,
    /// Whether samples are sorted by brightness, so that [`Film::reweighted`] is known.
    pub reweight: bool,
    /// Error at which the render ends, before it has all its samples.
    pub target: Option<Target>,
}

impl Options {
    /// Nothing but the image.
    pub fn new(integrator: Integrator, samples: u64, seed: u64) -> Self {
        Options {
            integrator,
            samples,
            seed,
            strategies: false,
            decomposition: Decomposition::default(),
            reweight: false,
            target: None,
        }
    }
}

/// How far a render has got.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress<'a> {
    /// Samples per pixel done.
    pub done: u64,
    /// Samples per pixel asked for.
    pub total: u64,
    /// The image so far.
    pub film: &'a Film,
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
    /// Probability with which connections that may not be unique were searched for further branches:
    /// the largest over the channel groups.
    pub search: f64,
    /// Whether the render ended because its error was small enough.
    pub reached: bool,
    /// One image for each strategy, if they were wanted.
    pub strategies: Vec<StrategyImage>,
    /// The image without the bias that is known of, if the estimator has any.
    pub debiased: Option<Debiased>,
    /// Where the light of all emitters went, if the estimator follows it from there.
    pub balance: Option<Balance>,
    /// Radius of the first photon map, the largest over the channel groups; zero for other estimators.
    pub first_radius: f64,
}

impl Rendering {
    /// The measured error, relative to the image's mean; infinite as long as it is not known.
    pub fn error(&self, measure: Measure) -> f64 {
        measure.error(&self.film, self.debiased.as_ref())
    }
}

/// Renders on the current thread pool: one scene for each group of channels, alike but for their spectra and
/// indices. A film's groups are in the same order. Of scenes over a period of sound, all instants get the
/// same number of samples if [`Options::samples`] is a multiple of theirs.
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
    let channels = options.integrator.channels(spec.channels);
    let lanes = options.integrator.lanes(spec.lanes);
    let mut film = Film::in_groups(spec.width, spec.height, channels, lanes)
        .decomposed(options.decomposition)
        .sorted(options.reweight);
    let mut stats = Stats::default();
    let mut strategies = options.strategies.then(|| Strategies::new(spec));
    let sources: Vec<Source> = scenes
        .iter()
        .enumerate()
        .map(|(group, scene)| Source::new(scene, options, group))
        .collect();
    let mut debiased = photons::debiased(spec, &options.integrator);
    let mut accounts = vec![Account::default(); sources.len()];
    let mut watch = options.target.map(Watch::new);
    let (mut done, mut next, mut reached) = (0, 1, false);
    while done < options.samples {
        let started = Instant::now();
        let look = watch.as_ref().map_or(u64::MAX, Watch::next);
        next = scenes[0].whole_periods(next.min(look.saturating_sub(done)));
        next = next.min(options.samples - done);
        for (source, account) in sources.iter().zip(&mut accounts) {
            let range = done..done + next;
            stats += match (&options.integrator, &mut debiased) {
                (Integrator::Aov(tracer), _) => {
                    aov::pass(source, tracer, range, &mut film, counter)
                }
                (_, Some(debiased)) => {
                    photons::pass(source, range, (&mut film, debiased, account), counter)
                }
                (integrator, None) if integrator.splats() => {
                    let into = (&mut film, strategies.as_mut(), account);
                    splats::pass(source, range, into, counter)
                }
                _ => pixels::pass(source, range, &mut film, counter),
            };
        }
        done += next;
        let progress = Progress {
            done,
            total: options.samples,
            film: &film,
        };
        if on_pass(&progress).is_break() {
            break;
        }
        let watch = watch.as_mut();
        reached = watch.is_some_and(|w| w.is_over(done, (&film, debiased.as_ref())));
        if reached {
            break;
        }
        next = longer_or_shorter(next, started.elapsed());
    }
    Rendering {
        film,
        stats,
        samples: done,
        search: sources.iter().map(|s| s.search).fold(0.0, f64::max),
        reached,
        strategies: strategies.map_or(Vec::new(), Strategies::into_images),
        debiased,
        balance: balance(&sources, &accounts),
        first_radius: sources.iter().map(|s| s.radius).fold(0.0, f64::max),
    }
}

/// The account over all channels, if there is one.
fn balance(sources: &[Source], accounts: &[Account]) -> Option<Balance> {
    let of = |(source, account): (&Source, &Account)| {
        let emitted = source.scene.powers(source.lanes()).map(|p| p.sum()).sum();
        account.balance(emitted)
    };
    let kept = sources.iter().zip(accounts);
    let kept = kept.filter(|(_, account)| account.particles() > 0);
    kept.map(of).reduce(|mut sum, balance| {
        sum += balance;
        sum
    })
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
