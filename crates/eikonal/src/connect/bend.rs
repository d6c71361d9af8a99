//! The chord between two points, bent by the field: where Newton's method starts.
//!
//! With the distance z along the chord as variable, from 0 to d, a ray is displaced from it by u(z), with
//! u″ = (1 + u′²)(g⊥ − u′g∥), g = ∇ ln n, and u = 0 at both ends. The equation is solved by collocation at the
//! nodes of Gauss–Legendre quadrature and iteration from u = 0, of which the first round is the
//! perturbation of first order. Only gradients are needed, at positions that do not wait for one another.

use crate::field::Field;
use glam::DVec3;

const COUNT: usize = 5;
/// Most rounds. Each makes the error smaller by a factor of some ten where a ray is bent mildly.
const ROUNDS: usize = 3;
/// Radians by which the last round may change the direction: Newton's method converges from there.
const SETTLED: f64 = 0.03;

/// Nodes on [0, 1].
const NODES: [f64; COUNT] = [
    0.046910077030668,
    0.230765344947158,
    0.5,
    0.769234655052842,
    0.953089922969332,
];
/// Weights of the quadrature ∫f dt.
const WEIGHTS: [f64; COUNT] = [
    0.118463442528095,
    0.239314335249683,
    0.284444444444444,
    0.239314335249683,
    0.118463442528095,
];
/// The solution of u″ = f, u(0) = u(1) = 0 at the nodes, for f through its values there.
#[rustfmt::skip]
const DISPLACEMENT: [[f64; COUNT]; COUNT] = [
    [-0.00380612646468, -0.00925822034476, -0.00631012302002, -0.00277080708843, -0.000209483933945],
    [-0.00458292919469, -0.0365642439057, -0.0338544860335, -0.0123831086586, -0.00137158246678],
    [-0.00262799611779, -0.0284831149933, -0.0627777777778, -0.0284831149933, -0.00262799611779],
    [-0.00137158246678, -0.0123831086586, -0.0338544860335, -0.0365642439057, -0.00458292919469],
    [-0.000209483933945, -0.00277080708843, -0.00631012302002, -0.00925822034476, -0.00380612646468],
];
/// Its derivative.
#[rustfmt::skip]
const SLOPE: [[f64; COUNT]; COUNT] = [
    [-0.0536745920497, -0.203659244484, -0.130967821404, -0.0608192487855, -0.00396901624645],
    [0.0152446923563, -0.0644317125001, -0.166814336842, -0.044907174454, -0.00832612361308],
    [0.000869974690441, 0.0759157715557, 0.0, -0.0759157715557, -0.000869974690441],
    [0.00832612361308, 0.044907174454, 0.166814336842, 0.0644317125001, -0.0152446923563],
    [0.00396901624645, 0.0608192487855, 0.130967821404, 0.203659244484, 0.0536745920497],
];
/// Its derivative at t = 0: −∫(1 − t)f dt.
const AT_START: [f64; COUNT] = [
    -0.112906313313784,
    -0.18408888012499,
    -0.142222222222222,
    -0.055225455124693,
    -0.005557129214311,
];

/// A guess of the ray from one point to another.
pub(super) struct Guess {
    /// Unit direction at the start.
    pub direction: DVec3,
    /// Optical path length.
    pub optical_length: f64,
    /// Field evaluations that it took.
    pub evaluations: u64,
}

/// The ray from `x` to `x + chord` in a field, with a direction (in radians) that would hardly change by
/// more than `accuracy` in a further round, or after the last one. `None` where the iteration does not
/// converge, or the ray turns away from the chord by more than 45°.
pub(super) fn bent_chord(field: &Field, x: DVec3, chord: DVec3, accuracy: f64) -> Option<Guess> {
    let d = chord.length();
    let e = chord / d;
    let (mut u, mut slope) = ([DVec3::ZERO; COUNT], [DVec3::ZERO; COUNT]);
    let (mut start, mut change) = (DVec3::ZERO, f64::INFINITY);
    let (mut optical_length, mut evaluations) = (0.0, 0);
    for _ in 0..ROUNDS {
        let mut f = [DVec3::ZERO; COUNT];
        optical_length = 0.0;
        for i in 0..COUNT {
            let (n2, grad) = field.gradient(x + chord * NODES[i] + u[i]);
            let g = grad / (2.0 * n2);
            let along = g.dot(e);
            let stretch = 1.0 + slope[i].length_squared();
            f[i] = (g - e * along - slope[i] * along) * (stretch * d);
            optical_length += WEIGHTS[i] * d * (n2 * stretch).sqrt();
        }
        evaluations += COUNT as u64;
        let next = sum(&AT_START, &f);
        let last = change;
        change = next.distance(start);
        start = next;
        if !(change < last && start.length_squared() < 1.0) {
            return None;
        }
        if change < accuracy {
            break;
        }
        for i in 0..COUNT {
            u[i] = sum(&DISPLACEMENT[i], &f) * d;
            slope[i] = sum(&SLOPE[i], &f);
        }
    }
    (change < SETTLED).then(|| Guess {
        direction: (e + start).normalize(),
        optical_length,
        evaluations,
    })
}

#[inline(always)]
fn sum(w: &[f64; COUNT], of: &[DVec3; COUNT]) -> DVec3 {
    (of[0] * w[0] + of[1] * w[1]) + (of[2] * w[2] + of[3] * w[3]) + of[4] * w[4]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{LinearIndex, LinearSquare};

    /// Forces tᵏ are integrated exactly: u = (tᵏ⁺² − t)/((k + 1)(k + 2)).
    #[test]
    fn powers_are_solved_exactly() {
        for k in 0..COUNT as i32 {
            let per = 1.0 / f64::from((k + 1) * (k + 2));
            let f = NODES.map(|t| DVec3::X * t.powi(k));
            assert!((sum(&AT_START, &f).x + per).abs() < 1e-13);
            for (i, t) in NODES.into_iter().enumerate() {
                let u = (t.powi(k + 2) - t) * per;
                let slope = (f64::from(k + 2) * t.powi(k + 1) - 1.0) * per;
                assert!((sum(&DISPLACEMENT[i], &f).x - u).abs() < 1e-11);
                assert!((sum(&SLOPE[i], &f).x - slope).abs() < 1e-11);
            }
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
        let found = bent_chord(&field, x, y - x, 0.0).unwrap();
        let n2 = |s: f64| field.n2(x + v * s + slope * (0.25 * s * s));
        // Simpson's rule is exact for n² along a parabola, quadratic in σ.
        let optical = sigma / 6.0 * (n2(0.0) + 4.0 * n2(0.5 * sigma) + n2(sigma));
        assert!(found.direction.distance(direction) < 1e-6);
        assert!((found.optical_length / optical - 1.0).abs() < 1e-8);
    }

    #[test]
    fn rays_that_turn_away_are_left_to_newton() {
        let steep: Field = LinearIndex::new(1.0, DVec3::Y * 3.0, DVec3::ZERO)
            .unwrap()
            .into();
        assert!(bent_chord(&steep, DVec3::ZERO, DVec3::X * 2.0, 1e-6).is_none());
    }
}
