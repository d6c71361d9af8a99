//! Rendering: samples spread over threads, with results that depend on the seed alone.

mod accumulator;
mod allocation;
mod aov;
mod bias;
mod candidate_pilot;
mod choice;
mod derivative;
mod films;
mod followed;
mod handle;
mod measure;
mod measurement;
mod memory;
mod passes;
mod photons;
mod pilot;
mod pilot_pixels;
mod pixels;
mod prepared;
mod ranges;
mod results;
mod shared;
mod source;
mod splats;
mod splitting;
mod state;
mod strategies;
mod strategy_pilot;
mod target;
mod tolerance_pilot;

pub use accumulator::{Accumulator, MergeError};
pub use allocation::ADAPTIVE_FROM;
pub use aov::Quantities;
pub use bias::Debiased;
pub use choice::{Basis, Candidate, Choice, Extent, choose};
pub use derivative::{
    Derivative, DerivativeOptions, Derivatives, IndexDerivativeOptions, IndexDerivatives,
    MeterDerivativeOptions, ReadingFunctional, check_indices, check_parameters, derivatives,
    index_derivatives, meter_derivatives,
};
pub use films::Films;
pub use handle::{GRACE, Handle};
pub use measure::{MeasureState, Readings, measure};
pub use measurement::{MeasureError, MeasureOptions, Measurement};
pub use memory::memory;
pub use prepared::RayAccuracy;
pub use ranges::{Ranges, UnsoundRanges};
pub use results::{RESULTS, results};
pub use state::State;
pub use strategies::StrategyImage;
pub use target::{Measure, Target};

pub use crate::path::{EnergyBalance, FirstVertexTechniques, Share};

use crate::aov::AovTracer;
use crate::film::{Decomposition, Film};
use crate::integrator::Integrator;
use crate::renderer::Renderer;
use crate::sampling::Replicates;
use crate::scene::Scene;
use crate::stats::Stats;
use crate::sum::ReproducibleSum;
use prepared::Prepared;
use serde::{Deserialize, Serialize};
use source::Source;
use std::ops::{ControlFlow, Range};

/// How a render is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// What the image shows, and how that is found.
    pub renderer: Renderer,
    /// Number of the first sample of each pixel; not 0 if this render is part of a larger one.
    pub first: u64,
    /// Samples per pixel, a mean over the image if it is [adaptive](RenderOptions::adaptive). A film has room for
    /// [`ReproducibleSum::MOST`]: a render ends there.
    pub samples: u64,
    /// Seed: the same seed gives the same image, bit for bit, for any number of threads.
    pub seed: u64,
    /// How samples of a pixel are to belong together: they do where the estimator [can take them so](Integrator::replicates).
    pub replicates: Replicates,
    /// Whether rays may be less accurate than the scene's tolerance asks for, where a pilot finds that the effect on the image is
    /// small beside its noise: see [`RayAccuracy`]. Only for estimators without photon maps, not where light is told apart by length, nor
    /// where a target says how small errors are to be.
    pub loosens_tolerance: bool,
    /// Whether an image of each strategy of a bidirectional estimator is wanted.
    pub strategies: bool,
    /// Whether noisy pixels get more samples than others if the estimator is `path`: after the first [`ADAPTIVE_FROM`] of the image
    /// half as many to eight times as many as on average, by what a pilot of four samples per pixel finds.
    /// Images with [sorted](RenderOptions::reweight) samples nevertheless have equally many in each pixel.
    pub adaptive: bool,
    /// How light is told apart on the film; it must fit the scene.
    pub decomposition: Decomposition,
    /// Whether samples are sorted by brightness, so that [`Film::reweighted`] is known.
    pub reweight: bool,
    /// Whether light that comes straight from an emitter into the sensor is left out: paths without a bounce.
    pub hide_emitters: bool,
    /// Error at which the render ends, before it has all its samples.
    pub target: Option<Target>,
    /// What is to be found of the sensor rays besides what the image shows.
    pub quantities: Option<AovTracer>,
}

impl RenderOptions {
    /// Nothing but the image.
    pub fn new(renderer: impl Into<Renderer>, samples: u64, seed: u64) -> Self {
        RenderOptions {
            renderer: renderer.into(),
            first: 0,
            samples,
            seed,
            replicates: Replicates::Single,
            loosens_tolerance: false,
            strategies: false,
            adaptive: false,
            decomposition: Decomposition::default(),
            reweight: false,
            hide_emitters: false,
            target: None,
            quantities: None,
        }
    }

    /// How samples of a pixel belong together.
    fn replicates(&self) -> Replicates {
        self.renderer.replicates(self.replicates)
    }

    /// Whether a pilot may find that rays need not be as accurate as the scene asks for.
    pub fn may_loosen(&self) -> bool {
        let is_plain = matches!(
            self.renderer,
            Renderer::Light(Integrator::Path(_) | Integrator::Particle(_) | Integrator::Bdpt(_))
        );
        let is_exact = self.target.is_some() || self.decomposition.length.is_some();
        self.loosens_tolerance && is_plain && !is_exact
    }

    /// Whether samples are shared out among pixels by their noise.
    fn shares_out(&self) -> bool {
        self.adaptive
            && !self.reweight
            && matches!(self.renderer, Renderer::Light(Integrator::Path(_)))
    }

    /// Numbers of the samples of each pixel.
    pub fn range(&self) -> Range<u64> {
        let end = self
            .first
            .saturating_add(self.samples)
            .min(ReproducibleSum::MOST);
        self.first.min(end)..end
    }
}

/// How far a render has got.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// Samples per pixel done, those of earlier runs included.
    pub done: u64,
    /// Samples per pixel asked for.
    pub total: u64,
    /// The image so far.
    pub film: &'a Film,
    /// All that there is so far.
    pub state: &'a State,
}

/// What a render gives.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// How accurate rays were: the least over the channel groups.
    pub accuracy: RayAccuracy,
    /// How paths began, in any of the channel groups.
    pub first_vertex: FirstVertexTechniques,
    /// Whether the render ended because its error was small enough.
    pub reached: bool,
    /// One image for each strategy, if they were wanted.
    pub strategies: Vec<StrategyImage>,
    /// Quantities of the sensor rays, if they were wanted besides.
    pub quantities: Option<Quantities>,
    /// The image without the bias that is known of, if the estimator has any.
    pub debiased: Option<Debiased>,
    /// Where the light of all emitters went, if the estimator follows it from there.
    pub balance: Option<EnergyBalance>,
    /// Radius of the first photon map or of the first merging, the largest over the channel groups; zero for other estimators.
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
/// same number of samples if [`RenderOptions::samples`] is a multiple of theirs.
///
/// `on_pass` is called between passes; when it breaks, the render stops with what it has: the same values as a render of
/// just that many samples.
///
/// # Panics
/// As [`State::new`].
pub fn render(
    scenes: &[Scene],
    options: &RenderOptions,
    on_pass: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Rendering {
    render_watched(scenes, options, &Handle::default(), on_pass)
}

impl Scene {
    /// Renders all samples on the current thread pool. [`render`] and [`render_watched`] report progress, can be stopped, and take
    /// films of more than [`Spectrum::CHANNELS`](crate::Spectrum::CHANNELS) channels.
    ///
    /// # Panics
    /// If the decomposition does not fit: see [`State::new`].
    pub fn render(&self, options: &RenderOptions) -> Rendering {
        render(std::slice::from_ref(self), options, |_| {
            ControlFlow::Continue(())
        })
    }
}

/// As [`render`]. Other threads see by the `handle` how many samples have been taken, and can end the render within a pass,
/// the pilot included.
///
/// # Panics
/// As [`State::new`].
pub fn render_watched(
    scenes: &[Scene],
    options: &RenderOptions,
    handle: &Handle,
    on_pass: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Rendering {
    let mut state = State::new(scenes, options);
    state.advance(scenes, options, handle, on_pass);
    state.into_rendering(scenes)
}

/// Finds it out, for every group, by pilots of so much work at most, if less than usual; worthless if the handle has stopped it.
fn prepare(
    scenes: &[Scene],
    options: &RenderOptions,
    work: Option<f64>,
    handle: &Handle,
) -> Vec<Prepared> {
    let groups = scenes.iter().enumerate().map(|(group, scene)| {
        let mut prepared = Prepared::new(scene);
        let mut source = Source::new(scene, group, options, prepared.clone(), handle);
        source.pilot_work = work.map_or(source.pilot_work, |w| w.min(source.pilot_work));
        match options.renderer {
            Renderer::Quantities(_) => {}
            Renderer::Light(Integrator::Photon(mapping)) => {
                prepared.radius = photons::first_radius(&source, &mapping);
            }
            Renderer::Light(Integrator::Vcm(vcm)) => {
                // Connections are used as is best without merging, but all light subpaths are followed.
                let connecting = source.light(Integrator::Bdpt(shared::connecting(&vcm)));
                prepared = strategy_pilot::prepared(&connecting, scenes.len());
                prepared.strategies.light = 1.0;
                prepared.radius = shared::first_radius(&source, &vcm);
            }
            Renderer::Light(integrator @ Integrator::Bdpt(_)) => {
                prepared = strategy_pilot::prepared(&source.light(integrator), scenes.len());
            }
            Renderer::Light(integrator) => prepared = pilot::prepared(&source.light(integrator)),
        }
        if let (true, Some(integrator)) = (options.may_loosen(), options.renderer.integrator()) {
            source.prepared = prepared.clone();
            prepared.accuracy = tolerance_pilot::chosen(&source.light(*integrator));
        }
        prepared
    });
    groups.collect()
}

/// Seed of the random numbers of a group of channels: each has an address space of its own.
fn seed_of_group(seed: u64, group: usize) -> u64 {
    seed.wrapping_add((group as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}
