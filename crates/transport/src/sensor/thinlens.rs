//! Thin-lens camera.

use super::{Perspective, Ray, to_world};
use crate::sampling::disc::uniform_disc_sample;
use glam::DAffine3;

/// A camera whose aperture is a disc, sharp at one distance. The lens is ideal and the distance is
/// measured along straight lines.
#[derive(Clone, Debug)]
pub struct ThinLens {
    pinhole: Perspective,
    aperture_radius: f64,
    focus_distance: f64,
}

impl ThinLens {
    /// Lengths are in the units of the camera's local coordinates.
    pub fn new(pinhole: Perspective, aperture_radius: f64, focus_distance: f64) -> Self {
        ThinLens {
            pinhole,
            aperture_radius,
            focus_distance,
        }
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        self.pinhole.to_world()
    }

    pub(super) fn ray(&self, image: [f64; 2], lens: [f64; 2]) -> Ray {
        let p = uniform_disc_sample(lens);
        let origin = p.extend(0.0) * self.aperture_radius;
        let focus = self.pinhole.at_unit_distance(image) * self.focus_distance;
        to_world(self.to_world(), origin, focus - origin)
    }
}
