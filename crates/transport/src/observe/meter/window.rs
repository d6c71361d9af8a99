//! Which power particles should have on their way, so that late gates are as sure as early ones (docs/theory.md#weight-windows).
//!
//! Of the light that starts, ever less is still on its way at an optical path length L: it is absorbed, or leaves the scene.
//! Particles that die in proportion leave late gates to a few of them. Where meters ask for it, a particle at L therefore
//! carries about the share of its first power that is still on its way there: lighter particles play Russian roulette, heavier
//! ones are divided. So about as many particles are on their way at all L. The shares are told by a pilot.

use super::flight::flights;
use super::tally::Scores;
use super::voxel_scores::voxels_suffice;
use super::{Meter, Setup, Tally, TaskSums};
use crate::Bins;
use crate::path::{Observer, VoxelFlight, WalkEvent, Workspace};
use crate::sampling::Sampler;
use crate::scene::VoxelVolume;
use crate::stop::Stop;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// Optical path lengths at which the pilot looks.
const LEVELS: usize = 64;
/// Particles of a round of the pilot, in tasks of `TASK`.
const PARTICLES: u64 = 512;
const TASK: u64 = 64;
/// Each round gets to where there is about a hundredth of the light that the one before got to, and less when there is little.
const ROUNDS: u64 = 12;
/// A level is known if so many of them, in effect, have got there. What is known badly makes particles too many or too few,
/// and nothing wrong.
const ENOUGH: f64 = 4.0;
/// Gates with less than this share of the light (90 dB below the first) get fewer particles.
const LEAST: f64 = 1e-9;
/// The pilot's random numbers are those of no measurement that anyone will ask for.
const SEED: u64 = 0x7769_6E64_6F77_0000;

/// The share of its first power that a particle should have left, at equal steps of optical path length up to the end of the
/// last gate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    levels: Bins,
    /// At the start of each step; falling.
    shares: Vec<f64>,
}

impl Window {
    /// What it should have left at an optical path length; all of it where no gate follows.
    pub fn share(&self, optical_length: f64) -> f64 {
        let step = self.levels.index(optical_length.max(0.0));
        step.and_then(|step| self.shares.get(step))
            .map_or(1.0, |share| share.clamp(LEAST, 1.0))
    }

    /// The window of a setup's particles; `None` if no meter asks for one.
    pub(super) fn learn(setup: &Setup, stop: &Stop) -> Option<Self> {
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
        // Measure the power that is still on its way, with the window that is known so far.
        for round in 0..ROUNDS {
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

    /// Takes what a round of the pilot has found. Returns whether it has got to the last gate.
    fn refine(&mut self, tally: &Tally, emitted: f64) -> bool {
        let (mut least, mut known) = (1.0, true);
        for (step, share) in self.shares.iter_mut().enumerate() {
            known &= tally.effective(step) >= ENOUGH;
            if known {
                least = (tally.mean(step) / emitted).clamp(LEAST, least);
            }
            *share = least;
        }
        known || least <= LEAST
    }
}

impl Setup<'_> {
    /// The power of a few particles that is still on its way at each level.
    fn pilot_round(&self, levels: Bins, round: u64, stop: &Stop) -> Option<Tally> {
        let tasks = (0..PARTICLES / TASK).into_par_iter().map(|task| {
            let mut ws = Workspace::new(self.scene.tolerance());
            ws.stop = stop.clone();
            let mut scores = Scores::default();
            for number in task * TASK..(task + 1) * TASK {
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
        tally.add(&tasks.iter().collect::<Vec<_>>(), PARTICLES);
        Some(tally)
    }
}

/// Scores the power of a particle at each level that it passes, the start of a step of optical path length.
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

    /// As in the measurement.
    fn sees_voxels(&self, volume: &VoxelVolume) -> bool {
        voxels_suffice(self.meters, volume)
    }

    fn fly_in_voxel(&mut self, flight: &VoxelFlight) {
        let end = flight.optical_length + flight.matter.n * flight.length;
        self.score(flight.power, [flight.optical_length, end]);
    }

    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        self.score_edge(event);
    }
}
