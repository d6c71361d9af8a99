//! A reference ray, along which connections to nearby points start.

use super::closest::{Nearest, Segment, minima};
use super::connection::Failure;
use super::newton::EndState;
use super::shoot::Trajectory;
use super::start::{Followed, InitialGuess, Reach};
use super::world::{Piece, World};
use crate::ray::{EVALUATIONS_PER_STEP, Tolerance, Work};
use glam::DVec3;

/// Maximum number of initial guesses; more than a point near a beam that is reflected many times
/// can need.
const MAX_STARTS: usize = 8;

/// Reference ray for the rays around it: the ray from the centre of a beam's aperture, or a ray
/// from a point.
///
/// A beam that bends, or is reflected inside a tank, passes a point several times. Each local
/// minimum of the distance between the point and this ray gives one initial guess for a connection.
#[derive(Clone, Debug)]
pub struct Guide<R> {
    start: InitialGuess<R>,
    /// Pieces of the ray, with the nodes at their starts.
    segments: Vec<(Segment<R>, EndState)>,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Guide<R> {
    /// Traces the ray of an initial guess over its optical path length.
    ///
    /// # Errors
    ///
    /// [`Failure::RayLost`] if the ray leaves its field, [`Failure::OverBudget`] if it takes too
    /// many steps.
    pub fn new<W: World<Region = R>>(
        world: &W,
        start: InitialGuess<R>,
        tolerance: Tolerance,
    ) -> Result<Self, Failure> {
        let mut segments = Vec::new();
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
            |segment, node| segments.push((*segment, *node)),
        )?;
        Ok(Guide { start, segments })
    }

    /// Returns the initial guess that this ray follows.
    pub fn start(&self) -> &InitialGuess<R> {
        &self.start
    }

    /// Returns the pieces of the ray, in order.
    pub fn pieces(&self) -> impl Iterator<Item = &Piece<R>> {
        self.segments.iter().map(|(segment, _)| &segment.piece)
    }

    /// Returns initial guesses at the ray's local closest approaches to `y`, nearest first, at most
    /// eight. The start of the ray is not among them.
    pub fn starts<W: World<Region = R>>(&self, world: &W, y: DVec3) -> Vec<Followed<R>> {
        let nearest: Vec<Nearest> = self
            .segments
            .iter()
            .map(|(segment, _)| segment.nearest(y))
            .collect();
        let mut minima = minima(&nearest);
        minima.sort_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance));
        minima.truncate(MAX_STARTS);
        let InitialGuess { family, region, .. } = self.start;
        let followed = |(i, nearest): &(usize, Nearest)| {
            let (segment, node) = &self.segments[*i];
            let field = world.field(segment.piece.region);
            Followed {
                start: nearest.start(family, region),
                end: node.advanced(field, segment.piece.arc.h() * nearest.theta),
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
