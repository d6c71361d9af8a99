//! A level of collocation: from the forces at a few nodes to the ray, or to the forces at more
//! nodes.

use super::linear::{Solution, dot, point, vector};
use super::rule::{Probes, QuadratureRule, Row, sum};
use super::{BoundaryProblem, CHORD_RULE, CollocatedRay, Collocation};
use crate::ray::Arc;
use fearless_simd::{Simd, f64x4};
use glam::DVec3;
use std::ops::ControlFlow;

/// Maximum number of rounds of Newton's method.
const MAX_ROUNDS: usize = 2;
/// Relative error of the Jacobian in units of c²/(a d). c are the last coefficients of u″, a is the
/// largest |u″|, and d is the length of the chord. It is quadratic because Gauss's quadrature errs
/// by coefficients twice as far out. The value is several times the largest error seen over fields
/// of grids, bumps and sound.
const ERROR_PER_TAIL: f64 = 0.02;
/// Relative error of the Jacobian per displacement since the Hessians were evaluated, in chords,
/// and per squared length of the chord in length scales. The value is as large as the errors seen
/// (0.06 to 0.15, by field).
const ERROR_PER_SHIFT: f64 = 0.14;
/// Relative error of the Jacobian per displacement and per change of the Hessians with
/// displacement, in units of 1/σ₁². The change is estimated from the chord, hence in one direction
/// only. Errors of at most 0.4 were seen. The value is much larger because it serves fields with
/// quadratic n², where Hessians do not change; a smaller value would hardly save a round elsewhere.
const ERROR_PER_CHANGE: f64 = 30.0;
/// Fraction of the Hessians' change that is assumed to remain after probes. With 0.02 instead, the
/// largest errors of the Jacobian begin to grow over fields of grids, bumps and sound.
const REMAINING_CHANGE: f64 = 0.05;
/// Largest number of nodes with which probes are used. On longer chords, which take more nodes,
/// probes leave more than a third of the change.
const MAX_PROBED_NODES: usize = 6;

/// Collocation rule for the ray itself: N nodes and M arcs, after a rule of K nodes.
pub(super) struct Level<const K: usize, const N: usize, const M: usize> {
    rule: QuadratureRule<N>,
    /// Weights of forces at the nodes of the previous rule in forces at the nodes.
    same: [[f64; K]; N],
    /// Weights of forces at the nodes of the previous rule in displacements at the nodes.
    refine: [[f64; K]; N],
    /// Weights of forces at the nodes in forces at the coarse nodes.
    coarsen: [[f64; N]; 3],
    probes: Probes<N>,
    /// Weights at the start of the first arc, and at the end of each arc.
    start: Row<N>,
    cuts: [Row<N>; M],
}

impl<const K: usize, const N: usize, const M: usize> Level<K, N, M> {
    /// Computes the tables.
    pub(super) const fn new() -> Self {
        let (before, rule) = (QuadratureRule::<K>::new(), QuadratureRule::new());
        let probes = Probes::new(&rule);
        let mut same = [[0.0; K]; N];
        let mut refine = same;
        let mut i = 0;
        while i < N {
            let row = before.row(rule.nodes[i]);
            (same[i], refine[i]) = (row.value, row.displacement);
            i += 1;
        }
        let mut coarsen = [[0.0; N]; 3];
        let mut i = 0;
        while i < 3 {
            coarsen[i] = rule.row(CHORD_RULE.nodes[i]).value;
            i += 1;
        }
        let start = rule.row(0.0);
        let mut cuts = [start; M];
        let mut i = 0;
        while i < M {
            cuts[i] = rule.row((i + 1) as f64 / M as f64);
            i += 1;
        }
        Level {
            rule,
            same,
            refine,
            coarsen,
            probes,
            start,
            cuts,
        }
    }

    /// Interpolates u″ at the nodes from u″ at the nodes of the previous rule.
    pub(super) fn same(&self, forces: &[DVec3; K]) -> [DVec3; N] {
        self.same.map(|row| sum(&row, forces))
    }

    /// Interpolates u″ at the coarse nodes from u″ at the nodes.
    pub(super) fn coarsened(&self, forces: &[DVec3; N]) -> [DVec3; 3] {
        self.coarsen.map(|row| sum(&row, forces))
    }

    /// Solves for the ray, given u″ at the nodes of the previous rule. Breaks with the ray, or with
    /// `None` if the field bends it too much. Continues with u″ at the nodes if more nodes are
    /// needed, or if `here` is false: then this level only refines the forces.
    #[inline(always)]
    pub(super) fn solve<S: Simd>(
        &self,
        simd: S,
        problem: &BoundaryProblem,
        forces: &[DVec3; K],
        here: bool,
        found: &mut Collocation,
    ) -> ControlFlow<Option<CollocatedRay>, [DVec3; N]> {
        let zero = vector(simd, DVec3::ZERO);
        let (mut before, mut u) = ([zero; K], [zero; N]);
        for i in 0..K {
            before[i] = vector(simd, forces[i]);
        }
        for (u, row) in u.iter_mut().zip(&self.refine) {
            *u = sum(row, &before);
        }
        for _ in 0..MAX_ROUNDS {
            *found.evaluations += N as u64;
            let Some(mut solution) = Solution::new(simd, &self.rule, problem, &u) else {
                return ControlFlow::Break(None);
            };
            if !(here && self.resolves(problem, &solution)) {
                return ControlFlow::Continue(solution.a.map(|a| point(a * solution.span2)));
            }
            let tolerated2 = self.tolerated2(problem, &solution, &u);
            // Planted error "a ray without a shot after one round, whatever the Hessians", found by morgana-eikonal/eikonal::collocation::rays_are_as_good_as_the_tolerance_says:
            // if tolerated2 < 0.0 {
            if tolerated2 < 1.0 {
                if N > MAX_PROBED_NODES || tolerated2 < REMAINING_CHANGE * REMAINING_CHANGE {
                    u = solution.u;
                    continue;
                }
                *found.evaluations += self.probes.nodes.len() as u64;
                solution.probe(problem, &self.rule, &self.probes, &u);
            }
            return ControlFlow::Break(self.ray(problem, &solution, &u, found.arcs));
        }
        ControlFlow::Break(None)
    }

    /// Returns the squared fraction of the Hessians' change that may remain uncorrected. The change
    /// is the change between the points `from`, where the Hessians were evaluated, and the
    /// solution. If the result is at least 1, no correction is necessary. The field's length scale
    /// bounds the change, or the forces on the chord give an estimate. On the chord, the exact
    /// forces differ from the linear forces by half the Hessians' change times the displacement.
    #[inline(always)]
    fn tolerated2<S: Simd>(
        &self,
        problem: &BoundaryProblem,
        solution: &Solution<S, N>,
        from: &[f64x4<S>; N],
    ) -> f64 {
        let per = ERROR_PER_SHIFT * problem.spanned * problem.spanned / problem.tolerance;
        let by_scale2 = problem.d2 / (per * per * solution.shift2);
        if by_scale2 >= 1.0 {
            return by_scale2;
        }
        let linear = solution.on_chord(from);
        let mut most = 0.0;
        for (row, exact) in self.coarsen.iter().zip(&problem.on_chord) {
            let apart = point(sum(row, &linear)) - *exact;
            most = f64::max(most, apart.length_squared());
        }
        let mut displaced2: f64 = 0.0;
        for u in from {
            displaced2 = displaced2.max(dot(*u, *u));
        }
        let change2 = 4.0 * most / (displaced2 * displaced2);
        let per = ERROR_PER_CHANGE * solution.span2 / problem.tolerance;
        by_scale2.max(1.0 / (per * per * change2 * solution.shift2))
    }

    /// Returns true if the nodes resolve the forces.
    #[inline(always)]
    fn resolves<S: Simd>(&self, problem: &BoundaryProblem, solution: &Solution<S, N>) -> bool {
        let [first, second] = &self.rule.tail;
        let tail = [sum(first, &solution.a), sum(second, &solution.a)];
        let tail2 = dot(tail[0], tail[0]).max(dot(tail[1], tail[1]));
        let mut most2: f64 = 0.0;
        for a in solution.a {
            most2 = most2.max(dot(a, a));
        }
        ERROR_PER_TAIL * tail2 * solution.span2 <= problem.tolerance * (most2 * problem.d2).sqrt()
    }

    /// Returns the ray of a solution, and stores its arcs; `None` if it leaves the field, or its
    /// Jacobian cannot be computed.
    #[inline(always)]
    fn ray<S: Simd>(
        &self,
        problem: &BoundaryProblem,
        solution: &Solution<S, N>,
        from: &[f64x4<S>; N],
        arcs: &mut Vec<Arc>,
    ) -> Option<CollocatedRay> {
        let (rule, span) = (&self.rule, solution.span2.sqrt());
        let first = node(problem, solution, span, 0.0, &self.start);
        let mut last = first;
        arcs.clear();
        for (i, row) in self.cuts.iter().enumerate() {
            let next = node(problem, solution, span, (i + 1) as f64 / M as f64, row);
            arcs.push(Arc::hermite(last, next, span / M as f64));
            last = next;
        }
        let v = [first[1], last[1]];
        let tangents = solution.tangents(rule, v[0], problem.tolerance)?;
        let jacobian = tangents.cross_section(v[1]).abs();
        let n2 = solution.displaced_n2(from);
        let arc_length = sum(&rule.weights, &n2.map(f64::sqrt)) * span;
        let sound = jacobian.is_finite() && arc_length.is_finite();
        sound.then_some(CollocatedRay {
            v,
            arc_length,
            optical_length: sum(&rule.weights, &n2) * span,
            sigma: span,
            jacobian,
            tangents,
        })
    }
}

/// Returns position, velocity and force at `t`, given the weights `row` there, of a ray with a
/// `span` of σ.
#[inline(always)]
fn node<S: Simd, const N: usize>(
    problem: &BoundaryProblem,
    solution: &Solution<S, N>,
    span: f64,
    t: f64,
    row: &Row<N>,
) -> [DVec3; 3] {
    let a = &solution.a;
    let x = problem.x + problem.chord * t + point(sum(&row.displacement, a)) * solution.span2;
    let v = problem.chord / span + point(sum(&row.slope, a)) * span;
    [x, v, point(sum(&row.value, a))]
}
