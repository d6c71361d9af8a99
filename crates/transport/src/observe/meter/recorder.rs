//! Passes the events of a particle's walk to the meters (docs/theory.md#meters,
//! docs/theory.md#random-walks).

use super::dwell::Dwell;
use super::flight::{Collision, Flight, FreeFlightLeg, Passing, flights, free_legs};
use super::fluence::{Cuts, Scoring, Slots};
use super::history::Histories;
use super::polarization::ParticleStokes;
use super::records::{Detected, RecordRows};
use super::tagging::Tagging;
use super::tally::Scores;
use super::voxel_scores::{VoxelScore, detail_in};
use super::{FluenceMeter, Meter};
use crate::Spectrum;
use crate::path::{
    CellDetail, CellRun, End, FreeFlightEvent, FreeLeg, Observer, Span, WalkEvent, WalkRay,
    Workspace,
};
use crate::sampling::Sampler;
use crate::scene::{CellVolume, MediumId};
use glam::DVec3;
use std::ops::ControlFlow;

/// Passes the flights, collisions and crossings of a particle to the meters. Meters have their own
/// random numbers.
pub(super) struct Recorder<'r, 'm> {
    pub meters: &'r [Meter],
    pub channels: usize,
    pub scores: &'r mut Scores,
    pub cuts: &'r mut Cuts,
    /// Scores of each fluence meter in the last voxel of a walk through voxels.
    pub in_voxels: &'r mut [VoxelScore<'m>],
    /// Tagged fluence in the last cell, for each meter.
    pub dwells: &'r mut [Option<Dwell>],
    pub sampler: Sampler,
    /// Number of the particle.
    pub particle: u64,
    /// Histories of the particle and its copies, if a meter keeps records.
    pub histories: Option<&'r mut Histories>,
    /// Effect of sound on the particle's phase, if a meter measures it.
    pub tagging: Option<&'r mut Tagging>,
    /// Polarisation, if a meter measures it.
    pub stokes: Option<&'r mut ParticleStokes<'m>>,
    /// Records of each meter.
    pub records: &'r mut [RecordRows],
}

impl Observer for Recorder<'_, '_> {
    const ALONG_SPANS: bool = true;

    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        self.resume(event.ray);
        if let Some(last) = self.fly_along(event) {
            self.end(event, &last);
        }
        ControlFlow::Continue(())
    }

    fn sees_free_flights(&self) -> bool {
        self.histories.is_none() && self.stokes.is_none()
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        if let Some(tagging) = &mut self.tagging {
            tagging.resume();
        }
        for free in free_legs(event) {
            if let Some(tagging) = &mut self.tagging {
                let leg = free.leg;
                tagging.follow(event.ray.start.medium, &leg.arc, leg.theta_end);
            }
            self.each_fluence(|meter, scoring| meter.fly_freely(&free, scoring));
        }
        self.each_fluence(|meter, scoring| meter.collide_freely(event, scoring));
        if let Some(tagging) = &mut self.tagging {
            tagging.scatter(event.direction);
        }
    }

    fn detail_in(&self, volume: &CellVolume) -> CellDetail {
        if self.tagging.is_some() || self.stokes.is_some() {
            return CellDetail::Edges;
        }
        detail_in(self.meters, volume)
    }

    #[inline]
    fn fly_in_cells(&mut self, run: &CellRun) {
        match run.cell {
            Some(voxel) => {
                for score in &mut *self.in_voxels {
                    score.fly(voxel, run, self.scores);
                }
            }
            None => self.run_through_cells(run),
        }
    }

    fn continue_walk(&mut self, copies: usize) {
        if let Some(histories) = &mut self.histories {
            histories.continue_walk(copies);
        }
        if let Some(tagging) = &mut self.tagging {
            tagging.continue_walk(copies);
        }
        if let Some(stokes) = &mut self.stokes {
            stokes.continue_walk(copies);
        }
    }

    // Planted error "copies of particles that take on the way of those that were cut" (2 lines), found by morgana-transport/transport::meters::records::copies_keep_their_own_ways_where_paths_are_cut:
    // fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        self.resume(event.ray);
        self.fly_along(event);
    }
}

impl Recorder<'_, '_> {
    /// Scores a run through cells that are not those of a meter.
    fn run_through_cells(&mut self, run: &CellRun) {
        let free = FreeFlightLeg {
            power: run.power,
            optical_length: run.optical_length,
            leg: &FreeLeg::straight([run.start(), run.direction()], run.length, run.matter),
        };
        self.each_fluence(|meter, scoring| meter.fly_freely(&free, scoring));
    }

    /// Continues with the last stored copy of the particle, along its next edge.
    fn resume(&mut self, ray: &WalkRay) {
        if let Some(histories) = &mut self.histories {
            histories.resume();
        }
        if let Some(tagging) = &mut self.tagging {
            tagging.resume();
        }
        if let Some(stokes) = &mut self.stokes {
            stokes.resume(ray.start.direction);
        }
    }

    /// Scores the flights along an edge, and the crossings of smooth surfaces between them. Returns
    /// the last flight.
    fn fly_along<'e>(&mut self, event: &'e WalkEvent) -> Option<Flight<'e>> {
        let mut last = None;
        for (i, flight) in flights(event).enumerate() {
            self.fly(&flight);
            if let Some(next) = event.edge.spans.get(i + 1) {
                if let Some(stokes) = &mut self.stokes {
                    stokes.pass(flight.span, next);
                }
                self.surface(&flight, Some(Beyond::along(&flight, next)));
            }
            last = Some(flight);
        }
        last
    }

    /// Scores the end of an edge; `last` is the flight that leads to it.
    fn end(&mut self, event: &WalkEvent, last: &Flight) {
        let onward = event.onward;
        if let (Some(stokes), Some(vertex), Some(ray)) = (&mut self.stokes, event.vertex, onward) {
            // Planted error "polarisation of particles that scattering leaves as it is", found by morgana-transport/transport::polarization::meters::records_of_scattered_light_are_polarised_as_pixels_are:
            // let _ = (stokes, vertex, ray);
            stokes.turn(vertex, ray.start.direction, ray.specular);
        }
        match event.edge.end {
            End::Collision(point) => {
                if let (Some(histories), Some(ray)) = (&mut self.histories, onward) {
                    histories.scatter(event.scene, &point, ray.start.direction);
                }
                self.collide(&Collision {
                    scene: event.scene,
                    point,
                    path: event.path(&point),
                    optical_length: last.length_after(),
                });
                if let (Some(tagging), Some(ray)) = (&mut self.tagging, onward) {
                    tagging.scatter(ray.start.direction);
                }
            }
            End::Surface { .. } => self.surface(last, onward.map(Beyond::reflected)),
            End::Dead if !event.edge.lost => self.surface(last, None),
            End::Dead | End::Escaped { .. } => {}
        }
    }

    /// Passes the surface at the end of a flight, if there is one, to the meters; `after` is the
    /// light beyond it.
    fn surface(&mut self, flight: &Flight, after: Option<Beyond>) {
        if let Some(passing) = passing(flight, after) {
            self.pass(&passing);
        }
    }

    /// Scores the remaining power in the last voxel, and in the last cells.
    pub(super) fn end_particle(&mut self) {
        for score in &mut *self.in_voxels {
            score.end(self.scores);
        }
        self.each_fluence(|meter, scoring| meter.end_dwell(scoring));
    }

    /// Visits each fluence meter, with the destination of its scores.
    #[inline]
    fn each_fluence(&mut self, mut see: impl FnMut(&FluenceMeter, &mut Scoring)) {
        let mut first = 0;
        for (meter, dwell) in self.meters.iter().zip(&mut *self.dwells) {
            if let Meter::Fluence(meter) = meter {
                let slots = Slots {
                    scores: self.scores,
                    first,
                    channels: self.channels,
                };
                let mut scoring = Scoring {
                    slots,
                    cuts: self.cuts,
                    sampler: &mut self.sampler,
                    tagging: self.tagging.as_deref(),
                    dwell,
                };
                see(meter, &mut scoring);
            }
            first += meter.cells() * self.channels;
        }
    }

    fn fly(&mut self, flight: &Flight) {
        if let Some(histories) = &mut self.histories {
            histories.fly(flight);
        }
        if let Some(tagging) = &mut self.tagging {
            tagging.fly(flight);
        }
        if let Some(stokes) = &mut self.stokes {
            stokes.fly(&flight.span.arc, flight.theta_end);
        }
        self.each_fluence(|meter, scoring| meter.fly(flight, scoring));
    }

    fn collide(&mut self, collision: &Collision) {
        self.each_fluence(|meter, scoring| meter.collide(collision, scoring));
    }

    fn pass(&mut self, passing: &Passing) {
        let mut slots = Slots {
            scores: self.scores,
            first: 0,
            channels: self.channels,
        };
        let accepts = |meter: &Meter| match meter {
            Meter::Irradiance(meter) => meter.accepting(passing).is_some(),
            Meter::Fluence(_) => false,
        };
        let tagging = self.tagging.as_mut();
        let tagging = tagging.filter(|_| self.meters.iter().any(accepts));
        let modulation = tagging.map(|tagging| tagging.arrive());
        let total = modulation.map(|modulation| modulation.total());
        for (meter, records) in self.meters.iter().zip(&mut *self.records) {
            if let Meter::Irradiance(meter) = meter
                && let stokes = self.stokes.as_deref().filter(|_| meter.stokes)
                && let stokes = stokes.map(|stokes| passing.stokes(stokes))
                && let Some(side) = meter.pass(passing, total, stokes.as_ref(), &mut slots)
                && meter.most_records.is_some()
                && let Some(histories) = &self.histories
            {
                records.push(&Detected {
                    particle: self.particle,
                    passing,
                    side,
                    history: histories.current(),
                    optical_length_rate: histories.optical_length_rate(),
                    channels: self.channels,
                    modulation: modulation.filter(|_| meter.tagged),
                    stokes,
                });
            }
            slots.first += meter.cells() * self.channels;
        }
    }
}

/// Returns the light that passes the surface at the end of a flight, if there is one, given the
/// light beyond it. For an opaque surface it returns the arriving light.
pub(super) fn passing<'e>(flight: &Flight<'e>, after: Option<Beyond>) -> Option<Passing<'e>> {
    let (object, intersection) = flight.span.surface?;
    let hit = flight.scene.hit(object, &intersection);
    let opaque = flight.scene.objects()[object].bsdf.is_opaque();
    let arrival = flight.span.arc.velocity(flight.theta_end).normalize();
    let beyond = if opaque {
        Beyond {
            direction: arrival,
            power: flight.power_at(flight.theta_end),
            medium: flight.span.medium,
        }
    } else {
        after?
    };
    let side = |d: DVec3| hit.normal.dot(d) > 0.0;
    // Planted error "reflected light counted as light that passes", found by morgana-transport/transport::meters::slabs::a_half_space_with_an_index_of_its_own:
    // (opaque || !side(beyond.direction) || side(beyond.direction)).then(|| Passing {
    (opaque || side(beyond.direction) == side(arrival)).then(|| Passing {
        scene: flight.scene,
        object,
        hit,
        direction: beyond.direction,
        medium: beyond.medium,
        power: beyond.power,
        optical_length: flight.length_after(),
    })
}

/// Light beyond a surface.
pub(super) struct Beyond {
    direction: DVec3,
    power: Spectrum,
    medium: MediumId,
}

impl Beyond {
    /// Returns the light on the next arc of an edge.
    pub(super) fn along(flight: &Flight, next: &Span) -> Self {
        Beyond {
            direction: next.arc.velocity(0.0).normalize(),
            power: flight.power_after(next),
            medium: next.medium,
        }
    }

    /// Returns the light on the ray with which the walk continues.
    pub(super) fn reflected(ray: &WalkRay) -> Self {
        Beyond {
            direction: ray.start.direction,
            power: ray.throughput,
            medium: ray.start.medium,
        }
    }
}
