//! A reference ray: where connections to the points near it start.

use super::closest::{Leg, Nearest, follow, minima};
use super::connection::Failure;
use super::start::{Reach, Start};
use super::world::{Piece, World};
use crate::ray::{Tolerance, Work};
use glam::DVec3;

/// More starts than a point near a beam that bounces about can need.
const MOST_STARTS: usize = 8;

/// A ray that stands for those around it: that from the centre of a beam's aperture, or one from a
/// point.
///
/// A beam that bends, or bounces inside a tank, passes a point several times. Each local minimum of
/// the distance between the point and this ray is one start for a connection.
#[derive(Clone, Debug)]
pub struct Guide<R> {
    start: Start<R>,
    legs: Vec<Leg<R>>,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Guide<R> {
    /// Follows the ray of a start over its optical path length.
    ///
    /// # Errors
    ///
    /// [`Failure::RayLost`] if the ray leaves its field or takes too many steps.
    pub fn new<W: World<Region = R>>(
        world: &W,
        start: Start<R>,
        tolerance: Tolerance,
    ) -> Result<Self, Failure> {
        let mut legs = Vec::new();
        let reach = Reach {
            optical_length: start.optical_length,
            reflections: u32::MAX,
            bounces: u32::MAX,
        };
        follow(
            world,
            (start.launch, start.region),
            (&reach, tolerance),
            &mut |i| start.pattern.reflects(i),
            &mut Work::default(),
            |leg| legs.push(*leg),
        )?;
        Ok(Guide { start, legs })
    }

    /// The start of the ray.
    pub fn start(&self) -> &Start<R> {
        &self.start
    }

    /// The pieces of the ray, in order.
    pub fn pieces(&self) -> impl Iterator<Item = &Piece<R>> {
        self.legs.iter().map(|leg| &leg.piece)
    }

    /// Starts at the ray's local closest approaches to `y`, nearest first, at most eight; none at the
    /// very start of the ray.
    pub fn starts(&self, y: DVec3) -> Vec<Start<R>> {
        let nearest: Vec<Nearest> = self.legs.iter().map(|leg| leg.nearest(y)).collect();
        let mut minima = minima(&nearest);
        minima.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        minima.truncate(MOST_STARTS);
        let Start { launch, region, .. } = self.start;
        minima.iter().map(|n| n.start(launch, region)).collect()
    }
}
