//! Tables of Bessel functions of one order and their derivatives (docs/theory.md#sound).
//!
//! The multiplication theorem (DLMF 10.23.1) gives (ρ_c/ρ)^m J_m(ρ) = Σ_j (−η)^j/j! J_{m+j}(ρ_c)
//! with η = (ρ² − ρ_c²)/(2ρ_c). The table holds the first terms about centres ρ_c that lie so close
//! together that the next terms are below rounding.

use super::bessel;
use std::sync::Arc;

/// Number of pieces per unit of ρ: |η| ≤ 1/6 in each piece.
const PIECES_PER_UNIT: f64 = 3.0;
/// Largest ρ of the table.
const MAX_RHO: f64 = 512.0;
/// Largest order with a table: for higher orders, (ρ/ρ_c)^m would exceed the range of numbers near
/// the axis.
const MAX_ORDER: u16 = 256;
/// Number of pairs of even and odd powers of η. The first omitted power, η¹², adds less than 5e-15
/// to second derivatives.
const PAIRS: usize = 6;
/// Bound of the error of J_m(ρ) e^{imφ}, and of its first and second derivatives by Cartesian
/// coordinates in units of ρ. Values are at most 1. The error is caused by rounding, mostly of ρ up
/// to [`MAX_RHO`].
pub(super) const ERROR: f64 = 1e-12;

/// Table of J_m for ρ up to [`MAX_RHO`], shared by copies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BesselTable(Arc<[Piece]>);

/// Piece of a table: (ρ_c/ρ)^m J_m(ρ) as a polynomial in η.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Centre ρ_c.
    center: f64,
    /// Reciprocal centre 1/ρ_c.
    per_center: f64,
    /// Coefficients of η^{2i} and η^{2i+1}.
    pairs: [[f64; 2]; PAIRS],
}

impl BesselTable {
    /// Creates the table of `order` m; `None` for orders that are too high.
    pub(super) fn new(order: u16) -> Option<Self> {
        let count = (MAX_RHO * PIECES_PER_UNIT) as usize;
        (order <= MAX_ORDER)
            .then(|| BesselTable((0..count).map(|i| Piece::new(order, i)).collect()))
    }

    /// Returns the piece for ρ² = `rho2`; `None` beyond the end of the table.
    #[inline(always)]
    pub(super) fn piece(&self, rho2: f64) -> Option<&Piece> {
        let reached = rho2 < MAX_RHO * MAX_RHO;
        let at = ((rho2 * (PIECES_PER_UNIT * PIECES_PER_UNIT)).sqrt()) as usize;
        self.0.get(at).filter(|_| reached)
    }

    /// Returns the memory in bytes.
    pub(super) fn memory(&self) -> usize {
        size_of_val(&*self.0)
    }
}

impl Piece {
    /// Creates the piece with index `i` of order m. Its centre is the middle of the range in ρ².
    fn new(order: u16, i: usize) -> Self {
        let [low, high] = [i, i + 1].map(|i| i as f64 / PIECES_PER_UNIT);
        let center = (0.5 * (low * low + high * high)).sqrt();
        let j: [f64; 2 * PAIRS] = bessel::run(order.into(), center);
        let (mut pairs, mut per_factorial) = ([[0.0; 2]; PAIRS], 1.0);
        for (p, j) in j.into_iter().enumerate() {
            // Planted error "a term left out of the tables of Bessel functions", found by morgana-eikonal/eikonal::field_values::acoustic_modes_solve_the_helmholtz_equation:
            // pairs[p / 2][p % 2] = if p == 9 { 0.0 } else { j * per_factorial };
            pairs[p / 2][p % 2] = j * per_factorial;
            per_factorial /= -((p + 1) as f64);
        }
        Piece {
            center,
            per_center: 1.0 / center,
            pairs,
        }
    }

    /// Returns 1/ρ_c.
    #[inline(always)]
    pub(super) fn per_center(&self) -> f64 {
        self.per_center
    }

    /// Returns the polynomial at ρ² = `rho2`, and its first and second derivatives by η.
    ///
    /// With w = η² the polynomial is E(w) + η O(w). Both parts are evaluated together.
    #[inline(always)]
    pub(super) fn at(&self, rho2: f64) -> [f64; 3] {
        let eta = 0.5 * (rho2 * self.per_center - self.center);
        let w = eta * eta;
        let times_w_plus = |a: [f64; 2], b: [f64; 2]| [a[0] * w + b[0], a[1] * w + b[1]];
        // Evaluate values, first derivatives by w, and halves of second derivatives.
        let (mut value, mut first, mut half) = (self.pairs[PAIRS - 1], [0.0; 2], [0.0; 2]);
        for pair in self.pairs[..PAIRS - 1].iter().rev() {
            half = times_w_plus(half, first);
            first = times_w_plus(first, value);
            value = times_w_plus(value, *pair);
        }
        let even = 2.0 * first[0] + 8.0 * w * half[0];
        let odd = 6.0 * first[1] + 8.0 * w * half[1];
        [
            value[0] + eta * value[1],
            2.0 * (eta * first[0] + w * first[1]) + value[1],
            even + eta * odd,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values J_m, J_m′ and J_m″ by libm alone, from neighbouring orders.
    fn expected(m: i32, x: f64) -> [f64; 3] {
        let j = |p: i32| libm::jn(m + p, x);
        let second = 0.25 * (j(-2) - 2.0 * j(0) + j(2));
        [j(0), 0.5 * (j(-1) - j(1)), second]
    }

    /// Values J_m, J_m′ and J_m″ by the table and the chain rule: J = (ρ/ρ_c)^m g(η), dη/dρ =
    /// ρ/ρ_c.
    fn found(table: &BesselTable, m: i32, x: f64) -> [f64; 3] {
        let piece = table.piece(x * x).unwrap();
        let [g, first, second] = piece.at(x * x);
        let (per, u) = (piece.per_center(), x * piece.per_center());
        let (f, order) = (u.powi(m), f64::from(m));
        let slope = order * per * u.powi(m - 1);
        let bend = order * (order - 1.0) * per * per * u.powi(m - 2);
        let curvature = f * (second * u * u + first * per);
        [
            f * g,
            slope * g + f * first * u,
            bend * g + 2.0 * slope * first * u + curvature,
        ]
    }

    #[test]
    fn agrees_with_libm_within_its_error() {
        for m in [0, 1, 2, 3, 5, 10, 31, 64, 200] {
            let table = BesselTable::new(m).unwrap();
            for step in 1..30_000 {
                // Take irrational steps, so that places lie anywhere in pieces.
                let x = f64::from(step) * 0.017_016_994_374_947_4;
                let pairs = found(&table, m.into(), x)
                    .into_iter()
                    .zip(expected(m.into(), x));
                for (p, (found, expected)) in pairs.enumerate() {
                    let error = (found - expected).abs();
                    assert!(error < 0.5 * ERROR, "{p}th of J_{m} at {x}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn pieces_meet() {
        for m in [0, 1, 7, 40] {
            let table = BesselTable::new(m).unwrap();
            for pair in table.0.windows(2).enumerate() {
                let (i, [a, b]) = (pair.0, [pair.1[0], pair.1[1]]);
                let rho2 = ((i + 1) as f64 / PIECES_PER_UNIT).powi(2);
                let scale = |p: &Piece| (rho2.sqrt() * p.per_center()).powi(m.into());
                let apart = scale(&a) * a.at(rho2)[0] - scale(&b) * b.at(rho2)[0];
                assert!(
                    apart.abs() < 0.1 * ERROR,
                    "J_{m} after piece {i}: {apart:e}"
                );
            }
        }
    }

    #[test]
    fn ends_where_it_says() {
        let table = BesselTable::new(3).unwrap();
        assert!(
            table
                .piece(MAX_RHO * MAX_RHO * (1.0 - f64::EPSILON))
                .is_some()
        );
        for beyond in [MAX_RHO * MAX_RHO, f64::INFINITY, f64::NAN] {
            assert!(table.piece(beyond).is_none());
        }
        assert!(BesselTable::new(MAX_ORDER + 1).is_none());
    }
}
