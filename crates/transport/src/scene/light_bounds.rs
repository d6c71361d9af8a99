//! Estimates of the light of an emitter at a receiver (docs/theory.md#choice-of-emitter).

use super::parts::Object;
use crate::connection_end::ConnectionEnd;
use crate::emitter::{Emitter, Surroundings};
use crate::phase::Phase;
use crate::shape::Shape;
use glam::DVec3;
use std::f64::consts::PI;

/// Smallest distance in estimates, relative to the radius of the scene.
const MIN_RELATIVE_DISTANCE: f64 = 1e-6;

/// A receiver of light, with the data that estimates need.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Receiver<'a> {
    /// A point of a medium that scatters light towards the previous vertex of the path.
    Volume {
        x: DVec3,
        direction: DVec3,
        phase: &'a Phase,
    },
    /// A point of a surface; the normal is on the side from which the path came.
    Surface {
        x: DVec3,
        normal: DVec3,
        opaque: bool,
    },
    /// A straight line along an edge.
    Segment { from: DVec3, to: DVec3 },
}

impl Receiver<'_> {
    /// Estimates the response to a light of unit intensity at an unknown position in a ball.
    pub(super) fn near(&self, center: DVec3, radius: f64) -> f64 {
        let Receiver::Segment { from, to } = *self else {
            let chord = center - self.position();
            let distance = chord.length().max(radius);
            return self.response(chord / distance, radius / distance) / (distance * distance);
        };
        // Compute ∫ ds/r² along the segment.
        let length = from.distance(to);
        let along = (center - from).dot((to - from) / length);
        let off = (center - from).length_squared() - along * along;
        let off = off.max(0.0).sqrt().max(radius);
        (((length - along) / off).atan() + (along / off).atan()) / off
    }

    /// Returns approximately the scattering function, including the cosine, towards a disc of some
    /// radius at unit distance in a unit direction.
    fn response(&self, direction: DVec3, radius: f64) -> f64 {
        match self {
            Receiver::Volume {
                x,
                direction: arrival,
                phase,
            } => {
                let blur = radius * radius;
                (1.0 - blur) * phase.pdf(*x, [*arrival, direction]) + blur / (4.0 * PI)
            }
            Receiver::Surface { normal, opaque, .. } => {
                let cos = normal.dot(direction);
                let cos = if *opaque { cos } else { cos.abs() };
                (cos + radius).clamp(0.0, 1.0) / PI
            }
            Receiver::Segment { .. } => 1.0,
        }
    }

    fn position(&self) -> DVec3 {
        match self {
            Receiver::Volume { x, .. } | Receiver::Surface { x, .. } => *x,
            Receiver::Segment { from, to } => 0.5 * (*from + *to),
        }
    }
}

/// Data of an emitter that estimates need: position, size, strength and directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightBounds {
    pub center: DVec3,
    pub radius: f64,
    /// Mean intensity, or irradiance of distant light.
    pub strength: f64,
    facing: Facing,
}

/// Directions in which an emitter radiates.
#[derive(Clone, Copy, Debug)]
enum Facing {
    /// Radiation in all directions.
    Everywhere,
    /// Radiation to one side of a flat surface.
    Side(DVec3),
    /// Radiation given by the emitter's intensity.
    Point,
    /// Radiation along a beam.
    Beam(DVec3),
    /// Radiation from infinity, along a direction or from all directions.
    Afar(Option<DVec3>),
}

impl LightBounds {
    pub(super) fn new(emitter: &Emitter, around: &Surroundings, objects: &[Object]) -> Self {
        let shape = |object: usize| &objects[object].shape;
        let power = emitter.power(around, shape).sum();
        let closest = MIN_RELATIVE_DISTANCE * around.radius;
        let bounds = |center, radius: f64, strength, facing| LightBounds {
            center,
            radius: radius.max(closest),
            strength,
            facing,
        };
        let disc = PI * around.radius * around.radius;
        match emitter {
            Emitter::Area { object, .. } => surface(shape(*object), power, bounds),
            Emitter::Textured(area) => surface(shape(area.object()), power, bounds),
            Emitter::Directional { direction, .. } => bounds(
                around.center,
                around.radius,
                power / disc,
                Facing::Afar(Some(*direction)),
            ),
            Emitter::Environment(_) => bounds(
                around.center,
                around.radius,
                power / disc,
                Facing::Afar(None),
            ),
            Emitter::Collimated(beam) => {
                let facing = Facing::Beam(beam.direction());
                bounds(beam.origin(), beam.radius(), power / PI, facing)
            }
            Emitter::Fiber(fiber) => {
                let aperture = fiber.aperture();
                let radius = aperture.radius();
                bounds(aperture.origin(), radius, power / (4.0 * PI), Facing::Point)
            }
            Emitter::Volume(volume) => {
                let all = volume.aabb();
                let radius = 0.5 * all.diagonal();
                bounds(all.center(), radius, power / (4.0 * PI), Facing::Everywhere)
            }
            point => {
                let position = point.singularity().unwrap_or(around.center);
                let facing = point.axis().map_or(Facing::Everywhere, |_| Facing::Point);
                bounds(position, 0.0, power / (4.0 * PI), facing)
            }
        }
    }

    /// Estimates the light of an emitter at a receiver.
    pub(super) fn guess(&self, emitter: &Emitter, receiver: &Receiver) -> f64 {
        let (center, radius) = (self.center, self.radius);
        let near = || receiver.near(center, radius);
        match self.facing {
            Facing::Everywhere => self.strength * near(),
            Facing::Side(normal) => {
                let chord = receiver.position() - center;
                let cos = (normal.dot(chord) + radius) / chord.length().max(radius);
                self.strength * near() * cos.clamp(0.0, 1.0)
            }
            Facing::Point => {
                let chord = (receiver.position() - center).normalize_or_zero();
                let strength = match (receiver, emitter) {
                    (Receiver::Segment { .. }, _) => self.strength,
                    (_, Emitter::Fiber(fiber)) => fiber.intensity_roughly(chord),
                    _ => emitter
                        .emitted(&ConnectionEnd::at(center), center, chord)
                        .sum(),
                };
                strength * near()
            }
            Facing::Beam(direction) => {
                // Let beams fade gradually to the sides, because they may bend.
                let chord = receiver.position() - center;
                let off = chord.reject_from_normalized(direction).length_squared();
                self.strength * receiver.response(-direction, 0.0) / (off + radius * radius)
            }
            Facing::Afar(Some(direction)) => self.strength * receiver.response(-direction, 0.0),
            Facing::Afar(None) => self.strength * receiver.response(DVec3::Z, 1.0),
        }
    }

    pub(crate) fn is_near(&self) -> bool {
        !matches!(self.facing, Facing::Beam(_) | Facing::Afar(_))
    }
}

/// Returns the bounds of a light of some power on a shape.
fn surface(
    shape: &Shape,
    power: f64,
    bounds: impl FnOnce(DVec3, f64, f64, Facing) -> LightBounds,
) -> LightBounds {
    let (center, radius) = (shape.aabb().center(), 0.5 * shape.diameter());
    if shape.is_flat() {
        let normal = shape.sample_area([0.5; 2]).normal;
        bounds(center, radius, power / PI, Facing::Side(normal))
    } else {
        bounds(center, radius, power / (4.0 * PI), Facing::Everywhere)
    }
}
