//! Extent of the scene, as emitters need it.

use crate::sampling::Frame;
use crate::sampling::disc::{uniform_disc_pdf, uniform_disc_sample};
use eikonal::Aabb;
use glam::{DVec2, DVec3};

/// Ball around the scene, as emitters need it.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// Centre of a ball that contains everything.
    pub center: DVec3,
    /// Radius of the ball.
    pub radius: f64,
}

impl Surroundings {
    /// Returns true if a box, which may be empty, lies within the ball.
    pub fn contains(&self, region: &Aabb) -> bool {
        let is_within = |x: DVec3| x.distance(self.center) <= self.radius;
        region.is_empty() || region.corners().into_iter().all(is_within)
    }

    /// Returns a point outside the ball, from which light that travels in the unit `direction`
    /// enters the ball.
    pub fn before(&self, direction: DVec3) -> DVec3 {
        self.center - direction * (2.0 * self.radius)
    }

    /// Samples a point uniformly on the disc as wide as the ball, around [`Surroundings::before`]
    /// and perpendicular to the unit `direction`. Parallel light that starts on the disc and
    /// travels straight fills the ball.
    pub fn disc(&self, direction: DVec3, u: [f64; 2]) -> DVec3 {
        let p = uniform_disc_sample(u) * self.radius;
        self.before(direction) + Frame::from_normal(direction).to_world(p.extend(0.0))
    }

    /// Returns the density per unit area with which [`Surroundings::disc`] samples the parallel ray
    /// through `x`.
    pub fn disc_pdf(&self, direction: DVec3, x: DVec3) -> f64 {
        let off_axis = (x - self.center).reject_from_normalized(direction);
        let p = DVec2::new(off_axis.length() / self.radius, 0.0);
        uniform_disc_pdf(p) / (self.radius * self.radius)
    }
}
