//! Free flights: flights from one collision to the next, without the work that other edges need.
//!
//! Theory: docs/theory.md#free-flight.

use super::trace::DrawnCollision;
use crate::path::segment::{Front, Start};
use crate::path::workspace::Workspace;
use crate::scene::{Matter, Scene};
use eikonal::connect::World;
use eikonal::ray::{Arc, LengthAlong, ShortRay};
use glam::DVec3;
use smallvec::{SmallVec, smallvec};

/// Largest number of legs of a curved flight. Longer flights take no more field evaluations as edges.
const MAX_CURVED_LEGS: usize = 8;

/// A flight from a point to a collision that meets no surface, through matter that is constant on
/// each leg.
#[derive(Clone, Debug)]
pub struct FreeFlight<'a> {
    /// Channel in which the collision was drawn.
    pub channel: usize,
    /// Legs of the flight, at least one.
    pub legs: SmallVec<[FreeLeg<'a>; 1]>,
    /// Position of the collision.
    pub end: DVec3,
    /// Unit direction of arrival at the collision.
    pub direction: DVec3,
    /// Optical path length.
    pub optical_length: f64,
}

/// Part of a free flight.
#[derive(Clone, Copy, Debug)]
pub struct FreeLeg<'a> {
    /// Curve of the leg.
    pub arc: Arc,
    /// θ at which the leg ends; it starts at θ = 0.
    pub theta_end: f64,
    /// Arc length and optical path length along the curve.
    pub lengths: [LengthAlong; 2],
    /// Matter along the leg.
    pub matter: &'a Matter,
}

impl<'a> FreeLeg<'a> {
    /// Creates a straight leg in a unit direction.
    #[inline]
    pub fn straight([x, direction]: [DVec3; 2], length: f64, matter: &'a Matter) -> Self {
        FreeLeg {
            // Planted error "tagged flights that nothing interrupts without the index", found by morgana-transport/transport::meters::sidebands::sidebands_of_meters_are_sums_over_records:
            // arc: Arc::straight(x, direction, length, 1.0),
            arc: Arc::straight(x, direction, length, matter.n),
            theta_end: 1.0,
            lengths: [length, matter.n * length].map(LengthAlong::even),
            matter,
        }
    }

    /// Returns the arc length.
    #[inline]
    pub fn length(&self) -> f64 {
        self.lengths[0].at(self.theta_end)
    }

    /// Returns the optical path length.
    #[inline]
    pub fn optical_length(&self) -> f64 {
        self.lengths[1].at(self.theta_end)
    }
}

impl<'a> FreeFlight<'a> {
    /// Returns the flight to a collision, if it is known to be free.
    #[inline]
    pub(crate) fn to(
        scene: &'a Scene,
        start: &Start,
        target: DrawnCollision,
        ws: &mut Workspace,
    ) -> Option<Self> {
        if start.front != Front::Point {
            return None;
        }
        match scene.matter_of_curved(start.medium) {
            Some(matter) => FreeFlight::curved(scene, start, target, matter, ws),
            None => {
                let flight = FreeFlight::straight(scene, start, target)?;
                ws.stats.work.steps += 1;
                Some(flight)
            }
        }
    }

    #[inline]
    fn straight(scene: &'a Scene, start: &Start, target: DrawnCollision) -> Option<Self> {
        let DrawnCollision { channel, depth } = target;
        let (direction, mut x) = (start.direction, start.x);
        let legs = scene.free_segments(start.medium, [x, direction], channel, depth)?;
        let legs = legs.iter().map(|segment| {
            let leg = FreeLeg::straight([x, direction], segment.length, segment.matter);
            x += direction * segment.length;
            leg
        });
        let legs: SmallVec<[FreeLeg; 1]> = legs.collect();
        Some(FreeFlight {
            channel,
            optical_length: legs.iter().map(FreeLeg::optical_length).sum(),
            legs,
            end: x,
            direction,
        })
    }

    /// Returns the flight through matter in which rays bend.
    #[inline]
    fn curved(
        scene: &'a Scene,
        start: &Start,
        target: DrawnCollision,
        matter: &'a Matter,
        ws: &mut Workspace,
    ) -> Option<Self> {
        let DrawnCollision { channel, depth } = target;
        let field = scene.field(start.medium);
        let mut left = depth / matter.extinction[channel];
        // Light without a collision within the scene leaves it; also true for infinite lengths.
        if left >= scene.reach(start.x) || !left.is_normal() {
            return None;
        }
        // Where a straight line meets a surface, the ray most likely does, too.
        let line = [start.x, start.direction];
        if !scene.is_free_line(start.medium, None, line, left) {
            return None;
        }
        let mut ray = match ws.last_flight.filter(|ray| ray.node.x == start.x) {
            Some(ray) => ray.turned(start.direction),
            None => ShortRay::new(field, start.x, start.direction),
        };
        let (mut legs, mut optical_length) = (smallvec![], 0.0);
        while legs.len() < MAX_CURVED_LEGS {
            let tolerance = ws.tolerance();
            let step = ray.advance(field, left, tolerance, &mut ws.stats.work)?;
            let leg = FreeLeg {
                arc: step.arc,
                theta_end: step.theta_end,
                lengths: step.lengths,
                matter,
            };
            let length = leg.length();
            if !scene.is_free_curve(&leg.arc, leg.theta_end, length) {
                return None;
            }
            optical_length += leg.optical_length();
            legs.push(leg);
            left -= length;
            if step.is_last {
                ws.last_flight = Some(ray);
                return Some(FreeFlight {
                    channel,
                    legs,
                    end: ray.node.x,
                    direction: ray.node.v.normalize(),
                    optical_length,
                });
            }
        }
        None
    }

    /// Returns the matter at the collision.
    #[inline]
    pub fn matter(&self) -> &'a Matter {
        self.legs[self.legs.len() - 1].matter
    }

    /// Returns the fraction of the power that is not absorbed at the end.
    #[inline]
    pub fn albedo(&self) -> f64 {
        self.matter().albedo[self.channel]
    }
}
