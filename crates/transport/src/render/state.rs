//! What a render has gathered so far, as data: to go on with it later, or to add it to what others have gathered.
//!
//! Sums do not depend on the order in which samples are taken ([`Sum`](crate::sum::Sum)), and samples only on their number
//! and the seed. So a render that goes on from a state, or one that is put together from parts, is the same
//! as one in one piece, bit for bit.

use super::allocation::Allocation;
use super::memory;
use super::passes::Passes;
use super::ranges::Ranges;
use super::source::{LightSamples, Source};
use super::splats::{FoundImages, ImageFilms};
use super::strategies::Strategies;
use super::target::{Target, Watch};
use super::{
    Debiased, Handle, Prepared, Progress, Quantities, RayAccuracy, RenderOptions, Rendering, aov,
    photons, pixels, prepare, splats,
};
use crate::Spectrum;
use crate::aov::AovTracer;
use crate::film::{Decomposition, Film, FilmShape, Scores};
use crate::integrator::Integrator;
use crate::path::{BalanceTotals, EnergyBalance, FirstVertexTechniques, Share};
use crate::renderer::Renderer;
use crate::scene::{NO_SCENE, Scene};
use crate::stats::Stats;
use serde::{Deserialize, Serialize};
use std::ops::{ControlFlow, Range};

/// Shapes of the films of a render.
struct Shapes {
    film: FilmShape,
    quantities: Option<FilmShape>,
    debiased: Option<FilmShape>,
}

impl Shapes {
    fn of(scene: &Scene, options: &RenderOptions) -> Self {
        options.decomposition.assert_fits(scene.emitters().len());
        let (spec, renderer) = (scene.film(), &options.renderer);
        let size = [spec.width, spec.height];
        let replicates = options.replicates();
        let quantities = |tracer: &AovTracer| FilmShape {
            replicates,
            ..FilmShape::plain(size, tracer.channels().count(), Spectrum::CHANNELS)
        };
        let blurs = renderer.integrator().is_some_and(Integrator::blurs);
        let (channels, group_size) = (
            renderer.channels(spec.channels),
            renderer.group_size(spec.group_size),
        );
        Shapes {
            film: FilmShape {
                replicates,
                decomposition: options.decomposition,
                sorts: options.reweight,
                ..FilmShape::plain(size, channels, group_size)
            },
            quantities: options.quantities.as_ref().map(quantities),
            debiased: blurs.then(|| FilmShape::of_light(spec)),
        }
    }
}

/// Result of a pass in one group of channels.
enum Found {
    Rays(aov::Found),
    Pixels(Vec<Scores>),
    Images(FoundImages),
}

/// What a render has gathered so far.
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
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    done: Ranges,
    film: Film,
    stats: Stats,
    quantities: Option<Quantities>,
    strategies: Option<Strategies>,
    debiased: Option<Debiased>,
    watch: Option<Watch>,
    /// For each group of channels.
    balances: Vec<BalanceTotals>,
    prepared: Vec<Prepared>,
    allocation: Allocation,
}

/// Why two states cannot be added up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// Samples would count twice.
    #[error("both have samples {} to {}", .0.start, .0.end - 1)]
    Overlap(Range<u64>),
    /// They keep other quantities, or of other pixels.
    #[error("they are of different renders")]
    Different,
}

impl State {
    /// Nothing yet.
    ///
    /// # Panics
    /// Without scenes, or if [`RenderOptions::decomposition`] has bins that are not [valid](crate::Bins::is_valid), more than
    /// [`MOST_BOUNCES`](crate::film::Decomposition::MOST_BOUNCES) bounces, or another number of emitters than the scenes.
    pub fn new(scenes: &[Scene], options: &RenderOptions) -> Self {
        let first = scenes.first().expect(NO_SCENE);
        let shapes = Shapes::of(first, options);
        State {
            done: Ranges::default(),
            film: Film::of(shapes.film),
            stats: Stats::default(),
            quantities: shapes.quantities.map(Quantities::new),
            strategies: options.strategies.then(Strategies::default),
            debiased: shapes.debiased.map(Debiased::new),
            watch: options.target.map(Watch::new),
            balances: vec![BalanceTotals::default(); scenes.len()],
            prepared: Vec::new(),
            allocation: Allocation::new(first, options),
        }
    }

    /// The image so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The samples that have been taken.
    pub fn done(&self) -> &Ranges {
        &self.done
    }

    /// Whether this is a state of a render of these scenes with these options, whichever samples it has.
    ///
    /// # Panics
    /// As [`State::new`].
    pub fn fits(&self, scenes: &[Scene], options: &RenderOptions) -> bool {
        let first = scenes.first().expect(NO_SCENE);
        let shapes = Shapes::of(first, options);
        let prepared = match self.done.count() {
            0 => [0, scenes.len()].contains(&self.prepared.len()),
            _ => self.prepared.len() == scenes.len(),
        };
        // An error that is no number is the same, too.
        let bits = |target: Target| (target.error.to_bits(), target.measure);
        let watched = self.watch.as_ref().map(Watch::target).map(bits);
        let watched = watched == options.target.map(bits);
        let pixels = self.film.width() * self.film.height();
        let allotted = self
            .allocation
            .fits(&Allocation::new(first, options), pixels);
        let counts = (self.balances.len(), self.strategies.is_some());
        let counted = counts == (scenes.len(), options.strategies);
        prepared && watched && allotted && counted && self.has(&shapes)
    }

    /// Returns whether its films have these shapes.
    fn has(&self, shapes: &Shapes) -> bool {
        let fits = |film: Option<&Film>, shape: Option<FilmShape>| match (film, shape) {
            (Some(film), Some(shape)) => film.fits(&shape),
            (film, shape) => film.is_none() && shape.is_none(),
        };
        let plain = FilmShape {
            decomposition: Decomposition::default(),
            sorts: false,
            ..shapes.film
        };
        let mut strategies = self.strategies.iter().flat_map(Strategies::films);
        self.film.fits(&shapes.film)
            && fits(self.debiased.as_ref().map(|d| &d.film), shapes.debiased)
            && fits(self.quantities.as_ref().map(|q| &q.film), shapes.quantities)
            && strategies.all(|film| film.fits(&plain))
    }

    fn is_like(&self, other: &State) -> bool {
        let shapes = Shapes {
            film: self.film.shape(),
            debiased: self.debiased.as_ref().map(|d| d.film.shape()),
            quantities: self.quantities.as_ref().map(|q| q.film.shape()),
        };
        self.has(&shapes)
            && other.has(&shapes)
            && self.balances.len() == other.balances.len()
            && self.strategies.is_some() == other.strategies.is_some()
    }

    /// Adds what another state of the same render has gathered: the same scenes, seed and options, but for the
    /// range of samples.
    ///
    /// # Errors
    /// Samples that both have, or states of obviously different renders; nothing is added then.
    pub fn merge(&mut self, other: &State) -> Result<(), MergeError> {
        let new = [&self.prepared, &other.prepared]
            .iter()
            .any(|p| p.is_empty());
        let prepared = new || self.prepared == other.prepared;
        let agree = prepared && self.allocation.agrees(&other.allocation);
        if !(agree && self.is_like(other)) {
            return Err(MergeError::Different);
        }
        if let Some(range) = self.done.overlap(&other.done) {
            return Err(MergeError::Overlap(range));
        }
        other.done.iter().for_each(|range| self.done.insert(range));
        if self.prepared.is_empty() {
            self.prepared.clone_from(&other.prepared);
        }
        self.film.merge(&other.film);
        self.allocation.learn(&other.allocation);
        self.stats += other.stats;
        if let (Some(quantities), Some(other)) = (&mut self.quantities, &other.quantities) {
            quantities.merge(other);
        }
        if let (Some(strategies), Some(other)) = (&mut self.strategies, &other.strategies) {
            strategies.merge(other);
        }
        if let (Some(debiased), Some(other)) = (&mut self.debiased, &other.debiased) {
            debiased.film.merge(&other.film);
        }
        for (balances, other) in self.balances.iter_mut().zip(&other.balances) {
            *balances += *other;
        }
        Ok(())
    }

    /// Takes the samples of the options' range that are missing, on the current thread pool; before the first, it finds out
    /// what the estimator has to know. See [`render`](super::render()) for `scenes` and `on_pass`,
    /// [`render_watched`](super::render_watched) for `handle`.
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
        if self.prepared.is_empty() {
            let prepared = prepare(scenes, options, None, handle);
            if handle.stop().is_raised() {
                return;
            }
            self.prepared = prepared;
        }
        let sources = self.sources(scenes, options, handle);
        let most = memory::samples_of_pass(&scenes[0], options);
        // Whoever has a replicate's first sample takes all of it, so that parts have whole replicates, too.
        let replicates = options.replicates();
        let range = options.range();
        let range = replicates.whole(range.start)..replicates.whole(range.end);
        let total = range.end - range.start;
        let mut passes = Passes::over(self.done.gaps(range), 1);
        while let Some(at) = passes.at() {
            if self.reached() {
                return;
            }
            if self.allocation.ready(at) == 0 {
                let mut allocation = self.allocation.clone();
                let lights = options.renderer.integrator();
                let lights = lights
                    .into_iter()
                    .flat_map(|i| sources.iter().map(|s| s.light(*i)));
                let between = || on_pass(&self.progress(total));
                let lights: Vec<LightSamples> = lights.collect();
                if allocation.measure(&lights, between).is_break() {
                    return;
                }
                self.allocation = allocation;
            }
            let look = self.watch.as_ref().map_or(u64::MAX, Watch::next);
            let soon = look.saturating_sub(self.done.count()).max(1);
            let ready = self.allocation.ready(at);
            let whole = |samples| scenes[0].whole_periods(samples, replicates);
            let pass = passes.begin(|next| whole(next.min(soon).min(most)).min(ready));
            let taken = self.pass(options, &sources, pass, handle);
            if taken.is_break() || on_pass(&self.progress(total)).is_break() {
                return;
            }
            passes.end();
        }
    }

    /// How far it has got on the way to so many samples.
    fn progress(&self, total: u64) -> Progress<'_> {
        Progress {
            done: self.done.count(),
            total,
            film: &self.film,
            state: self,
        }
    }

    fn sources<'a>(
        &self,
        scenes: &'a [Scene],
        options: &RenderOptions,
        handle: &'a Handle,
    ) -> Vec<Source<'a>> {
        let groups = scenes.iter().zip(&self.prepared).enumerate();
        let source = |(group, (scene, prepared)): (usize, (&'a Scene, &Prepared))| {
            Source::new(scene, group, options, prepared.clone(), handle)
        };
        groups.map(source).collect()
    }

    /// Takes a range of samples in all groups of channels. If the handle ends the pass, the state stays as it was.
    fn pass(
        &mut self,
        options: &RenderOptions,
        sources: &[Source],
        samples: Range<u64>,
        handle: &Handle,
    ) -> ControlFlow<()> {
        // All groups have the same sensor rays, unless the index depends on the wavelength: then these are the first one's.
        let quantities = self.quantities.as_ref().zip(options.quantities.as_ref());
        let quantities = quantities.map(|(quantities, tracer)| {
            let samples = samples.clone();
            aov::pass(&sources[0], tracer, samples, &quantities.film, |_| ())
        });
        let found = sources.iter();
        let found = found.map(|source| self.found(options, source, samples.clone()));
        let found: Vec<(Found, Stats)> = found.collect();
        if handle.stop().is_raised() {
            return ControlFlow::Break(());
        }
        if let (Some(kept), Some(quantities)) = (&mut self.quantities, quantities) {
            kept.add(quantities);
        }
        for (group, (found, stats)) in found.into_iter().enumerate() {
            self.stats += stats;
            match found {
                Found::Rays(rays) => aov::add(&mut self.film, rays),
                Found::Pixels(scores) => {
                    self.film.add_scores(group, pixels::PIXELS_PER_TASK, scores);
                }
                Found::Images((images, balances)) => {
                    let mut films = ImageFilms {
                        film: &mut self.film,
                        debiased: self.debiased.as_mut(),
                        strategies: self.strategies.as_mut(),
                    };
                    for image in images {
                        image.add(&sources[group], &mut films);
                    }
                    self.balances[group] += balances;
                }
            }
        }
        self.done.insert(samples);
        if let Some(watch) = &mut self.watch {
            watch.look(self.done.count(), &self.film, self.debiased.as_ref());
        }
        ControlFlow::Continue(())
    }

    /// Takes a range of samples in one group of channels.
    fn found(
        &self,
        options: &RenderOptions,
        source: &Source,
        samples: Range<u64>,
    ) -> (Found, Stats) {
        let film = &self.film;
        match &options.renderer {
            Renderer::Quantities(tracer) => {
                let count = |taken| source.handle.count(taken);
                let (rays, stats) = aov::pass(source, tracer, samples, film, count);
                (Found::Rays(rays), stats)
            }
            Renderer::Light(Integrator::Photon(mapping)) => {
                let (images, stats) = photons::pass(source, mapping, samples, film);
                (Found::Images(images), stats)
            }
            Renderer::Light(integrator) if integrator.splats() => {
                let light = source.light(*integrator);
                let told_apart = self.strategies.is_some();
                let (images, stats) = splats::pass(&light, samples, film, told_apart);
                (Found::Images(images), stats)
            }
            Renderer::Light(integrator) => {
                let light = source.light(*integrator);
                let (scores, stats) = pixels::pass(&light, samples, &self.allocation, film);
                (Found::Pixels(scores), stats)
            }
        }
    }

    /// Whether the error is small enough, if that is what the render is to end at.
    pub fn reached(&self) -> bool {
        self.watch.as_ref().is_some_and(Watch::is_over)
    }

    /// How accurate rays are at least.
    fn accuracy(&self, scenes: &[Scene]) -> RayAccuracy {
        let least = |a: RayAccuracy, b: RayAccuracy| RayAccuracy {
            tolerance: a.tolerance.max(b.tolerance),
            effect: a.effect.max(b.effect),
        };
        let all = self.prepared.iter().map(|p| p.accuracy);
        all.fold(RayAccuracy::of(scenes.first().expect(NO_SCENE)), least)
    }

    /// How paths begin in any of the groups.
    fn first_vertex(&self) -> FirstVertexTechniques {
        let all = || self.prepared.iter().map(|p| p.first_vertex);
        FirstVertexTechniques {
            forced_collisions: all().map(|b| b.forced_collisions).max().unwrap_or(0),
            splitting: all().any(|b| b.splitting),
        }
    }

    /// The result; `scenes` are those that were rendered.
    ///
    /// # Panics
    /// Without scenes.
    pub fn into_rendering(self, scenes: &[Scene]) -> Rendering {
        let samples = self.done.count();
        let largest = |f: fn(&Prepared) -> f64| self.prepared.iter().map(f).fold(0.0, f64::max);
        Rendering {
            search: largest(|p| p.search),
            accuracy: self.accuracy(scenes),
            first_vertex: self.first_vertex(),
            first_radius: largest(|p| p.radius),
            balance: balance(scenes, &self.balances),
            reached: self.reached(),
            samples,
            stats: self.stats,
            quantities: self.quantities,
            strategies: self
                .strategies
                .map_or(Vec::new(), |s| s.into_images(samples)),
            debiased: self.debiased,
            film: self.film,
        }
    }
}

/// The energy balance over all channels, if there is one.
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
