//! The ray between two points within one field by collocation, without a shot.
//!
//! With t = σ/σ₁ from 0 to 1 the ray is x + (y − x)t + u(t), u″ = σ₁²a, u = 0 at both ends, where a = ½∇n² along it. As
//! |x′| = σ₁n everywhere and ∫|u′|² dt = −∫u·u″ dt, σ₁² = |y − x|²/∫(n² + a·u) dt. Forces at a few nodes on the chord give a
//! first guess. There, at more nodes, the Hessians of n² give forces that are linear in the displacement, with which
//! the equation is solved by iteration, without evaluations: Newton's method. The same Hessians move the tangents, of
//! which only the end is needed. Where the ray lies too far from the guess for that, two of its nodes say how the Hessians have
//! changed, or there is a second round.
//!
//! Theory: docs/theory.md#collocation.

mod level;
mod linear;
mod rule;

pub(super) use rule::{QuadratureRule, sum};

use crate::field::Field;
use crate::lanes;
use crate::ray::{Arc, Tangents};
use fearless_simd::{Level as Lanes, dispatch};
use glam::DVec3;
use level::Level;
use std::ops::ControlFlow;

/// On the chord: no place is further from a node than a fifth of it.
const COARSE: QuadratureRule<3> = QuadratureRule::new();
static SHORTEST: Level<3, 4, 1> = Level::new();
static SHORT: Level<3, 6, 2> = Level::new();
static MIDDLE: Level<6, 8, 3> = Level::new();
static LONG: Level<8, 12, 4> = Level::new();

/// Chords of up to so many length scales, at the tolerance 1e-4, for each level: beyond that a feature might be missed.
const SPANNED: [f64; 4] = [1.5, 3.5, 4.5, 7.0];

/// A ray that was found.
pub(super) struct CollocatedRay {
    /// Velocities dx/dσ at the ends.
    pub v: [DVec3; 2],
    pub arc_length: f64,
    pub optical_length: f64,
    pub sigma: f64,
    /// J at the far end.
    pub jacobian: f64,
    /// Tangents there, of unit changes of the first direction.
    pub tangents: Tangents,
}

/// What is kept of a search.
pub(super) struct Collocation<'a> {
    /// The ray, piece by piece, if there is one.
    pub arcs: &'a mut Vec<Arc>,
    /// Grows with every evaluation of the field.
    pub evaluations: &'a mut u64,
}

/// What is asked for.
struct BoundaryProblem<'a> {
    field: &'a Field,
    x: DVec3,
    chord: DVec3,
    /// Square of the chord's length.
    d2: f64,
    tolerance: f64,
    /// The chord in length scales.
    spanned: f64,
    /// Forces at the coarse nodes on the chord.
    on_chord: [DVec3; 3],
}

/// The ray from `x` over `chord`, to a relative `tolerance`. `None` if it bends too much or the field changes too fast.
pub(super) fn collocated(
    field: &Field,
    x: DVec3,
    chord: DVec3,
    tolerance: f64,
    found: &mut Collocation,
) -> Option<CollocatedRay> {
    collocated_by(lanes::level(), field, x, chord, tolerance, found)
}

/// The same, with given vector instructions.
fn collocated_by(
    lanes: Lanes,
    field: &Field,
    x: DVec3,
    chord: DVec3,
    tolerance: f64,
    found: &mut Collocation,
) -> Option<CollocatedRay> {
    let at = COARSE.nodes.map(|t| x + chord * t);
    let scales = at.map(|x| field.length_scale(x));
    let mut problem = BoundaryProblem {
        field,
        x,
        chord,
        d2: chord.length_squared(),
        tolerance,
        spanned: chord.length() / scales.into_iter().fold(f64::INFINITY, f64::min),
        on_chord: [DVec3::ZERO; 3],
    };
    // Errors fall with the sixth (of arcs) to sixteenth power of what is spanned.
    let most = (1e4 * tolerance).sqrt().sqrt().sqrt();
    let level = |spanned: f64| SPANNED.iter().position(|s| spanned <= s * most);
    let first = level(problem.spanned).or_else(|| {
        let along = at.map(|x| field.step_scale(x, chord));
        level(chord.length() / along.into_iter().fold(f64::INFINITY, f64::min))
    })?;
    *found.evaluations += at.len() as u64;
    let gradients = at.map(|x| field.gradient(x));
    problem.on_chord = gradients.map(|(_, grad)| grad * 0.5);
    let coarse = problem.first_order(gradients.map(|(n2, _)| n2));
    solved(lanes, &problem, first, coarse, found)
        .break_value()
        .flatten()
}

/// Breaks with the end of the search, level by level from the `first`, given u″ at the coarse nodes.
fn solved(
    lanes: Lanes,
    problem: &BoundaryProblem,
    first: usize,
    mut coarse: [DVec3; 3],
    found: &mut Collocation,
) -> ControlFlow<Option<CollocatedRay>> {
    if first == 0 {
        let forces = dispatch!(lanes, simd => SHORTEST.solve(simd, problem, &coarse, true, found))?;
        coarse = SHORTEST.coarsened(&forces);
    }
    // One level only betters the first guess for the next, which saves that a second round.
    let (forces, here) = if first < 3 {
        let here = first < 2;
        let forces = dispatch!(lanes, simd => SHORT.solve(simd, problem, &coarse, here, found))?;
        (forces, true)
    } else {
        (SHORT.same(&coarse), false)
    };
    let forces = dispatch!(lanes, simd => MIDDLE.solve(simd, problem, &forces, here, found))?;
    dispatch!(lanes, simd => LONG.solve(simd, problem, &forces, true, found))?;
    ControlFlow::Break(None)
}

impl BoundaryProblem<'_> {
    /// u″ at the coarse nodes, given n² there on the chord.
    fn first_order(&self, mut n2: [f64; 3]) -> [DVec3; 3] {
        let a = self.on_chord;
        let straight = self.d2 / sum(&COARSE.weights, &n2);
        for (i, n2) in n2.iter_mut().enumerate() {
            // 2a·u from n² at the displaced point, and a·u.
            let u = sum(&COARSE.rows[i].displacement, &a) * straight;
            *n2 += 3.0 * a[i].dot(u);
        }
        let span2 = self.d2 / sum(&COARSE.weights, &n2);
        a.map(|a| a * span2)
    }
}

#[cfg(all(test, any(target_arch = "x86", target_arch = "x86_64")))]
mod tests {
    use super::*;
    use crate::field::Gaussian;

    /// What is known of rays over chords that take 4, 6, 8 and 12 nodes.
    fn values(lanes: Lanes) -> Vec<f64> {
        let field = Field::from(Gaussian::new(1.33, 0.1, DVec3::ZERO, 0.4).unwrap());
        let ray = |length: f64| {
            let x = DVec3::new(-0.5 * length, 0.1, 0.2);
            let chord = DVec3::new(length, 0.05, -0.1);
            let (mut arcs, mut evaluations) = (Vec::new(), 0);
            let mut found = Collocation {
                arcs: &mut arcs,
                evaluations: &mut evaluations,
            };
            let ray = collocated_by(lanes, &field, x, chord, 1e-4, &mut found).unwrap();
            let [a, b] = ray.v;
            let ends = arcs.iter().flat_map(|arc| arc.end().to_array());
            let lengths = [ray.arc_length, ray.optical_length, ray.sigma, ray.jacobian];
            let all = a.to_array().into_iter().chain(b.to_array());
            all.chain(lengths).chain(ends).collect()
        };
        [0.1, 0.3, 0.8, 1.4]
            .into_iter()
            .flat_map::<Vec<f64>, _>(ray)
            .collect()
    }

    #[test]
    fn instructions_make_no_difference() {
        lanes::assert_agree(1e-13, values);
    }
}
