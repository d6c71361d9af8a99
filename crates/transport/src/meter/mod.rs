//! Meters: what particles leave on their way from the emitters, other than in a picture.
//!
//! A particle starts with the power of the emitters over the density of its ray, flies along curved
//! edges, and is absorbed and scattered on the way: a random walk (`particle`). The `recorder` watches it, and shows the meters
//! its flights, collisions and crossings (`flight`); every meter has slots in one tally (`tally`). No index enters anywhere
//! (docs/theory.md#meters): power is conserved along rays, whatever the index does to radiance.

mod flight;
mod fluence;
mod grid;
mod irradiance;
mod particle;
mod positions;
mod reading;
mod recorder;
mod tally;
mod window;

pub use fluence::{Estimator, FluenceMeter};
pub use grid::{Coordinates, MeterGrid};
pub use irradiance::{Cosines, IrradianceMeter};
pub use positions::Positions;
pub use reading::{Reading, ReadingAxis};
pub use tally::Tally;
pub(crate) use tally::TaskSums;
pub use window::Window;

use crate::Spectrum;
use crate::path::{BalanceSums, Workspace};
use crate::sampling::{Discrete, Sampler};
use crate::scene::Scene;
use crate::stop::Stop;
use fluence::Cuts;
use reading::Quantity;
use recorder::Recorder;
use tally::Scores;

/// An instrument.
#[derive(Clone, Debug)]
pub enum Meter {
    /// Fluence rate and absorbed power in space.
    Fluence(FluenceMeter),
    /// Power through a surface.
    Irradiance(IrradianceMeter),
}

impl Meter {
    /// Number of cells, over all that it measures.
    pub fn cells(&self) -> usize {
        match self {
            Meter::Fluence(meter) => meter.slots(),
            Meter::Irradiance(meter) => meter.slots(),
        }
    }

    fn quantities(&self) -> Vec<Quantity> {
        match self {
            Meter::Fluence(meter) => meter.quantities(),
            Meter::Irradiance(meter) => meter.quantities(),
        }
    }

    /// Optical path length at which its last gate ends, if it has gates.
    fn last_gate(&self) -> Option<f64> {
        let gates = match self {
            Meter::Fluence(meter) => meter.optical_length,
            Meter::Irradiance(meter) => meter.optical_length,
        };
        gates.map(|bins| bins.max)
    }
}

/// Slots that meters take in a tally with so many channels.
pub fn slots(meters: &[Meter], channels: usize) -> usize {
    let cells = meters.iter().map(Meter::cells);
    let cells = cells.fold(0, usize::saturating_add);
    cells.saturating_mul(channels)
}

/// How particles are followed and what measures them, for one group of channels.
#[derive(Clone, Debug)]
pub struct Setup<'a> {
    scene: &'a Scene,
    meters: &'a [Meter],
    /// Emitters by their power.
    choice: Discrete,
    /// Power of all emitters.
    emitted: Spectrum,
    /// Channel probabilities.
    channel_pdf: Spectrum,
    channels: usize,
    max_depth: u32,
    rr_depth: u32,
    /// What particles should be worth on their way, if a meter has gates.
    window: Option<Window>,
}

impl<'a> Setup<'a> {
    /// A setup for paths of at most `max_depth` edges and specular events, with Russian roulette from `rr_depth` on.
    /// `None` if no light is emitted.
    pub fn new(
        scene: &'a Scene,
        meters: &'a [Meter],
        channels: usize,
        max_depth: u32,
        rr_depth: u32,
    ) -> Option<Self> {
        let white = Spectrum(std::array::from_fn(|c| f64::from(u8::from(c < channels))));
        let powers: Vec<Spectrum> = scene.powers(channels).collect();
        let weights: Vec<f64> = powers.iter().map(|power| power.sum()).collect();
        Some(Setup {
            scene,
            meters,
            choice: Discrete::new(&weights).ok()?,
            emitted: powers.into_iter().fold(Spectrum::ZERO, |sum, p| sum + p),
            channel_pdf: white / channels as f64,
            channels,
            max_depth,
            rr_depth,
            window: None,
        })
    }

    /// The setup with particles that keep to a window.
    #[must_use]
    pub fn within(self, window: Option<Window>) -> Self {
        Setup { window, ..self }
    }

    /// The window that makes late gates as sure as early ones; `None` if no meter has gates. It is worthless once a `stop` is
    /// raised.
    pub fn window(&self, stop: &Stop) -> Option<Window> {
        Window::learn(self, stop)
    }

    /// Power of all emitters, per channel.
    pub fn emitted(&self) -> Spectrum {
        self.emitted
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        slots(self.meters, self.channels)
    }

    /// Follows the particles of one task, each with random numbers of its own.
    pub(crate) fn task(
        &self,
        seed: u64,
        particles: std::ops::Range<u64>,
        ws: &mut Workspace,
    ) -> (TaskSums, BalanceSums) {
        let (mut part, mut scores, mut cuts) =
            (TaskSums::default(), Scores::default(), Cuts::new());
        let mut balance = BalanceSums::default();
        for number in particles {
            ws.stats.paths += 1;
            let mut sampler = Sampler::new(seed, 0, number);
            let mut recorder = Recorder {
                meters: self.meters,
                channels: self.channels,
                scores: &mut scores,
                cuts: &mut cuts,
                sampler: Sampler::new(seed, 1, number),
            };
            let particle = self.follow(number, &mut recorder, &mut sampler, ws);
            balance.add(&particle, &mut ws.stats.not_finite);
            part.take(&mut scores);
        }
        ws.stats.not_finite += scores.not_finite;
        (part.finish(), balance)
    }

    /// What each meter has measured.
    pub fn readings(&self, tally: &Tally) -> Vec<Vec<Reading>> {
        let mut first = 0;
        let read = |meter: &Meter| {
            let quantities = meter.quantities();
            let readings = quantities
                .iter()
                .map(|q| q.read(tally, first, self.channels));
            let readings = readings.collect();
            first += meter.cells() * self.channels;
            readings
        };
        self.meters.iter().map(read).collect()
    }
}
