//! Where along a ray it comes close to a point: starts for connections.

use super::connection::Failure;
use super::family::RayFamily;
use super::pattern::Pattern;
use super::shoot::Trajectory;
use super::start::{InitialGuess, Reach};
use super::world::{Piece, World};
use crate::interface::Mapped;
use crate::ray::{Node, Tolerance, Work};
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

/// Follows the ray of a family, without tangents, as far as the reach goes; `visit` sees every
/// piece. Where refraction is possible `reflect`, given the number of the encounter, says whether to
/// reflect all the same.
pub(super) fn follow<W: World>(
    world: &W,
    (family, region): (RayFamily, W::Region),
    reach: &Reach,
    tolerance: Tolerance,
    reflect: &mut dyn FnMut(u32) -> bool,
    work: &mut Work,
    mut visit: impl FnMut(&Leg<W::Region>),
) -> Result<(), Failure> {
    let node = Node::start(world.field(region), family.x(), family.direction(), ());
    let visit = |leg: &Leg<W::Region>, _: &Node<()>| visit(leg);
    follow_from(
        world,
        (node, region),
        reach,
        tolerance,
        reflect,
        work,
        visit,
    )
}

/// The same from a node, with its tangents or without; `visit` sees the node at the start of every piece, too.
pub(super) fn follow_from<W: World, V: Mapped>(
    world: &W,
    (node, region): (Node<V>, W::Region),
    reach: &Reach,
    tolerance: Tolerance,
    reflect: &mut dyn FnMut(u32) -> bool,
    work: &mut Work,
    mut visit: impl FnMut(&Leg<W::Region>, &Node<V>),
) -> Result<(), Failure> {
    let length = reach.optical_length;
    let mut shot = Trajectory::new(world, (node, region), length, tolerance, work);
    let (mut before, mut pattern, mut bounces) = (0.0, shot.pattern(), 0);
    let mut first = *shot.end();
    while bounces <= reach.bounces
        && let Some(piece) = shot.advance(reflect, work)?
    {
        let leg = Leg {
            piece,
            before,
            pattern,
        };
        visit(&leg, &first);
        first = shot.node();
        before += piece.arc.optical_length(piece.theta_end);
        pattern = shot.pattern();
        bounces += u32::from(piece.is_reflected());
    }
    Ok(())
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
    pub fn nearest(&self, y: DVec3) -> Nearest {
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
    pub fn start<R>(&self, family: RayFamily, region: R) -> InitialGuess<R> {
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
