//! Flights: rays through one field that end on a surface or at an arc length, for paths that are
//! scattered between them. Flights are traced and taken back one at a time
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::follow::RayFailure;
use crate::budget::STEPS_PER_RAY;
use crate::field::Field;
use crate::ray::{Arc, Flow, Node, Step, Tolerance, Variation, Work};
use glam::DVec3;

/// Longest step in units of the field's resolved span, as for whole rays: every coefficient of the
/// field has an effect.
const MAX_STEP_PER_RESOLVED_SPAN: f64 = 1.5;
/// Maximum number of corrections of a last step; each squares the error.
const MAX_CORRECTIONS: usize = 3;

/// Arc length ∫n dσ, summed over the kicks of the scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ArcLength(f64);

impl Variation for ArcLength {
    /// Index n.
    type Local = f64;

    fn local(field: &Field, x: DVec3) -> (f64, DVec3, f64) {
        let (n2, grad) = field.gradient(x);
        (n2, grad * 0.5, n2.sqrt())
    }

    fn kick(&mut self, n: &f64, h: f64) {
        self.0 += n * h;
    }

    fn drift(&mut self, _: f64) {}

    fn straight(&mut self, local: &f64, h: f64) {
        self.kick(local, h);
    }

    /// Interpolates by the cubic that has the indices as slopes.
    fn interpolate(start: &Self, first: &f64, end: &Self, last: &f64, h: f64, t: f64) -> Self {
        let (whole, first, last) = (end.0 - start.0, first * h, last * h);
        let (b, c) = (3.0 * whole - 2.0 * first - last, first + last - 2.0 * whole);
        ArcLength(start.0 + t * (first + t * (b + t * c)))
    }
}

/// Intersection of an arc with a surface.
#[derive(Clone, Copy, Debug)]
pub struct FlightIntersection<M> {
    /// Parameter of the arc.
    pub theta: f64,
    /// Intersection point, on the surface to round-off.
    pub position: DVec3,
    /// Unit normal of the surface at the intersection, of either sign.
    pub normal: DVec3,
    /// Data of the surface.
    pub what: M,
}

/// A point of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightPoint {
    /// Position.
    pub x: DVec3,
    /// Velocity dx/dσ; its length is the index up to the tolerance.
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

/// Parameters with which flights are traced.
#[derive(Clone, Copy, Debug)]
pub struct FlightLimits {
    /// Tolerance of the steps.
    pub tolerance: Tolerance,
    /// True if steps must see every sample of a grid, as derivatives by the samples require.
    pub resolved: bool,
    /// Arc length at which a flight ends that has met no surface.
    pub length: f64,
}

/// A flight, step by step. It can trace one flight after another in the same memory.
#[derive(Clone, Debug, Default)]
pub struct Flight {
    nodes: Vec<Node<ArcLength>>,
    spans: Vec<f64>,
}

impl Flight {
    /// Returns the spans of σ of the steps.
    pub fn spans(&self) -> &[f64] {
        &self.spans
    }

    /// Traces the ray from `x` with velocity `v` to the first surface. Without a surface, it ends
    /// with the step that reaches the length limit.
    ///
    /// # Errors
    ///
    /// The ray is lost, or takes too many steps.
    pub fn follow<M>(
        &mut self,
        field: &Field,
        [x, v]: [DVec3; 2],
        limits: &FlightLimits,
        work: &mut Work,
        meets: impl Fn(&Arc) -> Option<FlightIntersection<M>>,
    ) -> Result<(FlightPoint, Option<FlightIntersection<M>>), RayFailure> {
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
                MAX_STEP_PER_RESOLVED_SPAN * field.resolved_span(at.x, at.v)
            } else {
                f64::INFINITY
            };
            // Exceed the remaining length slightly, so that rounding leaves no remainder.
            let step = flow.advance(((1.0 + 1e-9) * left).min(resolved), work);
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
        }
    }

    /// Returns the point at an arc length of the last traced flight, the index of the step that
    /// contains it, and the span from the start of this step.
    pub fn at(&self, field: &Field, resolved: bool, length: f64) -> (FlightPoint, usize, f64) {
        let beyond = self.nodes.partition_point(|n| n.variation.0 <= length);
        let step = beyond.saturating_sub(1);
        let start = &self.nodes[step];
        let is_line = is_line(field, resolved, [self.nodes[0].x, self.nodes[0].v]);
        let mut h = (length - start.variation.0) / start.n2.sqrt();
        let mut node = advanced(field, is_line, start, h);
        for _ in 0..MAX_CORRECTIONS {
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

/// Returns true if a flight is one straight step that needs only the value of the index.
pub(super) fn is_line(field: &Field, resolved: bool, [x, v]: [DVec3; 2]) -> bool {
    field.is_constant() && !(resolved && field.resolved_span(x, v).is_finite())
}

/// Returns the node a span `h` further by one step.
fn advanced(field: &Field, is_line: bool, start: &Node<ArcLength>, h: f64) -> Node<ArcLength> {
    if is_line {
        start.advanced_straight(h)
    } else {
        start.advanced(field, h)
    }
}

/// Returns the end of a step on the surface that it meets, and the span up to it.
fn reach<M>(
    field: &Field,
    is_line: bool,
    step: &Step<ArcLength>,
    met: &FlightIntersection<M>,
) -> (Node<ArcLength>, f64) {
    let mut h = met.theta * step.arc.h();
    let mut node = advanced(field, is_line, &step.start, h);
    for _ in 0..MAX_CORRECTIONS {
        let missing = met.normal.dot(met.position - node.x) / met.normal.dot(node.v);
        if missing.abs() <= f64::EPSILON * h {
            break;
        }
        h += missing;
        node = advanced(field, is_line, &step.start, h);
    }
    (node, h)
}
