//! Apertures: position, shape and irradiance of the start of a beam.

use super::picture::Picture;
use super::slide::Slide;
use crate::sampling::disc::{
    disc_to_ring, gaussian_disc_pdf, gaussian_disc_sample, uniform_disc_pdf, uniform_disc_sample,
};
use crate::sampling::{DistributionError, Frame};
use crate::{Orientation, Spectrum};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Irradiance across a beam. Lengths are > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamProfile {
    /// Constant inside a disc.
    Disc {
        /// Radius of the disc.
        radius: f64,
    },
    /// Constant between two circles.
    Annulus {
        /// Radius of the inner circle, below the radius of the outer circle.
        inner: f64,
        /// Radius of the outer circle.
        radius: f64,
    },
    /// Gaussian exp(−2r²/w²).
    Gaussian {
        /// Radius w at which the irradiance is 1/e² of its value on the axis.
        waist: f64,
    },
    /// Constant inside a rectangle.
    Rectangle {
        /// Extent along local x.
        width: f64,
        /// Extent along local y.
        height: f64,
    },
    /// Constant inside a parallelogram with two sides along local x.
    Parallelogram {
        /// Length of the sides along local x.
        width: f64,
        /// Distance between these sides, along local y.
        height: f64,
        /// Displacement along local x of the side at larger y, from the side at smaller y; of any
        /// sign.
        skew: f64,
    },
}

impl BeamProfile {
    /// Returns ∫ irradiance dA over the irradiance on the axis.
    fn area(self) -> f64 {
        match self {
            BeamProfile::Disc { radius } => PI * radius * radius,
            BeamProfile::Annulus { inner, radius } => PI * (radius - inner) * (radius + inner),
            BeamProfile::Gaussian { waist } => 0.5 * PI * waist * waist,
            BeamProfile::Rectangle { width, height }
            | BeamProfile::Parallelogram { width, height, .. } => width * height,
        }
    }

    /// Returns the radius that contains most of the light.
    fn radius(self) -> f64 {
        match self {
            BeamProfile::Disc { radius } | BeamProfile::Annulus { radius, .. } => radius,
            BeamProfile::Gaussian { waist } => waist,
            BeamProfile::Rectangle { width, height } => 0.5 * width.hypot(height),
            BeamProfile::Parallelogram {
                width,
                height,
                skew,
            } => 0.5 * (width + skew.abs()).hypot(height),
        }
    }

    /// Returns the radius beyond which the light is negligible.
    fn reach(self) -> f64 {
        match self {
            BeamProfile::Rectangle { .. } | BeamProfile::Parallelogram { .. } => self.radius(),
            _ => 3.0 * self.radius(),
        }
    }

    /// Returns the irradiance at a local point over the irradiance on the axis.
    fn relative(self, p: DVec2) -> f64 {
        let within = match self {
            BeamProfile::Disc { radius } => p.length() <= radius,
            BeamProfile::Annulus { inner, radius } => (inner..=radius).contains(&p.length()),
            BeamProfile::Gaussian { waist } => return (-2.0 * (p.length() / waist).powi(2)).exp(),
            BeamProfile::Rectangle { width, height } => {
                p.x.abs() <= 0.5 * width && p.y.abs() <= 0.5 * height
            }
            BeamProfile::Parallelogram {
                width,
                height,
                skew,
            } => {
                let y = p.y / height;
                (p.x - y * skew).abs() <= 0.5 * width && y.abs() <= 0.5
            }
        };
        f64::from(u8::from(within))
    }

    /// Samples a local point with density proportional to the irradiance.
    fn sample(self, u: [f64; 2]) -> DVec2 {
        match self {
            BeamProfile::Disc { radius } => radius * uniform_disc_sample(u),
            BeamProfile::Annulus { inner, radius } => {
                radius * disc_to_ring(inner / radius, uniform_disc_sample(u))
            }
            BeamProfile::Gaussian { waist } => gaussian_disc_sample(deviation(waist), u),
            BeamProfile::Rectangle { width, height } => {
                DVec2::new((u[0] - 0.5) * width, (u[1] - 0.5) * height)
            }
            BeamProfile::Parallelogram {
                width,
                height,
                skew,
            } => {
                let [x, y] = u.map(|u| u - 0.5);
                DVec2::new(x * width + y * skew, y * height)
            }
        }
    }

    /// Returns the density of [`BeamProfile::sample`] per unit area.
    fn pdf(self, p: DVec2) -> f64 {
        match self {
            BeamProfile::Disc { radius } => uniform_disc_pdf(p / radius) / (radius * radius),
            BeamProfile::Gaussian { waist } => gaussian_disc_pdf(deviation(waist), p),
            _ => self.relative(p) / self.area(),
        }
    }
}

/// Part of a plane on which a beam starts, with the direction and the irradiance profile of the
/// beam.
#[derive(Clone, Debug)]
pub struct Aperture {
    origin: DVec3,
    /// Frame with +z along the light. It is left-handed if a transform mirrors it.
    frame: Frame,
    profile: BeamProfile,
    /// Image that multiplies the irradiance over a rectangle.
    picture: Option<Arc<Picture>>,
}

impl Aperture {
    /// Creates an aperture around `origin`, perpendicular to the light along `direction`, not zero.
    /// For a rectangle, [`Aperture::oriented`] also sets its rotation.
    pub fn new(origin: DVec3, direction: DVec3, profile: BeamProfile) -> Self {
        Aperture {
            origin,
            frame: Frame::from_normal(direction.normalize()),
            profile,
            picture: None,
        }
    }

    /// Creates an aperture around `origin`, with light along local +z.
    pub fn oriented(origin: DVec3, orientation: Orientation, profile: BeamProfile) -> Self {
        let [s, t, n] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| orientation.to_world(axis));
        Aperture {
            origin,
            frame: Frame { s, t, n },
            profile,
            picture: None,
        }
    }

    /// Creates a rectangle with `width` along local x, `height` along local y, and an image that
    /// multiplies its irradiance. The image is upright for an observer who looks along the light,
    /// with local +y up.
    ///
    /// # Errors
    /// Fails if the image is black, or if its number of pixels does not match its size.
    pub fn picture(
        origin: DVec3,
        orientation: Orientation,
        [width, height]: [f64; 2],
        slide: Slide,
    ) -> Result<Self, DistributionError> {
        let rectangle = BeamProfile::Rectangle { width, height };
        Ok(Aperture {
            picture: Some(Arc::new(Picture::new(slide)?)),
            ..Aperture::oriented(origin, orientation, rectangle)
        })
    }

    /// Returns the aperture with its rectangle, and the image of the rectangle, sheared into a
    /// parallelogram: `skew` is the displacement along local x of the side at larger y, from the
    /// side at smaller y. Round apertures do not change.
    pub fn with_skew(self, skew: f64) -> Self {
        let profile = match self.profile {
            BeamProfile::Rectangle { width, height } => BeamProfile::Parallelogram {
                width,
                height,
                skew,
            },
            round => round,
        };
        Aperture { profile, ..self }
    }

    /// Returns the aperture displaced by `shift`.
    pub(crate) fn moved(mut self, shift: DVec3) -> Self {
        self.origin += shift;
        self
    }

    /// Returns the centre.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the frame: local +z is the normal of the plane, on the side of the light.
    pub(super) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns the unit normal of the plane, on the side of the light.
    pub fn direction(&self) -> DVec3 {
        self.frame.n
    }

    /// Returns the irradiance profile, without the image.
    pub fn profile(&self) -> BeamProfile {
        self.profile
    }

    /// Returns the radius that contains most of the light.
    pub fn radius(&self) -> f64 {
        self.profile.radius()
    }

    /// Returns the radius beyond which the light is negligible.
    pub fn reach(&self) -> f64 {
        self.profile.reach()
    }

    /// Returns ∫ relative irradiance dA.
    pub(super) fn area(&self) -> Spectrum {
        let area = Spectrum::splat(self.profile.area());
        self.picture
            .as_ref()
            .map_or(area, |picture| area * picture.mean())
    }

    /// Returns the irradiance where the relative irradiance is one, for light of the given total
    /// power. It is zero in channels in which the image is black.
    pub(super) fn peak(&self, power: Spectrum) -> Spectrum {
        let area = self.area();
        power.zip(
            area,
            |power, area| {
                if area > 0.0 { power / area } else { 0.0 }
            },
        )
    }

    /// Returns the image, if there is one.
    pub(super) fn slide(&self) -> Option<&Slide> {
        self.picture.as_ref().map(|picture| picture.slide())
    }

    /// Returns the image coordinates, in [0, 1]² from the top left, of a point of the plane.
    pub(super) fn locate(&self, point: DVec3) -> [f64; 2] {
        self.coordinates(self.to_local(point))
    }

    /// Returns the relative irradiance at a point of the plane: the profile over its value on the
    /// axis, times the image.
    pub(super) fn relative(&self, point: DVec3) -> Spectrum {
        let p = self.to_local(point);
        let relative = self.profile.relative(p);
        match &self.picture {
            Some(picture) if relative > 0.0 => picture.at(self.coordinates(p)),
            _ => Spectrum::splat(relative),
        }
    }

    /// Samples a point with density proportional to the irradiance, summed over the channels of an
    /// image.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let p = match &self.picture {
            Some(picture) => self.profile.sample(picture.sample(u).map(|c| 1.0 - c)),
            None => self.profile.sample(u),
        };
        self.origin + self.frame.to_world(p.extend(0.0))
    }

    /// Returns the density of [`Aperture::sample`] per unit area.
    pub(super) fn pdf(&self, point: DVec3) -> f64 {
        let p = self.to_local(point);
        let pdf = self.profile.pdf(p);
        match &self.picture {
            Some(picture) if pdf > 0.0 => pdf * picture.pdf(self.coordinates(p)),
            _ => pdf,
        }
    }

    /// Converts a point to coordinates of the plane. For round profiles, only the distance from the
    /// axis is computed.
    fn to_local(&self, point: DVec3) -> DVec2 {
        let offset = point - self.origin;
        match self.profile {
            BeamProfile::Rectangle { .. } | BeamProfile::Parallelogram { .. } => {
                self.frame.to_local(offset).truncate()
            }
            _ => DVec2::new(offset.reject_from_normalized(self.frame.n).length(), 0.0),
        }
    }

    /// Returns image coordinates in [0, 1]² from the top left.
    fn coordinates(&self, p: DVec2) -> [f64; 2] {
        match self.profile {
            BeamProfile::Rectangle { width, height } => [0.5 - p.x / width, 0.5 - p.y / height],
            BeamProfile::Parallelogram {
                width,
                height,
                skew,
            } => {
                let y = p.y / height;
                [0.5 - (p.x - y * skew) / width, 0.5 - y]
            }
            _ => [0.5; 2],
        }
    }
}

/// Returns the standard deviation of exp(−2r²/w²) along each axis.
fn deviation(waist: f64) -> f64 {
    0.5 * waist
}
