//! A ray through one field, step by step, with steps that keep a tolerance (docs/theory.md#error-control).

use super::step::{EVALUATIONS_PER_STEP, Node, Step};
use super::tangent::Variation;
use crate::field::Field;
use std::ops::AddAssign;

/// Relative position error per unit of arc length that a ray may make, in (0, 1).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Tolerance(f64);

impl Tolerance {
    /// Clamps to the range in which the error control works, [1e-12, 1e-2]; what is not a number becomes the default.
    pub fn new(tolerance: f64) -> Self {
        if tolerance.is_nan() {
            return Tolerance::default();
        }
        Tolerance(tolerance.clamp(1e-12, 1e-2))
    }

    /// The number itself.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Default for Tolerance {
    /// 1e-6: a micrometre per metre.
    fn default() -> Self {
        Tolerance(1e-6)
    }
}

/// Work done, in units that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Work {
    /// Accepted steps.
    pub steps: u64,
    /// Steps repeated because their error was too large.
    pub rejected: u64,
    /// Field evaluations.
    pub evaluations: u64,
    /// Rays shot by connections.
    pub shots: u64,
}

impl AddAssign for Work {
    fn add_assign(&mut self, o: Work) {
        self.steps += o.steps;
        self.rejected += o.rejected;
        self.evaluations += o.evaluations;
        self.shots += o.shots;
    }
}

/// A step never exceeds the field's length scale, nor this multiple of the step that is expected to keep the
/// tolerance, so that it cannot jump over a feature whatever the error estimate says.
const MOST_OVER_EXPECTED: f64 = 1.25;
/// A repeated step shrinks at least this far below the size that would just have been accepted.
const SAFETY: f64 = 0.9;

/// Where the field turns a ray at the rate Ω per unit of σ, a step makes an error of h⁵Ω⁴n over this.
const ERROR: f64 = 11520.0;

/// A ray as it is followed through one field.
///
/// The step size follows from the tolerance and the measured local error; it depends on the
/// family alone, so equal starts give equal rays. Where the index is constant steps are straight, and as
/// long as that is known.
#[derive(Clone, Debug)]
pub struct Flow<'a, V: Variation> {
    field: &'a Field,
    node: Node<V>,
    tolerance: f64,
    /// The expected step in units of the length scale.
    expected: f64,
    h: f64,
    /// The length scale of the field at the node, if it has been asked for.
    scale: Option<f64>,
}

impl<'a, V: Variation> Flow<'a, V> {
    /// Starts a ray at a node.
    pub fn new(field: &'a Field, node: Node<V>, tolerance: Tolerance) -> Self {
        let mut flow = Flow {
            field,
            node,
            tolerance: tolerance.get(),
            expected: expected_step(tolerance),
            h: f64::INFINITY,
            scale: None,
        };
        if !field.is_constant() {
            flow.h = flow.first_guess();
        }
        flow
    }

    /// Where the ray has got to.
    pub fn node(&self) -> &Node<V> {
        &self.node
    }

    /// Takes the next step, of at most `limit` of σ (finite, positive).
    pub fn advance(&mut self, limit: f64, work: &mut Work) -> Step<V> {
        if self.field.is_constant() {
            return self.straight(limit, work);
        }
        let homogeneous = self.field.homogeneous_span(self.node.x, self.node.v);
        if homogeneous > self.longest() {
            return self.straight(homogeneous.min(limit), work);
        }
        loop {
            let longest = self.longest();
            // Two steps for a span that one nearly reaches would be one too many.
            let near = SAFETY * limit <= self.h;
            let h = if near { limit } else { self.h }.min(longest);
            let step = Step::new(self.field, &self.node, h);
            work.evaluations += EVALUATIONS_PER_STEP;
            let scale = self.resize(&step);
            if scale >= 1.0 || !step.end.x.is_finite() {
                self.settle(h, scale);
                self.node = step.end;
                self.scale = None;
                work.steps += 1;
                return step;
            }
            self.h = h * (SAFETY * scale).max(0.1);
            work.rejected += 1;
        }
    }

    /// A step over which nothing bends the ray.
    fn straight(&mut self, h: f64, work: &mut Work) -> Step<V> {
        let step = Step::straight(&self.node, h);
        work.steps += 1;
        self.node = step.end;
        step
    }

    /// Chooses the next step size after one of size `h` that could have been `scale` times longer.
    /// A step that something else cut short says nothing against a longer one.
    fn settle(&mut self, h: f64, scale: f64) {
        let next = h * (SAFETY * scale).clamp(0.5, 2.0);
        self.h = if h < self.h { self.h.max(next) } else { next };
    }

    /// The factor by which this step could be longer: its error per length grows as h⁴. Round-off of positions is no error of
    /// the step: shorter ones would have the same.
    fn resize(&self, step: &Step<V>) -> f64 {
        let round_off = f64::EPSILON * (step.start.x.length() + step.end.x.length());
        let allowed = (self.tolerance * step.arc.h() * step.start.v.length()).max(round_off);
        fourth_root(allowed / step.error().max(1e-300))
    }

    /// The longest span of σ that cannot jump over a feature of the field.
    fn longest(&mut self) -> f64 {
        let n = self.node.v.length();
        let multiple = (MOST_OVER_EXPECTED * self.expected).min(1.0);
        multiple * self.length_scale() / n
    }

    /// A first step from the length scale and the forces, which both say how fast the field turns rays.
    fn first_guess(&mut self) -> f64 {
        let n = self.node.v.length();
        let omega = (n / self.length_scale()).max(self.node.a.length() / n);
        SAFETY * self.expected / omega
    }

    fn length_scale(&mut self) -> f64 {
        let (field, x, v) = (self.field, self.node.x, self.node.v);
        *self.scale.get_or_insert_with(|| field.step_scale(x, v))
    }
}

/// The step that is expected to keep the tolerance, in units of the length scale.
pub(super) fn expected_step(tolerance: Tolerance) -> f64 {
    fourth_root(ERROR * tolerance.get())
}

/// x^¼ by roots that every processor rounds alike.
fn fourth_root(x: f64) -> f64 {
    x.sqrt().sqrt()
}
