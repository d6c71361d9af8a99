//! Closest approaches of rays to a point, as initial guesses for connections.

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

/// A piece of a ray, with the optical length and the pattern before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<R> {
    pub piece: Piece<R>,
    /// Optical path length before the piece.
    pub before: f64,
    /// Reflections by choice before the piece.
    pub pattern: Pattern,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Traces the ray of a family, without tangents, as far as `reach` allows, and calls `visit`
    /// with every piece. Where refraction is possible, `reflect` receives the number of the
    /// encounter and returns true to reflect the ray instead.
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
        mut visit: impl FnMut(&Segment<R>),
    ) -> Result<(), Failure> {
        let node = Node::start(world.field(region), family.x(), family.direction(), ());
        let (length, tolerance) = (reach.optical_length, self.scouting());
        Trajectory::new(world, node, region, length, tolerance, &mut self.work).follow(
            reach,
            reflect,
            &mut self.work,
            |segment, _| visit(segment),
        )
    }
}

impl<W: World, V: Mapped> Trajectory<'_, W, V> {
    /// Traces the ray, with or without tangents, through at most `reach.bounces` reflections. Calls
    /// `visit` with every piece and the node at its start. Where refraction is possible, `reflect`
    /// receives the number of the encounter and returns true to reflect the ray instead.
    ///
    /// # Errors
    ///
    /// [`Failure::RayLost`] or [`Failure::OverBudget`].
    pub(super) fn follow(
        mut self,
        reach: &Reach,
        reflect: &mut dyn FnMut(u32) -> bool,
        work: &mut Work,
        mut visit: impl FnMut(&Segment<W::Region>, &Node<V>),
    ) -> Result<(), Failure> {
        let (mut before, mut pattern, mut bounces) = (0.0, self.pattern(), 0);
        let mut first = *self.end();
        while bounces <= reach.bounces
            && let Some(piece) = self.advance(reflect, work)?
        {
            let segment = Segment {
                piece,
                before,
                pattern,
            };
            visit(&segment, &first);
            first = self.node();
            before += piece.arc.optical_length(piece.theta_end);
            pattern = self.pattern();
            bounces += u32::from(piece.is_reflected());
        }
        Ok(())
    }
}

/// Closest approach of a piece of a ray to a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub distance: f64,
    /// Parameter of the piece's arc.
    pub theta: f64,
    /// Optical path length along the whole ray.
    pub optical_length: f64,
    /// Reflections by choice up to the closest approach.
    pub pattern: Pattern,
    /// Unit direction of the ray.
    pub direction: DVec3,
    /// True if the closest approach is at the first or the last point of the piece, respectively.
    pub ends: [bool; 2],
}

impl<R> Segment<R> {
    /// Returns the closest approach of this piece to `y`.
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
    /// Returns the initial guess of a connection at this approach, on the ray of a family.
    pub(super) fn start<R>(&self, family: RayFamily, region: R) -> InitialGuess<R> {
        InitialGuess {
            family,
            region,
            optical_length: self.optical_length,
            pattern: self.pattern,
        }
    }
}

/// Returns the local minima of the distance along a ray, with the indices of their pieces, from the
/// closest approaches of consecutive pieces. A minimum lies inside a piece, or where two pieces
/// meet (counted once for each pattern). The start of the ray is not a minimum.
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
