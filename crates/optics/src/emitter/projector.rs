//! A point that throws an image, as a slide projector does.

use super::picture::Picture;
use super::slide::Slide;
use crate::sampling::DistributionError;
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::PI;

/// A projector (Mitsuba's `projector`). A white diffuse screen across its axis at unit distance shows the image.
#[derive(Clone, Debug)]
pub struct Projector {
    position: DVec3,
    /// Local axes: +x to the left of the image, +y up, +z forwards.
    orientation: Orientation,
    /// Half extents of the image at unit distance.
    half: [f64; 2],
    picture: Picture,
}

impl Projector {
    /// An image that is `fov_x` wide, in radians in (0, π).
    ///
    /// # Errors
    /// An image without pixels or light, or whose values are negative or not finite.
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

    /// The same, displaced by `shift`.
    pub fn moved(mut self, shift: DVec3) -> Self {
        self.position += shift;
        self
    }

    /// Where the light is.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Unit direction in which it throws the middle of the image.
    pub fn axis(&self) -> DVec3 {
        self.orientation.to_world(DVec3::Z)
    }

    /// Half extents of the image at unit distance.
    pub fn half(&self) -> [f64; 2] {
        self.half
    }

    /// The image.
    pub(super) fn slide(&self) -> &Slide {
        self.picture.slide()
    }

    /// Image coordinates in [0, 1]² from the top left of a unit direction, and its cosine to the axis; `None`
    /// beside the image.
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

    /// Radiant intensity in a unit direction: at unit distance an irradiance of π times the pixel falls across
    /// the axis, so that I = π L/cos³θ.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let Some((uv, cos)) = self.locate(direction) else {
            return Spectrum::ZERO;
        };
        self.picture.at(uv) * (PI / cos.powi(3))
    }

    /// Total power: π times the image's mean times the area of the screen.
    pub fn power(&self) -> Spectrum {
        self.picture.mean() * (PI * self.area())
    }

    /// Area of the image at unit distance.
    fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1]
    }

    /// A direction in proportion to the image, summed over channels, on the screen.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let uv = self.picture.sample(u);
        let [x, y] = [0, 1].map(|k| (1.0 - 2.0 * uv[k]) * self.half[k]);
        self.orientation.to_world(DVec3::new(x, y, 1.0).normalize())
    }

    /// Density of [`Projector::sample`] per steradian: dΩ = cos³θ dA.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        self.locate(direction).map_or(0.0, |(uv, cos)| {
            self.picture.pdf(uv) / (self.area() * cos.powi(3))
        })
    }
}
