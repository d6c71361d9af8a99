//! Orthographic camera.

use super::{Sensed, SensorRay, to_world};
use crate::connection_end::{ConnectionEnd, EndSample};
use crate::sampling::disc::{uniform_disc_inverse, uniform_disc_sample};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::PI;

/// Camera with parallel rays along local +z, through the square [−1, 1]² of the local plane z = 0.
/// The height of the square is divided by the aspect ratio. All rays start on the plane through the
/// sensor's position perpendicular to them. It is the plane of the square, unless the transform
/// shears it.
///
/// The rays of a [round](Orthographic::round) camera pass through the unit disc instead.
#[derive(Clone, Debug)]
pub struct Orthographic {
    to_world: DAffine3,
    to_local: DAffine3,
    aspect: f64,
    round: bool,
}

impl Orthographic {
    /// Creates the camera. `to_world` must be invertible; `aspect` is width over height.
    pub fn new(to_world: DAffine3, aspect: f64) -> Self {
        Orthographic {
            to_world,
            to_local: to_world.inverse(),
            aspect,
            round: false,
        }
    }

    /// Creates a camera with a square image that covers the local unit disc: the concentric map
    /// turns equal areas of the image into equal areas of the disc. `to_world` must be invertible.
    pub fn round(to_world: DAffine3) -> Self {
        Orthographic {
            round: true,
            ..Orthographic::new(to_world, 1.0)
        }
    }

    /// Returns the camera displaced by `shift`.
    pub(super) fn moved(mut self, shift: DVec3) -> Self {
        self.to_world.translation += shift;
        self.to_local = self.to_world.inverse();
        self
    }

    /// Returns width over height of the image.
    pub fn aspect(&self) -> f64 {
        self.aspect
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    pub(super) fn ray(&self, [s, t]: [f64; 2]) -> SensorRay {
        let local = if self.round {
            -uniform_disc_sample([s, t])
        } else {
            DVec2::new(1.0 - 2.0 * s, (1.0 - 2.0 * t) / self.aspect)
        };
        let SensorRay { origin, direction } = to_world(&self.to_world, local.extend(0.0), DVec3::Z);
        let ahead = (origin - self.to_world.translation).dot(direction);
        SensorRay {
            origin: origin - direction * ahead,
            direction,
        }
    }

    fn direction(&self) -> DVec3 {
        self.to_world.matrix3.z_axis.normalize()
    }

    pub(super) fn sample_end(&self) -> EndSample {
        EndSample::only(ConnectionEnd::parallel(
            self.to_world.translation,
            self.direction(),
        ))
    }

    /// Returns the image position of a ray: the intersection of its line, which is parallel to
    /// local z, with the local plane z = 0. An area dx dy there has the cross section |det M|/|M
    /// e_z| dx dy.
    pub(super) fn sense(&self, start: DVec3, direction: DVec3) -> Option<Sensed> {
        let local = self.to_local.transform_point3(start).truncate();
        let m = self.to_world.matrix3;
        let (image, image_area) = if self.round {
            (uniform_disc_inverse(-local), PI)
        } else {
            let image = [0.5 * (1.0 - local.x), 0.5 * (1.0 - local.y * self.aspect)];
            (image, 4.0 / self.aspect)
        };
        let sensed = Sensed {
            image,
            density: m.z_axis.length() / (image_area * m.determinant().abs()),
        };
        (direction.dot(self.direction()) > 0.0).then_some(sensed)
    }
}
