//! What an emitter must know of the scene.

use crate::sampling::Frame;
use crate::sampling::disc::{uniform_disc_pdf, uniform_disc_sample};
use eikonal::Aabb;
use glam::{DVec2, DVec3};

/// What an emitter must know of the scene around it.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// Centre of a ball that contains everything.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

impl Surroundings {
    /// Whether a box, which may be empty, lies within the ball.
    pub fn contains(&self, region: &Aabb) -> bool {
        let is_within = |x: DVec3| x.distance(self.center) <= self.radius;
        region.is_empty() || region.corners().into_iter().all(is_within)
    }

    /// A point outside the ball, from where light that travels in the unit `direction` enters it.
    pub fn before(&self, direction: DVec3) -> DVec3 {
        self.center - direction * (2.0 * self.radius)
    }

    /// A point, uniform over the disc as wide as the ball that lies around [`Surroundings::before`]
    /// across the unit `direction`: parallel light that starts there, and goes straight until it
    /// enters the ball, fills it.
    pub fn disc(&self, direction: DVec3, u: [f64; 2]) -> DVec3 {
        let p = uniform_disc_sample(u) * self.radius;
        self.before(direction) + Frame::from_normal(direction).to_world(p.extend(0.0))
    }

    /// Density per unit area with which [`Surroundings::disc`] chooses the parallel ray through `x`.
    pub fn disc_pdf(&self, direction: DVec3, x: DVec3) -> f64 {
        let off_axis = (x - self.center).reject_from_normalized(direction);
        let p = DVec2::new(off_axis.length() / self.radius, 0.0);
        uniform_disc_pdf(p) / (self.radius * self.radius)
    }
}
