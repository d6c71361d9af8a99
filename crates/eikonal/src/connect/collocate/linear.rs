//! A ray, and its neighbours, in forces that are linear in the displacement at each node.

use super::Problem;
use super::rule::{Rule, sum};
use crate::field::Jet;
use crate::ray::perpendicular_basis;
use glam::{DMat3, DVec3};

/// Sweeps of an iteration that is worth it.
const MOST_SWEEPS: usize = 12;
/// Square of the share by which a sweep's change must be smaller than the one before.
const SMALLER: f64 = 0.25;
/// Sweeps end when the next change is below this many tolerances.
const SETTLED: f64 = 0.03;

/// The ray in linear forces around given displacements.
pub(super) struct Solution<const N: usize> {
    /// Displacements from the chord.
    pub u: [DVec3; N],
    /// n² there.
    pub n2: [f64; N],
    /// Forces ½∇n² there.
    pub a: [DVec3; N],
    half_hess: [DMat3; N],
    /// σ₁².
    pub span2: f64,
    /// Square of the largest displacement from where the forces are exact.
    pub shift2: f64,
}

impl<const N: usize> Solution<N> {
    /// The solution for forces at the displacements `from`; `None` if it does not settle.
    pub fn new(rule: &Rule<N>, problem: &Problem, from: &[DVec3; N]) -> Option<Self> {
        let (x, chord) = (problem.x, problem.chord);
        let at: [Jet; N] =
            std::array::from_fn(|i| problem.field.jet(x + chord * rule.nodes[i] + from[i]));
        let mut solution = Solution {
            u: *from,
            n2: [0.0; N],
            a: [DVec3::ZERO; N],
            half_hess: at.map(|jet| jet.hess * 0.5),
            span2: 0.0,
            shift2: 0.0,
        };
        let settled = (SETTLED * problem.tolerance).powi(2) * problem.d2;
        let mut last = f64::INFINITY;
        for _ in 0..MOST_SWEEPS {
            let change = solution.sweep(rule, problem.d2, (&at, from));
            // Sweeps converge geometrically: by so much the next one would change.
            let ratio = if last.is_finite() { change / last } else { 1.0 };
            if change * ratio <= settled {
                solution.shift2 = largest(&solution.u, from);
                return Some(solution);
            }
            if change.is_nan() || change >= SMALLER * last {
                return None;
            }
            last = change;
        }
        None
    }

    /// Forces and span for the displacements, and displacements for these; returns the square of their change.
    fn sweep(&mut self, rule: &Rule<N>, d2: f64, (at, from): (&[Jet; N], &[DVec3; N])) -> f64 {
        let mut integrand = [0.0; N];
        for i in 0..N {
            let (shift, force) = (self.u[i] - from[i], at[i].grad * 0.5);
            let turn = self.half_hess[i] * shift;
            self.a[i] = force + turn;
            self.n2[i] = at[i].n2 + (2.0 * force + turn).dot(shift);
            integrand[i] = self.n2[i] + self.a[i].dot(self.u[i]);
        }
        self.span2 = d2 / sum(&rule.weights, &integrand);
        let next = std::array::from_fn(|i| sum(&rule.rows[i].displacement, &self.a) * self.span2);
        let change = largest(&next, &self.u);
        self.u = next;
        change
    }

    /// J at the far end, given the velocities at both ends, to a relative `tolerance`: δx″ = σ₁²·½Hess(n²)·δx, started by δx′ =
    /// σ₁n across the ray. `None` if that does not settle.
    pub fn jacobian(&self, rule: &Rule<N>, v: [DVec3; 2], tolerance: f64) -> Option<f64> {
        let sigma_n = self.span2.sqrt() * v[0].length();
        let basis = perpendicular_basis(v[0].normalize());
        let [a, b] = basis.map(|across| self.tangent(rule, across * sigma_n, tolerance));
        Some(a?.cross(b?).dot(v[1].normalize()).abs())
    }

    /// Where the tangent ends that starts with δx′ = `slope`.
    fn tangent(&self, rule: &Rule<N>, slope: DVec3, tolerance: f64) -> Option<DVec3> {
        let mut dx = rule.nodes.map(|t| slope * t);
        let most = slope.length_squared();
        let settled = tolerance * tolerance * most;
        // The first change is relative to the tangent itself, and ratios only fall.
        let mut last = most;
        for _ in 0..MOST_SWEEPS {
            let f: [DVec3; N] = std::array::from_fn(|i| self.half_hess[i] * dx[i] * self.span2);
            // What is zero at both ends starts with another slope than δx.
            let far = slope - sum(&rule.at_start, &f);
            let next =
                std::array::from_fn(|i| far * rule.nodes[i] + sum(&rule.rows[i].displacement, &f));
            let change = largest(&next, &dx);
            dx = next;
            if change * (change / last) <= settled {
                return Some(far);
            }
            last = change;
        }
        None
    }
}

/// Square of the largest distance between points of the same number; NaN if one is.
fn largest<const N: usize>(a: &[DVec3; N], b: &[DVec3; N]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    squares.fold(0.0, |most, s| if s > most || s.is_nan() { s } else { most })
}
