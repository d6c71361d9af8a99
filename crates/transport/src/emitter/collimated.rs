//! Collimated beam: a laser.

use crate::Spectrum;
use crate::sampling::Frame;
use crate::sampling::disc::{
    gaussian_disc_pdf, gaussian_disc_sample, uniform_disc_pdf, uniform_disc_sample,
};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// How a beam's irradiance varies across it.
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
}

impl BeamProfile {
    /// ∫ irradiance dA over that on the axis.
    fn area(self) -> f64 {
        match self {
            BeamProfile::Disc { radius } => PI * radius * radius,
            BeamProfile::Gaussian { waist } => 0.5 * PI * waist * waist,
        }
    }
}

/// A beam of parallel rays that starts on a plane.
#[derive(Clone, Debug)]
pub struct Collimated {
    origin: DVec3,
    direction: DVec3,
    profile: BeamProfile,
    /// Irradiance on the axis.
    peak: Spectrum,
}

impl Collimated {
    /// A beam of the given total power; `origin` is the centre of the aperture, `direction` that of the
    /// light, not zero.
    pub fn new(origin: DVec3, direction: DVec3, profile: BeamProfile, power: Spectrum) -> Self {
        Collimated {
            origin,
            direction: direction.normalize(),
            profile,
            peak: power / profile.area(),
        }
    }

    /// Centre of the aperture.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Unit direction of the light.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// Total power.
    pub fn power(&self) -> Spectrum {
        self.peak * self.profile.area()
    }

    /// Radius that contains most of the beam.
    pub fn radius(&self) -> f64 {
        match self.profile {
            BeamProfile::Disc { radius } => radius,
            BeamProfile::Gaussian { waist } => waist,
        }
    }

    /// Irradiance at a point of the aperture plane.
    pub fn irradiance(&self, point: DVec3) -> Spectrum {
        let r = self.distance(point);
        match self.profile {
            BeamProfile::Disc { radius } if r <= radius => self.peak,
            BeamProfile::Disc { .. } => Spectrum::ZERO,
            BeamProfile::Gaussian { waist } => self.peak * (-2.0 * (r / waist).powi(2)).exp(),
        }
    }

    /// A point of the aperture plane, in proportion to the irradiance there.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let p = match self.profile {
            BeamProfile::Disc { radius } => radius * uniform_disc_sample(u),
            BeamProfile::Gaussian { waist } => gaussian_disc_sample(deviation(waist), u),
        };
        self.origin + Frame::from_normal(self.direction).to_world(p.extend(0.0))
    }

    /// Density of [`Collimated::sample`] per unit area.
    pub(super) fn pdf(&self, point: DVec3) -> f64 {
        let p = DVec2::new(self.distance(point), 0.0);
        match self.profile {
            BeamProfile::Disc { radius } => uniform_disc_pdf(p / radius) / (radius * radius),
            BeamProfile::Gaussian { waist } => gaussian_disc_pdf(deviation(waist), p),
        }
    }

    /// Distance from the axis.
    fn distance(&self, point: DVec3) -> f64 {
        (point - self.origin)
            .reject_from_normalized(self.direction)
            .length()
    }
}

/// Standard deviation of exp(−2r²/w²) along each axis.
fn deviation(waist: f64) -> f64 {
    0.5 * waist
}
