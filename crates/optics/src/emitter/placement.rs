//! Positions and axes of emitters, and displaced emitters.

use super::{Aperture, Emitter, each_spot};
use glam::DVec3;

impl Emitter {
    /// Returns the position of an emitter that starts at a place in the scene but on no object.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Emitter::Collimated(beam) => Some(beam.origin()),
            Emitter::Volume(volume) => Some(volume.sample([0.5; 2])),
            _ => self.singularity(),
        }
    }

    /// Returns the point, or the centre of the points, from which a point-like emitter radiates.
    /// Distances are sampled around it, because its light falls off as 1/r².
    pub fn singularity(&self) -> Option<DVec3> {
        each_spot!(self, e => Some(e.position()), {
            Emitter::Point { position, .. } => Some(*position),
            Emitter::PointOnFace(point) => Some(point.position()),
            Emitter::Fiber(fiber) => Some(fiber.origin()),
            _ => None,
        })
    }

    /// Returns the unit direction around which an emitter within the scene radiates from its own
    /// position, if there is one.
    pub fn axis(&self) -> Option<DVec3> {
        each_spot!(self, e => Some(e.axis()), {
            Emitter::Fiber(fiber) => Some(fiber.direction()),
            _ => self.aperture().map(Aperture::direction),
        })
    }

    /// Returns the aperture from which the emitter radiates, if it has one.
    pub fn aperture(&self) -> Option<&Aperture> {
        match self {
            Emitter::Collimated(beam) => Some(beam.aperture()),
            Emitter::Fiber(fiber) => Some(fiber.aperture()),
            _ => None,
        }
    }

    /// Returns the emitter displaced by `shift`. Emitters without an [axis](Emitter::axis) stay in
    /// place.
    pub fn moved(&self, shift: DVec3) -> Emitter {
        each_spot!(self, e => e.moved(shift).into(), {
            Emitter::Collimated(beam) => beam.clone().moved(shift).into(),
            Emitter::Fiber(fiber) => fiber.clone().moved(shift).into(),
            other => other.clone(),
        })
    }
}
