//! Sensors: where sensor subpaths start.
//!
//! All sensors read radiance: a pixel is the mean of L over its footprint (and over the lens), so a
//! sensor subpath starts with weight n² (theory §3) and nothing else.

mod orthographic;
mod perspective;
mod thinlens;

pub use orthographic::Orthographic;
pub use perspective::Perspective;
pub use thinlens::ThinLens;

use glam::{DAffine3, DVec3};

/// A position and a unit direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
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
}

impl Sensor {
    /// The ray through a position of the image, (s, t) in [0, 1]² from the top left corner, and a
    /// position on the lens, uniform in [0, 1)².
    pub fn ray(&self, image: [f64; 2], lens: [f64; 2]) -> Ray {
        match self {
            Sensor::Perspective(s) => s.ray(image),
            Sensor::ThinLens(s) => s.ray(image, lens),
            Sensor::Orthographic(s) => s.ray(image),
        }
    }

    /// Local-to-world transform.
    pub fn to_world(&self) -> &DAffine3 {
        match self {
            Sensor::Perspective(s) => s.to_world(),
            Sensor::ThinLens(s) => s.to_world(),
            Sensor::Orthographic(s) => s.to_world(),
        }
    }

    /// Where the sensor is.
    pub fn position(&self) -> DVec3 {
        self.to_world().translation
    }
}

/// A ray given in local coordinates.
fn to_world(to_world: &DAffine3, origin: DVec3, direction: DVec3) -> Ray {
    Ray {
        origin: to_world.transform_point3(origin),
        direction: to_world.transform_vector3(direction).normalize(),
    }
}
