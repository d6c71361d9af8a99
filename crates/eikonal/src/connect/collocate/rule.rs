//! Collocation at the nodes of Gauss–Legendre quadrature: u″ = f on [0, 1] with u(0) = u(1) = 0,
//! for the polynomial f through values at the nodes.
//!
//! The polynomial is Σₖ cₖPₖ(2t − 1) with cₖ = (2k + 1) Σᵢ wᵢ Pₖ(2tᵢ − 1) fᵢ. These coefficients
//! are exact, because the quadrature is exact for products of the polynomials. Legendre polynomials
//! are integrated by (2k + 1)Pₖ = (Pₖ₊₁ − Pₖ₋₁)′.

use crate::lanes::Summand;

/// Number of Legendre polynomials computed; more than the degree of any rule plus two.
const POLYNOMIALS: usize = 16;
/// Number of iterations of Newton's method on Legendre polynomials, from the right: far more than
/// needed.
const ITERATIONS: usize = 100;

/// The rule of N nodes on [0, 1].
pub(crate) struct QuadratureRule<const N: usize> {
    /// Nodes, ascending from 0 to 1.
    pub nodes: [f64; N],
    /// Quadrature weights.
    pub weights: [f64; N],
    /// Weights of values at the nodes in u′(0) = −∫(1 − t)f dt.
    pub at_start: [f64; N],
    /// Weights of values at the nodes in f, u′ and u at each node.
    pub rows: [Row<N>; N],
    /// Weights of values at the nodes in the last two of the coefficients cₖ.
    pub tail: [[f64; N]; 2],
    /// Weights, in u at the first half of the nodes, of the even and of the odd part about the
    /// middle.
    halves: [[[f64; N]; N]; 2],
}

/// Weights of values at the nodes of a rule, at one place.
#[derive(Clone, Copy)]
pub(crate) struct Row<const N: usize> {
    /// Weights in f.
    pub value: [f64; N],
    /// Weights in u′.
    pub slope: [f64; N],
    /// Weights in u.
    pub displacement: [f64; N],
}

impl<const N: usize> QuadratureRule<N> {
    /// Computes the rule.
    pub(crate) const fn new() -> Self {
        let mut rule = QuadratureRule {
            nodes: roots(),
            weights: [0.0; N],
            at_start: [0.0; N],
            rows: [Row::ZERO; N],
            tail: [[0.0; N]; 2],
            halves: [[[0.0; N]; N]; 2],
        };
        let n = N as f64;
        let mut i = 0;
        while i < N {
            let z = 2.0 * rule.nodes[i] - 1.0;
            let p = legendre(z);
            let before = p[N - 1];
            rule.weights[i] = (1.0 - z * z) / (n * n * before * before);
            rule.at_start[i] = -rule.weights[i] * (1.0 - rule.nodes[i]);
            rule.tail[0][i] = (2.0 * n - 3.0) * rule.weights[i] * p[N - 2];
            rule.tail[1][i] = (2.0 * n - 1.0) * rule.weights[i] * p[N - 1];
            i += 1;
        }
        let mut i = 0;
        while i < N {
            let row = rule.row(rule.nodes[i]);
            let mut j = 0;
            while j < N / 2 {
                let (near, far) = (row.displacement[j], row.displacement[N - 1 - j]);
                rule.halves[0][i][j] = 0.5 * (near + far);
                rule.halves[1][i][j] = 0.5 * (near - far);
                j += 1;
            }
            rule.rows[i] = row;
            i += 1;
        }
        rule
    }

    /// Returns u at the nodes, for an even number of nodes. The nodes are symmetric about the
    /// middle, so that the even and the odd part of f are independent, which halves the work.
    #[inline(always)]
    pub(crate) fn displacements<T: Summand>(&self, f: &[T; N]) -> [T; N] {
        const { assert!(N.is_multiple_of(2)) };
        let (mut even, mut odd) = (*f, *f);
        for j in 0..N / 2 {
            even[j] = f[j] + f[N - 1 - j];
            odd[j] = f[j] - f[N - 1 - j];
        }
        let mut u = *f;
        for i in 0..N / 2 {
            let mut parts = [
                even[0] * self.halves[0][i][0],
                odd[0] * self.halves[1][i][0],
            ];
            for j in 1..N / 2 {
                parts[0] = parts[0].plus(self.halves[0][i][j], even[j]);
                parts[1] = parts[1].plus(self.halves[1][i][j], odd[j]);
            }
            u[i] = parts[0] + parts[1];
            u[N - 1 - i] = parts[0] - parts[1];
        }
        u
    }

    /// Returns the weights of values at the nodes in f, u′ and u at `t`.
    pub(crate) const fn row(&self, t: f64) -> Row<N> {
        let at = legendre(2.0 * t - 1.0);
        let mut row = Row::ZERO;
        let mut i = 0;
        while i < N {
            let p = legendre(2.0 * self.nodes[i] - 1.0);
            let mut k = 0;
            while k < N {
                let c = (2 * k + 1) as f64 * self.weights[i] * p[k];
                let [slope, displacement] = integrals(k, t, &at);
                row.value[i] += c * at[k];
                row.slope[i] += c * slope;
                row.displacement[i] += c * displacement;
                k += 1;
            }
            i += 1;
        }
        row
    }
}

/// The two middle nodes, which measure the change of the field along a ray that moved with its ends
/// fixed. They are next to ½ ± 1/√28, with which ∫ (t(1 − t))²f dt over [0, 1] is exact for cubic
/// f. The change of J is about ∫ t(1 − t) times a change that is itself t(1 − t) times a smooth
/// function.
pub(crate) struct Probes<const N: usize> {
    pub nodes: [usize; 2],
    /// Weights of changes at the two nodes in the change at each node: t(1 − t) times a linear
    /// function of t.
    pub spread: [[f64; 2]; N],
}

impl<const N: usize> Probes<N> {
    /// Computes the weights.
    pub(crate) const fn new(rule: &QuadratureRule<N>) -> Self {
        let nodes = [N / 2 - 1, N / 2];
        let [p, q] = [rule.nodes[nodes[0]], rule.nodes[nodes[1]]];
        let mut spread = [[0.0; 2]; N];
        let mut i = 0;
        while i < N {
            let t = rule.nodes[i];
            let share = t * (1.0 - t) / (p * (1.0 - p) * (q - p));
            spread[i] = [share * (q - t), share * (t - p)];
            i += 1;
        }
        Probes { nodes, spread }
    }
}

impl<const N: usize> Row<N> {
    const ZERO: Self = Row {
        value: [0.0; N],
        slope: [0.0; N],
        displacement: [0.0; N],
    };
}

/// Returns u′ and u for f = Pₖ(2t − 1), given the Legendre polynomials `p` at 2t − 1.
const fn integrals(k: usize, t: f64, p: &[f64; POLYNOMIALS]) -> [f64; 2] {
    match k {
        0 => [t - 0.5, 0.5 * t * (t - 1.0)],
        1 => [t * (t - 1.0) + 1.0 / 6.0, t * (t - 0.5) * (t - 1.0) / 3.0],
        _ => {
            let odd = (2 * k + 1) as f64;
            let slope = (p[k + 1] - p[k - 1]) / (2.0 * odd);
            let after = (p[k + 2] - p[k]) / (odd + 2.0);
            let before = (p[k] - p[k - 2]) / (odd - 2.0);
            [slope, (after - before) / (4.0 * odd)]
        }
    }
}

/// Returns Legendre polynomials at `z`.
const fn legendre(z: f64) -> [f64; POLYNOMIALS] {
    let mut p = [1.0; POLYNOMIALS];
    p[1] = z;
    let mut k = 1;
    while k + 1 < POLYNOMIALS {
        let n = k as f64;
        p[k + 1] = ((2.0 * n + 1.0) * z * p[k] - n * p[k - 1]) / (n + 1.0);
        k += 1;
    }
    p
}

/// Returns the roots of P_N(2t − 1), from the last to the first. Newton's method is applied to the
/// polynomial with the known roots divided out; from the right it descends to each root.
const fn roots<const N: usize>() -> [f64; N] {
    let mut roots = [0.0; N];
    let mut known = 0;
    while known < N {
        let mut z = 1.1;
        let mut round = 0;
        while round < ITERATIONS {
            let p = legendre(z);
            let slope = N as f64 * (z * p[N] - p[N - 1]) / (z * z - 1.0);
            let mut others = 0.0;
            let mut i = 0;
            while i < known {
                others += 1.0 / (z - (2.0 * roots[N - 1 - i] - 1.0));
                i += 1;
            }
            z -= p[N] / (slope - p[N] * others);
            round += 1;
        }
        roots[N - 1 - known] = 0.5 * (z + 1.0);
        known += 1;
    }
    roots
}

/// Returns Σ wᵢfᵢ.
#[inline(always)]
pub(crate) fn sum<const N: usize, T: Summand>(w: &[f64; N], of: &[T; N]) -> T {
    let mut sum = of[0] * w[0];
    for i in 1..N {
        sum = sum.plus(w[i], of[i]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forces tᵏ are integrated exactly: u = (tᵏ⁺² − t)/((k + 1)(k + 2)).
    fn solves_powers_exactly<const N: usize>() {
        let rule = QuadratureRule::<N>::new();
        for k in 0..N as i32 {
            let per = 1.0 / f64::from((k + 1) * (k + 2));
            let f = rule.nodes.map(|t| t.powi(k));
            assert!((sum(&rule.weights, &f) - 1.0 / f64::from(k + 1)).abs() < 1e-13);
            assert!((sum(&rule.at_start, &f) + per).abs() < 1e-13);
            for t in [0.0, 0.3, 1.0].into_iter().chain(rule.nodes) {
                let row = rule.row(t);
                let u = (t.powi(k + 2) - t) * per;
                let slope = (f64::from(k + 2) * t.powi(k + 1) - 1.0) * per;
                assert!((sum(&row.value, &f) - t.powi(k)).abs() < 1e-13);
                assert!((sum(&row.displacement, &f) - u).abs() < 1e-13);
                assert!((sum(&row.slope, &f) - slope).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn halves_say_what_rows_say() {
        let rule = QuadratureRule::<6>::new();
        let f = rule.nodes.map(|t| (3.0 * t).exp());
        let u = rule.displacements(&f);
        for (row, u) in rule.rows.iter().zip(u) {
            assert!((sum(&row.displacement, &f) - u).abs() < 1e-13);
        }
    }

    /// Two of the nodes determine a change that is t(1 − t) times a linear function of t.
    #[test]
    fn probes_say_what_changes_in_proportion_to_displacements() {
        let rule = QuadratureRule::<6>::new();
        let probes = Probes::new(&rule);
        let change = |t: f64| t * (1.0 - t) * (0.7 - 1.3 * t);
        let known = probes.nodes.map(|i| change(rule.nodes[i]));
        for (spread, t) in probes.spread.iter().zip(rule.nodes) {
            assert!((sum(spread, &known) - change(t)).abs() < 1e-15);
        }
    }

    #[test]
    fn powers_are_solved_exactly() {
        solves_powers_exactly::<4>();
        solves_powers_exactly::<5>();
        solves_powers_exactly::<8>();
    }

    /// The quadrature is exact up to the power 2N − 1, and the tail consists of the last two
    /// coefficients.
    #[test]
    fn quadrature_is_gausss_and_the_tail_is_the_end_of_legendres_series() {
        let rule = QuadratureRule::<6>::new();
        let f = rule.nodes.map(|t| t.powi(11));
        assert!((sum(&rule.weights, &f) - 1.0 / 12.0).abs() < 1e-13);
        let series = rule.nodes.map(|t| {
            let p = legendre(2.0 * t - 1.0);
            p[0] - 3.0 * p[3] + 0.25 * p[4] + 0.5 * p[5]
        });
        let tail = rule.tail.map(|row| sum(&row, &series));
        assert!((tail[0] - 0.25).abs() < 1e-13 && (tail[1] - 0.5).abs() < 1e-13);
    }
}
