//! From the forces at a few nodes to the ray, or to the forces at more nodes.

use super::linear::{Solution, dot, point, vector};
use super::rule::{Probes, QuadratureRule, Row, sum};
use super::{BoundaryProblem, COARSE, CollocatedRay, Collocation};
use crate::ray::Arc;
use fearless_simd::{Simd, f64x4};
use glam::DVec3;
use std::ops::ControlFlow;

/// Rounds of Newton's method.
const MOST_ROUNDS: usize = 2;
/// The Jacobian is wrong by at most this times the square of the last coefficients of u″, over the largest u″, in
/// chords, for Gauss's quadrature errs by coefficients twice as far out: several times what was seen over fields of
/// grids, bumps and sound.
const PER_TAIL: f64 = 0.02;
/// The same per displacement since the Hessians were evaluated, in chords, and per square of chords per length scale: as much as was
/// seen (0.06 to 0.15, by field).
const PER_SHIFT: f64 = 0.14;
/// The same per displacement and per change of the Hessians with it, in units of 1/σ₁², as far as the chord tells, which knows of one
/// direction only. At most 0.4 was seen; this is so much more because it is for fields of which n² is quadratic, where nothing
/// changes, and less would spare hardly a round elsewhere.
const PER_CHANGE: f64 = 30.0;
/// Probes are taken to leave this share of the Hessians' change. With 0.02 in its place, the largest errors of the Jacobian begin to grow over
/// the same fields.
const LEFT: f64 = 0.05;
/// Of longer chords, which take more nodes than these, probes leave more than a third.
const MOST_PROBED: usize = 6;

/// A rule for the ray itself: of N nodes, cut into M arcs, after one of K nodes.
pub(super) struct Level<const K: usize, const N: usize, const M: usize> {
    rule: QuadratureRule<N>,
    /// Forces at the nodes by those at the nodes before,
    same: [[f64; K]; N],
    /// and displacements.
    refine: [[f64; K]; N],
    /// Forces at the coarse nodes by those at the nodes.
    coarsen: [[f64; N]; 3],
    probes: Probes<N>,
    /// Where the first arc begins, and where each ends.
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
            coarsen[i] = rule.row(COARSE.nodes[i]).value;
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

    /// u″ at the nodes, given that at those before.
    pub(super) fn same(&self, forces: &[DVec3; K]) -> [DVec3; N] {
        self.same.map(|row| sum(&row, forces))
    }

    /// u″ at the coarse nodes, given that at the nodes.
    pub(super) fn coarsened(&self, forces: &[DVec3; N]) -> [DVec3; 3] {
        self.coarsen.map(|row| sum(&row, forces))
    }

    /// From u″ at the nodes before: the end, with the ray unless the field bends it too much, or u″ at the nodes if more of
    /// them are needed, or the ray is not to be found `here`.
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
        for _ in 0..MOST_ROUNDS {
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
                if N > MOST_PROBED || tolerated2 < LEFT * LEFT {
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

    /// Square of the share that may be left of the Hessians' change between the displacements `from`, where they were evaluated, and those
    /// of the solution: from 1 on they do as they are. By the field's length scale, or by what the forces are on the chord, where the
    /// Hessians' changes have made them differ from linear ones by half of that change times the displacement.
    #[inline(always)]
    fn tolerated2<S: Simd>(
        &self,
        problem: &BoundaryProblem,
        solution: &Solution<S, N>,
        from: &[f64x4<S>; N],
    ) -> f64 {
        let per = PER_SHIFT * problem.spanned * problem.spanned / problem.tolerance;
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
        let per = PER_CHANGE * solution.span2 / problem.tolerance;
        by_scale2.max(1.0 / (per * per * change2 * solution.shift2))
    }

    /// Whether the nodes are enough for the forces.
    #[inline(always)]
    fn resolves<S: Simd>(&self, problem: &BoundaryProblem, solution: &Solution<S, N>) -> bool {
        let [first, second] = &self.rule.tail;
        let tail = [sum(first, &solution.a), sum(second, &solution.a)];
        let tail2 = dot(tail[0], tail[0]).max(dot(tail[1], tail[1]));
        let mut most2: f64 = 0.0;
        for a in solution.a {
            most2 = most2.max(dot(a, a));
        }
        PER_TAIL * tail2 * solution.span2 <= problem.tolerance * (most2 * problem.d2).sqrt()
    }

    /// The ray of a solution, and its arcs; `None` if it leaves the field, or its Jacobian is not to be had.
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

/// Place, velocity and force at t, given the row of it, of a ray with a span of σ.
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
