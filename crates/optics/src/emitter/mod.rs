//! Emitters.
//!
//! An emitter has three functions. It samples where a connection ends, with its density. It
//! computes the light that leaves from this end. It samples the first rays of light subpaths
//! ([`Emission`]). The module `path` handles radiometric factors that depend on the ray in between,
//! and the division by n² that turns radiance into basic radiance.

mod angular_profile;
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
pub use angular_profile::AngularProfile;
pub use aperture::{Aperture, BeamProfile};
pub use collimated::Collimated;
pub use distant_disc::{DiscError, DistantDisc};
pub use emission::Emission;
pub use environment::{Environment, ImageError};
pub use environment_map::EnvironmentMap;
pub use fiber::{Divergence, Fiber};
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

/// Ways in which randomly scattered paths can reach an emitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Emitter that paths cannot reach.
    Delta,
    /// Emitter that paths reach by intersecting a surface.
    Area,
    /// Emitter that paths reach by leaving the scene.
    Sky,
    /// Emitter that paths reach by crossing its volume. The integrator `path` gathers the light of
    /// the volume along all edges. Other estimators gather it along edges from the sensor.
    Volume,
}

impl Class {
    /// All classes.
    pub const ALL: [Class; 4] = [Class::Delta, Class::Area, Class::Sky, Class::Volume];
}

/// Source of light.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// Point with the same intensity (W/sr) in all directions.
    Point {
        /// Position.
        position: DVec3,
        /// Radiant intensity.
        intensity: Spectrum,
    },
    /// Point on a face, which radiates in all directions. A scene creates it from a point that lies
    /// on a face.
    PointOnFace(Arc<PointOnFace>),
    /// Point that radiates into a cone.
    Spot(Spot),
    /// Point that projects an image.
    Projector(Arc<Projector>),
    /// Point with the measured intensities of a luminaire.
    Luminaire(Arc<Luminaire>),
    /// Surface with the same radiance in all directions, on the side of a shape to which its
    /// normals point.
    Area {
        /// Index of the object whose surface emits.
        object: usize,
        /// Radiance.
        radiance: Spectrum,
    },
    /// Surface like `Area`, with a radiance that varies over the shape.
    Textured(Arc<TexturedArea>),
    /// Parallel light from infinity.
    Directional {
        /// Unit direction in which the light travels.
        direction: DVec3,
        /// Irradiance on a surface perpendicular to the direction, in the ambient medium.
        irradiance: Spectrum,
    },
    /// Light from all directions at infinity.
    Environment(Environment),
    /// Beam of parallel rays.
    Collimated(Collimated),
    /// Aperture that radiates into a cone.
    Fiber(Fiber),
    /// Volume that emits from all its points.
    Volume(Arc<VolumeLight>),
}

/// Evaluates an expression on whichever point this is whose intensity varies around an axis. Other
/// emitters have arms of their own.
macro_rules! each_spot {
    ($self:expr, $e:ident => $of_spot:expr, { $($arms:tt)* }) => {
        match $self {
            Emitter::Spot($e) => $of_spot,
            Emitter::Projector($e) => $of_spot,
            Emitter::Luminaire($e) => $of_spot,
            $($arms)*
        }
    };
}
use each_spot;

/// Implements `From` for [`Emitter`].
macro_rules! from {
    ($($emitter:ident),*) => {$(
        impl From<$emitter> for Emitter {
            fn from(emitter: $emitter) -> Self {
                Emitter::$emitter(emitter.into())
            }
        }
    )*};
}

from!(Collimated, Fiber, Luminaire, Projector, Spot);

impl Emitter {
    /// Creates an environment with the same radiance from all directions, W/(m² sr) if lengths are
    /// in metres.
    pub fn constant(radiance: impl Into<Spectrum>) -> Self {
        Emitter::Environment(Environment::Constant(radiance.into()))
    }

    /// Creates a point with the same intensity, W/sr, in all directions.
    pub fn point(position: impl Into<DVec3>, intensity: impl Into<Spectrum>) -> Self {
        Emitter::Point {
            position: position.into(),
            intensity: intensity.into(),
        }
    }

    /// Samples the end of a connection. `shape` returns the shape of an object, `u` is uniform in
    /// [0, 1)².
    pub fn sample_end<'a>(
        &self,
        around: &Surroundings,
        shape: impl Fn(usize) -> &'a Shape,
        u: [f64; 2],
    ) -> EndSample {
        each_spot!(self, e => EndSample::only(ConnectionEnd::at(e.position())), {
            Emitter::Point { position, .. } => EndSample::only(ConnectionEnd::at(*position)),
            Emitter::PointOnFace(point) => point.sample_end(u[0]),
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
        })
    }

    /// Returns the radiance at a point of the emitting shape, and the density per unit area with
    /// which [`Emitter::sample_end`] samples it. Returns `None` for emitters that are on no
    /// surface.
    pub fn on_surface(&self, shape: &Shape, site: &Site) -> Option<(Spectrum, f64)> {
        match self {
            Emitter::Area { radiance, .. } => {
                Some((*radiance, shape.pdf_area(site.position, site.primitive)))
            }
            Emitter::Textured(area) => Some((area.radiance(site), area.pdf(shape, site))),
            _ => None,
        }
    }

    /// Returns the light that leaves `start` in the unit `direction`. Its quantity depends on the
    /// emitter. It is intensity for all kinds of points, and intensity per area or volume for
    /// fibres and media. It is radiance for environments, and radiance times cosine for areas. It
    /// is irradiance perpendicular to the direction for directional emitters and beams. For a
    /// medium that emits, the result is only an estimate; `Scene::leaving` returns the exact value.
    pub fn emitted(&self, end: &ConnectionEnd, start: DVec3, direction: DVec3) -> Spectrum {
        each_spot!(self, e => e.intensity(direction), {
            Emitter::Point { intensity, .. } => *intensity,
            Emitter::PointOnFace(point) => {
                point.emitted(end.position().unwrap_or(start), direction)
            }
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
        })
    }

    /// Estimates [`Emitter::emitted`] for a sampled end, summed over the channels, at low cost. The
    /// estimate serves to choose among ends.
    pub fn emitted_roughly(&self, sampled: &EndSample, start: DVec3, direction: DVec3) -> f64 {
        match self {
            Emitter::Environment(Environment::Image(map)) => map.total() * sampled.pdf,
            _ => self.emitted(&sampled.end, start, direction).sum(),
        }
    }

    /// Returns true if the emission differs much among the ends, as for an environment image or a
    /// textured light.
    pub fn is_image(&self) -> bool {
        matches!(
            self,
            Emitter::Environment(Environment::Image(_)) | Emitter::Textured(_)
        )
    }

    /// Returns true if connections choose among several points. Around each point the light falls
    /// off as 1/r².
    pub fn has_many_points(&self) -> bool {
        matches!(self, Emitter::Fiber(_) | Emitter::PointOnFace(_))
    }

    /// Returns the kind of the emitter, for messages.
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

    /// Returns the way in which randomly scattered paths can reach the emitter.
    pub fn class(&self) -> Class {
        match self {
            Emitter::Area { .. } | Emitter::Textured(_) => Class::Area,
            Emitter::Environment(_) => Class::Sky,
            Emitter::Volume(_) => Class::Volume,
            _ => Class::Delta,
        }
    }

    /// Returns true if the light comes from infinity, parallel or from all sides.
    pub fn is_at_infinity(&self) -> bool {
        matches!(self, Emitter::Directional { .. } | Emitter::Environment(_))
    }

    /// Returns true if no randomly scattered vertex can lie on the emitter.
    pub fn is_delta(&self) -> bool {
        matches!(self.class(), Class::Delta | Class::Volume)
    }
}

/// Creates an end at a point of an aperture or a volume. By rounding, the point may lie just
/// outside the light, or the light may be black. For an end that contributes nothing, any density
/// is correct.
fn one_of_many(position: DVec3, pdf: f64) -> EndSample {
    EndSample {
        end: ConnectionEnd::at(position),
        pdf: if pdf > 0.0 { pdf } else { 1.0 },
        delta: true,
    }
}

/// Creates an end at a point sampled from the surface of an object.
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

/// Returns the cosine of a direction to the normal of the surface at the end; 0 behind the surface,
/// and if there is no surface.
fn cosine(end: &ConnectionEnd, direction: DVec3) -> f64 {
    match end {
        ConnectionEnd::Point {
            surface: Some(on), ..
        } => on.normal.dot(direction).max(0.0),
        _ => 0.0,
    }
}
