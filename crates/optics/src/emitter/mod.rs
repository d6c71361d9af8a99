//! Emitters.
//!
//! An emitter answers three questions: where a connection should aim (with what density), how much
//! light leaves it there, and which rays a light subpath should start with ([`Emission`]).
//! Radiometric factors that depend on the way between, and the division by n² that turns radiance
//! into basic radiance, belong to `path`.

mod aperture;
mod collimated;
mod distant_disc;
mod emission;
mod environment;
mod environment_map;
mod fiber;
mod luminaire;
mod picture;
mod placement;
mod point_on_face;
mod power;
mod projector;
mod slide;
mod spot;
mod surroundings;
mod table;
mod textured;
mod values;
mod volume_light;

pub use crate::connection_end::{ConnectionEnd, EndSample, OnSurface};
pub use aperture::{Aperture, BeamProfile};
pub use collimated::Collimated;
pub use distant_disc::{DiscError, DistantDisc};
pub use emission::Emission;
pub use environment::{Environment, ImageError};
pub use environment_map::EnvironmentMap;
pub use fiber::{AngularProfile, Divergence, Fiber};
pub use luminaire::{Luminaire, LuminaireError};
pub use point_on_face::PointOnFace;
pub use projector::Projector;
pub use slide::Slide;
pub use spot::{Spot, SpotTextureError};
pub use surroundings::Surroundings;
pub use textured::{TexturedArea, TexturedError};
pub use values::{EmittedRay, EmitterValues};
pub use volume_light::{Estimate, VolumeLight};

use crate::Spectrum;
use crate::shape::{AreaSample, Shape, Site};
use glam::DVec3;
use std::sync::Arc;

/// How paths that are scattered at random can find an emitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Not at all.
    Delta,
    /// By meeting a surface.
    Area,
    /// By leaving the scene.
    Sky,
    /// By passing through it: `path` gathers its light along all edges, other estimators along those from the sensor.
    Volume,
}

impl Class {
    /// All classes.
    pub const ALL: [Class; 4] = [Class::Delta, Class::Area, Class::Sky, Class::Volume];
}

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
    /// A point that radiates in all directions from a face: a scene makes it of a point that lies on one.
    PointOnFace(Arc<PointOnFace>),
    /// A point that radiates into a cone.
    Spot(Spot),
    /// A point that throws an image.
    Projector(Arc<Projector>),
    /// A point that radiates as measured on a luminaire.
    Luminaire(Arc<Luminaire>),
    /// Radiates from the side of a shape to which its normals point, the same radiance in all
    /// directions.
    Area {
        /// Index of the object that it covers.
        object: usize,
        /// Radiance.
        radiance: Spectrum,
    },
    /// As `Area`, but the radiance varies over the shape.
    Textured(Arc<TexturedArea>),
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
    /// An aperture that radiates into a cone.
    Fiber(Fiber),
    /// All points of a volume.
    Volume(Arc<VolumeLight>),
}

impl From<Collimated> for Emitter {
    fn from(beam: Collimated) -> Self {
        Emitter::Collimated(beam)
    }
}

impl From<Fiber> for Emitter {
    fn from(fiber: Fiber) -> Self {
        Emitter::Fiber(fiber)
    }
}

impl From<Spot> for Emitter {
    fn from(spot: Spot) -> Self {
        Emitter::Spot(spot)
    }
}

impl Emitter {
    /// The same radiance, W/(m² sr) if lengths are in metres, from all around.
    pub fn constant(radiance: impl Into<Spectrum>) -> Self {
        Emitter::Environment(Environment::Constant(radiance.into()))
    }

    /// A point that radiates the same intensity, W/sr, in all directions.
    pub fn point(position: impl Into<DVec3>, intensity: impl Into<Spectrum>) -> Self {
        Emitter::Point {
            position: position.into(),
            intensity: intensity.into(),
        }
    }

    /// Chooses where to aim; `shape` gives the shape of an object, `u` is uniform in [0, 1)².
    pub fn sample_end<'a>(
        &self,
        around: &Surroundings,
        shape: impl Fn(usize) -> &'a Shape,
        u: [f64; 2],
    ) -> EndSample {
        match self {
            Emitter::Point { position, .. } => EndSample::only(ConnectionEnd::at(*position)),
            Emitter::PointOnFace(point) => point.sample_end(u[0]),
            Emitter::Spot(spot) => EndSample::only(ConnectionEnd::at(spot.position())),
            Emitter::Projector(projector) => {
                EndSample::only(ConnectionEnd::at(projector.position()))
            }
            Emitter::Luminaire(luminaire) => {
                EndSample::only(ConnectionEnd::at(luminaire.position()))
            }
            Emitter::Directional { direction, .. } => EndSample::only(ConnectionEnd::parallel(
                around.before(*direction),
                *direction,
            )),
            Emitter::Collimated(beam) => EndSample::only(ConnectionEnd::Plane {
                through: beam.origin(),
                direction: beam.direction(),
                beam: true,
            }),
            Emitter::Fiber(fiber) => {
                let aperture = fiber.aperture();
                let position = aperture.sample(u);
                one_of_many(position, aperture.pdf(position))
            }
            Emitter::Volume(volume) => {
                let position = volume.sample(u);
                one_of_many(position, volume.pdf(position))
            }
            Emitter::Environment(environment) => {
                let (toward, pdf) = environment.sample(u);
                EndSample {
                    end: ConnectionEnd::parallel(around.before(-toward), -toward),
                    pdf,
                    delta: false,
                }
            }
            Emitter::Area { object, .. } => {
                let shape = shape(*object);
                end_at(*object, shape, &shape.sample_area(u))
            }
            Emitter::Textured(area) => {
                let shape = shape(area.object());
                end_at(area.object(), shape, &area.sample(shape, u))
            }
        }
    }

    /// The radiance of a point of the shape that the emitter covers, and the density per unit area with which
    /// [`Emitter::sample_end`] chooses it; `None` for emitters on no surface.
    pub fn on_surface(&self, shape: &Shape, site: &Site) -> Option<(Spectrum, f64)> {
        match self {
            Emitter::Area { radiance, .. } => {
                Some((*radiance, shape.pdf_area(site.position, site.primitive)))
            }
            Emitter::Textured(area) => Some((area.radiance(site), area.pdf(shape, site))),
            _ => None,
        }
    }

    /// What leaves `start` in the unit `direction`: intensity (points of any kind), intensity per area (fibre) or volume, radiance
    /// times cosine (area), radiance (environment) or irradiance across the direction (directional, beam). What a medium emits is only
    /// guessed: `Scene::leaving` knows.
    pub fn emitted(&self, end: &ConnectionEnd, start: DVec3, direction: DVec3) -> Spectrum {
        match self {
            Emitter::Point { intensity, .. } => *intensity,
            Emitter::PointOnFace(point) => {
                point.emitted(end.position().unwrap_or(start), direction)
            }
            Emitter::Spot(spot) => spot.intensity(direction),
            Emitter::Projector(projector) => projector.intensity(direction),
            Emitter::Luminaire(luminaire) => luminaire.intensity(direction),
            Emitter::Directional { irradiance, .. } => *irradiance,
            Emitter::Collimated(beam) => beam.irradiance(start),
            Emitter::Fiber(fiber) => fiber.emitted(start, direction),
            Emitter::Volume(volume) => volume.radiance(start),
            Emitter::Environment(environment) => environment.radiance(-direction),
            Emitter::Area { radiance, .. } => *radiance * cosine(end, direction),
            Emitter::Textured(area) => match end {
                ConnectionEnd::Point {
                    surface: Some(on), ..
                } => area.radiance(&on.site) * cosine(end, direction),
                _ => Spectrum::ZERO,
            },
        }
    }

    /// [`Emitter::emitted`] of an end as sampled, summed over the channels, or about that where it is to be had at less cost: to
    /// choose ends by.
    pub fn emitted_roughly(&self, sampled: &EndSample, start: DVec3, direction: DVec3) -> f64 {
        match self {
            Emitter::Environment(Environment::Image(map)) => map.total() * sampled.pdf,
            _ => self.emitted(&sampled.end, start, direction).sum(),
        }
    }

    /// Whether its ends differ much in what they emit, as an image does.
    pub fn is_image(&self) -> bool {
        matches!(
            self,
            Emitter::Environment(Environment::Image(_)) | Emitter::Textured(_)
        )
    }

    /// Whether connections have a choice of points at which to end, each of which its light falls off around as 1/r².
    pub fn has_many_points(&self) -> bool {
        matches!(self, Emitter::Fiber(_) | Emitter::PointOnFace(_))
    }

    /// The emitter's kind, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Emitter::Point { .. } | Emitter::PointOnFace(_) => "point",
            Emitter::Spot(_) => "spot",
            Emitter::Projector(_) => "projector",
            Emitter::Luminaire(_) => "ies",
            Emitter::Area { .. } | Emitter::Textured(_) => "area",
            Emitter::Directional { .. } => "directional",
            Emitter::Environment(e) => e.kind(),
            Emitter::Collimated(_) => "collimated",
            Emitter::Fiber(_) => "fiber",
            Emitter::Volume(volume) if volume.medium().is_some() => "medium",
            Emitter::Volume(_) => "volumelight",
        }
    }

    /// How paths scattered at random can find it.
    pub fn class(&self) -> Class {
        match self {
            Emitter::Area { .. } | Emitter::Textured(_) => Class::Area,
            Emitter::Environment(_) => Class::Sky,
            Emitter::Volume(_) => Class::Volume,
            _ => Class::Delta,
        }
    }

    /// Whether its light comes from infinity, parallel or from all sides.
    pub fn is_at_infinity(&self) -> bool {
        matches!(self, Emitter::Directional { .. } | Emitter::Environment(_))
    }

    /// Whether no vertex of a path can lie on it by chance.
    pub fn is_delta(&self) -> bool {
        matches!(self.class(), Class::Delta | Class::Volume)
    }
}

/// An end at a point of an aperture or a volume. By rounding it may lie just beside all light, or the light may be black: any
/// density does for an end that brings nothing.
fn one_of_many(position: DVec3, pdf: f64) -> EndSample {
    EndSample {
        end: ConnectionEnd::at(position),
        pdf: if pdf > 0.0 { pdf } else { 1.0 },
        delta: true,
    }
}

/// An end at a point drawn from the surface of an object.
fn end_at(object: usize, shape: &Shape, sample: &AreaSample) -> EndSample {
    EndSample {
        end: ConnectionEnd::Point {
            position: sample.position,
            surface: Some(OnSurface {
                object,
                normal: sample.normal,
                site: shape.site_of(sample),
            }),
        },
        pdf: sample.pdf,
        delta: false,
    }
}

/// Cosine to the normal of the surface that is aimed at; 0 behind it, and where there is none.
fn cosine(end: &ConnectionEnd, direction: DVec3) -> f64 {
    match end {
        ConnectionEnd::Point {
            surface: Some(on), ..
        } => on.normal.dot(direction).max(0.0),
        _ => 0.0,
    }
}
