//! Disc at infinity, such as the sun.

use crate::Spectrum;
use crate::sampling::Frame;
use crate::sampling::sphere::{uniform_cone_pdf, uniform_cone_sample};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Environment with the same radiance from all directions within an angle around a centre.
#[derive(Clone, Copy, Debug)]
pub struct DistantDisc {
    frame: Frame,
    /// Value of 1 − cos of the half angle.
    height: f64,
    radiance: Spectrum,
}

/// Reason why a disc at infinity cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DiscError {
    /// The direction of the centre is zero or not finite.
    #[error("the direction of a disc in the sky must not be zero")]
    Direction,
    /// The half angle is out of range.
    #[error("the half angle of a disc in the sky must lie in (0, π], got {0}")]
    HalfAngle(f64),
}

impl DistantDisc {
    /// Creates a disc around the direction `center`, as seen from the scene. `half_angle` is in
    /// radians, in (0, π], and `radiance` ≥ 0.
    ///
    /// # Errors
    /// Fails if the direction is zero or not finite, or if the half angle is out of range.
    pub fn new(
        center: DVec3,
        half_angle: f64,
        radiance: impl Into<Spectrum>,
    ) -> Result<Self, DiscError> {
        let axis = center.try_normalize().ok_or(DiscError::Direction)?;
        if !(half_angle > 0.0 && half_angle <= PI) {
            return Err(DiscError::HalfAngle(half_angle));
        }
        let sin = (0.5 * half_angle).sin();
        Ok(DistantDisc {
            frame: Frame::from_normal(axis),
            height: 2.0 * sin * sin,
            radiance: radiance.into(),
        })
    }

    /// Returns the solid angle in steradians.
    pub fn solid_angle(&self) -> f64 {
        // Planted error "discs in the sky brighter than their radiance over their solid angle", found by morgana-transport/transport::emitters::discs_in_the_sky_are_sampled_by_their_density:
        // TAU * self.height * 0.9
        TAU * self.height
    }

    /// Returns the radiance within the disc.
    pub(super) fn scale(&self) -> Spectrum {
        self.radiance
    }

    pub(super) fn radiance(&self, toward: DVec3) -> Spectrum {
        if self.pdf(toward) > 0.0 {
            self.radiance
        } else {
            Spectrum::ZERO
        }
    }

    pub(super) fn sample(&self, u: [f64; 2]) -> (DVec3, f64) {
        let local = uniform_cone_sample(self.height, u);
        let toward = self.frame.to_world(local).normalize();
        (toward, 1.0 / self.solid_angle())
    }

    pub(super) fn pdf(&self, toward: DVec3) -> f64 {
        uniform_cone_pdf(self.height, self.frame.to_local(toward))
    }

    pub(super) fn integral(&self) -> Spectrum {
        self.radiance * self.solid_angle()
    }
}
