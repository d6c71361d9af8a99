//! Rendering on several threads. Results depend on the seed only.

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
use crate::film::{Cells, Decomposition, Film, FilmSpec};
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

/// Options of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Quantity that the image shows, and its estimator.
    pub renderer: Renderer,
    /// Number of the first sample of each pixel. It is not 0 if this render is part of a larger
    /// one.
    pub first: u64,
    /// Samples per pixel; the mean over the image if the render is
    /// [adaptive](RenderOptions::adaptive). The render ends at [`ReproducibleSum::MAX_NUMBERS`]
    /// samples, because a film has no room for more.
    pub samples: u64,
    /// Seed. Equal seeds give equal images, bit for bit, for any number of threads.
    pub seed: u64,
    /// Kind of replicates into which samples of a pixel are grouped, if the estimator [supports
    /// it](Integrator::replicates).
    pub replicates: Replicates,
    /// True if rays may be less accurate than the scene's tolerance. A pilot then chooses an
    /// accuracy with an effect on the image that is small compared with the noise: see
    /// [`RayAccuracy`]. Ignored for estimators with photon maps, for layers by length, and for
    /// renders with a target error.
    pub loosens_tolerance: bool,
    /// True if the render also makes an image of each strategy of a bidirectional estimator.
    pub strategies: bool,
    /// True if noisy pixels receive more samples than others, for estimator `path`. After the first
    /// [`ADAPTIVE_FROM`] samples of the image, a pixel receives half to eight times the average
    /// number. A pilot of four samples per pixel determines the numbers. Images with
    /// [sorted](RenderOptions::reweight) samples take equally many in each pixel.
    pub adaptive: bool,
    /// Separation of the film's light into layers; it must fit the scene.
    pub decomposition: Decomposition,
    /// True if samples are sorted by brightness, for [`Film::reweighted`].
    pub reweight: bool,
    /// True if light that travels straight from an emitter into the sensor is left out: paths
    /// without a bounce.
    pub hide_emitters: bool,
    /// Error at which the render ends, even if samples are left.
    pub target: Option<Target>,
    /// Quantities of sensor rays that are computed in addition to the image.
    pub quantities: Option<AovTracer>,
}

impl RenderOptions {
    /// Creates options for an image without extras.
    pub fn new(renderer: impl Into<Renderer>, samples: u64, seed: u64) -> Self {
        RenderOptions {
            renderer: renderer.into(),
            first: 0,
            samples,
            seed,
            replicates: Replicates::SINGLE,
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

    /// Returns the kind of replicates that the estimator uses.
    fn replicates(&self) -> Replicates {
        self.renderer.replicates(self.replicates)
    }

    /// Returns true if a pilot may choose rays that are less accurate than the scene's tolerance.
    pub fn may_loosen(&self) -> bool {
        let is_plain = matches!(
            self.renderer,
            Renderer::Light(Integrator::Path(_) | Integrator::Particle(_) | Integrator::Bdpt(_))
        );
        let is_exact = self.target.is_some() || self.decomposition.length.is_some();
        self.loosens_tolerance && is_plain && !is_exact
    }

    /// Returns true if noisy pixels receive more samples.
    fn is_adaptive(&self) -> bool {
        self.adaptive
            && !self.reweight
            && matches!(self.renderer, Renderer::Light(Integrator::Path(_)))
    }

    /// Returns the cells in which samples of a film are taken. Pixels with different numbers of
    /// samples are independent.
    fn cells(&self, film: &FilmSpec) -> Cells {
        if self.is_adaptive() {
            Cells::apart(film)
        } else {
            Cells::of(film)
        }
    }

    /// Returns the numbers of the samples of each pixel.
    pub fn range(&self) -> Range<u64> {
        let end = self
            .first
            .saturating_add(self.samples)
            .min(ReproducibleSum::MAX_NUMBERS);
        self.first.min(end)..end
    }
}

/// Progress of a render.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// Samples per pixel taken so far, including earlier runs.
    pub done: u64,
    /// Samples per pixel requested.
    pub total: u64,
    /// Image so far.
    pub film: &'a Film,
    /// Complete state so far.
    pub state: &'a State,
}

/// Result of a render.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Rendering {
    /// Image.
    pub film: Film,
    /// Counts of events and failures.
    pub stats: Stats,
    /// Samples per pixel taken; fewer than requested if the render was stopped.
    pub samples: u64,
    /// Probability with which connections that may not be unique were searched for further
    /// branches: the maximum over the channel groups.
    pub search: f64,
    /// Accuracy of rays: the lowest over the channel groups.
    pub accuracy: RayAccuracy,
    /// First-vertex techniques that any of the channel groups used.
    pub first_vertex: FirstVertexTechniques,
    /// True if the render ended because it reached its target error.
    pub reached: bool,
    /// Images of the strategies, if requested.
    pub strategies: Vec<StrategyImage>,
    /// Quantities of the sensor rays, if requested in addition to the image.
    pub quantities: Option<Quantities>,
    /// Image without its known bias, if the estimator is biased.
    pub debiased: Option<Debiased>,
    /// Energy balance of the light of all emitters, if the estimator follows light from emitters.
    pub balance: Option<EnergyBalance>,
    /// Radius of the first photon map or of the first merging, the maximum over the channel groups;
    /// zero for other estimators.
    pub first_radius: f64,
}

impl Rendering {
    /// Returns the measured error, relative to the image's mean; infinite as long as it is unknown.
    pub fn error(&self, measure: Measure) -> f64 {
        measure.error(&self.film, self.debiased.as_ref())
    }
}

/// Renders on the current thread pool. `scenes` holds one scene for each group of channels, in the
/// order of the film's groups. The scenes are alike except for their spectra and indices. For
/// scenes over a period of sound, all instants get the same number of samples if
/// [`RenderOptions::samples`] is a multiple of their number.
///
/// `on_pass` is called between passes. When it breaks, the render stops with the samples taken so
/// far. The result equals a render of that number of samples.
///
/// # Panics
/// Panics like [`State::new`].
pub fn render(
    scenes: &[Scene],
    options: &RenderOptions,
    on_pass: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Rendering {
    render_watched(scenes, options, &Handle::default(), on_pass)
}

impl Scene {
    /// Renders all samples on the current thread pool. [`render`] and [`render_watched`] report
    /// progress, can be stopped, and support films of more than
    /// [`Spectrum::CHANNELS`](crate::Spectrum::CHANNELS) channels.
    ///
    /// # Panics
    /// If the decomposition does not fit the scene: see [`State::new`].
    pub fn render(&self, options: &RenderOptions) -> Rendering {
        render(std::slice::from_ref(self), options, |_| {
            ControlFlow::Continue(())
        })
    }
}

/// Renders like [`render`]. Through the `handle`, other threads can read the number of samples
/// taken, and can end the render within a pass or within the pilot.
///
/// # Panics
/// Panics like [`State::new`].
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

/// Runs the pilots of every group. `work` limits the work of each pilot, if it is below the
/// default. The results have no meaning if the handle has stopped the pilots.
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
                // Choose the strategies' probabilities as without merging, except that all light
                // subpaths are followed.
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

/// Derives the seed of a group of channels. Groups have different random numbers.
fn seed_of_group(seed: u64, group: usize) -> u64 {
    seed.wrapping_add((group as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}
