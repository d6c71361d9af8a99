//! A reference ray: where connections to the points near it start.

use super::closest::{Leg, Nearest, minima};
use super::connection::Failure;
use super::newton::EndState;
use super::shoot::Trajectory;
use super::start::{Followed, InitialGuess, Reach};
use super::world::{Piece, World};
use crate::ray::{EVALUATIONS_PER_STEP, Tolerance, Work};
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
    start: InitialGuess<R>,
    /// With the nodes from which they begin.
    legs: Vec<(Leg<R>, EndState)>,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Guide<R> {
    /// Follows the ray of a start over its optical path length.
    ///
    /// # Errors
    ///
    /// [`Failure::RayLost`] if the ray leaves its field or takes too many steps.
    pub fn new<W: World<Region = R>>(
        world: &W,
        start: InitialGuess<R>,
        tolerance: Tolerance,
    ) -> Result<Self, Failure> {
        let mut legs = Vec::new();
        let reach = Reach {
            optical_length: start.optical_length,
            reflections: u32::MAX,
            bounces: u32::MAX,
        };
        let node = start.family.node(world.field(start.region));
        let (length, work) = (start.optical_length, &mut Work::default());
        Trajectory::new(world, node, start.region, length, tolerance, work).follow(
            &reach,
            &mut |i| start.pattern.reflects(i),
            work,
            |leg, node| legs.push((*leg, *node)),
        )?;
        Ok(Guide { start, legs })
    }

    /// The start of the ray.
    pub fn start(&self) -> &InitialGuess<R> {
        &self.start
    }

    /// The pieces of the ray, in order.
    pub fn pieces(&self) -> impl Iterator<Item = &Piece<R>> {
        self.legs.iter().map(|(leg, _)| &leg.piece)
    }

    /// Starts at the ray's local closest approaches to `y`, nearest first, at most eight; none at the
    /// very start of the ray.
    pub fn starts<W: World<Region = R>>(&self, world: &W, y: DVec3) -> Vec<Followed<R>> {
        let nearest: Vec<Nearest> = self.legs.iter().map(|(leg, _)| leg.nearest(y)).collect();
        let mut minima = minima(&nearest);
        minima.sort_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance));
        minima.truncate(MOST_STARTS);
        let InitialGuess { family, region, .. } = self.start;
        let followed = |(i, nearest): &(usize, Nearest)| {
            let (leg, node) = &self.legs[*i];
            let field = world.field(leg.piece.region);
            Followed {
                start: nearest.start(family, region),
                end: node.advanced(field, leg.piece.arc.h() * nearest.theta),
                evaluations: if field.is_constant() {
                    0
                } else {
                    EVALUATIONS_PER_STEP
                },
            }
        };
        minima.iter().map(followed).collect()
    }
}
