//! Record of a path for the backward sweep. It takes eight bytes per step, and some hundred bytes
//! per flight.

use super::arrival::Arrival;
use super::fresnel::FresnelShare;
use crate::Spectrum;
use crate::scene::MediumId;
use eikonal::adjoint::{Flight, FlightCrossing, FlightPoint};
use glam::DVec3;
use std::ops::Range;

/// Path from the sensor to an emitter. One object can record several paths in turn, in the same
/// memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct AttachedPath {
    pub(super) flight: Flight,
    /// Spans of the steps of all segments.
    pub(super) spans: Vec<f64>,
    pub(super) segments: Vec<Segment>,
    /// Start of the path.
    pub(super) origin: DVec3,
    /// Light at the end of the path; `None` if the path did not reach an emitter.
    pub(super) found: Option<Found>,
}

/// Light at the end of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub arrival: Arrival,
    /// Throughput up to the light, for basic radiance; it includes the factor n² of the sensor.
    pub throughput: Spectrum,
    /// Radiance that arrives at the sensor.
    pub value: Spectrum,
    /// Number of edges and specular events.
    pub depth: u32,
}

/// Flight through one medium.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub medium: MediumId,
    /// Range of the flight's steps in `spans`.
    pub spans: Range<usize>,
    /// Unit direction in which the flight starts at a point. `None` behind a boundary and after a
    /// null collision, where the flight starts with a velocity.
    pub direction: Option<DVec3>,
    pub sampled: SampledChannel,
    pub end: SegmentEnd,
}

/// Channel in which a segment's end was sampled.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampledChannel {
    pub channel: usize,
    /// Probability of each channel, given the end of the segment.
    pub posterior: Spectrum,
}

impl SampledChannel {
    /// First channel, where all channels are equal.
    pub(super) const GREY: Self = SampledChannel {
        channel: 0,
        posterior: Spectrum([1.0, 0.0, 0.0, 0.0]),
    };
}

/// End of a segment.
#[derive(Clone, Debug)]
pub(super) enum SegmentEnd {
    /// Collision, real or null.
    Scattered(Scattering),
    /// A boundary.
    Crossed(Box<Crossed>),
    /// Light.
    Arrived(FlightPoint),
}

/// Collision on a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattering {
    pub vertex: FlightPoint,
    /// Index of the segment's step that contains the collision; `span` is the span from the step's
    /// start.
    pub step: usize,
    pub span: f64,
    /// Unit direction after a real collision; `None` after a null collision.
    pub onward: Option<DVec3>,
    /// Boundary on which the segment would have ended; `None` if it is too far to matter.
    pub boundary: Option<Beyond>,
}

/// Boundary beyond a collision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beyond {
    pub end: FlightPoint,
    pub normal: DVec3,
    /// Derivative of the length up to the collision by the length up to the boundary, at a fixed
    /// random number.
    pub length: f64,
    /// Derivative, by the length up to the boundary, of the logarithm of the probability to collide
    /// before it.
    pub log: f64,
}

/// Boundary between two segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossed {
    pub end: FlightPoint,
    pub crossing: FlightCrossing,
    /// Medium behind the boundary.
    pub far: MediumId,
    /// Fraction of the light that is followed, if it is divided between reflection and refraction.
    pub share: Option<FresnelShare>,
}

impl AttachedPath {
    /// Returns the contribution of the path, and the number of its edges and specular events.
    pub(crate) fn found(&self) -> Option<(Spectrum, u32)> {
        self.found.as_ref().map(|found| (found.value, found.depth))
    }

    /// Clears the path.
    pub(super) fn clear(&mut self) {
        self.spans.clear();
        self.segments.clear();
        self.found = None;
    }

    /// Appends the steps of the last flight. Returns their range.
    pub(super) fn keep(&mut self) -> Range<usize> {
        let first = self.spans.len();
        self.spans.extend_from_slice(self.flight.spans());
        first..self.spans.len()
    }
}
