//! Scattering angles that keep their digits near 0 and π.

use crate::sampling::Frame;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A scattering angle θ as 1 − cosθ and 1 + cosθ: a sharply forward lobe lives in the digits that
/// the cosine itself would lose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polar {
    /// 1 − cosθ, in [0, 2].
    pub below: f64,
    /// 1 + cosθ, in [0, 2].
    pub above: f64,
}

impl Polar {
    /// From 1 − cosθ.
    pub(super) fn from_below(below: f64) -> Self {
        let below = below.clamp(0.0, 2.0);
        Polar {
            below,
            above: 2.0 - below,
        }
    }

    /// From cosθ.
    pub(super) fn from_cos(cos: f64) -> Self {
        Polar {
            below: 1.0 - cos,
            above: 1.0 + cos,
        }
    }

    /// cosθ.
    pub(super) fn cos(self) -> f64 {
        if self.below < self.above {
            1.0 - self.below
        } else {
            self.above - 1.0
        }
    }

    /// The unit vector at this angle from `axis`, turned around it by `u` of a full turn.
    pub(super) fn around(self, axis: DVec3, u: f64) -> DVec3 {
        let turn = DVec2::from_angle(TAU * u);
        // Normalised, so that the length does not drift over thousands of scattering events.
        self.across(axis, turn).normalize()
    }

    /// The unit vector at this angle from `axis`, of about unit length, given the cosine and sine of the angle around it.
    #[inline]
    pub(super) fn turned(self, axis: DVec3, around: [f64; 2]) -> DVec3 {
        let direction = self.across(axis, around.into());
        // A step of Newton's method towards unit length squares its error.
        direction * (1.5 - 0.5 * direction.length_squared())
    }

    /// As long as `axis`, up to rounding.
    #[inline]
    fn across(self, axis: DVec3, turn: DVec2) -> DVec3 {
        let sin = (self.below * self.above).max(0.0).sqrt();
        Frame::from_normal(axis).to_world((sin * turn).extend(self.cos()))
    }
}
