//! Sensors: where sensor subpaths start, and what a light subpath that arrives is worth.
//!
//! All sensors read radiance. With u = (s, t) a position on the image, pixel j reads
//!
//! ```text
//! I_j = ∫ h_j(u) L(u) du,   L averaged over the lens,   ∫ h_j du = 1
//! ```
//!
//! where h_j is the density of the reconstruction filter about the pixel's centre: a product of two
//! `Filter::pdf`, each times the number of pixels along its side, since
//! u is in units of the image.
//!
//! * A sensor subpath draws u from h_j and a point of the lens, uniform by the power that passes there ([`Sensor::ray`]), so it
//!   starts with weight n² (docs/theory.md#radiance) and nothing else.
//! * A light subpath that is connected to the sensor aims at a point of it ([`Sensor::sample_end`]). Changing
//!   variables from u to the rays of that point (steradians), or to the parallel rays (area across
//!   them), turns the integral into n² h_j(u) `density` L̃, with u and du/dΩ or du/dA⊥ = `density`
//!   from [`Sensor::sense`]. On a lens or a stop the average over its area divides by that area,
//!   which is the reciprocal of the density of the end: they cancel.
//! * Where the aperture diffracts ([`Sensor::point_spread`]), both are displaced on the image by an offset that is drawn
//!   from the point spread function: the sensor subpath starts at u less the offset, and the light subpath arrives at u plus it.

mod aperture;
mod batch;
mod camera;
mod orthographic;
mod perspective;
mod telecentric;
mod thinlens;

pub use aperture::{ApertureError, ApertureShape, Iris, PointSpread};
pub use batch::Batch;
pub use camera::{Camera, CameraError, Projection, look_at};
pub use orthographic::Orthographic;
pub use perspective::Perspective;
pub use telecentric::{ApertureStop, Telecentric};
pub use thinlens::ThinLens;

use crate::connection_end::{ConnectionEnd, EndSample};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// A position and a unit direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorRay {
    /// Start.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

/// Where on the image a ray that leaves the sensor belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Position (s, t) from the top left corner in units of the image: the image is [0, 1]², but a
    /// filter may reach beyond.
    pub image: [f64; 2],
    /// The density with which [`Sensor::ray`], with uniform positions on the image, chooses this ray
    /// among those of the same point of the sensor: per steradian; for an orthographic or
    /// telecentric sensor, per unit area across its rays.
    pub density: f64,
}

/// A sensor without its film. Local coordinates follow Mitsuba: the camera looks along +z, +y is
/// up, and +x is to the left of the image.
#[derive(Clone, Debug)]
pub enum Sensor {
    /// Pinhole.
    Perspective(Perspective),
    /// Thin lens.
    ThinLens(ThinLens),
    /// Parallel rays.
    Orthographic(Orthographic),
    /// None: light is measured by meters. It sees nothing.
    Absent(DAffine3),
    /// Parallel rays for each point of a stop.
    Telecentric(Telecentric),
    /// Several side by side, which nothing connects to.
    Batch(Arc<Batch>),
}

impl Sensor {
    /// The ray through a position of the image, (s, t) in [0, 1]² from the top left corner, and a
    /// position on the lens, uniform in [0, 1)².
    pub fn ray(&self, image: [f64; 2], lens: [f64; 2]) -> SensorRay {
        match self {
            Sensor::Perspective(s) => s.ray(image),
            Sensor::ThinLens(s) => s.ray(image, lens),
            Sensor::Orthographic(s) => s.ray(image),
            Sensor::Absent(frame) => to_world(frame, DVec3::ZERO, DVec3::Z),
            Sensor::Telecentric(s) => s.ray(image, lens),
            Sensor::Batch(s) => s.ray(image, lens),
        }
    }

    /// Chooses where a connection to the sensor should aim, uniformly over the lens; `u` is uniform
    /// in [0, 1)². Importance travels along the end's direction, so light against it.
    pub fn sample_end(&self, u: [f64; 2]) -> EndSample {
        match self {
            Sensor::Perspective(_) | Sensor::Absent(_) | Sensor::Batch(_) => {
                EndSample::only(ConnectionEnd::at(self.position()))
            }
            Sensor::ThinLens(s) => s.sample_end(u),
            Sensor::Orthographic(s) => s.sample_end(),
            Sensor::Telecentric(s) => s.sample_end(u),
        }
    }

    /// The end at the point from which one of the sensor's rays starts, in a unit direction, or at all
    /// rays of that direction.
    pub fn end_of_ray(&self, origin: DVec3, direction: DVec3) -> ConnectionEnd {
        match self {
            Sensor::Perspective(_) | Sensor::ThinLens(_) => ConnectionEnd::at(origin),
            Sensor::Absent(_) | Sensor::Batch(_) => ConnectionEnd::at(origin),
            Sensor::Orthographic(s) => s.sample_end().end,
            Sensor::Telecentric(s) => s.end_along(direction),
        }
    }

    /// Where on the image the ray belongs that leaves the sensor at `start`, a point that was aimed
    /// at, in the unit `direction`; the light travels against it. `None` if the sensor does not look
    /// that way (docs/theory.md#subpaths-from-either-end).
    pub fn sense(&self, start: DVec3, direction: DVec3) -> Option<Sensed> {
        let sensed = match self {
            Sensor::Perspective(s) => s.sense(direction),
            Sensor::ThinLens(s) => s.sense(start, direction),
            Sensor::Orthographic(s) => s.sense(start, direction),
            Sensor::Absent(_) | Sensor::Batch(_) => None,
            Sensor::Telecentric(s) => s.sense(start, direction),
        };
        // Rays almost along the plane of the lens overflow.
        sensed.filter(|s| s.density.is_finite() && s.image.iter().all(|x| x.is_finite()))
    }

    /// The same, displaced by `shift`.
    pub fn moved(self, shift: DVec3) -> Self {
        match self {
            Sensor::Perspective(s) => Sensor::Perspective(s.moved(shift)),
            Sensor::ThinLens(s) => Sensor::ThinLens(s.moved(shift)),
            Sensor::Orthographic(s) => Sensor::Orthographic(s.moved(shift)),
            Sensor::Telecentric(s) => Sensor::Telecentric(s.moved(shift)),
            Sensor::Absent(_) | Sensor::Batch(_) => self,
        }
    }

    /// Whether its rays, those of one point of its stop if it has any, have one direction.
    pub fn is_parallel(&self) -> bool {
        matches!(self, Sensor::Orthographic(_) | Sensor::Telecentric(_))
    }

    /// What its aperture does to the image, if it diffracts.
    pub fn point_spread(&self) -> Option<&PointSpread> {
        match self {
            Sensor::ThinLens(s) => s.point_spread(),
            Sensor::Telecentric(s) => s.point_spread(),
            Sensor::Perspective(_) | Sensor::Orthographic(_) => None,
            Sensor::Absent(_) | Sensor::Batch(_) => None,
        }
    }

    /// Local-to-world transform, of the first if there are several.
    pub fn to_world(&self) -> &DAffine3 {
        match self {
            Sensor::Perspective(s) => s.to_world(),
            Sensor::ThinLens(s) => s.to_world(),
            Sensor::Orthographic(s) => s.to_world(),
            Sensor::Absent(frame) => frame,
            Sensor::Telecentric(s) => s.to_world(),
            Sensor::Batch(s) => s.first().to_world(),
        }
    }

    /// Where the sensor is; the first, if there are several.
    pub fn position(&self) -> DVec3 {
        self.to_world().translation
    }

    /// Where the sensors are, of which there may be several.
    pub fn positions(&self) -> impl Iterator<Item = DVec3> {
        let sensors = match self {
            Sensor::Batch(batch) => batch.sensors(),
            one => std::slice::from_ref(one),
        };
        sensors.iter().map(Sensor::position)
    }
}

/// A ray given in local coordinates.
fn to_world(to_world: &DAffine3, origin: DVec3, direction: DVec3) -> SensorRay {
    SensorRay {
        origin: to_world.transform_point3(origin),
        direction: to_world.transform_vector3(direction).normalize(),
    }
}
