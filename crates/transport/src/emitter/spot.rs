//! Spotlight.

use crate::Spectrum;
use glam::DVec3;

/// A point source with full intensity inside a cone, falling linearly with the angle to zero at a
/// wider one (as Mitsuba's `spot`).
#[derive(Clone, Debug)]
pub struct Spot {
    position: DVec3,
    axis: DVec3,
    intensity: Spectrum,
    cutoff: f64,
    beam_width: f64,
}

impl Spot {
    /// `axis` is the unit direction of the cone; angles are half angles in radians, with
    /// 0 ≤ `beam_width` ≤ `cutoff`.
    pub fn new(
        position: DVec3,
        axis: DVec3,
        intensity: Spectrum,
        (cutoff, beam_width): (f64, f64),
    ) -> Self {
        Spot {
            position,
            axis,
            intensity,
            cutoff,
            beam_width,
        }
    }

    /// Where the light is.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Radiant intensity in a unit direction.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let angle = self.axis.angle_between(direction);
        if angle <= self.beam_width {
            self.intensity
        } else if angle >= self.cutoff {
            Spectrum::ZERO
        } else {
            self.intensity * ((self.cutoff - angle) / (self.cutoff - self.beam_width))
        }
    }
}
