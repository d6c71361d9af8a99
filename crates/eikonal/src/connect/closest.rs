//! Where along a ray it comes close to a point: starts for connections.

use super::connection::Failure;
use super::family::RayFamily;
use super::pattern::Pattern;
use super::shoot::Trajectory;
use super::solver::Solver;
use super::start::{InitialGuess, Reach};
use super::world::{Piece, World};
use crate::interface::Mapped;
use crate::ray::{Node, Work};
use glam::DVec3;

/// A piece of a ray with what came before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg<R> {
    pub piece: Piece<R>,
    /// Optical path length.
    pub before: f64,
    /// Reflections by choice.
    pub pattern: Pattern,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Follows the ray of a family, without tangents, as far as the reach goes; `visit` sees every
    /// piece. Where refraction is possible `reflect`, given the number of the encounter, says whether to
    /// reflect all the same.
    ///
    /// # Errors
    ///
    /// [`Failure::RayLost`] or [`Failure::OverBudget`].
    pub(super) fn follow<W: World<Region = R>>(
        &mut self,
        world: &W,
        family: RayFamily,
        region: R,
        reach: &Reach,
        reflect: &mut dyn FnMut(u32) -> bool,
        mut visit: impl FnMut(&Leg<R>),
    ) -> Result<(), Failure> {
        let node = Node::start(world.field(region), family.x(), family.direction(), ());
        let (length, tolerance) = (reach.optical_length, self.scouting());
        Trajectory::new(world, node, region, length, tolerance, &mut self.work).follow(
            reach,
            reflect,
            &mut self.work,
            |leg, _| visit(leg),
        )
    }
}

impl<W: World, V: Mapped> Trajectory<'_, W, V> {
    /// Follows the ray, with its tangents or without, through at most the bounces of the reach; `visit` sees every
    /// piece and the node at its start. Where refraction is possible `reflect`, given the number of the encounter,
    /// says whether to reflect all the same.
    ///
    /// # Errors
    ///
    /// [`Failure::RayLost`] or [`Failure::OverBudget`].
    pub(super) fn follow(
        mut self,
        reach: &Reach,
        reflect: &mut dyn FnMut(u32) -> bool,
        work: &mut Work,
        mut visit: impl FnMut(&Leg<W::Region>, &Node<V>),
    ) -> Result<(), Failure> {
        let (mut before, mut pattern, mut bounces) = (0.0, self.pattern(), 0);
        let mut first = *self.end();
        while bounces <= reach.bounces
            && let Some(piece) = self.advance(reflect, work)?
        {
            let leg = Leg {
                piece,
                before,
                pattern,
            };
            visit(&leg, &first);
            first = self.node();
            before += piece.arc.optical_length(piece.theta_end);
            pattern = self.pattern();
            bounces += u32::from(piece.is_reflected());
        }
        Ok(())
    }
}

/// Where a piece of a ray comes closest to a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub distance: f64,
    /// Parameter of the piece's arc.
    pub theta: f64,
    /// Along the whole ray.
    pub optical_length: f64,
    /// Reflections by choice until then.
    pub pattern: Pattern,
    /// Unit direction of the ray.
    pub direction: DVec3,
    /// Whether it is the first or the last point of the piece.
    pub ends: [bool; 2],
}

impl<R> Leg<R> {
    /// Where this piece is closest to `y`.
    pub(super) fn nearest(&self, y: DVec3) -> Nearest {
        let arc = &self.piece.arc;
        let theta = arc.closest_approach(y).min(self.piece.theta_end);
        Nearest {
            distance: arc.position(theta).distance(y),
            theta,
            optical_length: self.before + arc.optical_length(theta),
            pattern: self.pattern,
            direction: arc.velocity(theta).normalize(),
            ends: [theta <= 0.0, theta >= self.piece.theta_end],
        }
    }
}

impl Nearest {
    /// The start of a connection here, on the ray of a family.
    pub(super) fn start<R>(&self, family: RayFamily, region: R) -> InitialGuess<R> {
        InitialGuess {
            family,
            region,
            optical_length: self.optical_length,
            pattern: self.pattern,
        }
    }
}

/// Where the distance has a local minimum along a ray, from the closest points of consecutive pieces:
/// inside a piece, or where two of them meet (once for each pattern), with the numbers of the pieces. The start of the ray is
/// none.
pub(super) fn minima(all: &[Nearest]) -> Vec<(usize, Nearest)> {
    let before = |i: usize| i.checked_sub(1).and_then(|i| all.get(i));
    let minimum = |i: usize, nearest: &Nearest| match nearest.ends {
        [false, false] => true,
        [_, true] => all.get(i + 1).is_none_or(|next| next.ends[0]),
        [true, false] => before(i).is_some_and(|b| b.ends[1] && b.pattern != nearest.pattern),
    };
    let minima = all.iter().enumerate().filter(|(i, n)| minimum(*i, n));
    minima.map(|(i, n)| (i, *n)).collect()
}
