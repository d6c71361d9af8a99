//! Sensors: starts of sensor subpaths, and the response to light subpaths that arrive.
//!
//! All sensors read radiance. With u = (s, t) a position on the image, pixel j reads
//!
//! ```text
//! I_j = ∫ h_j(u) L(u) du,   L averaged over the lens,   ∫ h_j du = 1
//! ```
//!
//! where h_j is the density of the reconstruction filter about the centre of the pixel. It is a
//! product of two `Filter::pdf`, each times the number of pixels along its side, because u is in
//! units of the image.
//!
//! * A sensor subpath samples u from h_j, and a point of the lens uniformly by transmitted power
//!   ([`Sensor::ray`]). Its only initial weight is n² (docs/theory.md#radiance).
//! * A light subpath that is connected to the sensor ends at a sampled point of it
//!   ([`Sensor::sample_end`]). The integral over u becomes an integral over the rays of this point
//!   (steradians), or over the parallel rays (area across them). Its integrand is n² h_j(u)
//!   `density` L̃, with u and du/dΩ or du/dA⊥ = `density` from [`Sensor::sense`]. On a lens or a
//!   stop, the average over its area divides by the area. This area is the reciprocal of the
//!   density of the end, so the two cancel.
//! * Where the aperture diffracts ([`Sensor::point_spread`]), both are displaced on the image by an
//!   offset sampled from the point spread function. The sensor subpath starts at u minus the
//!   offset, and the light subpath arrives at u plus the offset.

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

/// Position and unit direction of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorRay {
    /// Start.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

/// Image position of a ray that leaves the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Position (s, t) from the top left corner, in units of the image. The image is [0, 1]², but a
    /// filter may extend beyond.
    pub image: [f64; 2],
    /// Density with which [`Sensor::ray`] samples this ray among all rays of its point of the
    /// sensor, for uniform positions on the image. It is per steradian. For an orthographic or
    /// telecentric sensor, it is per unit area across the rays.
    pub density: f64,
}

/// Sensor without its film. Local coordinates follow Mitsuba: the camera looks along +z, +y is up,
/// and +x is to the left of the image.
#[derive(Clone, Debug)]
pub enum Sensor {
    /// Pinhole camera.
    Perspective(Perspective),
    /// Camera with a thin lens.
    ThinLens(ThinLens),
    /// Camera with parallel rays.
    Orthographic(Orthographic),
    /// No sensor: meters measure the light.
    Absent(DAffine3),
    /// Camera with parallel rays for each point of a stop.
    Telecentric(Telecentric),
    /// Several sensors side by side. Estimators cannot connect paths to them.
    Batch(Arc<Batch>),
}

impl Sensor {
    /// Returns the ray through a position of the image and a position on the lens. `image` is (s,
    /// t) in [0, 1]² from the top left corner; `lens` is uniform in [0, 1)².
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

    /// Samples the end of a connection to the sensor, uniformly over the lens; `u` is uniform in
    /// [0, 1)². Importance travels along the direction of the end, and light against it.
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

    /// Returns the end of a connection for the sensor ray that starts at `origin` in a unit
    /// direction. It is a point, or, for parallel rays, the plane of all rays of this direction.
    pub fn end_of_ray(&self, origin: DVec3, direction: DVec3) -> ConnectionEnd {
        match self {
            Sensor::Perspective(_) | Sensor::ThinLens(_) => ConnectionEnd::at(origin),
            Sensor::Absent(_) | Sensor::Batch(_) => ConnectionEnd::at(origin),
            Sensor::Orthographic(s) => s.sample_end().end,
            Sensor::Telecentric(s) => s.end_along(direction),
        }
    }

    /// Returns the image position of the ray that leaves the sensor at `start`, a sampled end, in
    /// the unit `direction`. The light travels against it. Returns `None` if the sensor does not
    /// see in this direction (docs/theory.md#subpaths-from-either-end).
    pub fn sense(&self, start: DVec3, direction: DVec3) -> Option<Sensed> {
        let sensed = match self {
            Sensor::Perspective(s) => s.sense(direction),
            Sensor::ThinLens(s) => s.sense(start, direction),
            Sensor::Orthographic(s) => s.sense(start, direction),
            Sensor::Absent(_) | Sensor::Batch(_) => None,
            Sensor::Telecentric(s) => s.sense(start, direction),
        };
        // Reject rays almost parallel to the lens, for which the numbers overflow.
        sensed.filter(|s| s.density.is_finite() && s.image.iter().all(|x| x.is_finite()))
    }

    /// Returns the sensor displaced by `shift`.
    pub fn moved(self, shift: DVec3) -> Self {
        match self {
            Sensor::Perspective(s) => Sensor::Perspective(s.moved(shift)),
            Sensor::ThinLens(s) => Sensor::ThinLens(s.moved(shift)),
            Sensor::Orthographic(s) => Sensor::Orthographic(s.moved(shift)),
            Sensor::Telecentric(s) => Sensor::Telecentric(s.moved(shift)),
            Sensor::Absent(_) | Sensor::Batch(_) => self,
        }
    }

    /// Returns true if the rays are parallel. With a stop, the rays through each point of the stop
    /// are parallel.
    pub fn is_parallel(&self) -> bool {
        matches!(self, Sensor::Orthographic(_) | Sensor::Telecentric(_))
    }

    /// Returns the point spread function of the aperture, if it diffracts.
    pub fn point_spread(&self) -> Option<&PointSpread> {
        match self {
            Sensor::ThinLens(s) => s.point_spread(),
            Sensor::Telecentric(s) => s.point_spread(),
            Sensor::Perspective(_) | Sensor::Orthographic(_) => None,
            Sensor::Absent(_) | Sensor::Batch(_) => None,
        }
    }

    /// Returns the local-to-world transform, of the first sensor if there are several.
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

    /// Returns the position, of the first sensor if there are several.
    pub fn position(&self) -> DVec3 {
        self.to_world().translation
    }

    /// Returns the positions of all sensors.
    pub fn positions(&self) -> impl Iterator<Item = DVec3> {
        let sensors = match self {
            Sensor::Batch(batch) => batch.sensors(),
            one => std::slice::from_ref(one),
        };
        sensors.iter().map(Sensor::position)
    }
}

/// Transforms a ray from local coordinates to the world.
fn to_world(to_world: &DAffine3, origin: DVec3, direction: DVec3) -> SensorRay {
    SensorRay {
        origin: to_world.transform_point3(origin),
        direction: to_world.transform_vector3(direction).normalize(),
    }
}
