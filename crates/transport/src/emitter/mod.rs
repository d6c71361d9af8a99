//! Emitters.
//!
//! An emitter answers two questions: where a connection should aim (with what density), and how
//! much light leaves it there. Radiometric factors that depend on the way between, and the division
//! by n² that turns radiance into basic radiance, belong to `path`.

mod collimated;
mod environment;
mod spot;

pub use collimated::{Collimated, Profile};
pub use environment::{Environment, ImageError};
pub use spot::Spot;

use crate::Spectrum;
use crate::shape::Shape;
use glam::DVec3;

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
    /// Radiates from the outer side of a shape, the same radiance in all directions.
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

/// Where a connection to an emitter should end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// A point; the edge's geometry term is 1/J.
    Point {
        /// The point.
        position: DVec3,
        /// The object on which it lies, and its normal there.
        surface: Option<(usize, DVec3)>,
    },
    /// Any point of the plane through `through` across `direction`, leaving along `direction`; the
    /// edge's geometry term is 1/A. A beam is guided: the ray from its centre shows where it goes.
    Plane {
        /// A point of the plane.
        through: DVec3,
        /// Unit direction in which the light travels.
        direction: DVec3,
        /// Whether `through` is the centre of a beam.
        beam: bool,
    },
}

/// An aim and its density: per unit area on a surface, per steradian for an environment, 1 if there
/// is no choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aimed {
    /// Where to.
    pub aim: Aim,
    /// With what density.
    pub pdf: f64,
    /// Whether scattered paths cannot find the emitter by chance.
    pub delta: bool,
}

/// What an emitter must know of the scene around it.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// Centre of a ball that contains everything.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

impl Surroundings {
    /// A point outside the ball, from where light that travels in `direction` enters it.
    fn before(&self, direction: DVec3) -> DVec3 {
        self.center - direction * (2.0 * self.radius)
    }
}

impl Emitter {
    /// Chooses where to aim; `shape` gives the shape of an object.
    pub fn aim<'a>(
        &self,
        around: &Surroundings,
        shape: impl Fn(usize) -> &'a Shape,
        u: [f64; 2],
    ) -> Aimed {
        let delta = |aim| Aimed {
            aim,
            pdf: 1.0,
            delta: true,
        };
        let point = |position| Aim::Point {
            position,
            surface: None,
        };
        match self {
            Emitter::Point { position, .. } => delta(point(*position)),
            Emitter::Spot(spot) => delta(point(spot.position())),
            Emitter::Directional { direction, .. } => delta(Aim::Plane {
                through: around.before(*direction),
                direction: *direction,
                beam: false,
            }),
            Emitter::Collimated(beam) => delta(Aim::Plane {
                through: beam.origin(),
                direction: beam.direction(),
                beam: true,
            }),
            Emitter::Environment(environment) => {
                let (toward, pdf) = environment.sample(u);
                Aimed {
                    aim: Aim::Plane {
                        through: around.before(-toward),
                        direction: -toward,
                        beam: false,
                    },
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

    /// What leaves `start` in the unit `direction`: intensity (point, spot), radiance times cosine
    /// (area), radiance (environment) or irradiance across the direction (directional, beam).
    pub fn emitted(&self, aim: &Aim, start: DVec3, direction: DVec3) -> Spectrum {
        match self {
            Emitter::Point { intensity, .. } => *intensity,
            Emitter::Spot(spot) => spot.intensity(direction),
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
            _ => None,
        }
    }

    /// The emitter's kind, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Emitter::Point { .. } => "point",
            Emitter::Spot(_) => "spot",
            Emitter::Area { .. } => "area",
            Emitter::Directional { .. } => "directional",
            Emitter::Environment(e) => e.kind(),
            Emitter::Collimated(_) => "collimated",
        }
    }

    /// Whether paths scattered at random can find it.
    pub fn is_delta(&self) -> bool {
        !matches!(self, Emitter::Area { .. } | Emitter::Environment(_))
    }
}
