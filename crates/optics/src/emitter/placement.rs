//! Positions and axes of emitters, and displaced emitters.

use super::{Aperture, Emitter};
use glam::DVec3;
use std::sync::Arc;

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
        match self {
            Emitter::Point { position, .. } => Some(*position),
            Emitter::PointOnFace(point) => Some(point.position()),
            Emitter::Spot(spot) => Some(spot.position()),
            Emitter::Projector(projector) => Some(projector.position()),
            Emitter::Luminaire(luminaire) => Some(luminaire.position()),
            Emitter::Fiber(fiber) => Some(fiber.origin()),
            _ => None,
        }
    }

    /// Returns the unit direction around which an emitter within the scene radiates from its own
    /// position, if there is one.
    pub fn axis(&self) -> Option<DVec3> {
        match self {
            Emitter::Spot(spot) => Some(spot.axis()),
            Emitter::Projector(projector) => Some(projector.axis()),
            Emitter::Luminaire(luminaire) => Some(luminaire.axis()),
            _ => self.aperture().map(Aperture::direction),
        }
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
        match self {
            Emitter::Spot(spot) => Emitter::Spot(spot.clone().moved(shift)),
            Emitter::Projector(projector) => {
                Emitter::Projector(Arc::new(projector.as_ref().clone().moved(shift)))
            }
            Emitter::Luminaire(luminaire) => {
                Emitter::Luminaire(Arc::new(luminaire.as_ref().clone().moved(shift)))
            }
            Emitter::Collimated(beam) => Emitter::Collimated(beam.clone().moved(shift)),
            Emitter::Fiber(fiber) => Emitter::Fiber(fiber.clone().moved(shift)),
            other => other.clone(),
        }
    }
}
