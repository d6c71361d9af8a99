//! Meters: quantities of particles on their paths from the emitters, other than pictures.
//!
//! A particle starts with the emitters' power over the density of its ray. It flies along curved
//! edges, and is absorbed and scattered on the way: a random walk (`particle`). The `recorder`
//! observes the walk, and passes its flights, collisions and crossings (`flight`) to the meters.
//! Every meter has slots in one tally (`tally`). The index does not enter (docs/theory.md#meters):
//! power is conserved along rays, while radiance changes with the index.

mod acceptance;
mod check;
mod copies;
mod differentiate;
mod dwell;
mod flight;
mod fluence;
mod fluorescence;
mod functionals;
mod grid;
mod history;
mod irradiance;
mod layout;
mod line;
mod particle;
mod polarization;
mod positions;
mod reading;
mod recorder;
mod records;
mod tagging;
mod tally;
mod voxel_scores;
mod window;

pub use acceptance::{Acceptance, Patch};
pub use check::MeterProblem;
pub use fluence::{Estimator, FluenceMeter};
pub use fluorescence::CyclicFluorescence;
pub(crate) use fluorescence::with_excitations;
pub(crate) use functionals::{Functionals, Near};
pub use grid::{Coordinates, MeterGrid};
pub use irradiance::{Cosines, IrradianceMeter, MeterSurface};
pub use positions::Positions;
pub use reading::{Reading, ReadingAxis};
pub use records::{RecordRegion, RecordTable};
pub(crate) use records::{RecordRows, Records};
pub use tally::Tally;
pub(crate) use tally::TaskSums;
pub use window::Window;

use crate::Spectrum;
use crate::frequency_domain::FrequencyDomain;
use crate::path::{BalanceSums, Workspace};
use crate::sampling::{Discrete, Sampler};
use crate::scene::Scene;
use crate::sidebands::Sidebands;
use crate::stop::Stop;
use crate::tagging::SoundInMedia;
use eikonal::Aabb;
use fluence::Cuts;
use fluorescence::Excitation;
use history::{Histories, HistoryRegions};
use layout::CellLayout;
use polarization::ParticleStokes;
use reading::{Quantity, TallyPart};
use recorder::Recorder;
use records::RecordLayout;
use tagging::{RequestedModulations, Tagging};
use tally::Scores;
use voxel_scores::VoxelScore;

/// Measuring instrument.
#[derive(Clone, Debug)]
pub enum Meter {
    /// Meter of fluence rate and absorbed power in space.
    Fluence(FluenceMeter),
    /// Meter of power through a surface.
    Irradiance(IrradianceMeter),
}

impl Meter {
    /// Returns the name of the kind of meter.
    pub fn kind(&self) -> &'static str {
        match self {
            Meter::Fluence(_) => "fluence",
            Meter::Irradiance(_) => "irradiance",
        }
    }

    /// Returns the number of cells of all quantities of the meter.
    pub fn cells(&self) -> usize {
        self.layout().cells()
    }

    /// Returns the order of the meter's cells.
    fn layout(&self) -> CellLayout {
        match self {
            Meter::Fluence(meter) => meter.layout(),
            Meter::Irradiance(meter) => meter.layout(),
        }
    }

    /// Returns the bounding box of the region that the meter measures; empty for meters on
    /// surfaces.
    pub fn aabb(&self) -> Aabb {
        match self {
            Meter::Fluence(meter) => *meter.grid.aabb(),
            Meter::Irradiance(_) => Aabb::EMPTY,
        }
    }

    /// Returns true if a [reading](Meter::readings) is a sum over particles: not an amplitude or a
    /// phase.
    pub(crate) fn is_linear(&self, reading: usize) -> bool {
        self.quantities()
            .get(reading)
            .is_none_or(Quantity::is_linear)
    }

    fn quantities(&self) -> Vec<Quantity> {
        match self {
            Meter::Fluence(meter) => meter.quantities(),
            Meter::Irradiance(meter) => meter.quantities(),
        }
    }

    /// Returns the maximum number of bytes that the meter takes in a scene, once light has reached
    /// all of its cells. They hold its sums, which readings later replace, the readings of sums
    /// that are read twice, and its records.
    pub fn memory(&self, scene: &Scene, channels: usize) -> usize {
        let regions = HistoryRegions::of(scene);
        let layout = RecordLayout {
            channels,
            regions: regions.count(),
            tagged: self.tags_records(),
            flows: regions.flows(),
            stokes: self.has_stokes(),
        };
        let records = self.most_records().map_or(0, |most| layout.memory(most));
        let sums = Tally::memory(self.cells().saturating_mul(channels));
        sums.max(self.memory_of_readings(channels))
            .saturating_add(records)
    }

    /// Returns the maximum number of bytes of the readings. The power of a bin is read as power and
    /// as irradiance; the third part of modulated light is read as an amplitude and a phase.
    fn memory_of_readings(&self, channels: usize) -> usize {
        let layout = self.layout();
        let frequencies = self.frequency_domain().map_or(0, |all| all.hertz().len());
        let twice = match self {
            Meter::Fluence(_) => frequencies,
            Meter::Irradiance(_) => 1 + frequencies,
        };
        let values = layout.values + twice;
        let bins = layout.bins.saturating_mul(values);
        let totals = layout.totals;
        Reading::memory(bins.saturating_add(totals).saturating_mul(channels))
    }

    /// Returns the maximum number of records, if the meter keeps records.
    fn most_records(&self) -> Option<usize> {
        match self {
            Meter::Fluence(_) => None,
            Meter::Irradiance(meter) => meter.most_records,
        }
    }

    /// Returns true if the meter's records hold the effect of sound on phases.
    fn tags_records(&self) -> bool {
        match self {
            Meter::Fluence(_) => false,
            Meter::Irradiance(meter) => meter.tagged && meter.most_records.is_some(),
        }
    }

    /// Returns the sidebands into which the meter separates light by the phase shift from sound.
    /// Returns `None` if it does not separate light.
    pub fn sidebands(&self) -> Option<&Sidebands> {
        match self {
            Meter::Fluence(meter) => meter.sidebands.as_ref(),
            Meter::Irradiance(meter) => meter.sidebands.as_ref(),
        }
    }

    /// Returns the frequencies at which the meter measures modulated light; `None` if it does not.
    pub fn frequency_domain(&self) -> Option<&FrequencyDomain> {
        match self {
            Meter::Fluence(meter) => meter.frequency_domain.as_ref(),
            Meter::Irradiance(meter) => meter.frequency_domain.as_ref(),
        }
    }

    /// Returns true if the meter measures Stokes parameters.
    pub fn has_stokes(&self) -> bool {
        match self {
            Meter::Fluence(_) => false,
            Meter::Irradiance(meter) => meter.stokes,
        }
    }

    /// Returns true if the meter measures the effect of sound on phases.
    pub fn is_tagged(&self) -> bool {
        self.tags_records() || self.sidebands().is_some()
    }

    /// Returns the optical path length up to which the meter needs weight windows: the end of its
    /// last gate. Returns `None` if the meter has no gates or uses no windows.
    fn windowed_length(&self) -> Option<f64> {
        let (gates, windows) = match self {
            Meter::Fluence(meter) => (meter.optical_length, meter.weight_windows),
            Meter::Irradiance(meter) => (meter.optical_length, meter.weight_windows),
        };
        gates.filter(|_| windows).map(|bins| bins.max)
    }
}

/// Returns the number of slots that meters take in a tally with `channels` channels.
pub fn slots(meters: &[Meter], channels: usize) -> usize {
    let cells = meters.iter().map(Meter::cells);
    let cells = cells.fold(0, usize::saturating_add);
    cells.saturating_mul(channels)
}

/// Particles and meters of a measurement, for one group of channels.
#[derive(Clone, Debug)]
pub struct Setup<'a> {
    scene: &'a Scene,
    meters: &'a [Meter],
    /// Distribution of emitters by their power; `None` if no emitter has power.
    choice: Option<Discrete>,
    /// Power of all emitters.
    emitted: Spectrum,
    /// Channel probabilities.
    channel_pdf: Spectrum,
    channels: usize,
    max_depth: u32,
    rr_depth: u32,
    /// Weight window of particles, if a meter uses weight windows.
    window: Option<Window>,
    /// Regions of records, if a meter keeps records.
    regions: Option<HistoryRegions>,
    /// Sound in the media, if a meter measures its effect.
    sound: Option<SoundInMedia>,
    /// Particles of other channels that excite fluorescence.
    excitations: Vec<Excitation<'a>>,
    /// Number of the film's channel whose fluorescence they excite.
    fluorescent_channel: usize,
}

/// Results of the particles of a task.
pub(crate) struct TaskResult {
    pub sums: TaskSums,
    pub balance: BalanceSums,
    /// Records of each meter.
    pub records: Vec<RecordRows>,
}

impl<'a> Setup<'a> {
    /// Creates a setup for paths of at most `max_depth` edges and specular events, with Russian
    /// roulette from `rr_depth` on.
    pub fn new(
        scene: &'a Scene,
        meters: &'a [Meter],
        channels: usize,
        max_depth: u32,
        rr_depth: u32,
    ) -> Self {
        let white = Spectrum(std::array::from_fn(|c| f64::from(u8::from(c < channels))));
        let powers: Vec<Spectrum> = scene.powers(channels).collect();
        let weights: Vec<f64> = powers.iter().map(|power| power.sum()).collect();
        Setup {
            scene,
            meters,
            choice: Discrete::new(&weights).ok(),
            emitted: powers.into_iter().fold(Spectrum::ZERO, |sum, p| sum + p),
            channel_pdf: white / channels as f64,
            channels,
            max_depth,
            rr_depth,
            window: None,
            regions: meters
                .iter()
                .any(|meter| meter.most_records().is_some())
                .then(|| HistoryRegions::of(scene)),
            sound: meters
                .iter()
                .any(Meter::is_tagged)
                .then(|| SoundInMedia::of(scene)),
            excitations: Vec::new(),
            fluorescent_channel: 0,
        }
    }

    /// Returns the meters.
    pub(crate) fn meters(&self) -> &'a [Meter] {
        self.meters
    }

    /// Returns the number of channels.
    pub(crate) fn channels(&self) -> usize {
        self.channels
    }

    /// Returns true if no light reaches the meters.
    pub fn is_dark(&self) -> bool {
        self.choice.is_none() && self.excitations.is_empty()
    }

    /// Restricts particles to a weight window.
    #[must_use]
    pub fn within(self, window: Option<Window>) -> Self {
        Setup { window, ..self }
    }

    /// Runs the pilot for a weight window that makes late gates as accurate as early ones; `None`
    /// if no meter uses one. The window has no meaning once `stop` is raised.
    pub fn window(&self, stop: &Stop) -> Option<Window> {
        Window::from_pilot(self, stop)
    }

    /// Returns the scene.
    pub(crate) fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Returns the power of all emitters, per channel.
    pub fn emitted(&self) -> Spectrum {
        self.emitted
    }

    /// Returns the standard error of [`Setup::emitted`], for media whose power had to be estimated.
    pub fn emitted_error(&self) -> Spectrum {
        self.scene.power_error(self.channels)
    }

    /// Returns the number of slots.
    pub fn slots(&self) -> usize {
        slots(self.meters, self.channels)
    }

    /// Follows the particles of one task. Each has its own random numbers.
    pub(crate) fn task(
        &self,
        seed: u64,
        particles: std::ops::Range<u64>,
        ws: &mut Workspace,
    ) -> TaskResult {
        let (mut scores, mut cuts) = (Scores::default(), Cuts::new());
        let mut balance = BalanceSums::default();
        let mut in_voxels = VoxelScore::of(self.meters);
        let mut dwells = vec![None; self.meters.len()];
        let mut histories = self.regions.clone().map(Histories::new);
        let requested = RequestedModulations::by(self.meters);
        let tagging = self.sound.clone();
        let mut tagging = tagging.map(|sound| Tagging::new(sound, requested));
        let has_stokes = self.meters.iter().any(Meter::has_stokes);
        let mut stokes = has_stokes.then(|| ParticleStokes::new(self.scene, self.channels));
        let mut records = vec![RecordRows::default(); self.meters.len()];
        for number in particles {
            ws.stats.paths += 1;
            let mut sampler = Sampler::new(seed, 0, number);
            if let Some(histories) = &mut histories {
                histories.start();
            }
            if let Some(tagging) = &mut tagging {
                tagging.start();
            }
            if let Some(stokes) = &mut stokes {
                stokes.start(self.scene.at(number));
            }
            let mut recorder = Recorder {
                meters: self.meters,
                channels: self.channels,
                scores: &mut scores,
                cuts: &mut cuts,
                in_voxels: &mut in_voxels,
                dwells: &mut dwells,
                sampler: Sampler::new(seed, 1, number),
                particle: number,
                histories: histories.as_mut(),
                tagging: tagging.as_mut(),
                stokes: stokes.as_mut(),
                records: &mut records,
            };
            let particle = self.follow(number, &mut recorder, &mut sampler, ws);
            recorder.end_particle();
            balance.add(&particle, &mut ws.stats.not_finite);
            scores.end_particle();
        }
        ws.stats.not_finite += scores.not_finite;
        TaskResult {
            sums: scores.finish(),
            balance,
            records,
        }
    }

    /// Creates empty records for each meter that keeps records.
    pub(crate) fn records(&self) -> Vec<Option<Records>> {
        let regions = self.regions.as_ref();
        let layout = |meter: &Meter| RecordLayout {
            channels: self.channels,
            regions: regions.map_or(0, HistoryRegions::count),
            tagged: meter.tags_records(),
            flows: regions.is_some_and(HistoryRegions::flows),
            stokes: meter.has_stokes(),
        };
        let records = |meter: &Meter| {
            let most = meter.most_records()?;
            Some(Records::new(layout(meter), most))
        };
        self.meters.iter().map(records).collect()
    }

    /// Returns the table of a meter's records for a fraction 2^−`share` of the particles.
    /// `followed` yields the numbers of all particles.
    pub(crate) fn record_table(
        &self,
        records: &Records,
        share: u32,
        followed: impl Iterator<Item = u64>,
    ) -> RecordTable {
        records.table(self.scene, share, followed)
    }

    /// Returns the readings of each meter. Sums are freed while they are read, so that readings
    /// take their place in memory.
    pub fn readings(&self, mut tally: Tally) -> Vec<Vec<Reading>> {
        let mut first = 0;
        let read = |meter: &Meter| {
            let part = TallyPart {
                tally: &mut tally,
                first,
                channels: self.channels,
            };
            first += meter.cells() * self.channels;
            reading::read(&meter.quantities(), &meter.layout(), part)
        };
        self.meters.iter().map(read).collect()
    }
}
