//! Derivatives of what meters read: particles take note of their factors on their walk, and of what they leave in the meters
//! (docs/theory.md#derivatives-of-light).

use super::flight::{Flight, Passing, flights};
use super::reading::{Quantity, ReadingAxis};
use super::recorder::{Beyond, passing};
use super::{Meter, Setup};
use crate::Spectrum;
use crate::derivative::{FactorRecorder, Sums, Tape};
use crate::path::{End, Observer, WalkEvent, Workspace};
use crate::sampling::Sampler;
use std::ops::{ControlFlow, Range};

/// Watches the walk of one particle, which is never divided.
struct TapeRecorder<'r> {
    meters: &'r [Meter],
    channels: usize,
    /// For each slot.
    weights: &'r [f64],
    tape: &'r mut Tape,
    /// Of the contributions on the tape.
    worths: &'r mut Vec<Spectrum>,
    emitter: usize,
}

impl Observer for TapeRecorder<'_> {
    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        if let Some(last) = self.fly_along(event) {
            self.end(event, &last);
        }
        if let (Some(vertex), Some(ray)) = (event.vertex, event.onward) {
            self.tape.turn(vertex, ray.start.direction);
        }
        ControlFlow::Continue(())
    }

    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        self.fly_along(event);
    }
}

impl TapeRecorder<'_> {
    /// Takes note of the flights along an edge, and of the crossings of smooth surfaces between them. Returns the last flight.
    fn fly_along<'e>(&mut self, event: &'e WalkEvent) -> Option<Flight<'e>> {
        let mut last = None;
        for (i, flight) in flights(event).enumerate() {
            self.tape
                .fly(flight.span.medium, &flight.span.arc, flight.theta_end);
            if let Some(next) = event.edge.spans.get(i + 1) {
                self.surface(&flight, Some(Beyond::along(&flight, next)));
            }
            last = Some(flight);
        }
        last
    }

    /// Takes note of the end of an edge, to which the last flight leads.
    fn end(&mut self, event: &WalkEvent, last: &Flight) {
        match event.edge.end {
            End::Collision(point) => self.tape.collide(point.medium, point.x),
            End::Surface { .. } => self.surface(last, event.onward.map(Beyond::reflected)),
            End::Dead if !event.edge.lost => self.surface(last, None),
            End::Dead | End::Escaped { .. } => {}
        }
    }

    fn surface(&mut self, flight: &Flight, after: Option<Beyond>) {
        if let Some(passing) = passing(flight, after) {
            self.pass(&passing);
        }
    }

    /// What light that passes a surface is worth.
    fn pass(&mut self, passing: &Passing) {
        let mut first = 0;
        let mut worth = Spectrum::ZERO;
        for meter in self.meters {
            if let Meter::Irradiance(meter) = meter {
                meter.scores(passing, |cell, power| {
                    for c in 0..self.channels {
                        worth[c] += power[c] * self.weights[first + cell * self.channels + c];
                    }
                });
            }
            first += meter.cells() * self.channels;
        }
        if !worth.is_zero() {
            self.tape.contribute(self.emitter);
            self.worths.push(worth);
        }
    }
}

impl Setup<'_> {
    /// Adds the derivatives of Σ weight × reading over all slots: sums over particles of numbers in a range.
    pub(crate) fn differentiate(
        &self,
        seed: u64,
        particles: Range<u64>,
        weights: &[f64],
        sums: &mut Sums,
        ws: &mut Workspace,
    ) {
        let (mut tape, mut worths) = (Tape::default(), Vec::new());
        for number in particles {
            if ws.stop.is_raised() {
                return;
            }
            ws.stats.paths += 1;
            let mut sampler = Sampler::new(seed, 0, number);
            // The number that will choose the emitter.
            let emitter = self.choice.sample(sampler.clone().next_1d()).index;
            let mut recorder = TapeRecorder {
                meters: self.meters,
                channels: self.channels,
                weights,
                tape: &mut tape,
                worths: &mut worths,
                emitter,
            };
            self.follow(number, &mut recorder, &mut sampler, ws);
            let not_finite = &mut ws.stats.not_finite;
            let finite = worths.drain(..).map(|worth| {
                *not_finite += u64::from(!worth.is_finite());
                worth.map(|w| if w.is_finite() { w } else { 0.0 })
            });
            sums.add(&tape, finite);
            tape.clear();
        }
    }

    /// Weights of all slots for a linear functional of readings, whose weights are given for each meter and each of its
    /// [readings](Setup::readings): as its means are, for the channels from `first_channel` on of `all`; an empty one counts nothing.
    pub(crate) fn slot_weights(
        &self,
        weights: &[Vec<Vec<f64>>],
        first_channel: usize,
        all: usize,
    ) -> Vec<f64> {
        let mut slots = vec![0.0; self.slots()];
        let mut first = 0;
        for (meter, weights) in self.meters.iter().zip(weights) {
            for (quantity, weights) in meter.quantities().iter().zip(weights) {
                for (cell, weights) in weights.chunks(all).enumerate() {
                    let measure = quantity.measures[cell % quantity.measures.len()];
                    for c in 0..self.channels {
                        let slot = first + (quantity.first + cell) * self.channels + c;
                        slots[slot] += weights[first_channel + c] / measure;
                    }
                }
            }
            first += meter.cells() * self.channels;
        }
        slots
    }
}

impl Meter {
    /// Names of what it reads and numbers of bins along each axis, that of channels left out.
    pub fn readings(&self) -> Vec<(&'static str, Vec<usize>)> {
        let quantities = self.quantities().into_iter();
        let named = |q: Quantity| (q.name, q.axes.iter().map(ReadingAxis::len).collect());
        quantities.map(named).collect()
    }
}
