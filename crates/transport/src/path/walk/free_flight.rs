//! Free flights: straight flights from one collision to the next, without the work that other edges
//! need.
//!
//! Theory: docs/theory.md#free-flight.

use super::trace::DrawnCollision;
use crate::path::segment::{Front, Start};
use crate::scene::{Scene, Segment, Segments};
use glam::DVec3;

/// A straight flight from a point to a collision, far from all surfaces, through matter that is
/// constant on each segment.
#[derive(Clone, Debug)]
pub struct FreeFlight<'a> {
    /// Start of the flight.
    pub start: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Arc length.
    pub length: f64,
    /// Channel in which the collision was drawn.
    pub channel: usize,
    /// Segments of the flight, at least one, with equal indices.
    pub segments: Segments<'a>,
}

impl<'a> FreeFlight<'a> {
    /// Returns the flight to a collision, if it is known to be free.
    #[inline]
    pub(crate) fn to(scene: &'a Scene, start: &Start, target: DrawnCollision) -> Option<Self> {
        if start.front != Front::Point {
            return None;
        }
        let DrawnCollision { channel, depth } = target;
        let line = [start.x, start.direction];
        let segments = scene.free_segments(start.medium, line, channel, depth)?;
        Some(FreeFlight {
            start: start.x,
            direction: start.direction,
            length: segments.iter().map(|segment| segment.length).sum(),
            channel,
            segments,
        })
    }

    /// Returns the position of the collision.
    #[inline]
    pub fn end(&self) -> DVec3 {
        self.start + self.direction * self.length
    }

    /// Returns the segment of the collision.
    #[inline]
    pub fn last(&self) -> &Segment<'a> {
        &self.segments[self.segments.len() - 1]
    }

    /// Returns the index.
    #[inline]
    pub fn n(&self) -> f64 {
        self.last().matter.n
    }

    /// Returns the fraction of the power that is not absorbed at the end.
    #[inline]
    pub fn albedo(&self) -> f64 {
        self.last().matter.albedo[self.channel]
    }
}
