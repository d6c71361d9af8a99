//! Solution for a ray and its tangents, with forces that are linear in the displacement at each
//! node.
//!
//! Each vector occupies the first three lanes of a SIMD vector; the fourth lane is zero. Results
//! are bit-identical for all instructions of the processor, if it fuses products and sums. Loops
//! replace closures, which the compiler does not always compile for these instructions.

use super::BoundaryProblem;
use super::rule::{Probes, QuadratureRule, sum};
use crate::field::Jet;
use crate::lanes::Summand;
use crate::ray::{Tangents, perpendicular_basis};
use fearless_simd::{Simd, SimdFloat, SimdFrom, f64x4};
use glam::{DMat3, DVec3};

/// Maximum number of sweeps of an iteration.
const MAX_SWEEPS: usize = 12;
/// Largest ratio of the mean squared changes of consecutive sweeps.
const MAX_CHANGE_RATIO: f64 = 0.25;
/// Predicted next change, in tolerances, below which sweeps end.
const MAX_NEXT_CHANGE: f64 = 0.02;

/// A ray in linear forces around given displacements.
pub(super) struct Solution<S: Simd, const N: usize> {
    simd: S,
    /// Displacements from the chord.
    pub u: [f64x4<S>; N],
    /// Forces ½∇n² at the displacements `u`.
    pub a: [f64x4<S>; N],
    /// n² and forces at the points of their evaluation.
    n2: [f64; N],
    force: [f64x4<S>; N],
    /// Columns of ½Hess(n²) where evaluated, or as corrected by probes.
    half_hess: [[f64x4<S>; 3]; N],
    /// σ₁².
    pub span2: f64,
    /// Mean squared displacement from where the forces are exact.
    pub shift2: f64,
}

impl<S: Simd, const N: usize> Solution<S, N> {
    /// Solves for the ray, with forces evaluated at the displacements `from`; `None` if the
    /// iteration does not converge.
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        rule: &QuadratureRule<N>,
        problem: &BoundaryProblem,
        from: &[f64x4<S>; N],
    ) -> Option<Self> {
        let zero = vector(simd, DVec3::ZERO);
        let mut solution = Solution {
            simd,
            u: *from,
            n2: [0.0; N],
            a: [zero; N],
            force: [zero; N],
            half_hess: [[zero; 3]; N],
            span2: 0.0,
            shift2: 0.0,
        };
        // Evaluate all jets before reading any: reading values just written in other sizes is slow.
        let mut jets = [Jet::constant(0.0); N];
        for (i, jet) in jets.iter_mut().enumerate() {
            *jet = solution.jet(rule, problem, i);
        }
        for (i, jet) in jets.iter().enumerate() {
            solution.n2[i] = jet.n2;
            solution.force[i] = vector(simd, jet.grad * 0.5);
            solution.half_hess[i] = half(simd, jet.hess);
        }
        let settled = (MAX_NEXT_CHANGE * problem.tolerance).powi(2) * problem.d2;
        let mut last = f64::INFINITY;
        for _ in 0..MAX_SWEEPS {
            let change = solution.sweep(rule, problem.d2, from);
            // Predict the change by the next sweep: sweeps converge geometrically.
            let ratio = if last.is_finite() { change / last } else { 1.0 };
            if change * ratio <= settled {
                solution.find_span(rule, problem.d2, from);
                solution.shift2 = mean_square(rule, &solution.u, from);
                return Some(solution);
            }
            if change.is_nan() || change >= MAX_CHANGE_RATIO * last {
                return None;
            }
            last = change;
        }
        None
    }

    /// Returns n² and its derivatives at a node.
    #[inline(always)]
    fn jet(&self, rule: &QuadratureRule<N>, problem: &BoundaryProblem, i: usize) -> Jet {
        let place = problem.x + problem.chord * rule.nodes[i] + point(self.u[i]);
        problem.field.jet(place)
    }

    /// Computes forces and span for the displacements, given the displacements `from` where forces
    /// are exact, then new displacements. Returns the mean squared change.
    #[inline(always)]
    fn sweep(&mut self, rule: &QuadratureRule<N>, d2: f64, from: &[f64x4<S>; N]) -> f64 {
        self.find_forces(from);
        self.find_span(rule, d2, from);
        let next = rule.displacements(&self.a);
        let mut change = vector(self.simd, DVec3::ZERO);
        for (i, next) in next.into_iter().enumerate() {
            let u = next * self.span2;
            let apart = u - self.u[i];
            change = change.plus(rule.weights[i], apart * apart);
            self.u[i] = u;
        }
        total(change)
    }

    /// Updates the forces for the displacements.
    #[inline(always)]
    fn find_forces(&mut self, from: &[f64x4<S>; N]) {
        for (i, from) in from.iter().enumerate() {
            let shift = self.u[i] - *from;
            let [x, y, z] = self.half_hess[i];
            self.a[i] = self.force[i]
                .plus(shift[0], x)
                .plus(shift[1], y)
                .plus(shift[2], z);
        }
    }

    /// Updates the span for displacements and forces.
    #[inline(always)]
    fn find_span(&mut self, rule: &QuadratureRule<N>, d2: f64, from: &[f64x4<S>; N]) {
        let mut integrand = self.u;
        for i in 0..N {
            let shift = self.u[i] - from[i];
            let along = self.a[i] * self.u[i];
            integrand[i] = shift.mul_add(self.force[i] + self.a[i], along);
        }
        let n2 = sum(&rule.weights, &self.n2);
        self.span2 = d2 / (n2 + total(sum(&rule.weights, &integrand)));
    }

    /// Returns n² at the displacements.
    #[inline(always)]
    pub(super) fn displaced_n2(&self, from: &[f64x4<S>; N]) -> [f64; N] {
        let mut n2 = self.n2;
        for i in 0..N {
            let shift = self.u[i] - from[i];
            n2[i] += total((self.force[i] + self.a[i]) * shift);
        }
        n2
    }

    /// Corrects forces, Hessians and span by the field at two nodes of the solution. Forces were
    /// exact at the displacements `from`.
    #[inline(always)]
    pub(super) fn probe(
        &mut self,
        problem: &BoundaryProblem,
        rule: &QuadratureRule<N>,
        probes: &Probes<N>,
        from: &[f64x4<S>; N],
    ) {
        self.find_forces(from);
        let mut forces = [self.a[0]; 2];
        let mut changes = [self.half_hess[0]; 2];
        for (k, i) in probes.nodes.into_iter().enumerate() {
            let jet = self.jet(rule, problem, i);
            forces[k] = vector(self.simd, jet.grad * 0.5) - self.a[i];
            let now = half(self.simd, jet.hess);
            for c in 0..3 {
                changes[k][c] = now[c] - self.half_hess[i][c];
            }
        }
        let [first, second] = changes;
        for i in 0..N {
            let [p, q] = probes.spread[i];
            self.a[i] = self.a[i].plus(p, forces[0]).plus(q, forces[1]);
            for c in 0..3 {
                // Planted error "Hessians that probes leave as they are", found by morgana-eikonal/eikonal::collocation::rays_are_as_good_as_the_tolerance_says:
                // let _ = (first[c] * p, second[c] * q);
                self.half_hess[i][c] = self.half_hess[i][c].plus(p, first[c]).plus(q, second[c]);
            }
        }
        self.find_span(rule, problem.d2, from);
    }

    /// Returns the forces that would act on the chord if they were linear around the displacements
    /// `from`, where they are exact.
    #[inline(always)]
    pub(crate) fn on_chord(&self, from: &[f64x4<S>; N]) -> [f64x4<S>; N] {
        let mut forces = self.force;
        for i in 0..N {
            forces[i] -= turned(&self.half_hess[i], from[i]);
        }
        forces
    }

    /// Returns the tangents at the far end of the rays from a point, given the first velocity, to a
    /// relative `tolerance`. They solve δx″ = σ₁²·½Hess(n²)·δx, with δx′ = σ₁n across the ray at
    /// the start. `None` if the iteration does not converge.
    #[inline(always)]
    pub(super) fn tangents(
        &self,
        rule: &QuadratureRule<N>,
        v: DVec3,
        tolerance: f64,
    ) -> Option<Tangents> {
        let span = self.span2.sqrt();
        let sigma_n = span * v.length();
        let slopes = perpendicular_basis(v.normalize()).map(|e| vector(self.simd, e * sigma_n));
        let mut dx = [[slopes[0]; N], [slopes[1]; N]];
        for dx in &mut dx {
            for (dx, t) in dx.iter_mut().zip(rule.nodes) {
                *dx *= t;
            }
        }
        // Mean square of σ₁n t.
        let most = sigma_n * sigma_n / 3.0;
        let settled = tolerance * tolerance * most;
        // Compare the first change with the tangents themselves; ratios of changes only fall.
        let mut last = most;
        for _ in 0..MAX_SWEEPS {
            // Advance both columns together, because neither depends on the other.
            let [first, second] = &mut dx;
            let ends = [
                self.tangent(rule, slopes[0], first),
                self.tangent(rule, slopes[1], second),
            ];
            let change = f64::max(ends[0].change, ends[1].change);
            if change * (change / last) <= settled {
                return Some(Tangents {
                    dx: [point(ends[0].dx), point(ends[1].dx)],
                    dv: [0, 1].map(|k| point(slopes[k] + ends[k].turn) / span),
                });
            }
            last = change;
        }
        None
    }

    /// Updates the tangent that starts with δx′ = `slope`, with forces for its previous values.
    #[inline(always)]
    fn tangent(
        &self,
        rule: &QuadratureRule<N>,
        slope: f64x4<S>,
        dx: &mut [f64x4<S>; N],
    ) -> FarEnd<S> {
        let mut f = *dx;
        for i in 0..N {
            // Planted error "tangents of a ray without a shot without the Hessian", found by morgana-eikonal/eikonal::collocation::rays_are_as_good_as_the_tolerance_says:
            // f[i] = turned(&self.half_hess[i], dx[i]) * 0.0;
            f[i] = turned(&self.half_hess[i], dx[i]) * self.span2;
        }
        // Correct the initial slope: the displacements are zero at both ends.
        let far = slope - sum(&rule.at_start, &f);
        let next = rule.displacements(&f);
        let mut change = vector(self.simd, DVec3::ZERO);
        for i in 0..N {
            let new = next[i].plus(rule.nodes[i], far);
            let apart = new - dx[i];
            change = change.plus(rule.weights[i], apart * apart);
            dx[i] = new;
        }
        FarEnd {
            dx: far,
            turn: sum(&rule.weights, &f),
            change: total(change),
        }
    }
}

/// Far end of a tangent.
struct FarEnd<S: Simd> {
    dx: f64x4<S>,
    /// Change of δx′ from the start to the far end.
    turn: f64x4<S>,
    /// Mean square of the tangent's last change.
    change: f64,
}

/// Converts to a vector with zero in the fourth lane.
#[inline(always)]
pub(super) fn vector<S: Simd>(simd: S, v: DVec3) -> f64x4<S> {
    f64x4::simd_from(simd, [v.x, v.y, v.z, 0.0])
}

/// Returns the columns of half a matrix.
#[inline(always)]
fn half<S: Simd>(simd: S, matrix: DMat3) -> [f64x4<S>; 3] {
    let half = matrix * 0.5;
    [
        vector(simd, half.x_axis),
        vector(simd, half.y_axis),
        vector(simd, half.z_axis),
    ]
}

/// Returns the first three lanes.
#[inline(always)]
pub(super) fn point<S: Simd>(v: f64x4<S>) -> DVec3 {
    DVec3::new(v[0], v[1], v[2])
}

#[inline(always)]
pub(super) fn dot<S: Simd>(a: f64x4<S>, b: f64x4<S>) -> f64 {
    total(a * b)
}

/// Returns the sum of the first three lanes.
#[inline(always)]
fn total<S: Simd>(v: f64x4<S>) -> f64 {
    v[0] + v[1] + v[2]
}

/// Multiplies a matrix, given by columns, with a vector.
#[inline(always)]
fn turned<S: Simd>(columns: &[f64x4<S>; 3], v: f64x4<S>) -> f64x4<S> {
    (columns[0] * v[0])
        .plus(v[1], columns[1])
        .plus(v[2], columns[2])
}

/// Returns the mean along the ray of the squared distance between corresponding points.
#[inline(always)]
fn mean_square<S: Simd, const N: usize>(
    rule: &QuadratureRule<N>,
    a: &[f64x4<S>; N],
    b: &[f64x4<S>; N],
) -> f64 {
    let mut squares = *a;
    for i in 0..N {
        let apart = a[i] - b[i];
        squares[i] = apart * apart;
    }
    total(sum(&rule.weights, &squares))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Field, Gaussian};
    use fearless_simd::{Level, dispatch};

    #[inline(always)]
    fn probes_are_exact_where_they_are<S: Simd>(simd: S) {
        let field = Field::from(Gaussian::new(1.33, 0.1, DVec3::new(0.1, 0.2, 0.0), 0.4).unwrap());
        let chord = DVec3::new(0.9, 0.05, -0.1);
        let problem = BoundaryProblem {
            field: &field,
            x: DVec3::new(-0.4, 0.1, 0.2),
            chord,
            d2: chord.length_squared(),
            tolerance: 1e-4,
            spanned: 1.0,
            on_chord: [DVec3::ZERO; 3],
        };
        let rule = QuadratureRule::<6>::new();
        let probes = Probes::new(&rule);
        let from = [vector(simd, DVec3::ZERO); 6];
        let mut solution = Solution::new(simd, &rule, &problem, &from).unwrap();
        solution.probe(&problem, &rule, &probes, &from);
        for i in probes.nodes {
            let jet = solution.jet(&rule, &problem, i);
            assert!(point(solution.a[i]).distance(jet.grad * 0.5) < 1e-14);
            let found = solution.half_hess[i].map(point);
            let expected = jet.hess * 0.5;
            let columns = [expected.x_axis, expected.y_axis, expected.z_axis];
            for (found, expected) in found.into_iter().zip(columns) {
                assert!(found.distance(expected) < 1e-14, "{i}: {found} {expected}");
            }
        }
    }

    #[test]
    fn probed_nodes_have_the_fields_forces_and_hessians() {
        dispatch!(Level::baseline(), simd => probes_are_exact_where_they_are(simd));
    }
}
