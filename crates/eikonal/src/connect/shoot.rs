//! Shots: rays with tangents through several regions and the interfaces between them.

use super::solver::Failure;
use crate::field::Field;
use crate::interface::{Interface, Rule};
use crate::ray::{Arc, Flow, Node, Tangents, Tolerance, Variation, Work};
use glam::{DMat3, DVec3};

/// The regions through which rays travel, each with a field, and the interfaces between them.
pub trait World {
    /// Names a region.
    type Region: Copy + PartialEq + std::fmt::Debug;

    /// The field of a region.
    fn field(&self, region: Self::Region) -> &Field;

    /// The first interface that an arc in `region` meets and that rays go on from by a
    /// deterministic rule. Opaque surfaces are none: a shot passes them, and its owner tests the
    /// final ray for occlusion.
    fn crossing(&self, region: Self::Region, arc: &Arc) -> Option<Crossing<Self::Region>>;

    /// How far a ray that leaves an interface starts off it, so that it does not meet it again: far
    /// below any tolerance, far above round-off.
    fn nudge(&self) -> f64;
}

/// Where an arc meets an interface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing<R> {
    /// Where on the arc, in (0, 1].
    pub theta: f64,
    /// Position.
    pub position: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Shape operator of the surface with respect to `normal`.
    pub shape: DMat3,
    /// How the ray goes on; a refraction that is not possible becomes a (total) reflection.
    pub rule: Rule,
    /// The region beyond.
    pub beyond: R,
    /// Names the surface to the world's owner.
    pub surface: usize,
}

/// What happened where a piece of a ray ended at an interface.
#[derive(Clone, Copy, Debug)]
pub struct Event {
    /// The rule that applied: never `Refract` for a total reflection.
    pub rule: Rule,
    /// Names the surface to the world's owner.
    pub surface: usize,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Velocity before.
    pub before: DVec3,
    /// Velocity after.
    pub after: DVec3,
}

/// A piece of a ray within one region.
#[derive(Clone, Copy, Debug)]
pub struct Piece<R> {
    /// The region.
    pub region: R,
    /// The curve, of which only θ ≤ `theta_end` belongs to the ray.
    pub arc: Arc,
    /// See `arc`.
    pub theta_end: f64,
    /// What ended the piece, if that was an interface.
    pub event: Option<Event>,
}

/// One field that fills all of space.
#[derive(Clone, Copy, Debug)]
pub struct Unbounded<'a>(pub &'a Field);

impl World for Unbounded<'_> {
    type Region = ();

    fn field(&self, (): ()) -> &Field {
        self.0
    }

    fn crossing(&self, (): (), _: &Arc) -> Option<Crossing<()>> {
        None
    }

    fn nudge(&self) -> f64 {
        0.0
    }
}

/// The last step goes this far beyond the target by the index at its start, so that it reaches it;
/// where the ray ends is then found on the arc.
const OVERSHOOT: f64 = 1.1;

/// More pieces than any sensible ray has: the end of rays that circle forever.
const MOST_PIECES: usize = 20_000;

/// Where a shot ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landing {
    pub x: DVec3,
    pub v: DVec3,
    pub a: DVec3,
    pub tangents: Tangents,
}

/// Shoots a ray over an optical path length; its pieces replace those in `pieces`.
pub(super) fn shoot<W: World>(
    world: &W,
    (mut node, mut region): (Node<Tangents>, W::Region),
    optical_length: f64,
    tolerance: Tolerance,
    pieces: &mut Vec<Piece<W::Region>>,
    work: &mut Work,
) -> Result<Landing, Failure> {
    pieces.clear();
    work.shots += 1;
    let mut left = optical_length;
    loop {
        let crossing;
        (node, left, crossing) = leg(world, node, region, left, tolerance, pieces, work)?;
        let Some(crossing) = crossing else {
            return Ok(Landing {
                x: node.x,
                v: node.v,
                a: node.a,
                tangents: node.variation,
            });
        };
        let event;
        (node, region, event) = cross(world, node, region, &crossing)?;
        if let Some(piece) = pieces.last_mut() {
            piece.event = Some(event);
        }
    }
}

type Leg<R> = (Node<Tangents>, f64, Option<Crossing<R>>);

/// Follows a ray to the next interface, or until no optical path length is left. Returns its end, the
/// length that is left, and the interface.
fn leg<W: World>(
    world: &W,
    node: Node<Tangents>,
    region: W::Region,
    mut left: f64,
    tolerance: Tolerance,
    pieces: &mut Vec<Piece<W::Region>>,
    work: &mut Work,
) -> Result<Leg<W::Region>, Failure> {
    let field = world.field(region);
    if left <= 0.0 {
        return Ok((node, 0.0, None));
    }
    let mut flow = Flow::new(field, node, tolerance);
    while pieces.len() < MOST_PIECES {
        let step = flow.advance(OVERSHOOT * left / flow.node().n2, work);
        let optical = step.arc.optical_length(1.0);
        let target = if optical >= left {
            step.arc.theta_at_optical_length(left)
        } else {
            1.0
        };
        let crossing = world
            .crossing(region, &step.arc)
            .filter(|c| c.theta <= target);
        let theta_end = crossing.as_ref().map_or(target, |c| c.theta);
        pieces.push(Piece {
            region,
            arc: step.arc,
            theta_end,
            event: None,
        });
        if let Some(crossing) = crossing {
            let (_, v, tangents) = step.at(theta_end);
            let node = Node::launch(field, crossing.position, v.normalize(), tangents);
            let spent = step.arc.optical_length(theta_end);
            return Ok((node, (left - spent).max(0.0), Some(crossing)));
        }
        if optical >= left {
            let mut node = step.end;
            (node.x, node.v, node.variation) = step.at(target);
            return Ok((node, 0.0, None));
        }
        if !step.end.x.is_finite() {
            break;
        }
        left -= optical;
    }
    Err(Failure::RayLost)
}

/// Takes a ray through an interface by its rule.
fn cross<W: World>(
    world: &W,
    node: Node<Tangents>,
    region: W::Region,
    crossing: &Crossing<W::Region>,
) -> Result<(Node<Tangents>, W::Region, Event), Failure> {
    let (far_n2, far_a, _) = <() as Variation>::local(world.field(crossing.beyond), node.x);
    let interface = Interface {
        normal: crossing.normal,
        shape: crossing.shape,
        near: (node.n2, node.a),
        far: (far_n2, far_a),
    };
    let rule = match interface.velocity(crossing.rule, node.v) {
        Some(_) => crossing.rule,
        None => Rule::Reflect,
    };
    let lost = Failure::RayLost;
    let after = interface.velocity(rule, node.v).ok_or(lost)?;
    let tangents = interface
        .tangents(rule, node.v, &node.variation)
        .ok_or(lost)?;
    let region = match rule {
        Rule::Reflect => region,
        Rule::Refract | Rule::Pass => crossing.beyond,
    };
    let off = crossing.normal * world.nudge().copysign(crossing.normal.dot(after));
    let event = Event {
        rule,
        surface: crossing.surface,
        normal: crossing.normal,
        before: node.v,
        after,
    };
    let node = Node::new(world.field(region), node.x + off, after, tangents);
    Ok((node, region, event))
}
