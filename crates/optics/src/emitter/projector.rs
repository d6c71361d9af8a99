//! Point that projects an image, like a slide projector.

use super::EmitterValues;
use super::picture::Picture;
use super::slide::Slide;
use crate::sampling::DistributionError;
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::PI;

/// Projector (Mitsuba's `projector`). A white diffuse screen perpendicular to its axis at unit
/// distance shows the image.
#[derive(Clone, Debug)]
pub struct Projector {
    position: DVec3,
    /// Orientation with local axes +x to the left of the image, +y up, +z forwards.
    orientation: Orientation,
    /// Half extents of the image at unit distance.
    half: [f64; 2],
    picture: Picture,
}

impl Projector {
    /// Creates a projector whose image is `fov_x` wide, in radians in (0, π).
    ///
    /// # Errors
    /// Fails if the image has no pixels or no light, or if its values are negative or not finite.
    pub fn new(
        position: DVec3,
        orientation: Orientation,
        fov_x: f64,
        slide: Slide,
    ) -> Result<Self, DistributionError> {
        let half = (0.5 * fov_x).tan();
        Ok(Projector {
            position,
            orientation,
            half: [half, half * slide.size[1] as f64 / slide.size[0] as f64],
            picture: Picture::new(slide)?,
        })
    }

    /// Returns the projector displaced by `shift`.
    pub fn moved(&self, shift: DVec3) -> Self {
        Projector {
            position: self.position + shift,
            ..self.clone()
        }
    }

    /// Returns the position.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the unit direction to the centre of the image.
    pub fn axis(&self) -> DVec3 {
        self.orientation.to_world(DVec3::Z)
    }

    /// Returns the half extents of the image at unit distance.
    pub fn half(&self) -> [f64; 2] {
        self.half
    }

    /// Returns the image.
    pub(super) fn values(&self) -> EmitterValues<'_> {
        EmitterValues::Slide(self.picture.slide())
    }

    /// Returns the image coordinates, in [0, 1]² from the top left, of a unit direction, and its
    /// cosine to the axis. Returns `None` outside the image.
    pub(super) fn locate(&self, direction: DVec3) -> Option<([f64; 2], f64)> {
        let d = self.orientation.to_local(direction);
        if d.z <= 0.0 {
            return None;
        }
        let uv = [0, 1].map(|k| 0.5 * (1.0 - d[k] / (d.z * self.half[k])));
        uv.iter()
            .all(|c| (0.0..=1.0).contains(c))
            .then_some((uv, d.z))
    }

    /// Returns the radiant intensity in a unit direction. At unit distance, the irradiance
    /// perpendicular to the axis is π times the pixel, so I = π L/cos³θ.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let Some((uv, cos)) = self.locate(direction) else {
            return Spectrum::ZERO;
        };
        self.picture.at(uv) * (PI / cos.powi(3))
    }

    /// Returns the total power: π times the mean of the image times the area of the screen.
    pub fn power(&self) -> Spectrum {
        self.picture.mean() * (PI * self.area())
    }

    /// Returns the area of the image at unit distance.
    fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1]
    }

    /// Samples a direction with density proportional to the image, summed over channels, on the
    /// screen.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let uv = self.picture.sample(u);
        let [x, y] = [0, 1].map(|k| (1.0 - 2.0 * uv[k]) * self.half[k]);
        self.orientation.to_world(DVec3::new(x, y, 1.0).normalize())
    }

    /// Returns the density of [`Projector::sample`] per steradian: dΩ = cos³θ dA.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        self.locate(direction).map_or(0.0, |(uv, cos)| {
            self.picture.pdf(uv) / (self.area() * cos.powi(3))
        })
    }
}
