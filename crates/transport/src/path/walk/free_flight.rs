//! Flights from one collision to the next that nothing interrupts: edges without any of the work that others take.
//!
//! Theory: docs/theory.md#free-flight.

use super::trace::DrawnCollision;
use crate::path::segment::{Front, Start};
use crate::scene::{Leg, Legs, Scene};
use glam::DVec3;

/// A straight flight from a point to a collision, far from all surfaces, through matter that is the same along each leg.
#[derive(Clone, Debug)]
pub struct FreeFlight<'a> {
    /// Where it starts.
    pub start: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Arc length.
    pub length: f64,
    /// The channel in which the collision was drawn.
    pub channel: usize,
    /// The legs, at least one, of one index.
    pub legs: Legs<'a>,
}

impl<'a> FreeFlight<'a> {
    /// The flight to a collision, if it is known to be free.
    #[inline]
    pub(crate) fn to(scene: &'a Scene, start: &Start, target: DrawnCollision) -> Option<Self> {
        if start.front != Front::Point {
            return None;
        }
        let DrawnCollision { channel, depth } = target;
        let line = [start.x, start.direction];
        let legs = scene.free_legs(start.medium, line, channel, depth)?;
        Some(FreeFlight {
            start: start.x,
            direction: start.direction,
            length: legs.iter().map(|leg| leg.length).sum(),
            channel,
            legs,
        })
    }

    /// Where it collides.
    #[inline]
    pub fn end(&self) -> DVec3 {
        self.start + self.direction * self.length
    }

    /// The leg on which it collides.
    #[inline]
    pub fn last(&self) -> &Leg<'a> {
        &self.legs[self.legs.len() - 1]
    }

    /// The index.
    #[inline]
    pub fn n(&self) -> f64 {
        self.last().matter.n
    }

    /// Share of the power that is not absorbed at the end.
    #[inline]
    pub fn albedo(&self) -> f64 {
        self.last().matter.albedo[self.channel]
    }
}
