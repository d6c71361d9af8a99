//! A run: the computation for a scene, and the conditions that it must fulfil.

use crate::clock::Clock;
use crate::input;
use crate::part::{BATCH, Header, INTEGRATOR, REASON};
use crate::rendered::Naming;
use crate::{Limits, Loaded, Outcome};
use std::sync::Arc;
use std::time::Duration;
use transport::device::Device;
use transport::integrator::Integrator;
use transport::meter::Meter;
use transport::render::{
    Basis, Candidate, Choice, Extent, Handle, MeasureError, MeasureOptions, MeasureState,
    Measurement, RenderOptions, Rendering, Target, choose, memory, render, results,
};
use transport::renderer::Renderer;
use transport::sampling::Replicates;
use transport::scene::Scene;

/// A computation for a scene: a picture, or the readings of its meters; complete or a part.
#[derive(Clone, Debug)]
pub struct Run<'a> {
    /// Scene.
    pub loaded: &'a Loaded,
    /// Renderer of a picture: the scene's own, or another.
    pub renderer: Renderer,
    /// Estimators among which a pilot [chooses](Run::choose); empty if the renderer is fixed. The
    /// renderer is one of them.
    pub candidates: Vec<Integrator>,
    /// Reason why the renderer was chosen, if a choice was made.
    pub reason: Option<String>,
    /// Grouping of a pixel's samples into replicates, if the renderer supports it; `None` if it
    /// follows from the sampler and the total.
    pub replicates: Option<Replicates>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Samples per pixel, or particles, of the whole; `None` if something else ends the run.
    pub total: Option<u64>,
    /// Index of this part, counted from 0, and the number of parts. The index must be below the
    /// number.
    pub shard: Option<[u64; 2]>,
    /// Time limit, checked between passes of about half a second.
    pub time: Option<Duration>,
    /// Error at which a picture is complete.
    pub target: Option<Target>,
    /// True if the run also makes images of a picture's strategies.
    pub strategies: bool,
    /// Device that walks particles; `None` for the CPU.
    pub device: Option<Arc<dyn Device>>,
    /// Number of particles of a batch, if a device walks them.
    pub batch: Option<u64>,
}

/// Reason why a run cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The bias of the integrator does not shrink, so the target may be unreachable.
    #[error(
        "the target error may never be reached by the integrator photon, whose bias does not shrink: use sppm, or give spp \
         or time"
    )]
    Unreachable,
    /// The integrator does not separate strategies.
    #[error("images of strategies (--strategies) need the integrator bdpt or particle, not {0}")]
    OneStrategy(&'static str),
    /// Nothing ends the run.
    #[error("nothing ends the run: give a number of samples or particles, or a time")]
    NoEnd,
    /// The whole has no part with this index.
    #[error("there is no part {index} of {count}: parts are counted from 0")]
    Shard {
        /// Index of the part.
        index: u64,
        /// Number of parts.
        count: u64,
    },
    /// The device cannot run the scene.
    #[error("{0}")]
    Device(String),
    /// The film does not fit into memory. Without this check, the system would end the program
    /// without a message.
    #[error("{0}")]
    Film(String),
    /// The meters need more memory than the limit.
    #[error("the meters need {} of memory, more than the limit of {} (--memory)", input::beyond(*.0, *.1)[0], input::beyond(*.0, *.1)[1])]
    MeterMemory(u64, u64),
    /// The meters do not fit into memory, or have no light to measure.
    #[error(transparent)]
    Meters(#[from] MeasureError),
}

impl<'a> Run<'a> {
    /// Makes the run that a scene specifies.
    pub fn new(loaded: &'a Loaded) -> Self {
        Run {
            loaded,
            renderer: loaded.renderer,
            candidates: loaded.candidates.clone(),
            reason: None,
            replicates: None,
            seed: 0,
            total: Some(loaded.samples),
            shard: None,
            time: None,
            target: None,
            strategies: false,
            device: None,
            batch: None,
        }
    }

    /// Chooses the estimator with a pilot on the current thread pool, if the scene leaves the
    /// choice open.
    pub fn choose(&mut self, handle: &Handle) {
        let mut candidates = std::mem::take(&mut self.candidates);
        if self.strategies {
            // Without a pilot the first candidate is chosen: start with the candidate that finds
            // more light.
            candidates.retain(Integrator::splats);
            candidates.reverse();
        }
        if candidates.is_empty() {
            return;
        }
        // Ignore the time limit of shards: all shards must make one choice.
        let time = self.time.filter(|_| self.shard.is_none());
        let extent = Extent {
            samples: self.total,
            seconds: time.map(|time| time.as_secs_f64()),
        };
        let options = self.options();
        let choice = choose(&self.loaded.groups, &candidates, &options, extent, handle);
        self.renderer = Renderer::Light(choice.integrator);
        self.reason = Some(self.why(&choice));
        if let (true, None, Some(seconds)) = (
            self.loaded.sampler.is_automatic(),
            self.total,
            extent.seconds,
        ) {
            let guess = choice.expected_samples(&self.loaded.groups, seconds);
            // Replicates of all sizes divide a power of two.
            // Planted error "replicates must divide a guessed number of samples", found by morgana-io/io::samplers::replicates_of_unknown_numbers_of_samples_follow_from_the_time:
            // let rounded = |samples: f64| samples as u64;
            let rounded = |samples: f64| 1 << (samples as u64).max(1).ilog2();
            self.replicates = guess.map(|samples| self.loaded.replicates(rounded(samples)));
        }
    }

    /// Returns the grouping of a pixel's samples into replicates.
    fn replicates(&self) -> Replicates {
        let samples = self.total.unwrap_or(self.loaded.samples);
        let wanted = self
            .replicates
            .unwrap_or_else(|| self.loaded.replicates(samples));
        self.renderer.replicates(wanted)
    }

    /// Returns the reason for the choice, in words.
    fn why(&self, choice: &Choice) -> String {
        match choice.basis {
            Basis::Single if self.strategies => return "no other has strategies".into(),
            Basis::Single => return "no other finds as much light".into(),
            Basis::TooShort => return "the render is too short for a pilot".into(),
            Basis::Ended => return "the render ended in its pilot".into(),
            Basis::Pilot => {}
        }
        if choice.candidates.iter().all(Candidate::is_noiseless) {
            return "a pilot finds no noise".into();
        }
        let gains = choice.gains();
        let gains: Vec<String> = gains
            .map(|(other, gain)| times(gain, other.name()))
            .collect();
        if gains.is_empty() {
            return "samples of others take too long".into();
        }
        format!("a pilot finds it {}", gains.join(" and "))
    }

    /// Adopts the estimator and the size of replicates of the run to which a part belongs. Choices
    /// that the scene makes have priority.
    pub fn choose_as(&mut self, header: &Header) {
        if self.loaded.sampler.is_automatic() {
            self.replicates = Some(header.replicates);
        }
        if self.device.is_some() {
            self.adopt_batches(header);
        }
        let candidates = std::mem::take(&mut self.candidates);
        let chosen = header.setting(INTEGRATOR);
        let chosen = candidates.iter().find(|i| Some(i.name()) == chosen);
        if let Some(integrator) = chosen {
            self.renderer = Renderer::Light(*integrator);
            self.reason = header.setting(REASON).map(String::from);
        }
    }

    /// Adopts the batches of parts that a device has made, which is not needed to merge them.
    pub fn adopt_batches(&mut self, header: &Header) {
        self.batch = header.setting(BATCH).and_then(|batch| batch.parse().ok());
    }

    /// Returns the header to store with parts of the run, without an origin.
    pub fn header(&self) -> Header {
        let target = self
            .target
            .map(|target| format!("{} ({})", target.error, target.measure.name()));
        let replicates = self.replicates();
        let settings = [
            ("seed", Some(self.seed.to_string())),
            (INTEGRATOR, Some(self.renderer.name().into())),
            ("sampler", Some(replicates.name())),
            ("adaptive", Some(self.loaded.adaptive.to_string())),
            ("strategies", self.strategies.then(|| "told apart".into())),
            ("target error", target),
            (REASON, self.reason.clone()),
            ("device", self.batch.map(|_| "gpu".into())),
            (BATCH, self.batch.map(|batch| batch.to_string())),
        ];
        let settings = settings.into_iter();
        let settings = settings.filter_map(|(name, value)| Some((name.to_owned(), value?)));
        Header {
            version: env!("CARGO_PKG_VERSION").into(),
            results: results(self.used()),
            scene_hash: self.loaded.hash.to_string(),
            settings: settings.collect(),
            total: self.total,
            replicates,
            shard: self.shard,
            origin: String::new(),
            seconds: 0.0,
        }
    }

    /// Returns the names of the estimator and of the kinds of meters.
    fn used(&self) -> impl Iterator<Item = &'static str> + Clone {
        let instruments = self.loaded.instruments.iter();
        std::iter::once(self.renderer.name()).chain(instruments.map(|i| i.meter.kind()))
    }

    /// Returns the options for rendering the picture.
    pub fn options(&self) -> RenderOptions {
        let range = self.header().range();
        RenderOptions {
            first: range.start,
            replicates: self.replicates(),
            loosens_tolerance: self.loaded.has_open_tolerance,
            strategies: self.strategies,
            decomposition: self.loaded.layering.decomposition,
            reweight: self.loaded.reweight,
            hide_emitters: self.loaded.hide_emitters,
            adaptive: self.loaded.adaptive,
            target: self.target,
            quantities: self.loaded.quantities,
            ..RenderOptions::new(self.renderer, range.end - range.start, self.seed)
        }
    }

    /// Returns the options for reading the meters.
    pub fn measure_options(&self) -> MeasureOptions {
        let range = self.header().range();
        let (max_depth, rr_depth) = self.renderer.depths();
        MeasureOptions {
            first: range.start,
            particles: range.end - range.start,
            seed: self.seed,
            max_depth,
            rr_depth,
        }
    }

    /// Renders the picture on the current thread pool: all its samples, or as many as its
    /// [time](Run::time) allows.
    ///
    /// # Errors
    /// Returns a [`Refusal`] if the run cannot begin, or if it has neither a total nor a time and
    /// would never end.
    pub fn render(&self) -> Result<Rendering, Refusal> {
        let mut clock = self.begin()?;
        let mut run = self.clone();
        run.choose(&Handle::default());
        Ok(render(&run.loaded.groups, &run.options(), |progress| {
            clock.look(progress.done == progress.total)
        }))
    }

    /// Reads the meters on the current thread pool: with all particles, or as many as the
    /// [time](Run::time) allows.
    ///
    /// # Errors
    /// Returns the errors of [`Run::render`].
    pub fn measure(&self) -> Result<Measurement, Refusal> {
        let mut clock = self.begin()?;
        let mut body = self.start()?;
        self.advance(&mut body, &Handle::default(), &mut clock, |_| ())?;
        match self.finish(body)? {
            Outcome::Readings(measurement) => Ok(*measurement),
            Outcome::Picture(_) => unreachable!("the scene has meters"),
        }
    }

    /// Starts the clock, if something ends the run.
    fn begin(&self) -> Result<Clock<'static>, Refusal> {
        self.check(Limits::default())?;
        if self.total.is_none() && self.time.is_none() {
            return Err(Refusal::NoEnd);
        }
        Ok(Clock::start(self.time, &|| false))
    }

    /// Checks that the run can begin.
    ///
    /// # Errors
    /// Returns the reason why it cannot: see [`Refusal`].
    pub fn check(&self, limits: Limits) -> Result<(), Refusal> {
        if let Some([index, count]) = self.shard.filter(|[index, count]| index >= count) {
            return Err(Refusal::Shard { index, count });
        }
        if !self.loaded.instruments.is_empty() {
            let meters = self.loaded.meters();
            self.check_meters(&meters, limits)?;
            MeasureState::new(&self.loaded.groups, &meters)?;
            return Ok(());
        }
        let mut integrators = self
            .renderer
            .integrator()
            .into_iter()
            .chain(&self.candidates);
        if self.strategies && !integrators.any(Integrator::separates_strategies) {
            return Err(Refusal::OneStrategy(self.renderer.name()));
        }
        let is_unlimited = self.target.is_some() && self.total.is_none() && self.time.is_none();
        if is_unlimited && !self.renderer.converges() {
            return Err(Refusal::Unreachable);
        }
        self.check_film(limits)
    }

    fn check_meters(&self, meters: &[Meter], limits: Limits) -> Result<(), Refusal> {
        let of_group = |scene: &Scene| {
            let channels = scene.film().channels;
            let memory = meters.iter().map(|meter| meter.memory(scene, channels));
            memory.fold(0, usize::saturating_add)
        };
        let groups = self.loaded.groups.iter().map(of_group);
        let needed = groups.fold(0, usize::saturating_add) as u64;
        match limits.memory {
            Some(most) if needed > most => Err(Refusal::MeterMemory(needed, most)),
            _ => Ok(()),
        }
    }

    fn check_film(&self, limits: Limits) -> Result<(), Refusal> {
        let film = self.loaded.scene().film();
        let bytes = memory(self.loaded.scene(), &self.options());
        let needs = |size: &str, more: String| {
            let (width, height) = (film.width, film.height);
            let layers = Naming::of(self.loaded).map(|n| format!(" with {}", n.describe()));
            let strategies = self.strategies.then_some(" with images of strategies");
            Refusal::Film(format!(
                "a film of {width} × {height} pixels{}{} needs {size} of memory{more}",
                layers.unwrap_or_default(),
                strategies.unwrap_or_default(),
            ))
        };
        match limits.memory {
            Some(most) if bytes as u64 > most => {
                let [size, most] = input::beyond(bytes as u64, most);
                Err(needs(
                    &size,
                    format!(", more than the limit of {most} (--memory)"),
                ))
            }
            _ => Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| {
                let more = ", more than this system has";
                needs(&input::bytes(bytes as u64), more.to_owned())
            }),
        }
    }
}

/// Describes the efficiency of the chosen integrator relative to another.
fn times(gain: f64, other: &str) -> String {
    if gain > 1000.0 {
        return format!("more than 1000× as efficient as {other}");
    }
    let digits = usize::from(gain < 10.0);
    format!("{gain:.digits$}× as efficient as {other}")
}

impl Loaded {
    /// Returns the meters of the scene's instruments.
    pub fn meters(&self) -> Vec<Meter> {
        self.instruments.iter().map(|i| i.meter.clone()).collect()
    }
}
