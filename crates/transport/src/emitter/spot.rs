//! Spotlight.

use crate::Spectrum;
use crate::sampling::Frame;
use crate::sampling::sphere::uniform_cone_sample;
use glam::DVec3;
use std::f64::consts::TAU;

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
    /// `axis` is the direction of the cone, not zero, and `intensity` that inside `beam_width`; angles are
    /// half angles in radians, with 0 ≤ `beam_width` ≤ `cutoff`, 0 < `cutoff` ≤ π.
    pub fn new(
        position: DVec3,
        axis: DVec3,
        intensity: Spectrum,
        cutoff: f64,
        beam_width: f64,
    ) -> Self {
        Spot {
            position,
            axis: axis.normalize(),
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
        let angle = self.angle(direction);
        if angle <= self.beam_width {
            self.intensity
        } else if angle >= self.cutoff {
            Spectrum::ZERO
        } else {
            self.intensity * ((self.cutoff - angle) / (self.cutoff - self.beam_width))
        }
    }

    /// Total power: 2π ∫ I sin θ dθ, constant up to the beam's width and a ramp from there to the cutoff.
    pub fn power(&self) -> Spectrum {
        let (inner, outer) = (self.beam_width, self.cutoff);
        let ramp = match outer - inner {
            // The limit of a narrow ramp, without its cancellation.
            width if width < 1e-6 => (0.5 * (inner + outer)).cos(),
            width => (outer.sin() - inner.sin()) / width,
        };
        self.intensity * (TAU * (1.0 - ramp))
    }

    /// A direction uniform over the cone.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let local = uniform_cone_sample(self.cap(), u);
        Frame::from_normal(self.axis).to_world(local).normalize()
    }

    /// Density of [`Spot::sample`] per steradian.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        if self.angle(direction) <= self.cutoff {
            1.0 / (TAU * self.cap())
        } else {
            0.0
        }
    }

    /// Angle from the axis; unlike the arc cosine it keeps its digits in a narrow cone.
    fn angle(&self, direction: DVec3) -> f64 {
        let sin = self.axis.cross(direction).length();
        sin.atan2(self.axis.dot(direction))
    }

    /// Height 1 − cos of the cap that the cone cuts out of the unit sphere.
    fn cap(&self) -> f64 {
        2.0 * (0.5 * self.cutoff).sin().powi(2)
    }
}
