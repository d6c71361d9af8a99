//! Collimated beam: a laser, or a rectangle of parallel light.

use super::aperture::{Aperture, BeamProfile};
use crate::Spectrum;
use glam::DVec3;

/// A beam of parallel rays that starts on a plane.
#[derive(Clone, Debug)]
pub struct Collimated {
    aperture: Aperture,
    /// Irradiance on the axis; with an image, where that is one.
    peak: Spectrum,
}

impl Collimated {
    /// A beam of the given total power; `origin` is the centre of the aperture, `direction` that of the
    /// light, not zero.
    pub fn new(origin: DVec3, direction: DVec3, profile: BeamProfile, power: Spectrum) -> Self {
        Collimated::through(Aperture::new(origin, direction, profile), power)
    }

    /// A beam of the given total power through an aperture; none in channels in which its image is black.
    pub fn through(aperture: Aperture, power: Spectrum) -> Self {
        let peak = aperture.peak(power);
        Collimated { aperture, peak }
    }

    /// A beam of the given irradiance on the axis; with an image, where that is one.
    pub fn with_irradiance(aperture: Aperture, irradiance: Spectrum) -> Self {
        Collimated {
            aperture,
            peak: irradiance,
        }
    }

    /// The same, displaced by `shift`.
    pub fn moved(mut self, shift: DVec3) -> Self {
        self.aperture = self.aperture.moved(shift);
        self
    }

    /// Where it starts.
    pub fn aperture(&self) -> &Aperture {
        &self.aperture
    }

    /// Centre of the aperture.
    pub fn origin(&self) -> DVec3 {
        self.aperture.origin()
    }

    /// Unit direction of the light.
    pub fn direction(&self) -> DVec3 {
        self.aperture.direction()
    }

    /// Irradiance on the axis; with an image, where that is one.
    pub(super) fn peak(&self) -> Spectrum {
        self.peak
    }

    /// Total power.
    pub fn power(&self) -> Spectrum {
        self.peak * self.aperture.area()
    }

    /// Radius that contains most of the beam.
    pub fn radius(&self) -> f64 {
        self.aperture.radius()
    }

    /// Irradiance at a point of the aperture plane.
    pub fn irradiance(&self, point: DVec3) -> Spectrum {
        self.peak * self.aperture.relative(point)
    }
}
