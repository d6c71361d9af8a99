//! Apertures: where across a beam its light starts, and how much of it.

use super::picture::Picture;
use super::slide::Slide;
use crate::sampling::disc::{
    gaussian_disc_pdf, gaussian_disc_sample, uniform_disc_pdf, uniform_disc_sample,
};
use crate::sampling::{DistributionError, Frame};
use crate::{Orientation, Spectrum};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// How a beam's irradiance varies across it. Lengths are > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamProfile {
    /// Constant inside a disc.
    Disc {
        /// Its radius.
        radius: f64,
    },
    /// exp(−2r²/w²).
    Gaussian {
        /// Radius w at which the irradiance has fallen to 1/e² of that on the axis.
        waist: f64,
    },
    /// Constant inside a rectangle.
    Rectangle {
        /// Its extent along local x.
        width: f64,
        /// Its extent along local y.
        height: f64,
    },
}

impl BeamProfile {
    /// ∫ irradiance dA over that on the axis.
    fn area(self) -> f64 {
        match self {
            BeamProfile::Disc { radius } => PI * radius * radius,
            BeamProfile::Gaussian { waist } => 0.5 * PI * waist * waist,
            BeamProfile::Rectangle { width, height } => width * height,
        }
    }

    /// Radius that contains most of the light.
    fn radius(self) -> f64 {
        match self {
            BeamProfile::Disc { radius } => radius,
            BeamProfile::Gaussian { waist } => waist,
            BeamProfile::Rectangle { width, height } => 0.5 * width.hypot(height),
        }
    }

    /// Radius beyond which there is nothing to speak of.
    fn reach(self) -> f64 {
        match self {
            BeamProfile::Rectangle { .. } => self.radius(),
            _ => 3.0 * self.radius(),
        }
    }

    /// Irradiance at a local point over that on the axis.
    fn relative(self, p: DVec2) -> f64 {
        let within = match self {
            BeamProfile::Disc { radius } => p.length() <= radius,
            BeamProfile::Gaussian { waist } => return (-2.0 * (p.length() / waist).powi(2)).exp(),
            BeamProfile::Rectangle { width, height } => {
                p.x.abs() <= 0.5 * width && p.y.abs() <= 0.5 * height
            }
        };
        f64::from(u8::from(within))
    }

    /// A local point in proportion to the irradiance.
    fn sample(self, u: [f64; 2]) -> DVec2 {
        match self {
            BeamProfile::Disc { radius } => radius * uniform_disc_sample(u),
            BeamProfile::Gaussian { waist } => gaussian_disc_sample(deviation(waist), u),
            BeamProfile::Rectangle { width, height } => {
                DVec2::new((u[0] - 0.5) * width, (u[1] - 0.5) * height)
            }
        }
    }

    /// Density of [`BeamProfile::sample`] per unit area.
    fn pdf(self, p: DVec2) -> f64 {
        match self {
            BeamProfile::Disc { radius } => uniform_disc_pdf(p / radius) / (radius * radius),
            BeamProfile::Gaussian { waist } => gaussian_disc_pdf(deviation(waist), p),
            BeamProfile::Rectangle { .. } => self.relative(p) / self.area(),
        }
    }
}

/// The part of a plane on which a beam starts, which way it goes, and how its irradiance varies there.
#[derive(Clone, Debug)]
pub struct Aperture {
    origin: DVec3,
    /// The light goes along +z. Left-handed if a transform mirrors it.
    frame: Frame,
    profile: BeamProfile,
    /// A factor of the irradiance, over a rectangle.
    picture: Option<Arc<Picture>>,
}

impl Aperture {
    /// An aperture around `origin` across `direction`, in which the light goes, not zero. A rectangle should rather have
    /// an [orientation](Aperture::oriented).
    pub fn new(origin: DVec3, direction: DVec3, profile: BeamProfile) -> Self {
        Aperture {
            origin,
            frame: Frame::from_normal(direction.normalize()),
            profile,
            picture: None,
        }
    }

    /// An aperture around `origin`; the light goes along local +z.
    pub fn oriented(origin: DVec3, orientation: Orientation, profile: BeamProfile) -> Self {
        let [s, t, n] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| orientation.to_world(axis));
        Aperture {
            origin,
            frame: Frame { s, t, n },
            profile,
            picture: None,
        }
    }

    /// A rectangle of a `width` along local x and a `height` along local y with an image as a factor of its irradiance:
    /// for someone who looks along the light, with local +y up, it is the right way round.
    ///
    /// # Errors
    /// The image is black, or not as it says.
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

    /// The same, displaced by `shift`.
    pub(crate) fn moved(mut self, shift: DVec3) -> Self {
        self.origin += shift;
        self
    }

    /// Its centre.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Unit direction in which the light goes at its centre.
    pub fn direction(&self) -> DVec3 {
        self.frame.n
    }

    /// How the irradiance varies across it, but for the image.
    pub fn profile(&self) -> BeamProfile {
        self.profile
    }

    /// Radius that contains most of the light.
    pub fn radius(&self) -> f64 {
        self.profile.radius()
    }

    /// Radius beyond which there is no light to speak of.
    pub fn reach(&self) -> f64 {
        self.profile.reach()
    }

    /// ∫ relative irradiance dA.
    pub(super) fn area(&self) -> Spectrum {
        let area = Spectrum::splat(self.profile.area());
        self.picture
            .as_ref()
            .map_or(area, |picture| area * picture.mean())
    }

    /// Irradiance where it is one relatively, of light of the given total power; zero in channels in which its image is
    /// black.
    pub(super) fn peak(&self, power: Spectrum) -> Spectrum {
        let area = self.area();
        power.zip(
            area,
            |power, area| {
                if area > 0.0 { power / area } else { 0.0 }
            },
        )
    }

    /// The image, if there is one.
    pub(super) fn slide(&self) -> Option<&Slide> {
        self.picture.as_ref().map(|picture| picture.slide())
    }

    /// Image coordinates in [0, 1]² from the top left of a point of the plane.
    pub(super) fn locate(&self, point: DVec3) -> [f64; 2] {
        self.coordinates(self.to_local(point))
    }

    /// Irradiance at a point of the plane over that of the profile on the axis, times the image.
    pub(super) fn relative(&self, point: DVec3) -> Spectrum {
        let p = self.to_local(point);
        let relative = self.profile.relative(p);
        match &self.picture {
            Some(picture) if relative > 0.0 => picture.at(self.coordinates(p)),
            _ => Spectrum::splat(relative),
        }
    }

    /// A point in proportion to the irradiance, summed over the channels of an image.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let p = match &self.picture {
            Some(picture) => self.profile.sample(picture.sample(u).map(|c| 1.0 - c)),
            None => self.profile.sample(u),
        };
        self.origin + self.frame.to_world(p.extend(0.0))
    }

    /// Density of [`Aperture::sample`] per unit area.
    pub(super) fn pdf(&self, point: DVec3) -> f64 {
        let p = self.to_local(point);
        let pdf = self.profile.pdf(p);
        match &self.picture {
            Some(picture) if pdf > 0.0 => pdf * picture.pdf(self.coordinates(p)),
            _ => pdf,
        }
    }

    /// A point in the plane's own coordinates; of round profiles just its distance from the axis.
    fn to_local(&self, point: DVec3) -> DVec2 {
        let offset = point - self.origin;
        match self.profile {
            BeamProfile::Rectangle { .. } => self.frame.to_local(offset).truncate(),
            _ => DVec2::new(offset.reject_from_normalized(self.frame.n).length(), 0.0),
        }
    }

    /// Image coordinates in [0, 1]² from the top left.
    fn coordinates(&self, p: DVec2) -> [f64; 2] {
        match self.profile {
            BeamProfile::Rectangle { width, height } => [0.5 - p.x / width, 0.5 - p.y / height],
            _ => [0.5; 2],
        }
    }
}

/// Standard deviation of exp(−2r²/w²) along each axis.
fn deviation(waist: f64) -> f64 {
    0.5 * waist
}
