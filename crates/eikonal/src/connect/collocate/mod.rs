//! Collocation: the ray between two points within one field, without tracing rays.
//!
//! With t = σ/σ₁ from 0 to 1 the ray is x + (y − x)t + u(t), u″ = σ₁²a, u = 0 at both ends, where a
//! = ½∇n² along the ray. As |x′| = σ₁n everywhere and ∫|u′|² dt = −∫u·u″ dt, σ₁² = |y − x|²/∫(n² +
//! a·u) dt. Forces at a few nodes on the chord give a first guess. At the displaced nodes of a
//! finer rule, Hessians of n² give forces that are linear in the displacement. With these forces,
//! iteration solves the equation without further evaluations: this is Newton's method. The Hessians
//! also propagate the tangents, which are needed only at the end. If the ray lies too far from the
//! guess, two of its nodes measure the change of the Hessians, or there is a second round.
//!
//! Theory: docs/theory.md#collocation.

mod level;
mod linear;
mod relax;
mod rule;

pub(super) use relax::Relaxation;
pub(super) use rule::{QuadratureRule, sum};

use crate::field::Field;
use crate::lanes;
use crate::ray::{Arc, Tangents};
use fearless_simd::{Level as Lanes, dispatch};
use glam::DVec3;
use level::Level;
use std::ops::ControlFlow;

/// Rule for the chord. Every point of the chord is within a fifth of the chord from a node.
const CHORD_RULE: QuadratureRule<3> = QuadratureRule::new();
static SHORTEST: Level<3, 4, 1> = Level::new();
static SHORT: Level<3, 6, 2> = Level::new();
static MIDDLE: Level<6, 8, 3> = Level::new();
static LONG: Level<8, 12, 4> = Level::new();

/// Longest chord for each level, in length scales, at the tolerance 1e-4. On a longer chord, the
/// nodes might miss a feature of the field.
const MAX_CHORDS: [f64; 4] = [1.5, 3.5, 4.5, 7.0];

/// A ray found by collocation.
pub(super) struct CollocatedRay {
    /// Velocities dx/dσ at the ends.
    pub v: [DVec3; 2],
    pub arc_length: f64,
    pub optical_length: f64,
    pub sigma: f64,
    /// Cross section J at the far end.
    pub jacobian: f64,
    /// Tangents at the far end, of unit changes of the first direction.
    pub tangents: Tangents,
}

/// Output of a search.
pub(super) struct Collocation<'a> {
    /// Pieces of the ray that was found; empty if there is none.
    pub arcs: &'a mut Vec<Arc>,
    /// Counter of field evaluations.
    pub evaluations: &'a mut u64,
    /// Storage.
    pub relaxation: &'a mut Relaxation,
}

/// Boundary-value problem to solve.
struct BoundaryProblem<'a> {
    field: &'a Field,
    x: DVec3,
    chord: DVec3,
    /// Squared length of the chord.
    d2: f64,
    tolerance: f64,
    /// Length of the chord in length scales.
    spanned: f64,
    /// Forces at the coarse nodes on the chord.
    on_chord: [DVec3; 3],
}

/// Finds the ray from `x` over `chord`, to a relative `tolerance`. `None` if the field bends it too
/// much or changes too fast.
pub(super) fn collocated(
    field: &Field,
    x: DVec3,
    chord: DVec3,
    tolerance: f64,
    found: &mut Collocation,
) -> Option<CollocatedRay> {
    collocated_by(lanes::level(), field, x, chord, tolerance, found)
}

/// Implements [`collocated`] with the given vector instructions.
fn collocated_by(
    lanes: Lanes,
    field: &Field,
    x: DVec3,
    chord: DVec3,
    tolerance: f64,
    found: &mut Collocation,
) -> Option<CollocatedRay> {
    // Measure the chord in length scales.
    let at = CHORD_RULE.nodes.map(|t| x + chord * t);
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
    // Scale the limits by the tolerance: errors are of the sixth (arcs) to sixteenth order in the
    // chord's length.
    let most = (1e4 * tolerance).sqrt().sqrt().sqrt();
    let level = |spanned: f64| MAX_CHORDS.iter().position(|s| spanned <= s * most);
    let first = level(problem.spanned).or_else(|| {
        let along = at.map(|x| field.step_scale(x, chord));
        level(chord.length() / along.into_iter().fold(f64::INFINITY, f64::min))
    });
    let Some(first) = first else {
        let is_long = problem.spanned > MAX_CHORDS[3];
        let relaxed = || relax::relaxed(field, x, chord, tolerance, found);
        return is_long.then(relaxed).flatten();
    };
    // Evaluate the forces on the chord, and search from the first guess.
    *found.evaluations += at.len() as u64;
    let gradients = at.map(|x| field.gradient(x));
    problem.on_chord = gradients.map(|(_, grad)| grad * 0.5);
    let coarse = problem.first_order(gradients.map(|(n2, _)| n2));
    solved(lanes, &problem, first, coarse, found)
        .break_value()
        .flatten()
}

/// Searches level by level from the `first`, given u″ at the coarse nodes, and breaks with the
/// result.
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
    // Only refine the first guess at one level: this saves the next level a second round.
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
    /// Returns u″ at the coarse nodes, given n² at these nodes on the chord.
    fn first_order(&self, mut n2: [f64; 3]) -> [DVec3; 3] {
        let a = self.on_chord;
        let straight = self.d2 / sum(&CHORD_RULE.weights, &n2);
        for (i, n2) in n2.iter_mut().enumerate() {
            // Add 2a·u, for n² at the displaced point, and a·u.
            let u = sum(&CHORD_RULE.rows[i].displacement, &a) * straight;
            *n2 += 3.0 * a[i].dot(u);
        }
        let span2 = self.d2 / sum(&CHORD_RULE.weights, &n2);
        a.map(|a| a * span2)
    }
}

#[cfg(all(test, any(target_arch = "x86", target_arch = "x86_64")))]
mod tests {
    use super::*;
    use crate::field::Gaussian;

    /// Returns the values of rays over chords that take 4, 6, 8 and 12 nodes.
    fn values(lanes: Lanes) -> Vec<f64> {
        let field = Field::from(Gaussian::new(1.33, 0.1, DVec3::ZERO, 0.4).unwrap());
        let ray = |length: f64| {
            let x = DVec3::new(-0.5 * length, 0.1, 0.2);
            let chord = DVec3::new(length, 0.05, -0.1);
            let (mut arcs, mut evaluations) = (Vec::new(), 0);
            let mut relaxation = Relaxation::default();
            let mut found = Collocation {
                arcs: &mut arcs,
                evaluations: &mut evaluations,
                relaxation: &mut relaxation,
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
