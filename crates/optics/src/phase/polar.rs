//! Scattering angles that keep their digits near 0 and π.

use crate::sampling::Frame;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Scattering angle θ, stored as 1 − cosθ and 1 + cosθ. These keep the digits of a narrow forward
/// lobe, which the cosine would lose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polar {
    /// Value of 1 − cosθ, in [0, 2].
    pub below: f64,
    /// Value of 1 + cosθ, in [0, 2].
    pub above: f64,
}

impl Polar {
    /// Creates the angle from 1 − cosθ.
    pub(super) fn from_below(below: f64) -> Self {
        let below = below.clamp(0.0, 2.0);
        Polar {
            below,
            above: 2.0 - below,
        }
    }

    /// Creates the angle from cosθ.
    pub(super) fn from_cos(cos: f64) -> Self {
        Polar {
            below: 1.0 - cos,
            above: 1.0 + cos,
        }
    }

    /// Returns cosθ.
    pub(super) fn cos(self) -> f64 {
        if self.below < self.above {
            1.0 - self.below
        } else {
            self.above - 1.0
        }
    }

    /// Returns the unit vector at this angle from `axis`, rotated around it by a fraction `u` of a
    /// turn.
    pub(super) fn around(self, axis: DVec3, u: f64) -> DVec3 {
        let turn = DVec2::from_angle(TAU * u);
        // Normalise, so that the length does not drift over thousands of scattering events.
        self.across(axis, turn).normalize()
    }

    /// Returns the vector at this angle from `axis`, of about unit length, given the cosine and
    /// sine of the azimuth.
    #[inline]
    pub(super) fn turned(self, axis: DVec3, around: [f64; 2]) -> DVec3 {
        let direction = self.across(axis, around.into());
        // Apply a step of Newton's method towards unit length, which squares the error.
        direction * (1.5 - 0.5 * direction.length_squared())
    }

    /// Returns a vector as long as `axis`, up to rounding.
    #[inline]
    fn across(self, axis: DVec3, turn: DVec2) -> DVec3 {
        let sin = (self.below * self.above).max(0.0).sqrt();
        Frame::from_normal(axis).to_world((sin * turn).extend(self.cos()))
    }
}
