//! Rays traced forward, and recorded for derivatives in reverse mode.

use super::action::Action;
use super::receiver::{Intersection, Receiver};
use crate::budget::{CROSSINGS_PER_RAY, STEPS_PER_RAY};
use crate::connect::{Crossing, World};
use crate::field::Field;
use crate::interface::{Interface, Rule};
use crate::ray::{Flow, Node, Step, Tolerance, Variation, Work};
use glam::DVec3;

/// Longest step, in units of the span that grids resolve (two cells). Six kicks then see three
/// cells, so that every coefficient has an effect, however weak a field is.
const MAX_STEP_PER_RESOLVED_SPAN: f64 = 1.5;
/// Maximum number of corrections of the last step before a surface; each squares the error.
const MAX_CORRECTIONS: usize = 3;

/// Start of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayStart<R> {
    /// Position.
    pub x: DVec3,
    /// Direction, of any length except zero. Derivatives are with respect to its unit vector.
    pub direction: DVec3,
    /// Region in which the ray starts.
    pub region: R,
}

/// End of a ray, on the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayEnd {
    /// Position.
    pub x: DVec3,
    /// Velocity dx/dσ; its length is the index up to the tolerance.
    pub v: DVec3,
    /// Optical path length ∫n ds from the start, in units of length.
    pub optical_length: f64,
}

/// Reason why a ray has no end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RayFailure {
    /// The ray has not met the receiver within its maximum length.
    #[error("did not reach the receiver")]
    Missed,
    /// The index is not positive, or not finite.
    #[error("left the field")]
    Lost,
    /// The ray takes too many steps, or meets too many surfaces.
    #[error("takes too much work")]
    OverBudget,
    /// The ray has reached the receiver without meeting one of the surfaces of a
    /// [`Sequence`](super::Sequence).
    #[error("missed a surface")]
    MissedSurface,
    /// A surface of a sequence has reflected the ray totally.
    #[error("was totally reflected")]
    Reflected,
    /// The ray does not pass an aperture of a sequence.
    #[error("was stopped by an aperture")]
    Stopped,
}

/// A surface that a ray has met, with the data that derivatives need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed<R> {
    /// Identifier of the surface in the world.
    pub surface: usize,
    pub interface: Interface,
    pub rule: Rule,
    pub x: DVec3,
    pub before: DVec3,
    pub after: DVec3,
    pub near: R,
    pub far: R,
}

/// Steps in one region. Except for the first segment, a segment starts at a surface that the ray
/// has passed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<R> {
    pub region: R,
    /// Index of the first step of the segment.
    pub first: usize,
    /// Surface at which the segment starts.
    pub passed: Option<Passed<R>>,
}

/// A ray that is traced to a receiver and recorded. It can trace one ray after another in the same
/// memory.
#[derive(Debug)]
pub struct AdjointRay<'w, W: World> {
    pub(super) world: &'w W,
    pub(super) receiver: Receiver,
    tolerance: Tolerance,
    /// Maximum length of a ray, in units of length.
    max_length: f64,
    /// Spans of σ of the steps.
    pub(super) spans: Vec<f64>,
    pub(super) segments: Vec<Segment<W::Region>>,
    pub(super) start: Option<RayStart<W::Region>>,
    pub(super) end: Option<RayEnd>,
    /// Normal of the receiver at the end of the ray.
    pub(super) normal: DVec3,
    /// Work done for all rays.
    pub work: Work,
}

impl<'w, W: World> AdjointRay<'w, W> {
    /// Creates rays in `world` that end on `receiver`, or fail after `max_length`, in units of
    /// length.
    pub fn new(world: &'w W, receiver: Receiver, tolerance: Tolerance, max_length: f64) -> Self {
        AdjointRay {
            world,
            receiver,
            tolerance,
            max_length,
            spans: Vec::new(),
            segments: Vec::new(),
            start: None,
            end: None,
            normal: DVec3::ZERO,
            work: Work::default(),
        }
    }

    /// Traces a ray, and discards the previous one.
    ///
    /// # Errors
    ///
    /// The reason why the ray has no end.
    pub fn follow(&mut self, start: RayStart<W::Region>) -> Result<RayEnd, RayFailure> {
        self.spans.clear();
        self.segments.clear();
        let direction = start.direction.normalize();
        (self.start, self.end) = (Some(RayStart { direction, ..start }), None);
        let field = self.world.field(start.region);
        let mut node = Node::start(field, start.x, direction, Action::default());
        let mut segment = Segment {
            region: start.region,
            first: 0,
            passed: None,
        };
        let mut so_far = Progressed::default();
        loop {
            self.segments.push(segment);
            let (end, met) = self.segment(&segment, node, &mut so_far)?;
            so_far.optical_length +=
                0.5 * (end.x.dot(end.v) - node.x.dot(node.v) + end.variation.0);
            let crossing = match met {
                End::Receiver(met) => {
                    self.normal = met.normal;
                    let end = RayEnd {
                        x: end.x,
                        v: end.v,
                        optical_length: so_far.optical_length,
                    };
                    return Ok(*self.end.insert(end));
                }
                End::Surface(crossing) => crossing,
            };
            if self.segments.len() > CROSSINGS_PER_RAY as usize {
                return Err(RayFailure::OverBudget);
            }
            (node, segment) = self.pass(&segment, &end, &crossing)?;
        }
    }

    /// Steps through one region, up to the receiver or a surface.
    fn segment(
        &mut self,
        segment: &Segment<W::Region>,
        node: Node<Action>,
        so_far: &mut Progressed,
    ) -> Result<(Node<Action>, End<W::Region>), RayFailure> {
        let field = self.world.field(segment.region);
        let mut flow = Flow::new(field, node, self.tolerance);
        loop {
            let at = *flow.node();
            if !(at.n2 > 0.0 && at.x.is_finite() && at.v.is_finite()) {
                return Err(RayFailure::Lost);
            }
            let left = (self.max_length - so_far.length) / at.v.length();
            if left <= 0.0 {
                return Err(RayFailure::Missed);
            }
            if self.spans.len() > STEPS_PER_RAY {
                return Err(RayFailure::OverBudget);
            }
            let limit = left.min(MAX_STEP_PER_RESOLVED_SPAN * field.resolved_span(at.x, at.v));
            let step = flow.advance(limit, &mut self.work);
            if let Some((end, h, met)) = self.met(segment.region, field, &step) {
                self.spans.push(h);
                so_far.length += h * at.v.length();
                return Ok((end, met));
            }
            self.spans.push(step.arc.h());
            so_far.length += step.arc.arc_length(1.0);
        }
    }

    /// Returns the end of a step at the receiver or a surface, the span up to there, and the
    /// receiver or surface. Returns `None` if the step meets neither.
    fn met(
        &self,
        region: W::Region,
        field: &Field,
        step: &Step<Action>,
    ) -> Option<(Node<Action>, f64, End<W::Region>)> {
        let received = self.receiver.first(&step.arc);
        let crossing = self.world.crossing(region, &step.arc);
        let end = match (received, crossing) {
            (Some(met), Some(crossing)) if met.theta <= crossing.theta => End::Receiver(met),
            (_, Some(crossing)) => End::Surface(crossing),
            (Some(met), None) => End::Receiver(met),
            (None, None) => return None,
        };
        let (theta, position, normal) = match &end {
            End::Receiver(met) => (met.theta, met.position, met.normal),
            End::Surface(crossing) => (crossing.theta, crossing.position, crossing.normal),
        };
        // Correct the span until the end lies on the surface.
        let mut h = theta * step.arc.h();
        if step.arc.is_straight() {
            return Some((step.start.advanced_straight(h), h, end));
        }
        let mut node = step.start.advanced(field, h);
        for _ in 0..MAX_CORRECTIONS {
            let missing = normal.dot(position - node.x) / normal.dot(node.v);
            if missing.abs() <= f64::EPSILON * h {
                break;
            }
            h += missing;
            node = step.start.advanced(field, h);
        }
        Some((node, h, end))
    }

    /// Returns the start of the next segment, beyond a surface or reflected by it.
    fn pass(
        &self,
        segment: &Segment<W::Region>,
        end: &Node<Action>,
        crossing: &Crossing<W::Region>,
    ) -> Result<(Node<Action>, Segment<W::Region>), RayFailure> {
        let (far_n2, far_a, ()) = <()>::local(self.world.field(crossing.beyond), end.x);
        let interface = Interface {
            normal: crossing.normal,
            shape: crossing.shape,
            near: (end.n2, end.a),
            far: (far_n2, far_a),
        };
        let refracted = interface.velocity(crossing.rule, end.v);
        let (rule, after) = match refracted {
            Some(after) => (crossing.rule, after),
            None => (
                Rule::Reflect,
                end.v - 2.0 * end.v.project_onto_normalized(crossing.normal),
            ),
        };
        let region = if rule == Rule::Reflect {
            segment.region
        } else {
            crossing.beyond
        };
        let off = self
            .world
            .ray_epsilon()
            .copysign(crossing.normal.dot(after));
        let x = end.x + crossing.normal * off;
        let node = Node::new(self.world.field(region), x, after, Action::default());
        if !after.is_finite() {
            return Err(RayFailure::Lost);
        }
        let passed = Passed {
            surface: crossing.surface,
            interface,
            rule,
            x: end.x,
            before: end.v,
            after,
            near: segment.region,
            far: crossing.beyond,
        };
        let segment = Segment {
            region,
            first: self.spans.len(),
            passed: Some(passed),
        };
        Ok((node, segment))
    }
}

/// End of a segment.
enum End<R> {
    Receiver(Intersection),
    Surface(Crossing<R>),
}

/// Lengths travelled along a ray.
#[derive(Default)]
struct Progressed {
    length: f64,
    optical_length: f64,
}
