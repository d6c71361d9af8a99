//! Weight windows: the power that particles should have along their paths. They make late gates as
//! accurate as early gates (docs/theory.md#weight-windows).
//!
//! The light in flight decreases with the optical path length L, because it is absorbed or leaves
//! the scene. If the number of particles decreased in proportion, only a few would reach late
//! gates. Weight windows instead make the power of each particle at L proportional to the power in
//! flight at L. Russian roulette ends particles with less power, and particles with more power are
//! divided. About equally many particles then reach all L. A pilot estimates the power in flight.

use super::flight::flights;
use super::tally::Scores;
use super::voxel_scores::detail_in;
use super::{Meter, Setup, Tally, TaskSums};
use crate::Bins;
use crate::path::{CellDetail, CellRun, Observer, WalkEvent, Workspace};
use crate::sampling::Sampler;
use crate::scene::CellVolume;
use crate::stop::Stop;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// Number of optical path lengths at which the pilot measures.
const LEVELS: usize = 64;
/// Number of particles of a round of the pilot, in tasks of [`PARTICLES_PER_TASK`].
const PARTICLES: u64 = 512;
const PARTICLES_PER_TASK: u64 = 64;
/// Maximum number of rounds. Each round reaches about a hundredth of the light that the previous
/// round reached, or less when there is little light.
const MAX_ROUNDS: u64 = 12;
/// Effective number of particles that must reach a level in the pilot. Inaccurate fractions cause
/// too many or too few particles, but no bias.
const MIN_EFFECTIVE_PARTICLES: f64 = 4.0;
/// Smallest fraction of the emitted power, 90 dB below it, that a window represents. Gates with
/// less light get fewer particles.
const MIN_FRACTION: f64 = 1e-9;
/// Seed of the pilot, unlike the seed of any plausible measurement.
const SEED: u64 = 0x7769_6E64_6F77_0000;

/// Fraction of the initial power that a particle should still have, as a function of its optical
/// path length. It is tabulated at equal steps up to the end of the last gate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    levels: Bins,
    /// Fractions at the start of each step, in descending order.
    shares: Vec<f64>,
}

impl Window {
    /// Returns the fraction of the initial power that a particle should still have at an optical
    /// path length; 1 beyond the last gate.
    pub fn share(&self, optical_length: f64) -> f64 {
        let step = self.levels.index(optical_length.max(0.0));
        step.and_then(|step| self.shares.get(step))
            .map_or(1.0, |share| share.clamp(MIN_FRACTION, 1.0))
    }

    /// Runs the pilot of a setup's particles. Returns `None` if no meter uses windows, and for
    /// fluorescent light, whose power first rises.
    pub(super) fn from_pilot(setup: &Setup, stop: &Stop) -> Option<Self> {
        if !setup.excitations.is_empty() {
            return None;
        }
        // Divide the optical length up to the end of the last gate into equal steps.
        let ends = setup.meters.iter().filter_map(Meter::windowed_length);
        let levels = Bins {
            min: 0.0,
            max: ends.reduce(f64::max)?,
            count: LEVELS,
        };
        let mut window = Window {
            levels,
            shares: vec![1.0; LEVELS],
        };
        // Measure the power in flight, using the window of the previous rounds.
        for round in 0..MAX_ROUNDS {
            let pilot = Setup {
                window: Some(window.clone()),
                ..setup.clone()
            };
            let tally = pilot.pilot_round(levels, round, stop)?;
            let done = window.refine(&tally, setup.emitted().sum());
            if done || stop.is_raised() {
                break;
            }
        }
        Some(window)
    }

    /// Updates the window with a round of the pilot. Returns true if the round has reached the last
    /// gate.
    fn refine(&mut self, tally: &Tally, emitted: f64) -> bool {
        let (mut least, mut known) = (1.0, true);
        for (step, share) in self.shares.iter_mut().enumerate() {
            known &= tally.effective(step) >= MIN_EFFECTIVE_PARTICLES;
            if known {
                least = (tally.mean(step) / emitted).clamp(MIN_FRACTION, least);
            }
            *share = least;
        }
        known || least <= MIN_FRACTION
    }
}

impl Setup<'_> {
    /// Measures, with a few particles, the power in flight at each level.
    fn pilot_round(&self, levels: Bins, round: u64, stop: &Stop) -> Option<Tally> {
        let tasks = (0..PARTICLES / PARTICLES_PER_TASK)
            .into_par_iter()
            .map(|task| {
                let mut ws = Workspace::new(self.scene.tolerance());
                ws.stop = stop.clone();
                let mut scores = Scores::default();
                for number in task * PARTICLES_PER_TASK..(task + 1) * PARTICLES_PER_TASK {
                    let mut sampler = Sampler::new(SEED + round, 0, number);
                    let mut pilot = Pilot {
                        meters: self.meters,
                        levels,
                        scores: &mut scores,
                    };
                    self.follow(number, &mut pilot, &mut sampler, &mut ws);
                    scores.end_particle();
                }
                scores.finish()
            });
        let mut tally = Tally::new(LEVELS)?;
        let tasks: Vec<TaskSums> = tasks.collect();
        tally.add(&tasks.iter().collect::<Vec<_>>(), PARTICLES, PARTICLES);
        Some(tally)
    }
}

/// Observer that scores the power of a particle at each level that it passes. A level is the start
/// of a step of optical path length.
struct Pilot<'p> {
    meters: &'p [Meter],
    levels: Bins,
    scores: &'p mut Scores,
}

impl Pilot<'_> {
    /// Scores all flights of an edge.
    fn score_edge(&mut self, event: &WalkEvent) {
        for flight in flights(event) {
            let power = flight.power_at(0.0).sum();
            self.score(power, [flight.optical_length, flight.length_after()]);
        }
    }

    /// Scores a flight between two optical path lengths.
    fn score(&mut self, power: f64, between: [f64; 2]) {
        let steps = &self.levels;
        let after = |length: f64| ((length - steps.min) / steps.width()).ceil().max(0.0) as usize;
        let [first, end] = between.map(after);
        for level in first.min(steps.count)..end.min(steps.count) {
            self.scores.add(level, power);
        }
    }
}

impl Observer for Pilot<'_> {
    const ALONG_SPANS: bool = true;

    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        self.score_edge(event);
        ControlFlow::Continue(())
    }

    /// Uses the criterion of the measurement.
    fn detail_in(&self, volume: &CellVolume) -> CellDetail {
        detail_in(self.meters, volume)
    }

    fn fly_in_cells(&mut self, run: &CellRun) {
        let power = run.power[run.channel];
        self.score(power, [run.optical_length, run.length_after()]);
    }

    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        self.score_edge(event);
    }
}
