//! Relaxation: the ray between two points within a field that changes often along it.
//!
//! Nodes at equal steps h of σ satisfy Numerov's formula x₊ − 2x + x₋ = h²/12 (a₊ + 10a + a₋), with
//! a = ½∇n². Newton's method solves these equations from the chord: its matrix is block
//! tridiagonal. The factors also give the derivatives of the first velocity with respect to the
//! far end, hence the tangents.
//!
//! Theory: docs/theory.md#relaxation.

use super::{CollocatedRay, Collocation};
use crate::field::{Field, Jet};
use crate::ray::{Arc, Tangents, perpendicular_basis};
use glam::{DMat3, DVec3};

/// Distance of nodes in length scales, at the tolerance 1e-4. In turbulence of 256³ samples, rays
/// then have directions and Jacobians as accurate as traced rays.
const SPACING: f64 = 0.33;
/// Distance of the places on the chord at which the length scale is taken, in length scales.
const SCALE_SPACING: f64 = 1.0;
/// Smallest number of steps between nodes.
const MIN_STEPS: usize = 8;
/// Largest number of steps between nodes. Longer rays are traced.
const MAX_STEPS: usize = 1024;
/// Maximum number of rounds of Newton's method.
const MAX_ROUNDS: usize = 6;
/// Largest change of the nodes by the last round, in tolerances times the step between nodes. The
/// Hessians, which belong to the nodes before this change, are then accurate enough.
const MAX_LAST_CHANGE: f64 = 20.0;
/// Largest change of the nodes by a round, relative to the chord.
const MAX_CHANGE: f64 = 0.5;
/// Largest change of the first direction by the next order of the scheme, in tolerances.
const MAX_ERROR: f64 = 2.0;
/// Smallest cross section of the ray tube, relative to straight rays. Closer to caustics, errors of
/// the Jacobian would be large.
const MIN_TUBE: f64 = 0.05;
/// Number of steps for each arc.
const STEPS_PER_ARC: usize = 4;

/// Weights of the forces at four nodes from an end in ∫₀¹ (1 − s) a(s) ds over the first step, exact
/// for cubic forces.
const END_WEIGHTS: [f64; 4] = [97.0 / 360.0, 114.0 / 360.0, -39.0 / 360.0, 8.0 / 360.0];

/// Storage that relaxations reuse.
#[derive(Clone, Debug, Default)]
pub(in crate::connect) struct Relaxation {
    nodes: Vec<DVec3>,
    jets: Vec<Jet>,
    /// Forces ½∇n² at the nodes.
    forces: Vec<DVec3>,
    /// Factors of the matrix: a node moves by `moves` less `couplings` times the next node's move.
    couplings: Vec<DMat3>,
    moves: Vec<DVec3>,
}

/// Boundary-value problem on nodes at equal steps.
struct Problem<'a> {
    field: &'a Field,
    x: DVec3,
    chord: DVec3,
    tolerance: f64,
    steps: usize,
}

/// Finds the ray from `x` over `chord`, to a relative `tolerance`. `None` if the nodes do not
/// resolve the field, or Newton's method does not converge.
pub(super) fn relaxed(
    field: &Field,
    x: DVec3,
    chord: DVec3,
    tolerance: f64,
    found: &mut Collocation,
) -> Option<CollocatedRay> {
    let scale = shortest_scale(field, x, chord)?;
    let spacing = SPACING * scale * (1e4 * tolerance).sqrt().sqrt();
    let steps = (chord.length() / spacing).max(MIN_STEPS as f64);
    if steps.is_nan() || steps > MAX_STEPS as f64 {
        return None;
    }
    let problem = Problem {
        field,
        x,
        chord,
        tolerance,
        steps: (steps as usize).next_multiple_of(STEPS_PER_ARC),
    };
    let span = found.relaxation.solve(&problem, found.evaluations)?;
    found.relaxation.ray(&problem, span, found.arcs)
}

/// Returns the shortest length scale along a chord; `None` if it would take too many places.
fn shortest_scale(field: &Field, x: DVec3, chord: DVec3) -> Option<f64> {
    let length = chord.length();
    let (mut shortest, mut at) = (f64::INFINITY, 0.0);
    for _ in 0..MAX_STEPS {
        let scale = field.step_scale(x + chord * (at / length), chord);
        shortest = shortest.min(scale);
        at += SCALE_SPACING * scale;
        if at >= length {
            return Some(shortest);
        }
    }
    None
}

impl Relaxation {
    /// Moves the nodes from the chord onto the ray. Returns the span of σ.
    fn solve(&mut self, problem: &Problem, evaluations: &mut u64) -> Option<f64> {
        let (n, length) = (problem.steps, problem.chord.length());
        self.nodes.clear();
        let place = |i: usize| problem.x + problem.chord * (i as f64 / n as f64);
        self.nodes.extend((0..=n).map(place));
        let settled = MAX_LAST_CHANGE * problem.tolerance * length / n as f64;
        for _ in 0..MAX_ROUNDS {
            *evaluations += n as u64 + 1;
            self.jets.clear();
            self.jets
                .extend(self.nodes.iter().map(|&x| problem.field.jet(x)));
            self.forces.clear();
            self.forces
                .extend(self.jets.iter().map(|jet| jet.grad * 0.5));
            let span = self.span(problem)?;
            let residual = |this: &Self, i: usize| this.residual(i, (span / n as f64).powi(2));
            self.factor(span / n as f64, |this, i| -residual(this, i));
            let change = self.substitute();
            if change.is_nan() || change > MAX_CHANGE * length {
                return None;
            }
            if change <= settled {
                return Some(span);
            }
        }
        None
    }

    /// Returns the span of σ for the present nodes and forces (docs/theory.md#collocation).
    fn span(&self, problem: &Problem) -> Option<f64> {
        let n = problem.steps;
        let displaced = |i: usize| {
            let u = self.nodes[i] - problem.x - problem.chord * (i as f64 / n as f64);
            self.jets[i].n2 + self.forces[i].dot(u)
        };
        let ends = 0.5 * (displaced(0) + displaced(n));
        let sum = (1..n).map(displaced).sum::<f64>() + ends;
        // Correct the trapezoidal rule by the derivatives at its ends.
        let first = self.forces[0].dot(self.nodes[1] - self.nodes[0]);
        let last = self.forces[n].dot(self.nodes[n] - self.nodes[n - 1]);
        let mean = (sum + (first - last) / 4.0) / n as f64;
        let span = (problem.chord.length_squared() / mean).sqrt();
        span.is_finite().then_some(span)
    }

    /// Returns the residual of Numerov's formula at a node, for the squared step.
    fn residual(&self, i: usize, h2: f64) -> DVec3 {
        let [x, a] = [&self.nodes, &self.forces].map(|v| [v[i - 1], v[i], v[i + 1]]);
        (x[2] - x[1]) - (x[1] - x[0]) - (a[2] + a[1] * 10.0 + a[0]) * (h2 / 12.0)
    }

    /// Factors the matrix for the step `h`, and eliminates from the right side `right`.
    fn factor(&mut self, h: f64, right: impl Fn(&Self, usize) -> DVec3) {
        let k = h * h / 24.0;
        let n = self.jets.len() - 1;
        self.couplings.clear();
        self.moves.clear();
        self.couplings.push(DMat3::ZERO);
        self.moves.push(DVec3::ZERO);
        for i in 1..n {
            let [before, here, after] = [i - 1, i, i + 1].map(|i| self.jets[i].hess);
            let lower = DMat3::IDENTITY - before * k;
            let upper = DMat3::IDENTITY - after * k;
            let diagonal = here * (-10.0 * k) - DMat3::from_diagonal(DVec3::splat(2.0));
            let pivot = (diagonal - lower * self.couplings[i - 1]).inverse();
            let eliminated = right(self, i) - lower * self.moves[i - 1];
            self.couplings.push(pivot * upper);
            self.moves.push(pivot * eliminated);
        }
    }

    /// Moves the nodes, and the forces with them to first order. Returns the largest move.
    fn substitute(&mut self) -> f64 {
        let (mut later, mut most) = (DVec3::ZERO, 0.0);
        for i in (1..self.couplings.len()).rev() {
            later = self.moves[i] - self.couplings[i] * later;
            self.nodes[i] += later;
            self.forces[i] += self.jets[i].hess * later * 0.5;
            most = f64::max(most, later.length_squared());
        }
        most.sqrt()
    }

    /// Returns the velocities at both ends.
    fn velocities(&self, h: f64) -> [DVec3; 2] {
        let (x, a, n) = (&self.nodes, &self.forces, self.nodes.len() - 1);
        let [mut first, mut last] = [x[1] - x[0], x[n] - x[n - 1]].map(|step| step / h);
        for (i, weight) in END_WEIGHTS.into_iter().enumerate() {
            first -= a[i] * (weight * h);
            last += a[n - i] * (weight * h);
        }
        [first, last]
    }

    /// Returns the tangents at the far end of rays from a point with the first velocity `v`. The
    /// factors become the moves of the nodes per move of the far end.
    fn tangents(&mut self, h: f64, v: DVec3) -> Tangents {
        self.factor(h, |_, _| DVec3::ZERO);
        let (n, moved) = (self.jets.len() - 1, &mut self.couplings);
        moved.push(DMat3::IDENTITY);
        for i in (1..n).rev() {
            moved[i] = -(moved[i] * moved[i + 1]);
        }
        // Take the velocities of these moves at both ends.
        // Planted error "tangents by relaxation that are straight at the ends", found by morgana-eikonal/eikonal::collocation::rays_are_as_good_as_the_tolerance_says:
        // let turned = |i: usize, weight: f64| self.jets[i].hess * moved[i] * (0.0 * h * weight);
        let turned = |i: usize, weight: f64| self.jets[i].hess * moved[i] * (0.5 * h * weight);
        let [mut first, mut last] =
            [moved[1] - moved[0], moved[n] - moved[n - 1]].map(|step| step * h.recip());
        for (i, weight) in END_WEIGHTS.into_iter().enumerate() {
            first -= turned(i, weight);
            last += turned(n - i, weight);
        }
        let per_slope = first.inverse();
        let dx = perpendicular_basis(v.normalize()).map(|e| per_slope * (e * v.length()));
        Tangents {
            dx,
            dv: dx.map(|dx| last * dx),
        }
    }

    /// Moves the nodes by the next order of the scheme, whose error is −h⁶x⁽⁶⁾/240 per step. Returns
    /// the change of the first direction.
    fn defer(&mut self, h: f64) -> f64 {
        let n = self.jets.len() - 1;
        let before = self.velocities(h)[0];
        self.factor(h, |this, i| {
            let i = i.clamp(2, n - 2);
            let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| this.forces[i + k - 2]);
            (a + e - (b + d) * 4.0 + c * 6.0) * (-h * h / 240.0)
        });
        self.substitute();
        let after = self.velocities(h)[0];
        (after - before).reject_from(after).length() / after.length()
    }

    /// Returns the ray through the nodes, and stores its arcs; `None` if the nodes do not resolve
    /// the field, or the far end is near a caustic.
    fn ray(&mut self, problem: &Problem, span: f64, arcs: &mut Vec<Arc>) -> Option<CollocatedRay> {
        let n = problem.steps;
        let h = span / n as f64;
        if self.defer(h) > MAX_ERROR * problem.tolerance {
            return None;
        }
        let v = self.velocities(h);
        self.store(arcs, h, v);
        let lengths = arcs.iter().map(|arc| arc.lengths(1.0));
        let [arc_length, optical_length] =
            lengths.fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        let tangents = self.tangents(h, v[0]);
        let jacobian = tangents.cross_section(v[1]).abs();
        let narrow = MIN_TUBE * problem.chord.length_squared();
        let sound = jacobian > narrow && jacobian.is_finite() && arc_length.is_finite();
        sound.then_some(CollocatedRay {
            v,
            arc_length,
            optical_length,
            sigma: span,
            jacobian,
            tangents,
        })
    }

    /// Stores the arcs through the nodes, with the velocities `v` at both ends.
    fn store(&self, arcs: &mut Vec<Arc>, h: f64, v: [DVec3; 2]) {
        let (x, a, n) = (&self.nodes, &self.forces, self.nodes.len() - 1);
        let state = |i: usize| {
            let v = match i {
                0 => v[0],
                i if i == n => v[1],
                i => (x[i + 1] - x[i - 1]) / (2.0 * h) - (a[i + 1] - a[i - 1]) * (h / 12.0),
            };
            [x[i], v, a[i]]
        };
        arcs.clear();
        let mut last = state(0);
        for i in (STEPS_PER_ARC..=n).step_by(STEPS_PER_ARC) {
            let next = state(i);
            arcs.push(Arc::hermite(last, next, h * STEPS_PER_ARC as f64));
            last = next;
        }
    }
}
