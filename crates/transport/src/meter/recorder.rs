//! Shows the meters what happens on a particle's walk (docs/theory.md#meters, docs/theory.md#random-walks).

use super::Meter;
use super::flight::{Collision, Flight, Passing, flights};
use super::fluence::{Cuts, Slots};
use super::history::Histories;
use super::records::{Detected, RecordRows};
use super::tally::Scores;
use crate::Spectrum;
use crate::path::{End, FreeFlightEvent, Observer, WalkEvent, Workspace};
use crate::sampling::Sampler;
use crate::scene::MediumId;
use glam::DVec3;
use std::ops::ControlFlow;

/// Shows the meters the flights, collisions and crossings of a particle. Meters draw from random numbers of their own.
pub(super) struct Recorder<'r> {
    pub meters: &'r [Meter],
    pub channels: usize,
    pub scores: &'r mut Scores,
    pub cuts: &'r mut Cuts,
    pub sampler: Sampler,
    /// Number of the particle.
    pub particle: u64,
    /// What has happened to it, if any meter keeps records.
    pub histories: Option<&'r mut Histories>,
    /// Records of each meter.
    pub records: &'r mut [RecordRows],
}

impl Observer for Recorder<'_> {
    const ALONG_SPANS: bool = true;

    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        if let Some(histories) = &mut self.histories {
            histories.resume();
        }
        if let Some(last) = self.fly_along(event) {
            self.end(event, &last);
        }
        ControlFlow::Continue(())
    }

    fn sees_free_flights(&self) -> bool {
        self.histories.is_none()
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        self.each(|meter, slots, cuts, _| {
            if let Meter::Fluence(meter) = meter {
                meter.fly_freely(event, slots, cuts);
            }
        });
    }

    fn go_on(&mut self, copies: usize) {
        if let Some(histories) = &mut self.histories {
            histories.go_on(copies);
        }
    }

    fn cut(&mut self, event: &WalkEvent, _ws: &mut Workspace) {
        self.fly_along(event);
    }
}

impl Recorder<'_> {
    /// Scores the flights along an edge, and the crossings of smooth surfaces between them. Returns the last flight.
    fn fly_along<'e>(&mut self, event: &'e WalkEvent) -> Option<Flight<'e>> {
        let mut last = None;
        for (i, flight) in flights(event).enumerate() {
            self.fly(&flight);
            if let Some(next) = event.edge.spans.get(i + 1) {
                self.surface(
                    &flight,
                    Some(Beyond {
                        direction: next.arc.velocity(0.0).normalize(),
                        power: flight.power_after(next),
                        medium: next.medium,
                    }),
                );
            }
            last = Some(flight);
        }
        last
    }

    /// Scores the end of an edge, to which the last flight leads.
    fn end(&mut self, event: &WalkEvent, last: &Flight) {
        let onward = event.onward;
        match event.edge.end {
            End::Collision(point) => {
                if let (Some(histories), Some(ray)) = (&mut self.histories, onward) {
                    histories.scatter(&point, ray.start.direction);
                }
                self.collide(&Collision {
                    scene: event.scene,
                    point,
                    path: event.path(&point),
                    optical_length: last.length_after(),
                });
            }
            End::Surface { .. } => self.surface(
                last,
                onward.map(|ray| Beyond {
                    direction: ray.start.direction,
                    power: ray.throughput,
                    medium: ray.start.medium,
                }),
            ),
            End::Dead if !event.edge.lost => self.surface(last, None),
            End::Dead | End::Escaped { .. } => {}
        }
    }

    /// Shows the meters the surface at the end of a flight, if there is one, and the light beyond it.
    fn surface(&mut self, flight: &Flight, after: Option<Beyond>) {
        let Some((object, meeting)) = flight.span.surface else {
            return;
        };
        let hit = flight.scene.hit(object, &meeting);
        let opaque = flight.scene.objects()[object].bsdf.is_opaque();
        let arrival = flight.span.arc.velocity(flight.theta_end).normalize();
        let seen = if opaque {
            Some(Beyond {
                direction: arrival,
                power: flight.power_at(flight.theta_end),
                medium: flight.span.medium,
            })
        } else {
            after
        };
        let Some(beyond) = seen else {
            return;
        };
        let side = |d: DVec3| hit.normal.dot(d) > 0.0;
        if opaque || side(beyond.direction) == side(arrival) {
            self.pass(&Passing {
                scene: flight.scene,
                object,
                hit,
                direction: beyond.direction,
                medium: beyond.medium,
                power: beyond.power,
                optical_length: flight.length_after(),
            });
        }
    }

    /// Each meter with its slots.
    fn each(&mut self, mut see: impl FnMut(&Meter, &mut Slots, &mut Cuts, &mut Sampler)) {
        let mut slots = Slots {
            scores: self.scores,
            first: 0,
            channels: self.channels,
        };
        for meter in self.meters {
            see(meter, &mut slots, self.cuts, &mut self.sampler);
            slots.first += meter.cells() * self.channels;
        }
    }

    fn fly(&mut self, flight: &Flight) {
        if let Some(histories) = &mut self.histories {
            histories.fly(flight);
        }
        self.each(|meter, slots, cuts, sampler| {
            if let Meter::Fluence(meter) = meter {
                meter.fly(flight, slots, cuts, sampler);
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
        let mut slots = Slots {
            scores: self.scores,
            first: 0,
            channels: self.channels,
        };
        for (meter, records) in self.meters.iter().zip(&mut *self.records) {
            if let Meter::Irradiance(meter) = meter
                && let Some(side) = meter.pass(passing, &mut slots)
                && meter.most_records.is_some()
                && let Some(histories) = &self.histories
            {
                records.push(&Detected {
                    particle: self.particle,
                    passing,
                    side,
                    history: histories.current(),
                    channels: self.channels,
                });
            }
            slots.first += meter.cells() * self.channels;
        }
    }
}

/// Light beyond a surface.
struct Beyond {
    direction: DVec3,
    power: Spectrum,
    medium: MediumId,
}
