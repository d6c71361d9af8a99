//! Pinhole camera.

use super::{Ray, to_world};
use glam::{DAffine3, DVec3};

/// A pinhole camera.
#[derive(Clone, Debug)]
pub struct Perspective {
    to_world: DAffine3,
    /// Half extents of the image at unit distance.
    half: [f64; 2],
}

impl Perspective {
    /// `fov_x` is the full horizontal angle in radians, in (0, π); `aspect` is width over height.
    pub fn new(to_world: DAffine3, fov_x: f64, aspect: f64) -> Self {
        let half = (0.5 * fov_x).tan();
        Perspective {
            to_world,
            half: [half, half / aspect],
        }
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Point at unit distance seen at an image position; +x is left, hence the signs.
    pub(super) fn at_unit_distance(&self, [s, t]: [f64; 2]) -> DVec3 {
        DVec3::new(
            (1.0 - 2.0 * s) * self.half[0],
            (1.0 - 2.0 * t) * self.half[1],
            1.0,
        )
    }

    pub(super) fn ray(&self, image: [f64; 2]) -> Ray {
        to_world(&self.to_world, DVec3::ZERO, self.at_unit_distance(image))
    }
}
