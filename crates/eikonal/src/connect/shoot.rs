//! Trajectories: rays through several regions and the interfaces between them
//! (docs/theory.md#connections).

use super::connection::Failure;
use super::pattern::Pattern;
use super::world::{Crossing, Event, Piece, World};
use crate::budget::{CROSSINGS_PER_RAY, STEPS_PER_RAY};
use crate::field::Field;
use crate::interface::{Interface, Mapped, Rule};
use crate::ray::{Arc, Flow, Node, Step, Tolerance, Variation, Work};
use glam::DVec3;

/// Factor by which the last step exceeds the span estimated at its start, so that it reaches the
/// target. The end of the ray is then found on the arc.
const OVERSHOOT: f64 = 1.05;

/// Fraction of the travelled optical path length below which the remainder counts as zero.
/// Round-off would determine the direction of a step over this remainder.
const ROUND_OFF: f64 = 1e-14;

/// Lengths travelled along a ray.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Travelled {
    pub arc_length: f64,
    pub optical_length: f64,
    /// Span of σ.
    pub sigma: f64,
    /// Arc length since the last interface, or of the segment that an interface has just ended.
    pub segment: f64,
}

/// A ray that is being traced, with or without tangents.
pub(super) struct Trajectory<'w, W: World, V: Mapped> {
    world: &'w W,
    region: W::Region,
    /// Steps through the field; `None` where the index is constant.
    flow: Option<Flow<'w, V>>,
    tolerance: Tolerance,
    end: Node<V>,
    /// Remaining optical path length.
    left: f64,
    travelled: Travelled,
    /// True if the next piece begins a segment.
    new_segment: bool,
    pieces: usize,
    crossings: u32,
    encounters: u32,
    pattern: Pattern,
}

impl<'w, W: World, V: Mapped> Trajectory<'w, W, V> {
    /// Starts a ray over an optical path length.
    pub(super) fn new(
        world: &'w W,
        node: Node<V>,
        region: W::Region,
        optical_length: f64,
        tolerance: Tolerance,
        work: &mut Work,
    ) -> Self {
        work.shots += 1;
        Trajectory {
            world,
            region,
            flow: flow(world.field(region), &node, tolerance),
            tolerance,
            end: node,
            left: optical_length,
            travelled: Travelled::default(),
            new_segment: false,
            pieces: 0,
            crossings: 0,
            encounters: 0,
            pattern: Pattern::REFRACT,
        }
    }

    /// Returns the current end of the ray.
    pub(super) fn end(&self) -> &Node<V> {
        &self.end
    }

    /// Returns the node at which the next piece begins.
    pub(super) fn node(&self) -> Node<V> {
        self.flow.as_ref().map_or(self.end, |flow| *flow.node())
    }

    /// Returns the lengths travelled so far.
    pub(super) fn travelled(&self) -> Travelled {
        self.travelled
    }

    /// Returns the reflections so far at which refraction was possible.
    pub(super) fn pattern(&self) -> Pattern {
        self.pattern
    }

    /// Advances to the next piece of the ray; `None` if no optical path length is left. Where
    /// refraction is possible, `reflect` receives the number of the encounter and returns true to
    /// reflect the ray instead.
    pub(super) fn advance(
        &mut self,
        reflect: &mut dyn FnMut(u32) -> bool,
        work: &mut Work,
    ) -> Result<Option<Piece<W::Region>>, Failure> {
        if self.left <= ROUND_OFF * self.travelled.optical_length {
            return Ok(None);
        }
        self.pieces += 1;
        let n2 = self.flow.as_ref().map_or(&self.end, Flow::node).n2;
        let sound = n2 > 0.0 && self.left.is_finite();
        if !sound {
            return Err(Failure::RayLost);
        }
        if self.pieces > STEPS_PER_RAY || self.crossings > CROSSINGS_PER_RAY {
            return Err(Failure::OverBudget);
        }
        let piece = match self.flow {
            Some(_) => self.curve(reflect, work),
            None => self.line(reflect, work),
        };
        piece.map(Some)
    }

    /// Returns the next piece where the index is constant: one line, to an interface or to the end.
    fn line(
        &mut self,
        reflect: &mut dyn FnMut(u32) -> bool,
        work: &mut Work,
    ) -> Result<Piece<W::Region>, Failure> {
        work.steps += 1;
        let Node { x, v, n2, .. } = self.end;
        let h = self.left / n2;
        let arc = Arc::line(x, v, h);
        let crossing = self.world.crossing(self.region, &arc);
        let theta_end = crossing.as_ref().map_or(1.0, |c| c.theta);
        let sigma = h * theta_end;
        self.end.variation.drift(sigma);
        self.end.x = arc.position(theta_end);
        let mut piece = Piece {
            region: self.region,
            arc,
            theta_end,
            event: None,
        };
        self.count(&piece, [n2.sqrt() * sigma, n2 * sigma]);
        match crossing {
            Some(c) => piece.event = Some(self.cross(v, self.end.variation, &c, reflect)?),
            None => self.left = 0.0,
        }
        Ok(piece)
    }

    /// Returns the next piece where the index varies: the part of a step up to an interface or the
    /// end.
    fn curve(
        &mut self,
        reflect: &mut dyn FnMut(u32) -> bool,
        work: &mut Work,
    ) -> Result<Piece<W::Region>, Failure> {
        let lost = Failure::RayLost;
        let flow = self.flow.as_mut().ok_or(lost)?;
        let &Node { n2, a, v, .. } = flow.node();
        // Estimate the span: the optical path length of a span h is n²h + (a·v)h² to second order.
        let h = self.left / n2;
        let change = (a.dot(v) * h / n2).clamp(-0.25, 0.25);
        let span = h * (1.0 + change) / (1.0 + 2.0 * change);
        let step = flow.advance(OVERSHOOT * span, work);
        let whole = step.arc.lengths(1.0);
        let reached = whole[1] >= self.left;
        let (target, lengths) = if reached {
            self.end_on(&step, whole[1])
        } else {
            (1.0, whole)
        };
        // Cut the step off at the first interface.
        let crossing = self
            .world
            .crossing(self.region, &step.arc)
            .filter(|c| c.theta <= target);
        let theta_end = crossing.as_ref().map_or(target, |c| c.theta);
        let mut piece = Piece {
            region: self.region,
            arc: step.arc,
            theta_end,
            event: None,
        };
        let lengths = match crossing {
            Some(_) => step.arc.lengths(theta_end),
            None => lengths,
        };
        self.count(&piece, lengths);
        if let Some(crossing) = crossing {
            let (_, v, variation) = step.at(theta_end);
            piece.event = Some(self.cross(v, variation, &crossing, reflect)?);
        } else if reached {
            self.left = 0.0;
            self.end = step.end;
            (self.end.x, self.end.v, self.end.variation) = step.at(target);
        } else if !step.end.x.is_finite() {
            return Err(lost);
        }
        Ok(piece)
    }

    /// Finds the end of the ray on a step, given the optical path length of the `whole` step.
    /// Returns θ and the lengths up to it. A guess of θ is used if it is accurate to the tolerance;
    /// the lengths always belong to the returned θ.
    fn end_on(&self, step: &Step<V>, whole: f64) -> (f64, [f64; 2]) {
        let theta = step.theta_at_optical_length(self.left, whole);
        let lengths = step.arc.lengths(theta);
        if (lengths[1] - self.left).abs() <= self.tolerance.get() * self.left {
            return (theta, lengths);
        }
        let theta = step.arc.theta_at_optical_length(self.left);
        (theta, step.arc.lengths(theta))
    }

    /// Adds a piece to the travelled lengths, given its arc length and optical path length.
    fn count(&mut self, piece: &Piece<W::Region>, [arc_length, optical_length]: [f64; 2]) {
        let so_far = &mut self.travelled;
        so_far.arc_length += arc_length;
        so_far.optical_length += optical_length;
        so_far.sigma += piece.arc.h() * piece.theta_end;
        so_far.segment = if self.new_segment {
            0.0
        } else {
            so_far.segment
        } + arc_length;
        self.new_segment = false;
        self.left = (self.left - optical_length).max(0.0);
    }

    /// Takes the ray through an interface, given its velocity and variation there.
    fn cross(
        &mut self,
        v: DVec3,
        variation: V,
        crossing: &Crossing<W::Region>,
        reflect: &mut dyn FnMut(u32) -> bool,
    ) -> Result<Event, Failure> {
        self.crossings += 1;
        self.new_segment = true;
        // Set up the interface.
        let field = self.world.field(self.region);
        let node = Node::start(field, crossing.position, v.normalize(), variation);
        let (far_n2, far_a, ()) = <()>::local(self.world.field(crossing.beyond), node.x);
        let interface = Interface {
            normal: crossing.normal,
            shape: crossing.shape,
            near: (node.n2, node.a),
            far: (far_n2, far_a),
        };
        // Choose the rule, and map the velocity and the variation.
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
        // Leave the interface on the side of the new velocity.
        let off = crossing.normal
            * self
                .world
                .ray_epsilon()
                .copysign(crossing.normal.dot(after));
        let field = self.world.field(self.region);
        self.end = Node::new(field, node.x + off, after, variation.ok_or(lost)?);
        self.flow = flow(field, &self.end, self.tolerance);
        Ok(Event {
            rule,
            far_n: far_n2.sqrt(),
            surface: crossing.surface,
            normal: crossing.normal,
            before: node.v,
            after,
        })
    }

    /// Chooses refraction or reflection, given the refracted velocity if refraction is possible.
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

/// Starts the flow from a node if the field bends rays.
fn flow<'w, V: Variation>(
    field: &'w Field,
    node: &Node<V>,
    tolerance: Tolerance,
) -> Option<Flow<'w, V>> {
    (!field.is_constant()).then(|| Flow::new(field, *node, tolerance))
}
