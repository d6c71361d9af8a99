//! Derivatives of meters' readings. Particles record the factors of their walk, and their scores in
//! the meters (docs/theory.md#derivatives-of-light).

use super::flight::{Collision, Flight, Passing, flights};
use super::fluence::Cuts;
use super::functionals::Functionals;
use super::reading::{Quantity, ReadingAxis};
use super::recorder::{Beyond, passing};
use super::{Estimator, FluenceMeter, Meter, Setup};
use crate::Spectrum;
use crate::derivative::{Sums, Tape};
use crate::frequency_domain::FrequencyDomain;
use crate::path::{End, Observer, WalkEvent, Workspace};
use crate::sampling::Sampler;
use crate::scene::MediumId;
use eikonal::ray::Arc;
use glam::DVec3;
use std::ops::{ControlFlow, Range};

/// Observer of the walk of one particle, which is never divided.
struct TapeRecorder<'r> {
    meters: &'r [Meter],
    wanted: &'r Functionals,
    notes: &'r mut Notes,
    sampler: Sampler,
}

/// Scores of a particle, with the factors that they are products of.
#[derive(Default)]
struct Notes {
    tape: Tape,
    /// Weighted score of each contribution on the tape.
    worths: Vec<Worth>,
    absorbed: Vec<Absorbed>,
    cuts: Cuts,
}

/// Weighted score of a contribution.
struct Worth {
    /// Index of the functional.
    row: usize,
    value: Spectrum,
}

/// Absorbed power at a position.
struct Absorbed {
    /// Index of the functional.
    row: usize,
    medium: MediumId,
    x: DVec3,
    /// Weighted score divided by the absorption coefficient.
    per_absorption: Spectrum,
}

/// Estimate of ∫ power ds in a cell.
struct Track<'e> {
    /// Cell of the fluence among the cells of all meters.
    cell: usize,
    /// Frequencies of modulated fluence, and the optical path length from the emitter.
    modulated: Option<(&'e FrequencyDomain, f64)>,
    /// Arc from the end of the tape to the point, up to θ, if the point lies beyond the tape.
    beyond: Option<(&'e Arc, f64)>,
    medium: MediumId,
    x: DVec3,
    path: Spectrum,
    absorption: Spectrum,
}

impl Notes {
    fn contribute(&mut self, row: usize, value: Spectrum) {
        self.tape.keep();
        self.worths.push(Worth { row, value });
    }

    /// Adds the derivatives to `sums`, and clears the particle. Values that are not finite are left
    /// out and counted.
    fn add_to(&mut self, sums: &mut Sums, not_finite: &mut u64) {
        let mut finite = |value: &mut Spectrum| {
            if !value.is_finite() {
                *not_finite += 1;
                *value = Spectrum::ZERO;
            }
        };
        self.worths.iter_mut().for_each(|w| finite(&mut w.value));
        let absorbed = &mut self.absorbed;
        absorbed
            .iter_mut()
            .for_each(|a| finite(&mut a.per_absorption));
        let mut rows: Vec<usize> = self.worths.iter().map(|worth| worth.row).collect();
        rows.sort_unstable();
        rows.dedup();
        for row in rows {
            let in_row = |worth: &Worth| {
                if worth.row == row {
                    worth.value
                } else {
                    Spectrum::ZERO
                }
            };
            sums.add(row, &self.tape, self.worths.iter().map(in_row));
        }
        for a in absorbed.drain(..) {
            // Planted error "absorbed power that does not grow with the absorption where it is", found by morgana-transport/transport::meters::derivatives::derivatives_conserve_power:
            // let _ = (a.row, a.medium, a.x, a.per_absorption);
            sums.absorb(a.row, a.medium, a.x, a.per_absorption);
        }
        self.worths.clear();
        self.tape.clear();
    }
}

impl Observer for TapeRecorder<'_> {
    const ALONG_SPANS: bool = true;

    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        if let Some(last) = self.fly_along(event) {
            self.end(event, &last);
        }
        ControlFlow::Continue(())
    }

    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        self.fly_along(event);
    }
}

impl TapeRecorder<'_> {
    /// Records the flights along an edge, and the crossings of smooth surfaces between them.
    /// Returns the last flight.
    fn fly_along<'e>(&mut self, event: &'e WalkEvent) -> Option<Flight<'e>> {
        let mut last = None;
        for (i, flight) in flights(event).enumerate() {
            self.each_fluence(Estimator::TrackLength, |recorder, meter, first| {
                recorder.fly(&flight, meter, first);
            });
            let (arc, theta) = (&flight.span.arc, flight.theta_end);
            self.notes.tape.fly(flight.span.medium, arc, theta);
            if let Some(next) = event.edge.spans.get(i + 1) {
                let beyond = Some(Beyond::along(&flight, next));
                self.surface(&flight, beyond, |tape| tape.pass_surface(flight.span, next));
            }
            last = Some(flight);
        }
        last
    }

    /// Records the end of an edge; `last` is the flight that leads to it.
    fn end(&mut self, event: &WalkEvent, last: &Flight) {
        match event.edge.end {
            End::Collision(point) => {
                let collision = Collision {
                    scene: event.scene,
                    point,
                    path: event.path(&point),
                    optical_length: last.length_after(),
                };
                self.each_fluence(Estimator::Collision, |recorder, meter, first| {
                    recorder.collide(&collision, meter, first);
                });
                // Planted error "derivatives of collisions by attached sampling", found by morgana-transport/transport::meters::derivatives::derivatives_conserve_power:
                // (no line)
                self.notes.tape.collide(point.medium, point.x);
                turn(&mut self.notes.tape, event);
            }
            End::Surface { .. } => {
                let beyond = event.onward.map(Beyond::reflected);
                self.surface(last, beyond, |tape| turn(tape, event));
            }
            End::Dead if !event.edge.lost => self.surface(last, None, |_| ()),
            End::Dead | End::Escaped { .. } => {}
        }
    }

    /// Visits each fluence meter that uses an estimator, with its first cell.
    fn each_fluence(
        &mut self,
        estimator: Estimator,
        mut see: impl FnMut(&mut Self, &FluenceMeter, usize),
    ) {
        let mut first = 0;
        for meter in self.meters {
            if let Meter::Fluence(meter) = meter
                && meter.estimator == estimator
            {
                see(self, meter, first);
            }
            first += meter.cells();
        }
    }

    /// Records a flight, which begins where the tape ends: in each cell at a random point.
    fn fly(&mut self, flight: &Flight, meter: &FluenceMeter, first: usize) {
        let (arc, medium) = (&flight.span.arc, flight.span.medium);
        let mut cuts = std::mem::take(&mut self.notes.cuts);
        meter.pieces_of(flight, &mut cuts, |bin, piece| {
            let cell = first + bin * meter.values();
            let mut cells = cell..cell + meter.values_at_once();
            if cells.all(|c| self.wanted.of_cell(c).is_none()) {
                return;
            }
            let (theta, path) = piece.power(flight, &mut self.sampler);
            let optical_length = || flight.optical_length + arc.optical_length(theta);
            self.leave(&Track {
                cell,
                modulated: meter
                    .frequency_domain
                    .as_ref()
                    .map(|domain| (domain, optical_length())),
                beyond: Some((arc, theta)),
                medium,
                x: arc.position(theta),
                path,
                absorption: flight.absorption_at(theta),
            });
        });
        self.notes.cuts = cuts;
    }

    /// Records a collision at the end of the tape.
    fn collide(&mut self, collision: &Collision, meter: &FluenceMeter, first: usize) {
        if let Some(bin) = meter.bin_of(collision) {
            self.leave(&Track {
                cell: first + bin * meter.values(),
                modulated: meter
                    .frequency_domain
                    .as_ref()
                    .map(|domain| (domain, collision.optical_length)),
                beyond: None,
                medium: collision.point.medium,
                x: collision.point.x,
                path: collision.path,
                absorption: collision.absorption(),
            });
        }
    }

    /// Records the scores of a track: its length, and the power absorbed along it.
    fn leave(&mut self, track: &Track) {
        let [fluence, absorbed] = [0, 1].map(|k| self.wanted.of_cell(track.cell + k));
        if let Some((row, weights)) = fluence {
            self.contribute(row, track.path * weights, track);
        }
        if let Some((domain, optical_length)) = track.modulated {
            for (cell, factor) in (track.cell + 2..).zip(domain.factors(optical_length)) {
                if let Some((row, weights)) = self.wanted.of_cell(cell) {
                    self.contribute(row, track.path * weights * factor, track);
                }
            }
        }
        if let Some((row, weights)) = absorbed {
            let per_absorption = track.path * weights;
            self.contribute(row, per_absorption * track.absorption, track);
            self.notes.absorbed.push(Absorbed {
                row,
                medium: track.medium,
                x: track.x,
                per_absorption,
            });
        }
    }

    fn contribute(&mut self, row: usize, value: Spectrum, track: &Track) {
        if value.is_zero() {
            return;
        }
        if let Some((arc, theta)) = track.beyond {
            // Planted error "fluence that flights leave before they attenuate in derivatives", found by morgana-transport/transport::meters::derivatives::derivatives_in_a_beam_have_closed_forms:
            // let _ = (arc, theta);
            self.notes.tape.branch_fly(track.medium, arc, theta);
        }
        self.notes.contribute(row, value);
    }

    /// Records the surface where a flight ends, if it ends at one. Light that arrives at an opaque
    /// surface is measured before the surface's factor. Light that passes another surface is
    /// measured after it.
    fn surface(&mut self, flight: &Flight, after: Option<Beyond>, note: impl FnOnce(&mut Tape)) {
        let passing = passing(flight, after);
        let is_opaque = |p: &Passing| p.scene.objects()[p.object].bsdf.is_opaque();
        let (arriving, passed) = match passing {
            // Planted error "light that passed an interface measured before its colour in derivatives", found by morgana-transport/transport::meters::colour_derivatives:::
            // Some(passing) => (Some(passing), None),
            Some(passing) if is_opaque(&passing) => (Some(passing), None),
            passing => (None, passing),
        };
        arriving.inspect(|passing| self.pass(passing));
        note(&mut self.notes.tape);
        passed.inspect(|passing| self.pass(passing));
    }

    /// Records the scores of light that passes a surface.
    fn pass(&mut self, passing: &Passing) {
        let mut first = 0;
        for meter in self.meters {
            if let Meter::Irradiance(meter) = meter {
                meter.all_scores(passing, |cell, power| {
                    if let Some((row, weights)) = self.wanted.of_cell(first + cell) {
                        let value = power * weights;
                        self.notes.contribute(row, value);
                    }
                });
            }
            first += meter.cells();
        }
    }
}

/// Records a turn at the vertex where an edge ends, if the particle continues from there.
fn turn(tape: &mut Tape, event: &WalkEvent) {
    if let (Some(vertex), Some(ray)) = (event.vertex, event.onward) {
        tape.turn_light(vertex, ray.start.direction, ray.specular);
    }
}

impl Setup<'_> {
    /// Adds the derivatives of functionals of readings to `sums`: sums over the particles with
    /// numbers in a range.
    pub(crate) fn differentiate(
        &self,
        seed: u64,
        particles: Range<u64>,
        wanted: &Functionals,
        sums: &mut Sums,
        ws: &mut Workspace,
    ) {
        let mut notes = Notes::default();
        for number in particles {
            if ws.stop.is_raised() {
                return;
            }
            ws.stats.paths += 1;
            let mut sampler = Sampler::new(seed, 0, number);
            let Some((emitted, ray)) = self.emit(number, &mut sampler) else {
                continue;
            };
            notes.tape.begin(&emitted);
            let mut recorder = TapeRecorder {
                meters: self.meters,
                wanted,
                notes: &mut notes,
                sampler: Sampler::new(seed, 1, number),
            };
            self.walk(number, ray, &mut recorder, &mut sampler, ws);
            notes.add_to(sums, &mut ws.stats.not_finite);
        }
    }
}

impl Meter {
    /// Returns the names of the readings with their axes, without the channel axis.
    pub fn readings(&self) -> Vec<(&'static str, Vec<ReadingAxis>)> {
        let quantities = self.quantities().into_iter();
        let named = |quantity: Quantity| (quantity.name, quantity.axes);
        quantities.map(named).collect()
    }
}
