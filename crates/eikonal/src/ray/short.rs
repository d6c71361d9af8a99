//! Short steps, for rays that end after a step or two, such as flights of particles from one
//! collision to the next. A short step takes two field evaluations. A [`Step`](super::Step) takes
//! six and goes about three times as far.
//!
//! Theory: docs/theory.md#short-steps.

use super::arc::{Arc, LengthAlong};
use super::flow::{SAFETY, Tolerance, Work, fourth_root};
use super::step::Node;
use crate::field::Field;
use glam::DVec3;

/// Largest fourth power of the rate at which a step turns, n h/L with the field's length scale L, in
/// units of the tolerance. With the next limit, errors are below the tolerance.
const MAX_TURN: f64 = 400.0;
/// Largest relative error of n² as the square of the speed at the end of a step, in units of the
/// tolerance.
const MAX_SPEED_ERROR: f64 = 0.1;
/// Largest number of steps that are tried in place of one.
const MAX_TRIES: usize = 3;
/// Relative amount by which a step aims beyond the end of its ray, so that the end is on its arc.
const EXCESS: f64 = 1e-3;

/// A ray that takes short steps.
#[derive(Clone, Copy, Debug)]
pub struct ShortRay {
    /// Current end of the ray.
    pub node: Node<()>,
    /// Longest step, as a fraction of the step that the field's length scale allows.
    share: f64,
}

/// Short step up to the end of its ray.
#[derive(Clone, Copy, Debug)]
pub struct ShortStep {
    /// Curve of the step.
    pub arc: Arc,
    /// θ at the end of the step, in (0, 1].
    pub theta_end: f64,
    /// True if the ray ends with the step.
    pub is_last: bool,
    /// Arc length and optical path length along the curve.
    pub lengths: [LengthAlong; 2],
}

impl ShortRay {
    /// Starts a ray at `x` in a unit direction.
    pub fn new(field: &Field, x: DVec3, direction: DVec3) -> Self {
        ShortRay {
            node: Node::start(field, x, direction, ()),
            share: 1.0,
        }
    }

    /// Returns the ray from the current end in another unit direction.
    pub fn turned(&self, direction: DVec3) -> Self {
        ShortRay {
            node: self.node.turned(direction),
            ..*self
        }
    }

    /// Follows the ray for the arc length `left` (finite, positive), or for as long as a short step
    /// keeps the tolerance. Returns `None` if the index changes too much for short steps, or is not
    /// a number. The ray must not be used after that.
    #[inline]
    pub fn advance(
        &mut self,
        field: &Field,
        left: f64,
        tolerance: Tolerance,
        work: &mut Work,
    ) -> Option<ShortStep> {
        let start = self.node;
        let n = start.n2.sqrt();
        if field.homogeneous_span(start.x, start.v) * n >= left {
            self.node = start.advanced_straight(left / n);
            work.steps += 1;
            return Some(ShortStep::straight(&start, n, left));
        }
        let longest = fourth_root(MAX_TURN * tolerance.get());
        let limit = longest * field.step_scale(start.x, start.v) / n;
        let span = span_of_length(&start, n, left) * (1.0 + EXCESS);
        for _ in 0..MAX_TRIES {
            let h = span.min(self.share * limit);
            let [middle, end] = advanced(field, &start, h);
            work.evaluations += 2;
            let speed_error = (end.v.length_squared() / end.n2 - 1.0).abs();
            let scale = fourth_root(MAX_SPEED_ERROR * tolerance.get() / speed_error.max(1e-300));
            if scale >= 1.0 {
                self.share = (self.share * (SAFETY * scale).clamp(1.0, 2.0)).min(1.0);
                self.node = end;
                work.steps += 1;
                let step = ShortStep::between([&start, &middle, &end], h);
                return self.cut(step, left, h == span, &middle);
            }
            work.rejected += 1;
            self.share = h / limit * (SAFETY * scale).max(0.1);
        }
        None
    }

    /// Ends the step at the arc length `left` if it was meant to end there. `middle` is the ray in
    /// the middle of the step.
    #[inline]
    fn cut(
        &mut self,
        mut step: ShortStep,
        left: f64,
        is_last: bool,
        middle: &Node<()>,
    ) -> Option<ShortStep> {
        let whole = step.lengths[0].at(1.0);
        if !is_last {
            return (whole < left).then_some(step);
        }
        // Also false for lengths that are not numbers.
        if !(left <= whole && whole < 1.1 * left) {
            return None;
        }
        step.is_last = true;
        step.theta_end = step.lengths[0].inverse(left);
        // Go back from the end, with an even change of the force.
        let (end, h) = (&mut self.node, step.arc.h());
        let back = (1.0 - step.theta_end) * h;
        let change = (end.a - middle.a) * (back / h);
        let x = step.arc.position(step.theta_end);
        end.n2 += (x - end.x).dot(end.a - change) * 2.0;
        end.v -= (end.a - change) * back;
        end.a -= change * 2.0;
        end.x = x;
        Some(step)
    }
}

impl ShortStep {
    /// Creates the step of span `h` of σ with given nodes at its start, in its middle and at its
    /// end.
    #[inline]
    fn between(nodes: [&Node<()>; 3], h: f64) -> Self {
        let [start, _, end] = nodes;
        let arc = Arc::hermite([start.x, start.v, start.a], [end.x, end.v, end.a], h);
        ShortStep {
            lengths: lengths(&arc, nodes),
            arc,
            theta_end: 1.0,
            is_last: false,
        }
    }

    /// Creates the last step of a ray where the index is constant.
    #[inline]
    fn straight(start: &Node<()>, n: f64, length: f64) -> Self {
        ShortStep {
            arc: Arc::line(start.x, start.v, length / n),
            theta_end: 1.0,
            is_last: true,
            lengths: [length, n * length].map(LengthAlong::even),
        }
    }
}

/// Returns the span of σ of a ray of the given arc length, if its index changes evenly.
fn span_of_length(start: &Node<()>, n: f64, length: f64) -> f64 {
    let span = length / n;
    // Solve n h + ½ n' h² = length, where n' = dn/dσ = v·a/n.
    let change = 2.0 * start.v.dot(start.a) * span / start.n2;
    2.0 * span / (1.0 + (1.0 + change).max(0.0).sqrt())
}

/// Returns arc length and optical path length along a step, by the rule of sixth order with the
/// values of n and n² in three places and their rates at the ends.
#[inline]
fn lengths(arc: &Arc, [start, middle, end]: [&Node<()>; 3]) -> [LengthAlong; 2] {
    let h = arc.h();
    // The force in the middle was taken beside the arc.
    let inner = middle.n2 + 2.0 * middle.a.dot(arc.position(0.5) - middle.x);
    let changes = [start, end].map(|node| 2.0 * node.v.dot(node.a));
    let squares = [start.n2, inner, end.n2];
    let indices = squares.map(f64::sqrt);
    let of_index = [0.5 * changes[0] / indices[0], 0.5 * changes[1] / indices[2]];
    [(indices, of_index), (squares, changes)].map(|([first, inner, last], changes)| {
        let ends = 7.0 * (first + last) + 0.5 * h * (changes[0] - changes[1]);
        let total = (ends + 16.0 * inner) * (h / 30.0);
        let [from, to] = [[first, changes[0]], [last, changes[1]]].map(|[v, a]| [v * h, a * h * h]);
        LengthAlong::quintic(from, total, to)
    })
}

/// Returns the nodes in the middle and at the end of a step of span `h` of σ, by Nyström's method
/// with the forces at the start, in the middle and at the end. Its positions are of fourth order,
/// and its velocities of third.
#[inline]
fn advanced(field: &Field, start: &Node<()>, h: f64) -> [Node<()>; 2] {
    let Node { x, v, a, .. } = *start;
    let at = |x, v| Node::new(field, x, v, ());
    let middle = at(x + v * (0.5 * h) + a * (0.125 * h * h), v + a * (0.5 * h));
    let end_x = x + v * h + (a + middle.a * 2.0) * (h * h / 6.0);
    let mut end = at(end_x, v);
    // Planted error "short steps that bend twice as much", found by morgana-eikonal/eikonal::ray_accuracy::short_steps_are_as_good_as_the_manual_says:
    // end.v = v + (a + middle.a * 4.0 + end.a) * (h / 3.0);
    end.v = v + (a + middle.a * 4.0 + end.a) * (h / 6.0);
    [middle, end]
}
