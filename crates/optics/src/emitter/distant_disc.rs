//! A disc in the sky, such as the sun's.

use crate::Spectrum;
use crate::sampling::Frame;
use crate::sampling::sphere::{uniform_cone_pdf, uniform_cone_sample};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// The same radiance from all directions within an angle around one.
#[derive(Clone, Copy, Debug)]
pub struct DistantDisc {
    frame: Frame,
    /// 1 − cos of the half angle.
    height: f64,
    radiance: Spectrum,
}

/// Why there is no such disc.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DiscError {
    /// The centre is no direction.
    #[error("the direction of a disc in the sky must not be zero")]
    Direction,
    /// The half angle is out of range.
    #[error("the half angle of a disc in the sky must lie in (0, π], got {0}")]
    HalfAngle(f64),
}

impl DistantDisc {
    /// A disc around the direction `center`, as seen from the scene, of `half_angle` in radians, in (0, π], and `radiance` ≥ 0.
    ///
    /// # Errors
    /// A direction that is zero or not finite, or a half angle out of range.
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

    /// Solid angle in steradians.
    pub fn solid_angle(&self) -> f64 {
        // Planted error "discs in the sky brighter than their radiance over their solid angle", found by morgana-transport/transport::emitters::discs_in_the_sky_are_sampled_by_their_density:
        // TAU * self.height * 0.9
        TAU * self.height
    }

    /// Radiance within the disc.
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
