//! Shows the meters what happens on a particle's walk (docs/theory.md#meters, docs/theory.md#random-walks).

use super::Meter;
use super::flight::{Collision, Flight, Passing, flights};
use super::fluence::{Cuts, Slots};
use super::tally::Scores;
use crate::Spectrum;
use crate::path::{End, Observer, WalkEvent, Workspace};
use crate::sampling::Sampler;
use glam::DVec3;
use std::ops::ControlFlow;

/// Shows the meters the flights, collisions and crossings of a particle. Meters draw from random numbers of their own.
pub(super) struct Recorder<'r> {
    pub meters: &'r [Meter],
    pub channels: usize,
    pub scores: &'r mut Scores,
    pub cuts: &'r mut Cuts,
    pub sampler: Sampler,
}

impl Observer for Recorder<'_> {
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

impl Recorder<'_> {
    /// Scores the flights along an edge, and the crossings of smooth surfaces between them. Returns the last flight.
    fn fly_along<'e>(&mut self, event: &'e WalkEvent) -> Option<Flight<'e>> {
        let mut last = None;
        for (i, flight) in flights(event).enumerate() {
            self.fly(&flight);
            if let Some(next) = event.edge.spans.get(i + 1) {
                let direction = next.arc.velocity(0.0).normalize();
                self.surface(&flight, Some((direction, flight.power_after(next))));
            }
            last = Some(flight);
        }
        last
    }

    /// Scores the end of an edge, to which the last flight leads.
    fn end(&mut self, event: &WalkEvent, last: &Flight) {
        let onward = event.onward;
        match event.edge.end {
            End::Collision(point) => self.collide(&Collision {
                scene: event.scene,
                point,
                path: event.path(&point),
                optical_length: last.length_after(),
            }),
            End::Surface { .. } => {
                self.surface(
                    last,
                    onward.map(|ray| (ray.start.direction, ray.throughput)),
                );
            }
            End::Dead if !event.edge.lost => self.surface(last, None),
            End::Dead | End::Escaped { .. } => {}
        }
    }

    /// Shows the meters the surface at the end of a flight, if there is one, and the direction and power of the light after it.
    fn surface(&mut self, flight: &Flight, after: Option<(DVec3, Spectrum)>) {
        let Some((object, meeting)) = flight.span.surface else {
            return;
        };
        let hit = flight.scene.hit(object, &meeting);
        let opaque = flight.scene.objects()[object].bsdf.is_opaque();
        let arrival = flight.span.arc.velocity(flight.theta_end).normalize();
        let seen = if opaque {
            Some((arrival, flight.power_at(flight.theta_end)))
        } else {
            after
        };
        let Some((direction, power)) = seen else {
            return;
        };
        let side = |d: DVec3| hit.normal.dot(d) > 0.0;
        if opaque || side(direction) == side(arrival) {
            self.pass(&Passing {
                object,
                hit,
                direction,
                power,
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
        self.each(|meter, slots, _, _| match meter {
            Meter::Irradiance(meter) if meter.object == passing.object => {
                meter.pass(passing, slots);
            }
            _ => {}
        });
    }
}
