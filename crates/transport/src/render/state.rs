//! States of renders: sums over their samples so far.

use super::accumulator::{Accumulator, Sampling};
use super::films::Films;
use super::memory;
use super::prepared::Prepared;
use super::source::{LightSamples, Source};
use super::splats::{FoundImages, ImageFilms};
use super::target::Watch;
use super::{Handle, Progress, RenderOptions, Rendering, aov, photons, pixels, prepare, splats};
use crate::film::{Film, Scores};
use crate::integrator::Integrator;
use crate::path::{BalanceTotals, EnergyBalance, Share};
use crate::renderer::Renderer;
use crate::scene::{NO_SCENE, Scene};
use crate::stats::Stats;
use std::ops::{ControlFlow, Range};

/// Sums over the samples of a render so far. They can be kept, continued, and merged with others.
///
/// ```no_run
/// # fn example(scenes: &[morgana_transport::Scene], options: morgana_transport::render::RenderOptions) {
/// use std::ops::ControlFlow;
/// use morgana_transport::render::{Handle, RenderOptions, State};
/// let handle = Handle::default();
/// let part = |first| {
///     let options = RenderOptions { first, samples: 8, ..options };
///     let mut state = State::new(scenes, &options);
///     state.advance(scenes, &options, &handle, |_| ControlFlow::Continue(()));
///     state
/// };
/// let mut whole = part(8);
/// whole.merge(&part(0)).unwrap();
/// let rendering = whole.into_rendering(scenes);
/// # }
/// ```
pub type State = Accumulator<Films>;

impl State {
    /// Creates a state without samples.
    ///
    /// # Panics
    /// If there are no scenes. If [`RenderOptions::decomposition`] has bins that are not
    /// [valid](crate::Bins::is_valid), more than
    /// [`MAX_BOUNCES`](crate::film::Decomposition::MAX_BOUNCES) bounces, or a number of emitters
    /// that differs from the scenes'.
    pub fn new(scenes: &[Scene], options: &RenderOptions) -> Self {
        let first = scenes.first().expect(NO_SCENE);
        Accumulator::empty(scenes.len(), Films::new(first, options))
    }

    /// Returns the image so far.
    pub fn film(&self) -> &Film {
        &self.sums.film
    }

    /// Returns true if this can be the state of a render of these scenes with these options, with
    /// any samples.
    ///
    /// # Panics
    /// Panics like [`State::new`].
    pub fn fits(&self, scenes: &[Scene], options: &RenderOptions) -> bool {
        let first = scenes.first().expect(NO_SCENE);
        self.has_groups(scenes.len()) && self.sums.fits(first, options)
    }

    /// Returns true if the render has a target, and its error is small enough.
    pub fn reached(&self) -> bool {
        self.sums.watch.as_ref().is_some_and(Watch::is_over)
    }

    /// Takes the missing samples of the options' range on the current thread pool. Runs the
    /// estimator's pilots before the first sample. See [`render`](super::render()) for `scenes` and
    /// `on_pass`, [`render_watched`](super::render_watched) for `handle`.
    ///
    /// # Panics
    /// If the state does not [fit](State::fits).
    pub fn advance(
        &mut self,
        scenes: &[Scene],
        options: &RenderOptions,
        handle: &Handle,
        mut on_pass: impl FnMut(&Progress) -> ControlFlow<()>,
    ) {
        assert!(
            self.fits(scenes, options),
            "the state is not one of a render of these scenes with these options"
        );
        let pilot = || prepare(scenes, options, None, handle);
        if self.run_pilot(handle, pilot).is_break() {
            return;
        }
        let groups = scenes.iter().zip(&self.learnt).enumerate();
        let sources = groups.map(|(group, (scene, prepared))| {
            Source::new(scene, group, options, prepared.clone(), handle)
        });
        let replicates = options.replicates();
        let render = RenderPasses {
            options,
            sources: sources.collect(),
            most: memory::samples_of_pass(&scenes[0], options),
        };
        // The part that contains a replicate's first sample takes the whole replicate. Parts then
        // also consist of whole replicates.
        let range = options.range();
        let range = replicates.whole(range.start)..replicates.whole(range.end);
        let total = range.end - range.start;
        self.take(range, &render, handle, |state| {
            on_pass(&Progress {
                done: state.done.count(),
                total,
                film: &state.sums.film,
                state,
            })
        });
    }

    /// Returns the result; `scenes` are the scenes that were rendered.
    ///
    /// # Panics
    /// If there are no scenes.
    pub fn into_rendering(self, scenes: &[Scene]) -> Rendering {
        let samples = self.done.count();
        let reached = self.reached();
        let largest = |f: fn(&Prepared) -> f64| self.learnt.iter().map(f).fold(0.0, f64::max);
        Rendering {
            search: largest(|p| p.search),
            accuracy: Prepared::least_accuracy(&self.learnt, scenes.first().expect(NO_SCENE)),
            first_vertex: Prepared::first_vertex_of_any(&self.learnt),
            first_radius: largest(|p| p.radius),
            balance: balance(scenes, &self.balances),
            reached,
            samples,
            stats: self.stats,
            quantities: self.sums.quantities,
            strategies: self
                .sums
                .strategies
                .map_or(Vec::new(), |s| s.into_images(samples)),
            debiased: self.sums.debiased,
            film: self.sums.film,
        }
    }
}

/// Result of a pass in one group of channels.
enum Found {
    Rays(aov::Found),
    Pixels(Vec<Scores>),
    Images(Box<FoundImages>),
}

/// Results of a pass in all groups of channels.
struct FoundByGroup {
    groups: Vec<(Found, Stats)>,
    quantities: Option<(aov::Found, Stats)>,
}

/// Passes of a render over its pixels.
struct RenderPasses<'a> {
    options: &'a RenderOptions,
    sources: Vec<Source<'a>>,
    /// Maximum number of samples of a pass, limited by memory.
    most: u64,
}

impl Sampling for RenderPasses<'_> {
    type Sums = Films;
    type Found = FoundByGroup;

    /// Computes the sampling share of each pixel before the first sample that needs it.
    fn prepare_pass(
        &self,
        state: &mut State,
        at: u64,
        mut on_pass: impl FnMut(&State) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if state.reached() {
            return ControlFlow::Break(());
        }
        if state.sums.allocation.ready(at) == 0 {
            let mut allocation = state.sums.allocation.clone();
            let lights = self.options.renderer.integrator().into_iter();
            let lights = lights.flat_map(|i| self.sources.iter().map(|s| s.light(*i)));
            let lights: Vec<LightSamples> = lights.collect();
            allocation.measure(&lights, || on_pass(state))?;
            state.sums.allocation = allocation;
        }
        ControlFlow::Continue(())
    }

    fn pass_size(&self, state: &State, at: u64, next: u64) -> u64 {
        let look = state.sums.watch.as_ref().map_or(u64::MAX, Watch::next);
        let soon = look.saturating_sub(state.done.count()).max(1);
        let size = next.min(soon).min(self.most);
        let first = &self.sources[0];
        let size = first.scene.whole_periods(size, first.replicates);
        size.min(state.sums.allocation.ready(at))
    }

    fn pass(&self, sums: &Films, samples: Range<u64>) -> FoundByGroup {
        // Take the rays of the first group. All groups have equal sensor rays, unless the index
        // depends on the wavelength.
        let quantities = sums
            .quantities
            .as_ref()
            .zip(self.options.quantities.as_ref());
        let quantities = quantities.map(|(quantities, tracer)| {
            let samples = samples.clone();
            aov::pass(&self.sources[0], tracer, samples, &quantities.film, |_| ())
        });
        let groups = self.sources.iter();
        let groups = groups.map(|source| self.pass_of_group(sums, source, samples.clone()));
        FoundByGroup {
            groups: groups.collect(),
            quantities,
        }
    }

    fn add(&self, state: &mut State, found: FoundByGroup) {
        let sums = &mut state.sums;
        if let (Some(kept), Some(quantities)) = (&mut sums.quantities, found.quantities) {
            kept.add(quantities);
        }
        for (group, (found, stats)) in found.groups.into_iter().enumerate() {
            state.stats += stats;
            match found {
                Found::Rays(rays) => aov::add(&mut sums.film, rays),
                Found::Pixels(scores) => {
                    sums.film.add_scores(group, pixels::PIXELS_PER_TASK, scores);
                }
                Found::Images(found) => {
                    let (images, balances) = *found;
                    let mut films = ImageFilms {
                        film: &mut sums.film,
                        debiased: sums.debiased.as_mut(),
                        strategies: sums.strategies.as_mut(),
                    };
                    for image in images {
                        image.add(&self.sources[group], &mut films);
                    }
                    state.balances[group] += balances;
                }
            }
        }
        if let Some(watch) = &mut sums.watch {
            watch.look(state.done.count(), &sums.film, sums.debiased.as_ref());
        }
    }
}

impl RenderPasses<'_> {
    fn pass_of_group(&self, sums: &Films, source: &Source, samples: Range<u64>) -> (Found, Stats) {
        let film = &sums.film;
        match &self.options.renderer {
            Renderer::Quantities(tracer) => {
                let count = |taken| source.handle.count(taken);
                let (rays, stats) = aov::pass(source, tracer, samples, film, count);
                (Found::Rays(rays), stats)
            }
            Renderer::Light(Integrator::Photon(mapping)) => {
                let (images, stats) = photons::pass(source, mapping, samples, film);
                (Found::Images(Box::new(images)), stats)
            }
            Renderer::Light(integrator) if integrator.splats() || source.cells.overlap() => {
                let light = source.light(*integrator);
                let separates_strategies = sums.strategies.is_some();
                let (images, stats) = splats::pass(&light, samples, film, separates_strategies);
                (Found::Images(Box::new(images)), stats)
            }
            Renderer::Light(integrator) => {
                let light = source.light(*integrator);
                let (scores, stats) = pixels::pass(&light, samples, &sums.allocation, film);
                (Found::Pixels(scores), stats)
            }
        }
    }
}

/// Sums the energy balance over all channels, if there is one.
fn balance(scenes: &[Scene], balances: &[BalanceTotals]) -> Option<EnergyBalance> {
    let kept = scenes.iter().zip(balances).enumerate();
    let kept = kept.filter(|(_, (_, balances))| balances.particles() > 0);
    let of = |(group, (scene, balances)): (usize, (&Scene, &BalanceTotals))| {
        let channels = scene.film().channels_of(group);
        balances.balance(Share {
            mean: scene.powers(channels).map(|p| p.sum()).sum(),
            error: scene.power_error(channels).sum(),
        })
    };
    kept.map(of).reduce(|mut sum, balance| {
        sum += balance;
        sum
    })
}
