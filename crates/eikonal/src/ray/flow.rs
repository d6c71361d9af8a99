//! A ray through one field, step by step, within a tolerance (docs/theory.md#error-control).

use super::step::{EVALUATIONS_PER_STEP, Node, Step};
use super::tangent::Variation;
use crate::field::Field;
use std::ops::AddAssign;

/// Relative position error per unit of arc length that a ray may make, in (0, 1).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Tolerance(f64);

impl Tolerance {
    /// Clamps to [1e-12, 1e-2], the range in which the error control works; NaN becomes the
    /// default.
    pub fn new(tolerance: f64) -> Self {
        if tolerance.is_nan() {
            return Tolerance::default();
        }
        Tolerance(tolerance.clamp(1e-12, 1e-2))
    }

    /// Returns the tolerance as a number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Default for Tolerance {
    /// Returns 1e-6: a micrometre per metre.
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
    /// Rays traced by connections.
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

/// Longest step relative to the step that is expected to keep the tolerance. A step also never
/// exceeds the field's length scale. Thus it cannot jump over a feature, whatever the error
/// estimate is.
const MAX_STEP_RATIO: f64 = 1.25;
/// Largest size of a repeated step, relative to the step that would just have been accepted.
pub(super) const SAFETY: f64 = 0.9;

/// Denominator of the error of a step: where the field turns a ray at the rate Ω per unit of σ, the
/// error is h⁵Ω⁴n over this.
const ERROR_DENOMINATOR: f64 = 11520.0;

/// A ray traced through one field.
///
/// The step size follows from the tolerance and the measured local error. It depends on the ray
/// alone, so that equal starts give equal rays. Where the field is known to be constant, steps are
/// straight and as long as the constant region allows.
#[derive(Clone, Debug)]
pub struct Flow<'a, V: Variation> {
    field: &'a Field,
    node: Node<V>,
    tolerance: f64,
    /// Expected step in units of the length scale.
    expected: f64,
    h: f64,
    /// Length scale of the field at the node, if computed.
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

    /// Returns the current end of the ray.
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
            // Take one step for a span that it nearly reaches, instead of two.
            let near = SAFETY * limit <= self.h;
            let h = if near { limit } else { self.h }.min(longest);
            let step = Step::new(self.field, &self.node, h);
            work.evaluations += EVALUATIONS_PER_STEP;
            let scale = self.resize(&step);
            if scale >= 1.0 || !step.end.x.is_finite() {
                self.adapt_step(h, scale);
                self.node = step.end;
                self.scale = None;
                work.steps += 1;
                return step;
            }
            self.h = h * (SAFETY * scale).max(0.1);
            work.rejected += 1;
        }
    }

    /// Takes a step over which the field does not bend the ray.
    fn straight(&mut self, h: f64, work: &mut Work) -> Step<V> {
        let step = Step::straight(&self.node, h);
        work.steps += 1;
        self.node = step.end;
        step
    }

    /// Chooses the next step size after a step of size `h` that could have been `scale` times
    /// longer. A step that was cut short by a limit does not reduce the size.
    fn adapt_step(&mut self, h: f64, scale: f64) {
        let next = h * (SAFETY * scale).clamp(0.5, 2.0);
        self.h = if h < self.h { self.h.max(next) } else { next };
    }

    /// Returns the factor by which this step could be longer: its error per length grows as h⁴.
    /// Round-off of positions does not count as error, because shorter steps would have the same
    /// round-off.
    fn resize(&self, step: &Step<V>) -> f64 {
        let round_off = f64::EPSILON * (step.start.x.length() + step.end.x.length());
        let allowed = (self.tolerance * step.arc.h() * step.start.v.length()).max(round_off);
        fourth_root(allowed / step.error().max(1e-300))
    }

    /// Returns the longest span of σ that cannot jump over a feature of the field.
    fn longest(&mut self) -> f64 {
        let n = self.node.v.length();
        let multiple = (MAX_STEP_RATIO * self.expected).min(1.0);
        multiple * self.length_scale() / n
    }

    /// Estimates the first step from the length scale and the forces, which both limit how fast the
    /// field turns rays.
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

/// Returns the expected step that keeps the tolerance, in units of the length scale.
pub(super) fn expected_step(tolerance: Tolerance) -> f64 {
    fourth_root(ERROR_DENOMINATOR * tolerance.get())
}

/// Returns x^¼ by square roots, which every processor rounds alike.
pub(super) fn fourth_root(x: f64) -> f64 {
    x.sqrt().sqrt()
}
