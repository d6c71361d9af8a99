//! A step of a ray, with or without tangents.
//!
//! The scheme is a six-stage, fourth-order symplectic Runge–Kutta–Nyström method: SRKN₆ᵇ of Blanes
//! and Moan ("Practical symplectic partitioned Runge–Kutta and Runge–Kutta–Nyström methods", J.
//! Comput. Appl. Math. 142, 2002). It is symmetric, hence time-reversible. Its error constant is
//! two orders of magnitude below the constant of Yoshida's composition. The last force evaluation
//! of a step is the first of the next step. Forces are known at both ends, so quintic Hermite dense
//! output and an error estimate need no further evaluations.
//!
//! Theory: docs/theory.md#steps.

use super::arc::Arc;
use super::tangent::Variation;
use crate::field::Field;
use glam::DVec3;

/// Kick (velocity) coefficients; symmetric about the middle one.
pub(crate) const KICK: [f64; 4] = [
    0.0829844064174052,
    0.396309801498368,
    -0.0390563049223486,
    1.0 - 2.0 * (0.0829844064174052 + 0.396309801498368 - 0.0390563049223486),
];
/// Drift (position) coefficients; symmetric.
pub(crate) const DRIFT: [f64; 3] = [
    0.245298957184271,
    0.604872665711080,
    // Planted error "one wrong digit in the step scheme", found by morgana-eikonal/eikonal::rays::the_scheme_converges_at_fourth_order:
    // 0.5 - (0.245298957184271 + 0.604972665711080),
    0.5 - (0.245298957184271 + 0.604872665711080),
];
/// Order of stages over one step: indices into `DRIFT` and into the `KICK` that follows each.
pub(crate) const STAGES: [(usize, usize); 6] = [(0, 1), (1, 2), (2, 3), (2, 2), (1, 1), (0, 0)];

/// Ratio of the scheme's local error to the measured quadrature defect ([`Step::error`]): an upper
/// bound seen over Luneburg, fisheye and Gaussian fields at tolerances of 1e-4 and below.
const ERROR_PER_DEFECT: f64 = 1.0 / 16.0;

/// Number of field evaluations of a step.
pub(crate) const EVALUATIONS_PER_STEP: u64 = STAGES.len() as u64;

/// A point of a ray, with the field's values there and the variation carried along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node<V: Variation> {
    /// Position.
    pub x: DVec3,
    /// Velocity dx/dσ; |v| = n.
    pub v: DVec3,
    /// n² of the field at `x`.
    pub n2: f64,
    /// Acceleration d²x/dσ² = ½∇n².
    pub a: DVec3,
    /// Tangent columns, or `()`.
    pub variation: V,
    local: V::Local,
}

impl<V: Variation> Node<V> {
    /// Creates the node at `x` with velocity `v`.
    pub fn new(field: &Field, x: DVec3, v: DVec3, variation: V) -> Self {
        let (n2, a, local) = V::local(field, x);
        Node {
            x,
            v,
            n2,
            a,
            variation,
            local,
        }
    }

    /// Creates the node at `x` with the unit direction `direction`: v = n·direction.
    pub fn start(field: &Field, x: DVec3, direction: DVec3, variation: V) -> Self {
        let mut node = Node::new(field, x, direction, variation);
        node.v = direction * node.n2.sqrt();
        node
    }

    /// Returns the node at the same position with another unit direction.
    pub fn turned(&self, direction: DVec3) -> Self {
        Node {
            v: direction * self.n2.sqrt(),
            ..*self
        }
    }

    /// Returns the node a span `h` of σ further, by one step of the scheme.
    pub fn advanced(&self, field: &Field, h: f64) -> Self {
        let mut node = *self;
        node.kick(KICK[0] * h);
        for (drift, kick) in STAGES {
            node.x += node.v * (DRIFT[drift] * h);
            node.variation.drift(DRIFT[drift] * h);
            (node.n2, node.a, node.local) = V::local(field, node.x);
            node.kick(KICK[kick] * h);
        }
        node
    }

    fn kick(&mut self, h: f64) {
        self.v += self.a * h;
        self.variation.kick(&self.local, h);
    }

    /// Returns the node a span `h` of σ further where the index is constant.
    pub(crate) fn advanced_straight(&self, h: f64) -> Self {
        let mut node = *self;
        node.x += node.v * h;
        node.variation.straight(&node.local, h);
        node
    }
}

/// Length of an arc, relative to its distance from the origin, below which round-off of positions
/// matters.
const MIN_RELATIVE_LENGTH: f64 = 1e-6;

/// A step of a ray: its two ends and the curve between them.
#[derive(Clone, Copy, Debug)]
pub struct Step<V: Variation> {
    /// Start of the step.
    pub start: Node<V>,
    /// End of the step.
    pub end: Node<V>,
    /// Curve between start and end.
    pub arc: Arc,
}

impl<V: Variation> Step<V> {
    /// Takes one step of span `h` of σ in a field.
    pub fn new(field: &Field, start: &Node<V>, h: f64) -> Self {
        let end = start.advanced(field, h);
        Step {
            arc: Arc::hermite([start.x, start.v, start.a], [end.x, end.v, end.a], h),
            start: *start,
            end,
        }
    }

    /// Takes a straight step of span `h` of σ, exact where the index is constant.
    pub fn straight(start: &Node<V>, h: f64) -> Self {
        Step {
            start: *start,
            end: start.advanced_straight(h),
            arc: Arc::line(start.x, start.v, h),
        }
    }

    /// Returns the estimated local position error.
    ///
    /// The defect x₁ − x₀ − h(v₀+v₁)/2 + h²(a₁−a₀)/12 is −h⁵x⁽⁵⁾/720 + O(h⁷). It is of the order of
    /// the scheme's own error and needs no evaluations (docs/theory.md#error-control).
    pub fn error(&self) -> f64 {
        let (s, e, h) = (&self.start, &self.end, self.arc.h());
        let defect = e.x - s.x - (s.v + e.v) * (0.5 * h) + (e.a - s.a) * (h * h / 12.0);
        defect.length() * ERROR_PER_DEFECT
    }

    /// Approximates the θ on the arc at which the optical path length from its start is `length`,
    /// given the optical path length of the `whole` arc. A cubic with n² at the ends as slopes is
    /// no less accurate than the step.
    pub fn theta_at_optical_length(&self, length: f64, whole: f64) -> f64 {
        let [first, last] = [&self.start, &self.end].map(|node| node.n2 * self.arc.h());
        let (b, c) = (3.0 * whole - 2.0 * first - last, first + last - 2.0 * whole);
        let mut t = length / whole;
        for _ in 0..2 {
            let excess = t * (first + t * (b + t * c)) - length;
            t -= excess / (first + t * (2.0 * b + t * 3.0 * c));
        }
        t.clamp(0.0, 1.0)
    }

    /// Returns position, velocity and variation at θ on the arc: dense output, differentiated
    /// exactly.
    pub fn at(&self, theta: f64) -> (DVec3, DVec3, V) {
        if theta >= 1.0 {
            return (self.end.x, self.end.v, self.end.variation);
        }
        if self.arc.is_straight() {
            // Use the node's velocity: round-off of positions would spoil the velocity of a very
            // short arc.
            let mut variation = self.start.variation;
            variation.drift(theta * self.arc.h());
            return (self.arc.position(theta), self.start.v, variation);
        }
        let variation = V::interpolate(
            &self.start.variation,
            &self.start.local,
            &self.end.variation,
            &self.end.local,
            self.arc.h(),
            theta,
        );
        (self.arc.position(theta), self.velocity(theta), variation)
    }

    /// Returns the velocity at θ on the arc. On very short arcs it is interpolated between the
    /// ends, because round-off of positions would spoil it.
    pub fn velocity(&self, theta: f64) -> DVec3 {
        let (start, end, h) = (&self.start, &self.end, self.arc.h());
        if h * start.v.length() > MIN_RELATIVE_LENGTH * start.x.length() {
            return self.arc.velocity(theta);
        }
        let t = theta;
        let change = (end.v - start.v) * (t * t * (3.0 - 2.0 * t));
        let bends = start.a * (t * (1.0 - t).powi(2)) + end.a * (t * t * (t - 1.0));
        start.v + change + bends * h
    }
}
