//! Emitters.
//!
//! An emitter answers three questions: where a connection should aim (with what density), how much
//! light leaves it there, and which rays a light subpath should start with ([`Emission`]).
//! Radiometric factors that depend on the way between, and the division by n² that turns radiance
//! into basic radiance, belong to `path`.

mod collimated;
mod emission;
mod environment;
mod luminaire;
mod power;
mod projector;
mod spot;
mod surroundings;

pub use crate::aim::{Aim, Aimed};
pub use collimated::{Collimated, Profile};
pub use emission::Emission;
pub use environment::{Environment, ImageError};
pub use luminaire::{Luminaire, LuminaireError};
pub use projector::Projector;
pub use spot::Spot;
pub use surroundings::Surroundings;

use crate::Spectrum;
use crate::shape::Shape;
use glam::DVec3;
use std::sync::Arc;

/// A source of light.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// Radiates the same intensity (W/sr) in all directions from a point.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity.
        intensity: Spectrum,
    },
    /// A point that radiates into a cone.
    Spot(Spot),
    /// A point that throws an image.
    Projector(Arc<Projector>),
    /// A point that radiates as measured on a lamp.
    Luminaire(Arc<Luminaire>),
    /// Radiates from the side of a shape to which its normals point, the same radiance in all
    /// directions.
    Area {
        /// Index of the object that it covers.
        object: usize,
        /// Radiance.
        radiance: Spectrum,
    },
    /// Parallel light from infinity.
    Directional {
        /// Unit direction in which the light travels.
        direction: DVec3,
        /// Irradiance on a surface across the direction, in the ambient medium.
        irradiance: Spectrum,
    },
    /// Light from all around.
    Environment(Environment),
    /// A beam of parallel rays.
    Collimated(Collimated),
}

impl Emitter {
    /// Chooses where to aim; `shape` gives the shape of an object, `u` is uniform in [0, 1)².
    pub fn aim<'a>(
        &self,
        around: &Surroundings,
        shape: impl Fn(usize) -> &'a Shape,
        u: [f64; 2],
    ) -> Aimed {
        match self {
            Emitter::Point { position, .. } => Aimed::only(Aim::at(*position)),
            Emitter::Spot(spot) => Aimed::only(Aim::at(spot.position())),
            Emitter::Projector(projector) => Aimed::only(Aim::at(projector.position())),
            Emitter::Luminaire(lamp) => Aimed::only(Aim::at(lamp.position())),
            Emitter::Directional { direction, .. } => {
                Aimed::only(Aim::parallel(around.before(*direction), *direction))
            }
            Emitter::Collimated(beam) => Aimed::only(Aim::Plane {
                through: beam.origin(),
                direction: beam.direction(),
                beam: true,
            }),
            Emitter::Environment(environment) => {
                let (toward, pdf) = environment.sample(u);
                Aimed {
                    aim: Aim::parallel(around.before(-toward), -toward),
                    pdf,
                    delta: false,
                }
            }
            Emitter::Area { object, .. } => {
                let sample = shape(*object).sample_area(u);
                Aimed {
                    aim: Aim::Point {
                        position: sample.position,
                        surface: Some((*object, sample.normal)),
                    },
                    pdf: sample.pdf,
                    delta: false,
                }
            }
        }
    }

    /// What leaves `start` in the unit `direction`: intensity (points of any kind), radiance times cosine
    /// (area), radiance (environment) or irradiance across the direction (directional, beam).
    pub fn emitted(&self, aim: &Aim, start: DVec3, direction: DVec3) -> Spectrum {
        match self {
            Emitter::Point { intensity, .. } => *intensity,
            Emitter::Spot(spot) => spot.intensity(direction),
            Emitter::Projector(projector) => projector.intensity(direction),
            Emitter::Luminaire(lamp) => lamp.intensity(direction),
            Emitter::Directional { irradiance, .. } => *irradiance,
            Emitter::Collimated(beam) => beam.irradiance(start),
            Emitter::Environment(environment) => environment.radiance(-direction),
            Emitter::Area { radiance, .. } => match aim {
                Aim::Point {
                    surface: Some((_, normal)),
                    ..
                } => *radiance * normal.dot(direction).max(0.0),
                _ => Spectrum::ZERO,
            },
        }
    }

    /// The point from which a point-like emitter radiates: distances are sampled around it, since
    /// its light falls off as 1/r².
    pub fn singularity(&self) -> Option<DVec3> {
        match self {
            Emitter::Point { position, .. } => Some(*position),
            Emitter::Spot(spot) => Some(spot.position()),
            Emitter::Projector(projector) => Some(projector.position()),
            Emitter::Luminaire(lamp) => Some(lamp.position()),
            _ => None,
        }
    }

    /// The emitter's kind, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Emitter::Point { .. } => "point",
            Emitter::Spot(_) => "spot",
            Emitter::Projector(_) => "projector",
            Emitter::Luminaire(_) => "ies",
            Emitter::Area { .. } => "area",
            Emitter::Directional { .. } => "directional",
            Emitter::Environment(e) => e.kind(),
            Emitter::Collimated(_) => "collimated",
        }
    }

    /// Whether paths scattered at random cannot find it.
    pub fn is_delta(&self) -> bool {
        !matches!(self, Emitter::Area { .. } | Emitter::Environment(_))
    }
}
