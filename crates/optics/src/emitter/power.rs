//! Power of emitters.

use super::{Emitter, Surroundings, each_spot};
use crate::Spectrum;
use crate::shape::Shape;
use std::f64::consts::PI;

impl Emitter {
    /// Returns the total power: the mean weight of [`Emitter::emit`]. For light from infinity, it
    /// is the power that enters a disc as wide as the surroundings, from every direction.
    pub fn power<'a>(&self, around: &Surroundings, shape: impl Fn(usize) -> &'a Shape) -> Spectrum {
        let disc = PI * around.radius * around.radius;
        each_spot!(self, e => e.power(), {
            Emitter::Point { intensity, .. } => *intensity * (4.0 * PI),
            Emitter::PointOnFace(point) => point.power(),
            Emitter::Area { object, radiance } => *radiance * (PI * shape(*object).area()),
            Emitter::Textured(area) => area.power(),
            Emitter::Directional { irradiance, .. } => *irradiance * disc,
            Emitter::Environment(environment) => environment.integral() * disc,
            Emitter::Collimated(beam) => beam.power(),
            Emitter::Fiber(fiber) => fiber.power(),
            Emitter::Volume(volume) => volume.power(),
        })
    }

    /// Returns the standard error of [`Emitter::power`]; zero if the power is exact.
    pub fn power_error(&self) -> Spectrum {
        match self {
            Emitter::Volume(volume) => volume.power_error(),
            _ => Spectrum::ZERO,
        }
    }
}
