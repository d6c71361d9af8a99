//! Flights: rays through one field that end on a surface or at an arc length, followed and taken back one at a time, for paths that are
//! scattered between them (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::follow::RayFailure;
use super::reverse::StartDerivative;
use crate::budget::STEPS_PER_RAY;
use crate::field::{Field, IndexDerivative};
use crate::ray::{Arc, DRIFT, Flow, KICK, Node, STAGES, Step, Tolerance, Variation, Work};
use glam::DVec3;

/// As for rays from end to end: no coefficient is without effect.
const PER_RESOLVED_SPAN: f64 = 1.5;
/// Corrections of a last step, each of which squares what is missing.
const CORRECTIONS: usize = 3;

/// ∫n dσ by the kicks of the scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ArcLength(f64);

impl Variation for ArcLength {
    /// n.
    type Local = f64;

    fn local(field: &Field, x: DVec3) -> (f64, DVec3, f64) {
        let (n2, grad) = field.gradient(x);
        (n2, grad * 0.5, n2.sqrt())
    }

    fn kick(&mut self, n: &f64, h: f64) {
        self.0 += n * h;
    }

    fn drift(&mut self, _: f64) {}

    /// By the cubic that has the indices as slopes.
    fn interpolate(start: &Self, first: &f64, end: &Self, last: &f64, h: f64, t: f64) -> Self {
        let (whole, first, last) = (end.0 - start.0, first * h, last * h);
        let (b, c) = (3.0 * whole - 2.0 * first - last, first + last - 2.0 * whole);
        ArcLength(start.0 + t * (first + t * (b + t * c)))
    }
}

/// Where a surface is met on an arc, and what it is.
#[derive(Clone, Copy, Debug)]
pub struct FlightMeeting<M> {
    /// Parameter of the arc.
    pub theta: f64,
    /// The point, on the surface to round-off.
    pub position: DVec3,
    /// Unit normal there, of either sign.
    pub normal: DVec3,
    /// What is met.
    pub what: M,
}

/// A point of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightPoint {
    /// Position.
    pub x: DVec3,
    /// Velocity dx/dσ, of which the length is the index up to the tolerance.
    pub v: DVec3,
    /// Arc length from the start.
    pub length: f64,
}

impl FlightPoint {
    fn of(node: &Node<ArcLength>) -> Self {
        FlightPoint {
            x: node.x,
            v: node.v,
            length: node.variation.0,
        }
    }
}

/// Derivative of a loss by a point of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightDerivative {
    /// By the position.
    pub x: DVec3,
    /// By the velocity.
    pub v: DVec3,
    /// By the arc length from the start.
    pub length: f64,
}

/// How flights are followed.
#[derive(Clone, Copy, Debug)]
pub struct FlightLimits {
    /// Of the steps.
    pub tolerance: Tolerance,
    /// Whether steps see every sample of a grid, as derivatives by them must.
    pub resolved: bool,
    /// Arc length at which a flight ends that has met nothing.
    pub length: f64,
}

/// A flight, step by step. It can follow one after another in the same memory.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    nodes: Vec<Node<ArcLength>>,
    spans: Vec<f64>,
}

impl Flight {
    /// Spans of σ of the steps.
    pub fn spans(&self) -> &[f64] {
        &self.spans
    }

    /// Follows the ray from `x` with velocity `v` to the first surface, or to the end of the step on which it gets as long as it may.
    ///
    /// # Errors
    /// It is lost, or takes too many steps.
    pub fn follow<M>(
        &mut self,
        field: &Field,
        [x, v]: [DVec3; 2],
        limits: &FlightLimits,
        work: &mut Work,
        meets: impl Fn(&Arc) -> Option<FlightMeeting<M>>,
    ) -> Result<(FlightPoint, Option<FlightMeeting<M>>), RayFailure> {
        self.nodes.clear();
        self.spans.clear();
        let node = Node::new(field, x, v, ArcLength::default());
        let is_line = is_line(field, limits.resolved, [x, v]);
        let mut flow = Flow::new(field, node, limits.tolerance);
        loop {
            let at = *flow.node();
            if !(at.n2 > 0.0 && at.x.is_finite() && at.v.is_finite()) {
                return Err(RayFailure::Lost);
            }
            if self.spans.len() > STEPS_PER_RAY {
                return Err(RayFailure::OverBudget);
            }
            let left = (limits.length - at.variation.0) / at.v.length();
            if left <= 0.0 {
                return Ok((FlightPoint::of(&at), None));
            }
            let resolved = if limits.resolved && !is_line {
                PER_RESOLVED_SPAN * field.resolved_span(at.x, at.v)
            } else {
                f64::INFINITY
            };
            // A little more than is left, lest rounding leaves a rest.
            let mut step = flow.advance((1.0 + 1e-9) * left.min(resolved), work);
            self.nodes.push(step.start);
            if let Some(met) = meets(&step.arc) {
                let (end, h) = reach(field, is_line, &step, &met);
                self.spans.push(h);
                let is_sound = end.x.is_finite() && h.is_finite();
                return if is_sound {
                    Ok((FlightPoint::of(&end), Some(met)))
                } else {
                    Err(RayFailure::Lost)
                };
            }
            self.spans.push(step.arc.h());
            if step.arc.is_straight() {
                step.end.variation.0 += step.arc.h() * at.n2.sqrt();
                flow = Flow::new(field, step.end, limits.tolerance);
            }
        }
    }

    /// The point at an arc length of the flight that was followed last; the number of the step on which it lies, and the span from its start.
    pub fn at(&self, field: &Field, resolved: bool, length: f64) -> (FlightPoint, usize, f64) {
        let beyond = self.nodes.partition_point(|n| n.variation.0 <= length);
        let step = beyond.saturating_sub(1);
        let start = &self.nodes[step];
        let is_line = is_line(field, resolved, [self.nodes[0].x, self.nodes[0].v]);
        let mut h = (length - start.variation.0) / start.n2.sqrt();
        let mut node = advanced(field, is_line, start, h);
        for _ in 0..CORRECTIONS {
            let missing = (length - node.variation.0) / node.n2.sqrt();
            if missing.abs() <= f64::EPSILON * h {
                break;
            }
            h += missing;
            node = advanced(field, is_line, start, h);
        }
        (FlightPoint::of(&node), step, h)
    }
}

/// Whether a flight is one straight step, of which only the value of the index is wanted.
fn is_line(field: &Field, resolved: bool, [x, v]: [DVec3; 2]) -> bool {
    field.is_constant() && !(resolved && field.resolved_span(x, v).is_finite())
}

/// The node a span `h` further by one step.
fn advanced(field: &Field, is_line: bool, start: &Node<ArcLength>, h: f64) -> Node<ArcLength> {
    if !is_line {
        return start.advanced(field, h);
    }
    let mut node = *start;
    node.x += node.v * h;
    node.variation.0 += node.n2.sqrt() * h;
    node
}

/// The end of a step on the surface that it meets, and its span.
fn reach<M>(
    field: &Field,
    is_line: bool,
    step: &Step<ArcLength>,
    met: &FlightMeeting<M>,
) -> (Node<ArcLength>, f64) {
    let mut h = met.theta * step.arc.h();
    let mut node = advanced(field, is_line, &step.start, h);
    for _ in 0..CORRECTIONS {
        let missing = met.normal.dot(met.position - node.x) / met.normal.dot(node.v);
        if missing.abs() <= f64::EPSILON * h {
            break;
        }
        h += missing;
        node = advanced(field, is_line, &step.start, h);
    }
    (node, h)
}

/// A point of a flight on the way back, and the derivative of a loss by it at equal σ.
#[derive(Clone, Copy, Debug)]
pub struct FlightAdjoint {
    /// Position.
    pub x: DVec3,
    /// Velocity.
    pub v: DVec3,
    /// The derivative.
    pub by: FlightDerivative,
}

impl FlightAdjoint {
    /// At the end of a flight, on a surface with this normal: the end stays on it.
    pub fn on_surface(field: &Field, end: &FlightPoint, normal: DVec3, by: FlightDerivative) -> Self {
        let mut adjoint = FlightAdjoint {
            x: end.x,
            v: end.v,
            by,
        };
        let by_span = adjoint.by_span(field);
        adjoint.by.x -= normal * (by_span / normal.dot(end.v));
        adjoint
    }

    /// At the end of a flight of given arc length, and the derivative by that length.
    pub fn at_length(field: &Field, end: &FlightPoint, by: FlightDerivative) -> (Self, f64) {
        let mut adjoint = FlightAdjoint {
            x: end.x,
            v: end.v,
            by,
        };
        let by_length = adjoint.by_span(field) / field.n(end.x);
        adjoint.by.length -= by_length;
        (adjoint, by_length)
    }

    /// By the span of σ up to here.
    fn by_span(&self, field: &Field) -> f64 {
        let (n2, grad) = field.gradient(self.x);
        let by = &self.by;
        by.x.dot(self.v) + by.v.dot(grad) * 0.5 + by.length * n2.sqrt()
    }

    /// Back over steps of a flight, the last first. What it says of the field goes to `sink`.
    pub fn back(
        &mut self,
        field: &Field,
        resolved: bool,
        spans: &[f64],
        sink: &mut impl FnMut(DVec3, IndexDerivative),
    ) {
        if is_line(field, resolved, [self.x, self.v]) {
            for &h in spans.iter().rev() {
                self.lengthen(field.n2(self.x), h, sink);
                self.drift(h);
            }
            return;
        }
        let mut kick = 0.0;
        for &h in spans.iter().rev() {
            for (drift, after) in STAGES.into_iter().rev() {
                self.kick(field, kick + KICK[after] * h, sink);
                kick = 0.0;
                self.drift(DRIFT[drift] * h);
            }
            kick = KICK[0] * h;
        }
        if !spans.is_empty() {
            self.kick(field, kick, sink);
        }
    }

    /// Back over x += h v.
    fn drift(&mut self, h: f64) {
        self.x -= self.v * h;
        self.by.v += self.by.x * h;
    }

    /// Back over an arc length of n h.
    fn lengthen(&self, n2: f64, h: f64, sink: &mut impl FnMut(DVec3, IndexDerivative)) {
        let n2 = self.by.length * h / (2.0 * n2.sqrt());
        let gradient = DVec3::ZERO;
        sink(self.x, IndexDerivative { n2, gradient });
    }

    /// Back over v += ½h∇n² and an arc length of n h.
    fn kick(&mut self, field: &Field, h: f64, sink: &mut impl FnMut(DVec3, IndexDerivative)) {
        let jet = field.jet(self.x);
        let by_n2 = self.by.length * h / (2.0 * jet.n2.sqrt());
        let by = IndexDerivative {
            n2: by_n2,
            gradient: self.by.v * (0.5 * h),
        };
        sink(self.x, by);
        self.v -= jet.grad * (0.5 * h);
        self.by.x += jet.hess * self.by.v * (0.5 * h) + jet.grad * by_n2;
    }

    /// At the start of a flight in a unit direction, v = n·direction: the derivative by the position and the direction.
    pub fn start(
        &self,
        field: &Field,
        direction: DVec3,
        sink: &mut impl FnMut(DVec3, IndexDerivative),
    ) -> StartDerivative {
        let (n2, grad) = field.gradient(self.x);
        let n = n2.sqrt();
        let along = direction.dot(self.by.v);
        let by_n2 = along / (2.0 * n);
        let gradient = DVec3::ZERO;
        sink(
            self.x,
            IndexDerivative {
                n2: by_n2,
                gradient,
            },
        );
        StartDerivative {
            x: self.by.x + grad * by_n2,
            direction: (self.by.v - direction * along) * n,
        }
    }
}
