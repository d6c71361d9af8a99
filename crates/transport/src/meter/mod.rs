//! Meters: what particles leave on their way from the emitters, other than in a picture.
//!
//! A particle starts with the power of the emitters over the density of its ray, flies along curved
//! edges, and is absorbed and scattered on the way (`particle`). Meters take note of its flights,
//! collisions and passages (`flight`); every meter has slots in one tally (`tally`). No index enters anywhere
//! (docs/theory.md#meters): power is conserved along rays, whatever the index does to radiance.

mod flight;
mod fluence;
mod grid;
mod irradiance;
mod particle;
mod positions;
mod reading;
mod tally;
mod window;

pub use fluence::{Estimator, FluenceMeter};
pub use grid::{Coordinates, Grid};
pub use irradiance::{Cosines, IrradianceMeter};
pub use positions::Positions;
pub use reading::{Axis, Reading};
pub use tally::{Tally, TaskSums};
pub use window::Window;

use crate::path::{BalanceSums, Workspace};
use crate::sampling::{Discrete, Sampler};
use crate::scene::Scene;
use crate::stop::Stop;
use crate::{Bins, Spectrum};
use flight::{Collision, Flight, Passing};
use fluence::{Cuts, Slots};
use particle::Particle;
use reading::Quantity;
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
    /// Of the window's pilot: optical path lengths at which power on its way is scored, in place of meters.
    levels: Option<Bins>,
}

impl<'a> Setup<'a> {
    /// `depths`: longest path in edges and specular events, and that at which Russian roulette begins.
    /// `None` if no light is emitted.
    pub fn new(
        scene: &'a Scene,
        meters: &'a [Meter],
        channels: usize,
        (max_depth, rr_depth): (u32, u32),
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
            levels: None,
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
    pub fn task(
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
            let recorder = Recorder {
                setup: self,
                scores: &mut scores,
                cuts: &mut cuts,
                sampler: Sampler::new(seed, 1, number),
            };
            let mut particle = Particle::new(self, number, recorder);
            particle.run(&mut sampler, ws);
            balance.add(&particle.particle_balance, &mut ws.stats.not_finite);
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

/// Passes what happens to a particle on to the meters. Meters draw from random numbers of their own, so
/// that the particle's way does not depend on who is looking.
struct Recorder<'r> {
    setup: &'r Setup<'r>,
    scores: &'r mut Scores,
    cuts: &'r mut Cuts,
    sampler: Sampler,
}

impl Recorder<'_> {
    /// Each meter with its slots.
    fn each(&mut self, mut see: impl FnMut(&Meter, &mut Slots, &mut Cuts, &mut Sampler)) {
        let channels = self.setup.channels;
        let mut slots = Slots {
            scores: self.scores,
            first: 0,
            channels,
        };
        for meter in self.setup.meters {
            see(meter, &mut slots, self.cuts, &mut self.sampler);
            slots.first += meter.cells() * channels;
        }
    }

    fn fly(&mut self, flight: &Flight) {
        if let Some(levels) = &self.setup.levels {
            let power = flight.power_at(0.0).sum();
            for level in flight.levels(levels) {
                self.scores.add(level, power);
            }
        }
        self.each(|meter, slots, cuts, sampler| {
            if let Meter::Fluence(meter) = meter {
                meter.fly(flight, slots, (cuts, sampler));
            }
        });
    }

    fn collide(&mut self, collision: &Collision) {
        self.each(|meter, slots, _, _| {
            if let Meter::Fluence(meter) = meter {
                meter.collide(collision, slots);
            }
        });
    }

    fn pass(&mut self, passing: &Passing) {
        self.each(|meter, slots, _, _| match meter {
            Meter::Irradiance(meter) if meter.object == passing.object => {
                meter.pass(passing, slots);
            }
            _ => {}
        });
    }
}
