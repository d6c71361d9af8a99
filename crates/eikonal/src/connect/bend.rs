//! Initial guesses for Newton's method: the chord between two points, bent by the field.
//!
//! Let z be the distance along the chord, from 0 to d. A ray is displaced from the chord by u(z),
//! with u″ = (1 + u′²)(g⊥ − u′g∥), g = ∇ ln n, and u = 0 at both ends. Iteration from u = 0 solves
//! the equation by collocation at the nodes of Gauss–Legendre quadrature. Rough guesses use few
//! nodes. The first round is first-order perturbation theory. Only gradients are needed, and the
//! evaluations in a round are independent of one another. Where only a part of the chord bends
//! rays, the nodes lie in this part, and the ray is straight outside. A ray from a plane starts
//! with u′ = 0 instead.
//!
//! Theory: docs/theory.md#the-bent-chord.

use super::collocate::{QuadratureRule, sum};
use crate::field::Field;
use glam::DVec3;

/// Maximum number of rounds. Each round reduces the error by a factor of about ten where the field
/// bends rays mildly.
const MAX_ROUNDS: usize = 3;
/// Largest change of the direction in the last round, in radians. Newton's method converges from
/// smaller errors.
const MAX_LAST_CHANGE: f64 = 0.03;

/// Smallest accuracy, in radians, for which four nodes are enough.
const FOUR_NODE_ACCURACY: f64 = 1e-4;

const COARSE_RULE: QuadratureRule<4> = QuadratureRule::new();
const FINE_RULE: QuadratureRule<5> = QuadratureRule::new();

/// Straight line, with the part in which the field bends rays.
pub(super) struct BentChord {
    /// Start of the line.
    pub x: DVec3,
    /// Vector from start to end.
    pub chord: DVec3,
    /// Begin and end of the bending part, in units of the chord.
    pub part: [f64; 2],
    /// Optical path lengths of the line before and after the bending part.
    pub optical: [f64; 2],
}

/// Approximate ray.
pub(super) struct Guess {
    /// Unit direction at the start.
    pub direction: DVec3,
    /// Displacement of the start; zero for rays from a point.
    pub offset: DVec3,
    /// Optical path length.
    pub optical_length: f64,
    /// Number of field evaluations used.
    pub evaluations: u64,
}

/// Approximates the ray along a line through a field.
///
/// The ray starts at the first point of the line. If `is_plane`, it starts in the direction of the
/// line from the plane across it. The iteration ends when a further round would hardly change the
/// direction by more than `accuracy`, or after the last round. `accuracy` is in radians; for planes
/// it applies to the direction of arrival. `None` if the iteration does not converge, or the ray
/// turns away from the chord by more than 45°.
pub(super) fn bent(
    field: &Field,
    line: &BentChord,
    is_plane: bool,
    accuracy: f64,
) -> Option<Guess> {
    if accuracy < FOUR_NODE_ACCURACY {
        FINE_RULE.solve(field, line, is_plane, accuracy)
    } else {
        COARSE_RULE.solve(field, line, is_plane, accuracy)
    }
}

/// Linear correction to a solution that is zero at both ends of the bending part. Outside this part
/// the ray is straight. With the correction, it begins and ends at the ends of the line.
struct Ends {
    /// Correction at the beginning of the part.
    offset: DVec3,
    slope: DVec3,
    /// Slopes of the ray before and after the part.
    outside: [DVec3; 2],
}

impl Ends {
    /// Computes the correction from the slopes `first` and `last` of the solution at both ends of
    /// the part.
    fn new(line: &BentChord, is_plane: bool, [first, last]: [DVec3; 2]) -> Self {
        let ([a, b], d) = (line.part, line.chord.length());
        let slope = if is_plane {
            -first
        } else {
            -(first * a + last * (1.0 - b))
        };
        let outside = [first + slope, last + slope];
        let at_end = outside[1] * (-d * (1.0 - b));
        Ends {
            offset: at_end - slope * (d * (b - a)),
            slope,
            outside,
        }
    }
}

impl<const N: usize> QuadratureRule<N> {
    /// Implements [`bent`] with `N` nodes.
    fn solve(
        &self,
        field: &Field,
        line: &BentChord,
        is_plane: bool,
        accuracy: f64,
    ) -> Option<Guess> {
        let BentChord { x, chord, part, .. } = *line;
        let e = chord.normalize();
        let (begin, along) = (x + chord * part[0], chord * (part[1] - part[0]));
        let d = along.length();
        let (mut u, mut slope) = ([DVec3::ZERO; N], [DVec3::ZERO; N]);
        let (mut turn, mut change) = (DVec3::ZERO, f64::INFINITY);
        let mut evaluations = 0;
        for round in 1..=MAX_ROUNDS {
            // Evaluate the forces at the displaced nodes.
            let mut f = [DVec3::ZERO; N];
            let mut optical_length = 0.0;
            for i in 0..N {
                let (n2, grad) = field.gradient(begin + along * self.nodes[i] + u[i]);
                let g = grad / (2.0 * n2);
                let ahead = g.dot(e);
                let stretch = 1.0 + slope[i].length_squared();
                f[i] = (g - e * ahead - slope[i] * ahead) * (stretch * d);
                optical_length += self.weights[i] * d * (n2 * stretch).sqrt();
            }
            evaluations += N as u64;
            // Satisfy the end conditions, and measure the change of the direction.
            let first = sum(&self.at_start, &f);
            let ends = Ends::new(line, is_plane, [first, first + sum(&self.weights, &f)]);
            let next = ends.outside[usize::from(is_plane)];
            let last = change;
            (change, turn) = (next.distance(turn), next);
            if !(change < last && turn.length_squared() < 1.0) {
                return None;
            }
            // Predict the change of direction in the next round: rounds converge geometrically.
            let ratio = if last.is_finite() { change / last } else { 1.0 };
            if change * ratio < accuracy || round == MAX_ROUNDS {
                let stretch = |slope: DVec3| (1.0 + slope.length_squared()).sqrt();
                let [before, after] = [0, 1].map(|i| line.optical[i] * stretch(ends.outside[i]));
                return (change < MAX_LAST_CHANGE).then(|| Guess {
                    direction: (e + ends.outside[0]).normalize(),
                    offset: if is_plane { ends.offset } else { DVec3::ZERO },
                    optical_length: before + optical_length + after,
                    evaluations,
                });
            }
            for i in 0..N {
                let shift = ends.offset + ends.slope * (d * self.nodes[i]);
                u[i] = sum(&self.rows[i].displacement, &f) * d + shift;
                slope[i] = sum(&self.rows[i].slope, &f) + ends.slope;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{LinearIndex, LinearSquare};

    fn whole(x: DVec3, chord: DVec3) -> BentChord {
        BentChord {
            x,
            chord,
            part: [0.0, 1.0],
            optical: [0.0; 2],
        }
    }

    /// In n² = a + b·x rays are parabolas, x + vσ + bσ²/4.
    #[test]
    fn a_parabola_is_found() {
        let slope = DVec3::new(0.05, -0.1, 0.02);
        let field: Field = LinearSquare::new(1.4, slope, DVec3::ZERO).unwrap().into();
        let (x, direction) = (DVec3::new(0.1, 0.2, -0.1), DVec3::new(0.6, 0.0, 0.8));
        let (v, sigma) = (direction * field.n(x), 0.7);
        let y = x + v * sigma + slope * (0.25 * sigma * sigma);
        let n2 = |s: f64| field.n2(x + v * s + slope * (0.25 * s * s));
        // Simpson's rule is exact for n² along a parabola, quadratic in σ.
        let optical = sigma / 6.0 * (n2(0.0) + 4.0 * n2(0.5 * sigma) + n2(sigma));
        let line = whole(x, y - x);
        let found = [
            COARSE_RULE.solve(&field, &line, false, 0.0),
            FINE_RULE.solve(&field, &line, false, 0.0),
        ];
        for found in found.map(Option::unwrap) {
            assert!(found.direction.distance(direction) < 1e-6);
            assert!((found.optical_length / optical - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn rays_that_turn_away_are_left_to_newton() {
        let steep: Field = LinearIndex::new(1.0, DVec3::Y * 3.0, DVec3::ZERO)
            .unwrap()
            .into();
        let line = whole(DVec3::ZERO, DVec3::X * 2.0);
        assert!(bent(&steep, &line, false, 1e-6).is_none());
    }
}
