//! Thin-lens camera.

use super::{ApertureShape, Perspective, PointSpread, Sensed, SensorRay, to_world};
use crate::connection_end::{ConnectionEnd, EndSample};
use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;

/// Camera with an aperture, in focus at one distance. The lens is ideal, and the distance is
/// measured along straight lines.
#[derive(Clone, Debug)]
pub struct ThinLens {
    pinhole: Perspective,
    aperture_radius: f64,
    focus_distance: f64,
    aperture: ApertureShape,
    point_spread: Option<PointSpread>,
}

impl ThinLens {
    /// Creates a camera with a round aperture. Lengths are in the units of the camera's local
    /// coordinates, > 0.
    pub fn new(pinhole: Perspective, aperture_radius: f64, focus_distance: f64) -> Self {
        ThinLens {
            pinhole,
            aperture_radius,
            focus_distance,
            aperture: ApertureShape::default(),
            point_spread: None,
        }
    }

    /// Returns the camera with an aperture of the given shape, in units of its radius. This removes
    /// diffraction, which must be set afterwards.
    pub fn with_aperture(self, aperture: ApertureShape) -> Self {
        ThinLens {
            aperture,
            point_spread: None,
            ..self
        }
    }

    /// Returns the camera with diffraction at its aperture. `wavelength` > 0 is the wavelength in
    /// vacuum, in scene units. The transform must not shear.
    ///
    /// The reduced radius is 2π a tan θ/λ along each axis of the aperture. The aperture is
    /// stretched if the axes of the transform differ in length.
    pub fn with_diffraction(self, wavelength: f64) -> Self {
        let m = self.to_world().matrix3;
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        let [half_x, half_y] = self.pinhole.half();
        let scale = [(x, half_x), (y, half_y)].map(|(axis, half)| {
            // Convert the spread from the plane at unit local distance, in the world, to the image,
            // which is 2 `half` wide.
            let spread = wavelength * z / (TAU * self.aperture_radius * axis);
            spread / axis / (2.0 * half)
        });
        ThinLens {
            point_spread: Some(PointSpread::new(&self.aperture, scale)),
            ..self
        }
    }

    /// Returns the camera displaced by `shift`.
    pub(super) fn moved(mut self, shift: DVec3) -> Self {
        self.pinhole = self.pinhole.moved(shift);
        self
    }

    /// Returns the pinhole camera with the image of the plane in focus.
    pub fn pinhole(&self) -> &Perspective {
        &self.pinhole
    }

    /// Returns the radius of the lens, in scene units.
    pub fn aperture_radius(&self) -> f64 {
        self.aperture_radius
    }

    /// Returns the distance to the plane in focus, in scene units.
    pub fn focus_distance(&self) -> f64 {
        self.focus_distance
    }

    pub(super) fn point_spread(&self) -> Option<&PointSpread> {
        self.point_spread.as_ref()
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        self.pinhole.to_world()
    }

    /// Returns a point of the lens in local coordinates.
    fn on_lens(&self, u: [f64; 2]) -> DVec3 {
        self.aperture.sample(u).extend(0.0) * self.aperture_radius
    }

    /// Returns the open area of the lens in scene units.
    fn area(&self) -> f64 {
        let m = self.to_world().matrix3;
        self.aperture_radius.powi(2) * self.aperture.area() * m.x_axis.cross(m.y_axis).length()
    }

    pub(super) fn ray(&self, image: [f64; 2], lens: [f64; 2]) -> SensorRay {
        let origin = self.on_lens(lens);
        let focus = self.pinhole.at_unit_distance(image) * self.focus_distance;
        to_world(self.to_world(), origin, focus - origin)
    }

    pub(super) fn sample_end(&self, u: [f64; 2]) -> EndSample {
        EndSample {
            end: ConnectionEnd::at(self.to_world().transform_point3(self.on_lens(u))),
            pdf: 1.0 / self.area(),
            delta: true,
        }
    }

    /// Returns the image position of a ray, where it intersects the plane of focus.
    pub(super) fn sense(&self, start: DVec3, direction: DVec3) -> Option<Sensed> {
        let to_local = self.pinhole.to_local();
        let origin = to_local.transform_point3(start);
        let local = to_local.transform_vector3(direction);
        let focus = origin + local * ((self.focus_distance - origin.z) / local.z);
        let sensed = || self.pinhole.sensed(focus / self.focus_distance, local.z);
        (local.z > 0.0).then(sensed)
    }
}
