//! Collimated beam: a laser, or a rectangle of parallel light.

use super::aperture::{Aperture, BeamProfile};
use crate::Spectrum;
use glam::DVec3;

/// Beam of parallel rays that starts on a plane.
#[derive(Clone, Debug)]
pub struct Collimated {
    aperture: Aperture,
    /// Irradiance on the axis; for an aperture with an image, the irradiance where the image is
    /// one.
    peak: Spectrum,
}

impl Collimated {
    /// Creates a beam of the given total power. `origin` is the centre of the aperture, and
    /// `direction` is the direction of the light, not zero.
    pub fn new(origin: DVec3, direction: DVec3, profile: BeamProfile, power: Spectrum) -> Self {
        Collimated::through(Aperture::new(origin, direction, profile), power)
    }

    /// Creates a beam of the given total power through an aperture. There is no light in channels
    /// in which the image is black.
    pub fn through(aperture: Aperture, power: Spectrum) -> Self {
        let peak = aperture.peak(power);
        Collimated { aperture, peak }
    }

    /// Creates a beam of the given irradiance on the axis; for an aperture with an image, the
    /// irradiance where the image is one.
    pub fn with_irradiance(aperture: Aperture, irradiance: Spectrum) -> Self {
        Collimated {
            aperture,
            peak: irradiance,
        }
    }

    /// Returns the beam displaced by `shift`.
    pub fn moved(mut self, shift: DVec3) -> Self {
        self.aperture = self.aperture.moved(shift);
        self
    }

    /// Returns the aperture from which the beam starts.
    pub fn aperture(&self) -> &Aperture {
        &self.aperture
    }

    /// Returns the centre of the aperture.
    pub fn origin(&self) -> DVec3 {
        self.aperture.origin()
    }

    /// Returns the unit direction of the light.
    pub fn direction(&self) -> DVec3 {
        self.aperture.direction()
    }

    /// Returns the irradiance on the axis; for an aperture with an image, the irradiance where the
    /// image is one.
    pub(super) fn peak(&self) -> Spectrum {
        self.peak
    }

    /// Returns the total power.
    pub fn power(&self) -> Spectrum {
        self.peak * self.aperture.area()
    }

    /// Returns the radius that contains most of the beam.
    pub fn radius(&self) -> f64 {
        self.aperture.radius()
    }

    /// Returns the irradiance at a point of the aperture plane.
    pub fn irradiance(&self, point: DVec3) -> Spectrum {
        self.peak * self.aperture.relative(point)
    }
}
