//! Flights from one collision to the next that nothing interrupts: edges without any of the work that others take.
//!
//! Theory: docs/theory.md#free-flight.

use super::trace::DrawnCollision;
use crate::medium::Leg;
use crate::path::segment::{Front, Start};
use crate::scene::{MediumId, Scene};
use glam::DVec3;
use smallvec::SmallVec;

/// A straight flight from a point to a collision, far from all surfaces, through matter that is the same along each leg.
#[derive(Clone, Debug)]
pub struct FreeFlight {
    /// Where it starts.
    pub start: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Arc length.
    pub length: f64,
    /// The medium.
    pub medium: MediumId,
    /// Its index.
    pub n: f64,
    /// The legs, at least one, with the coefficients of the channel in which the collision was drawn.
    pub legs: SmallVec<[Leg; 2]>,
}

impl FreeFlight {
    /// The flight to a collision, if it is known to be free.
    #[inline]
    pub(crate) fn to(scene: &Scene, start: &Start, target: DrawnCollision) -> Option<Self> {
        let medium = scene.medium(start.medium);
        if start.front != Front::Point || !medium.index.is_constant() {
            return None;
        }
        let DrawnCollision { channel, depth } = target;
        let (x, direction) = (start.x, start.direction);
        let legs = medium.legs(x, direction, channel, depth)?;
        let length: f64 = legs.iter().map(|leg| leg.length).sum();
        // Light that collides nowhere, or only far outside, leaves.
        if length.is_nan() || length >= scene.reach(x) {
            return None;
        }
        let is_free = scene.is_free(start.medium, x, direction, length);
        is_free.then(|| FreeFlight {
            start: x,
            direction,
            length,
            medium: start.medium,
            n: medium.index.n(x),
            legs,
        })
    }

    /// Where it collides.
    pub fn end(&self) -> DVec3 {
        self.start + self.direction * self.length
    }

    /// The leg on which it collides.
    pub fn last(&self) -> &Leg {
        &self.legs[self.legs.len() - 1]
    }

    /// Share of the power that is not absorbed at the end.
    pub fn albedo(&self) -> f64 {
        let last = self.last();
        1.0 - last.absorption / last.extinction
    }
}
