//! Orthographic camera.

use super::{Ray, to_world};
use glam::{DAffine3, DVec3};

/// Parallel rays along local +z from the square [−1, 1]² of the local plane z = 0; its height is
/// divided by the aspect ratio.
#[derive(Clone, Debug)]
pub struct Orthographic {
    to_world: DAffine3,
    aspect: f64,
}

impl Orthographic {
    /// `aspect` is width over height.
    pub fn new(to_world: DAffine3, aspect: f64) -> Self {
        Orthographic { to_world, aspect }
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    pub(super) fn ray(&self, [s, t]: [f64; 2]) -> Ray {
        let origin = DVec3::new(1.0 - 2.0 * s, (1.0 - 2.0 * t) / self.aspect, 0.0);
        to_world(&self.to_world, origin, DVec3::Z)
    }
}
