//! Pinhole camera.

use super::{Sensed, SensorRay, to_world};
use glam::{DAffine3, DVec3};

/// Pinhole camera.
#[derive(Clone, Debug)]
pub struct Perspective {
    to_world: DAffine3,
    to_local: DAffine3,
    /// Half extents of the image at unit distance.
    half: [f64; 2],
}

impl Perspective {
    /// Creates the camera. `to_world` must be invertible. `fov_x` is the full horizontal angle in
    /// radians, in (0, π). `aspect` is width over height.
    pub fn new(to_world: DAffine3, fov_x: f64, aspect: f64) -> Self {
        let half = (0.5 * fov_x).tan();
        Perspective {
            to_world,
            to_local: to_world.inverse(),
            half: [half, half / aspect],
        }
    }

    /// Returns the camera displaced by `shift`.
    pub(super) fn moved(mut self, shift: DVec3) -> Self {
        self.to_world.translation += shift;
        self.to_local = self.to_world.inverse();
        self
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    pub(super) fn to_local(&self) -> &DAffine3 {
        &self.to_local
    }

    /// Returns the half extents of the image at unit distance.
    pub fn half(&self) -> [f64; 2] {
        self.half
    }

    /// Returns the point at unit distance seen at an image position. +x points left, hence the
    /// signs.
    pub(super) fn at_unit_distance(&self, [s, t]: [f64; 2]) -> DVec3 {
        DVec3::new(
            (1.0 - 2.0 * s) * self.half[0],
            (1.0 - 2.0 * t) * self.half[1],
            1.0,
        )
    }

    pub(super) fn ray(&self, image: [f64; 2]) -> SensorRay {
        to_world(&self.to_world, DVec3::ZERO, self.at_unit_distance(image))
    }

    pub(super) fn sense(&self, direction: DVec3) -> Option<Sensed> {
        let local = self.to_local.transform_vector3(direction);
        (local.z > 0.0).then(|| self.sensed(local / local.z, local.z))
    }

    /// Returns the image position at which `at_unit_distance` is seen, and the density of its ray.
    /// The unit direction of the ray has the local component `z`.
    ///
    /// For w = M (x, y, 1), dΩ = |det M| dx dy/|w|³ and |w| = 1/z. From any other point of the
    /// plane z = 0, an area of the image, scaled by its distance f, subtends the same solid angle:
    /// f² from the area, f from the height above it, and |w| = f/z.
    pub(super) fn sensed(&self, at_unit_distance: DVec3, z: f64) -> Sensed {
        let [half_x, half_y] = self.half;
        let image_area = 4.0 * half_x * half_y;
        let det = self.to_world.matrix3.determinant().abs();
        Sensed {
            image: [
                0.5 * (1.0 - at_unit_distance.x / half_x),
                0.5 * (1.0 - at_unit_distance.y / half_y),
            ],
            density: 1.0 / (image_area * det * z.powi(3)),
        }
    }
}
