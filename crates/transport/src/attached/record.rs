//! What is kept of a path, so that derivatives can go back along it: eight bytes for each step, and some hundreds for each flight.

use super::arrival::Arrival;
use super::fresnel::FresnelShare;
use crate::Spectrum;
use crate::scene::MediumId;
use eikonal::adjoint::{Flight, FlightCrossing, FlightPoint};
use glam::DVec3;
use std::ops::Range;

/// A path from the sensor to where it met light. It can hold one after another in the same memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct AttachedPath {
    pub(super) flight: Flight,
    /// Spans of the steps of all legs.
    pub(super) spans: Vec<f64>,
    pub(super) legs: Vec<Leg>,
    /// Where it starts.
    pub(super) origin: DVec3,
    /// What it brought.
    pub(super) found: Option<Found>,
}

/// Light that a path has met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub arrival: Arrival,
    /// Throughput up to there: basic radiance, n² of the sensor included.
    pub throughput: Spectrum,
    /// What arrives at the sensor.
    pub value: Spectrum,
    /// Edges and specular events.
    pub depth: u32,
}

/// A flight through one medium.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    pub medium: MediumId,
    /// Where its steps are.
    pub spans: Range<usize>,
    /// The unit direction in which it starts at a point; `None` behind a boundary, and where nothing was collided with: it starts with a velocity.
    pub direction: Option<DVec3>,
    pub drawn: Drawn,
    pub end: LegEnd,
}

/// In which channel it was drawn where a leg ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub channel: usize,
    /// The probability with which each of the channels would have been the one, given where the leg ends.
    pub posterior: Spectrum,
}

impl Drawn {
    /// In the first of channels that are all alike.
    pub(super) const GREY: Self = Drawn {
        channel: 0,
        posterior: Spectrum([1.0, 0.0, 0.0, 0.0]),
    };
}

/// What ends a leg.
#[derive(Clone, Debug)]
pub(super) enum LegEnd {
    /// A collision, also with what is missing to the majorant of a medium.
    Scattered(Scattering),
    /// A boundary.
    Crossed(Box<Crossed>),
    /// Light.
    Arrived(FlightPoint),
}

/// A collision on a leg.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattering {
    pub vertex: FlightPoint,
    /// Number of the step of the leg on which it lies, and the span from its start.
    pub step: usize,
    pub span: f64,
    /// Unit direction after it; `None` if nothing was there to collide with.
    pub onward: Option<DVec3>,
    /// The boundary on which the leg would have ended; `None` if that is too far to matter.
    pub boundary: Option<Beyond>,
}

/// The boundary beyond a collision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beyond {
    pub end: FlightPoint,
    pub normal: DVec3,
    /// Derivative of the length up to the collision by that up to the boundary, at the same random number.
    pub length: f64,
    /// That of the logarithm of the probability to collide before.
    pub log: f64,
}

/// A boundary between two legs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossed {
    pub end: FlightPoint,
    pub crossing: FlightCrossing,
    /// The medium beyond.
    pub far: MediumId,
    /// What is followed of the light, if it is shared between reflection and refraction.
    pub share: Option<FresnelShare>,
}

impl AttachedPath {
    /// What it brought, and the number of its edges and specular events.
    pub(crate) fn found(&self) -> Option<(Spectrum, u32)> {
        self.found.as_ref().map(|found| (found.value, found.depth))
    }

    /// Forgets the path.
    pub(super) fn clear(&mut self) {
        self.spans.clear();
        self.legs.clear();
        self.found = None;
    }

    /// Keeps the steps of the flight that was followed last, and says where they are.
    pub(super) fn keep(&mut self) -> Range<usize> {
        let first = self.spans.len();
        self.spans.extend_from_slice(self.flight.spans());
        first..self.spans.len()
    }
}
