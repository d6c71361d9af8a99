//! Shots: rays through several regions and the interfaces between them.

use super::connection::Failure;
use super::pattern::Pattern;
use super::world::{Crossing, Event, Piece, World};
use crate::interface::{Interface, Mapped, Rule};
use crate::ray::{Flow, Node, Step, Tolerance, Variation, Work};
use glam::DVec3;

/// The last step goes this far beyond the target by what the start of the step lets expect, so that it
/// reaches it; where the ray ends is then found on the arc.
const OVERSHOOT: f64 = 1.05;

/// More pieces than any sensible ray has: the end of rays that circle forever.
const MOST_PIECES: usize = 20_000;

/// More interfaces than any sensible ray meets: the end of those that creep along inside a curved one.
const MOST_CROSSINGS: u32 = 1000;

/// How far a ray has come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Travelled {
    pub arc_length: f64,
    pub optical_length: f64,
    /// Span of σ.
    pub sigma: f64,
    /// Arc length since the last interface, or of the leg that one has just ended.
    pub leg: f64,
}

/// A ray on its way: with tangents, or alone.
pub(super) struct Shot<'w, W: World, V: Mapped> {
    world: &'w W,
    region: W::Region,
    flow: Flow<'w, V>,
    tolerance: Tolerance,
    end: Node<V>,
    /// Optical path length that is left.
    left: f64,
    travelled: Travelled,
    /// Whether the next piece begins a leg.
    new_leg: bool,
    pieces: usize,
    crossings: u32,
    encounters: u32,
    pattern: Pattern,
}

impl<'w, W: World, V: Mapped> Shot<'w, W, V> {
    /// Starts a ray that is to be followed over an optical path length.
    pub fn new(
        world: &'w W,
        (node, region): (Node<V>, W::Region),
        optical_length: f64,
        tolerance: Tolerance,
        work: &mut Work,
    ) -> Self {
        work.shots += 1;
        Shot {
            world,
            region,
            flow: Flow::new(world.field(region), node, tolerance),
            tolerance,
            end: node,
            left: optical_length,
            travelled: Travelled::default(),
            new_leg: false,
            pieces: 0,
            crossings: 0,
            encounters: 0,
            pattern: Pattern::REFRACT,
        }
    }

    /// Where the ray has got to.
    pub fn end(&self) -> &Node<V> {
        &self.end
    }

    /// How far the ray has come.
    pub fn travelled(&self) -> Travelled {
        self.travelled
    }

    /// The reflections so far at which refraction was possible.
    pub fn pattern(&self) -> Pattern {
        self.pattern
    }

    /// The next piece of the ray; `None` if no optical path length is left. Where refraction is
    /// possible `reflect`, given the number of the encounter, says whether to reflect all the same.
    pub fn advance(
        &mut self,
        reflect: &mut dyn FnMut(u32) -> bool,
        work: &mut Work,
    ) -> Result<Option<Piece<W::Region>>, Failure> {
        if self.left <= 0.0 {
            return Ok(None);
        }
        self.pieces += 1;
        let &Node { n2, a, v, .. } = self.flow.node();
        let sound = n2 > 0.0 && self.left.is_finite();
        if self.pieces > MOST_PIECES || self.crossings > MOST_CROSSINGS || !sound {
            return Err(Failure::RayLost);
        }
        // The optical path length of a span h is n²h + (a·v)h² to second order.
        let h = self.left / n2;
        let change = (a.dot(v) * h / n2).clamp(-0.25, 0.25);
        let span = h * (1.0 + change) / (1.0 + 2.0 * change);
        let step = self.flow.advance(OVERSHOOT * span, work);
        let whole = step.arc.lengths(1.0);
        let target = if whole[1] >= self.left {
            step.arc.theta_at_optical_length(self.left)
        } else {
            1.0
        };
        let crossing = self
            .world
            .crossing(self.region, &step.arc)
            .filter(|c| c.theta <= target);
        let mut piece = Piece {
            region: self.region,
            arc: step.arc,
            theta_end: crossing.as_ref().map_or(target, |c| c.theta),
            event: None,
        };
        let reached = whole[1] >= self.left;
        self.count(&piece, whole);
        if let Some(crossing) = crossing {
            piece.event = Some(self.cross(&step, &crossing, reflect)?);
        } else if reached {
            self.left = 0.0;
            self.end = step.end;
            (self.end.x, self.end.v, self.end.variation) = step.at(target);
        } else if !step.end.x.is_finite() {
            return Err(Failure::RayLost);
        }
        Ok(Some(piece))
    }

    /// Counts a piece as travelled, given the arc length and optical path length of its whole arc.
    fn count(&mut self, piece: &Piece<W::Region>, whole: [f64; 2]) {
        let [arc_length, optical_length] = if piece.theta_end < 1.0 {
            piece.arc.lengths(piece.theta_end)
        } else {
            whole
        };
        let so_far = &mut self.travelled;
        so_far.arc_length += arc_length;
        so_far.optical_length += optical_length;
        so_far.sigma += piece.arc.h() * piece.theta_end;
        so_far.leg = if self.new_leg { 0.0 } else { so_far.leg } + arc_length;
        self.new_leg = false;
        self.left = (self.left - optical_length).max(0.0);
    }

    /// Takes the ray through an interface.
    fn cross(
        &mut self,
        step: &Step<V>,
        crossing: &Crossing<W::Region>,
        reflect: &mut dyn FnMut(u32) -> bool,
    ) -> Result<Event, Failure> {
        self.crossings += 1;
        self.new_leg = true;
        let (_, v, variation) = step.at(crossing.theta);
        let field = self.world.field(self.region);
        let node = Node::launch(field, crossing.position, v.normalize(), variation);
        let (far_n2, far_a, ()) = <()>::local(self.world.field(crossing.beyond), node.x);
        let interface = Interface {
            normal: crossing.normal,
            shape: crossing.shape,
            near: (node.n2, node.a),
            far: (far_n2, far_a),
        };
        let rule = match crossing.rule {
            Rule::Refract => self.choose(interface.velocity(Rule::Refract, node.v), reflect),
            other => other,
        };
        let lost = Failure::RayLost;
        let after = interface.velocity(rule, node.v).ok_or(lost)?;
        let variation = node.variation.mapped(&interface, rule, node.v);
        if rule != Rule::Reflect {
            self.region = crossing.beyond;
        }
        let off = crossing.normal * self.world.nudge().copysign(crossing.normal.dot(after));
        let field = self.world.field(self.region);
        self.end = Node::new(field, node.x + off, after, variation.ok_or(lost)?);
        self.flow = Flow::new(field, self.end, self.tolerance);
        Ok(Event {
            rule,
            far_n: far_n2.sqrt(),
            surface: crossing.surface,
            normal: crossing.normal,
            before: node.v,
            after,
        })
    }

    /// Refraction or reflection, given what refraction would give, if it is possible.
    fn choose(&mut self, refracted: Option<DVec3>, reflect: &mut dyn FnMut(u32) -> bool) -> Rule {
        let encounter = self.encounters;
        self.encounters += 1;
        if refracted.is_none() {
            return Rule::Reflect;
        }
        match self.pattern.with(encounter) {
            Some(pattern) if reflect(encounter) => {
                self.pattern = pattern;
                Rule::Reflect
            }
            _ => Rule::Refract,
        }
    }
}
