//! Cubic splines through samples of a function of one variable.

use super::error::FieldError;
use super::formula::{Interval, Number, Series};

/// A twice continuously differentiable function through samples: a cubic between neighbours.
///
/// At either end the third derivative is continuous at the next-to-last sample ("not a knot"), so
/// that cubics are reproduced. Alternatively the slope at the start is zero, for samples that begin
/// on an axis or in a centre of symmetry. Beyond the samples the function continues as a parabola
/// (C. de Boor, *A Practical Guide to Splines*, 2001, ch. IV).
#[derive(Clone, Debug)]
pub(super) struct Spline {
    start: Start,
    /// Places of the samples, ascending.
    knots: Vec<f64>,
    /// Coefficients of powers of the distance from the knot at the left: for the piece before the
    /// first knot, and for the piece after each knot.
    cubics: Vec<[f64; 4]>,
    /// Jumps of the third derivative at knots, divided by the spacing there: an estimate of the
    /// fourth derivative.
    fourth: Vec<f64>,
    /// Ranges of the Taylor coefficients over blocks of [`BLOCK`] consecutive pieces.
    blocks: Vec<Series<Interval, BLOCK_ORDERS>>,
}

/// Number of pieces in a block. Ranges over long intervals use blocks instead of pieces.
const BLOCK: usize = 32;
/// Maximum number of Taylor coefficients that blocks store.
const BLOCK_ORDERS: usize = 5;

/// Condition at the first end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// No condition.
    Free,
    /// Zero slope: the function is even there.
    Even,
}

impl Spline {
    /// Creates the spline through at least two samples at ascending places.
    pub(super) fn new(samples: &[[f64; 2]], start: Start) -> Result<Self, FieldError> {
        check(samples)?;
        let knots: Vec<f64> = samples.iter().map(|s| s[0]).collect();
        let values: Vec<f64> = samples.iter().map(|s| s[1]).collect();
        let cubics = cubics(&knots, &values, start);
        let fourth = (1..knots.len() - 1).map(|i| {
            let jump = 6.0 * (cubics[i + 1][3] - cubics[i][3]);
            2.0 * jump.abs() / (knots[i + 1] - knots[i - 1])
        });
        let fourth = [0.0].into_iter().chain(fourth).chain([0.0]).collect();
        let mut spline = Spline {
            start,
            knots,
            cubics,
            fourth,
            blocks: Vec::new(),
        };
        let inner = spline.knots.len() - 1;
        let block = |i: usize| spline.pieces(1 + i * BLOCK, (i + 1) * BLOCK);
        spline.blocks = (0..inner / BLOCK).map(block).collect();
        Ok(spline)
    }

    /// Returns a range of the Taylor coefficients over whole pieces, from the `first` to the
    /// `last`.
    fn pieces<const K: usize>(&self, first: usize, last: usize) -> Series<Interval, K> {
        let piece = |k: usize| {
            let (low, high) = (self.knots[k - 1], self.knots[k]);
            let t = Series::variable(Interval::new(0.0, high - low));
            horner(t, self.cubics[k])
        };
        (first + 1..=last).fold(piece(first), |all, k| union(&all, &piece(k)))
    }

    /// Returns the values at the samples.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.cubics[1..].iter().map(|cubic| cubic[0])
    }

    /// Returns the number of coefficients of all cubics.
    pub(super) fn coefficient_count(&self) -> usize {
        4 * self.cubics.len()
    }

    /// Adds derivatives with respect to the coefficients, given the derivatives with respect to
    /// value and slope at a place.
    pub(super) fn add_coefficient_derivative(
        &self,
        u: f64,
        [value, slope]: [f64; 2],
        into: &mut [f64],
    ) {
        let piece = self.piece(u);
        let t = u - self.origin(piece);
        let (powers, slopes) = ([1.0, t, t * t, t * t * t], [0.0, 1.0, 2.0 * t, 3.0 * t * t]);
        for (i, sum) in into[4 * piece..4 * piece + 4].iter_mut().enumerate() {
            *sum += value * powers[i] + slope * slopes[i];
        }
    }

    /// Converts changes of the values to changes of the coefficients, which depend on the values
    /// linearly.
    pub(super) fn coefficient_change(&self, values: &[f64]) -> Vec<f64> {
        cubics(&self.knots, values, self.start).into_flattened()
    }

    /// Converts derivatives with respect to the coefficients to derivatives with respect to the
    /// values: the transpose of `coefficient_change`.
    pub(super) fn value_derivative(&self, by_coefficients: &[f64]) -> Vec<f64> {
        let mut unit = vec![0.0; self.knots.len()];
        let mut found = Vec::new();
        for i in 0..unit.len() {
            unit[i] = 1.0;
            let change = self.coefficient_change(&unit);
            let terms = change.iter().zip(by_coefficients).map(|(a, b)| a * b);
            found.push(terms.sum());
            unit[i] = 0.0;
        }
        found
    }

    /// Returns the index of the piece that contains a place.
    fn piece(&self, u: f64) -> usize {
        self.knots.partition_point(|knot| *knot <= u)
    }

    /// Returns the place about which the cubic of a piece is expanded.
    fn origin(&self, piece: usize) -> f64 {
        self.knots[piece.saturating_sub(1)]
    }

    /// Returns the Taylor coefficients at a place.
    #[inline]
    pub(super) fn at<const K: usize>(&self, u: f64) -> Series<f64, K> {
        let piece = self.piece(u);
        let t = Series::variable(u - self.origin(piece));
        horner(t, self.cubics[piece])
    }

    /// Returns a range of the Taylor coefficients over an interval.
    pub(super) fn over<const K: usize>(&self, u: Interval) -> Series<Interval, K> {
        let (first, last) = (self.piece(u.low), self.piece(u.high));
        let of = |piece: usize| {
            let low = if piece == first {
                u.low
            } else {
                self.knots[piece - 1]
            };
            let high = if piece == last {
                u.high
            } else {
                self.knots[piece]
            };
            let origin = self.origin(piece);
            let t = Series::variable(Interval::new(low - origin, high - origin));
            horner(t, self.cubics[piece])
        };
        let mut all = of(first);
        let mut piece = first + 1;
        while piece <= last {
            let block = (piece - 1) / BLOCK;
            let is_whole = (piece - 1) % BLOCK == 0 && piece + BLOCK <= last;
            match self
                .blocks
                .get(block)
                .filter(|_| is_whole && K <= BLOCK_ORDERS)
            {
                Some(known) => {
                    all = union(&all, &Series(std::array::from_fn(|k| known.0[k])));
                    piece += BLOCK;
                }
                None => {
                    all = union(&all, &of(piece));
                    piece += 1;
                }
            }
        }
        all
    }

    /// Estimates the largest fourth derivative over an interval.
    pub(super) fn fourth(&self, u: Interval) -> f64 {
        let (first, last) = (self.piece(u.low), self.piece(u.high));
        // Take the knots of all pieces that the interval touches.
        let (from, to) = (first.saturating_sub(1), (last + 1).min(self.fourth.len()));
        self.fourth[from..to].iter().copied().fold(0.0, f64::max)
    }

    pub(super) fn memory(&self) -> usize {
        size_of_val(&*self.knots)
            + size_of_val(&*self.cubics)
            + size_of_val(&*self.fourth)
            + size_of_val(&*self.blocks)
    }
}

/// Returns the cubics through values at knots.
fn cubics(knots: &[f64], values: &[f64], start: Start) -> Vec<[f64; 4]> {
    let bends = second_derivatives(knots, values, start);
    let mut cubics = vec![[0.0; 4]];
    for i in 0..knots.len() - 1 {
        let h = knots[i + 1] - knots[i];
        let [m, next] = [bends[i], bends[i + 1]];
        let slope = (values[i + 1] - values[i]) / h - h * (2.0 * m + next) / 6.0;
        cubics.push([values[i], slope, 0.5 * m, (next - m) / (6.0 * h)]);
    }
    if start == Start::Even {
        // Set the slope exactly, so that rounding leaves no kink.
        cubics[1][1] = 0.0;
    }
    // Continue beyond both ends with the value, slope and second derivative there.
    let [a, b, c, d] = cubics[knots.len() - 1];
    let h = knots[knots.len() - 1] - knots[knots.len() - 2];
    let slope = b + h * (2.0 * c + h * 3.0 * d);
    let last = a + h * (b + h * (c + h * d));
    cubics.push([last, slope, c + 3.0 * h * d, 0.0]);
    let [a, b, c, _] = cubics[1];
    cubics[0] = [a, b, c, 0.0];
    cubics
}

fn union<const K: usize>(a: &Series<Interval, K>, b: &Series<Interval, K>) -> Series<Interval, K> {
    Series(std::array::from_fn(|k| a.0[k].union(b.0[k])))
}

/// Returns a + bt + ct² + dt³.
#[inline(always)]
fn horner<N: Number>(t: N, [a, b, c, d]: [f64; 4]) -> N {
    let inner = t.times(d).plus(c);
    let inner = t.mul(&inner).plus(b);
    t.mul(&inner).plus(a)
}

fn check(samples: &[[f64; 2]]) -> Result<(), FieldError> {
    if samples.len() < 2 {
        return Err(FieldError::FewSamples(samples.len()));
    }
    let is_bad = |s: &[f64; 2]| !(s[1].is_finite() && s[1] > 0.0);
    if let Some(at) = samples.iter().position(is_bad) {
        let value = samples[at][1];
        return Err(FieldError::BadTableIndex {
            at: samples[at][0],
            value,
        });
    }
    let ascends = |pair: &[[f64; 2]]| pair[1][0] - pair[0][0] > 0.0;
    match samples.windows(2).find(|pair| !ascends(pair)) {
        Some(pair) => Err(FieldError::NotAscending(pair[0][0], pair[1][0])),
        None if samples.iter().all(|s| s[0].is_finite()) => Ok(()),
        None => Err(FieldError::NotFinite {
            what: "place of a sample",
            value: f64::NAN,
        }),
    }
}

/// Computes second derivatives at the knots, by one tridiagonal solve.
fn second_derivatives(knots: &[f64], values: &[f64], start: Start) -> Vec<f64> {
    let n = knots.len();
    let h = |i: usize| knots[i + 1] - knots[i];
    let secant = |i: usize| (values[i + 1] - values[i]) / h(i);
    // Use a parabola through three samples and a line through two: there are too few inner knots
    // for the end conditions.
    let free = n > 3;
    let (mut diagonal, mut upper, mut right) = (vec![1.0; n], vec![0.0; n], vec![0.0; n]);
    let mut lower = vec![0.0; n];
    for i in 1..n - 1 {
        lower[i] = h(i - 1);
        diagonal[i] = 2.0 * (h(i - 1) + h(i));
        upper[i] = h(i);
        right[i] = 6.0 * (secant(i) - secant(i - 1));
    }
    // Insert the end condition m₀ = m₁ + (m₁ − m₂)h₀/h₁ into the equation of the first inner knot.
    let even = start == Start::Even;
    if even {
        (diagonal[0], upper[0], right[0]) = (2.0 * h(0), h(0), 6.0 * secant(0));
    } else if free {
        diagonal[1] += h(0) * (1.0 + h(0) / h(1));
        upper[1] -= h(0) * h(0) / h(1);
        lower[1] = 0.0;
    } else if n == 3 {
        (diagonal[1], upper[1], lower[1]) = (diagonal[1] + h(0) + h(1), 0.0, 0.0);
    }
    if n > 2 && (free || even) {
        let (a, b) = (h(n - 2), h(n - 3));
        diagonal[n - 2] += a * (1.0 + a / b);
        lower[n - 2] -= a * a / b;
        upper[n - 2] = 0.0;
    } else if even {
        // Use a parabola through two samples.
        lower[1] = -1.0;
    }
    let mut m = solve(&lower, diagonal, &upper, right);
    if !even && free {
        m[0] = m[1] + (m[1] - m[2]) * h(0) / h(1);
    } else if !even && n == 3 {
        m[0] = m[1];
    }
    if n > 2 && (free || even) {
        m[n - 1] = m[n - 2] + (m[n - 2] - m[n - 3]) * h(n - 2) / h(n - 3);
    } else if n == 3 {
        m[2] = m[1];
    }
    m
}

/// Solves a tridiagonal system without pivoting: its matrix is diagonally dominant, or nearly so at
/// the ends.
fn solve(lower: &[f64], mut diagonal: Vec<f64>, upper: &[f64], mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for i in 1..n {
        let factor = lower[i] / diagonal[i - 1];
        diagonal[i] -= factor * upper[i - 1];
        right[i] -= factor * right[i - 1];
    }
    right[n - 1] /= diagonal[n - 1];
    for i in (0..n - 1).rev() {
        right[i] = (right[i] - upper[i] * right[i + 1]) / diagonal[i];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spline(places: &[f64], f: impl Fn(f64) -> f64, start: Start) -> Spline {
        let samples: Vec<[f64; 2]> = places.iter().map(|u| [*u, f(*u)]).collect();
        Spline::new(&samples, start).unwrap()
    }

    /// Ranges over many pieces contain all values in them, for any ends of the interval. They
    /// exceed the values by no more than bounds of single pieces do.
    #[test]
    fn ranges_over_many_pieces_hold_all_values() {
        let places: Vec<f64> = (0..200).map(f64::from).collect();
        let f = |u: f64| 2.0 + (0.13 * u).sin() + 1e-3 * u;
        let spline = spline(&places, f, Start::Free);
        for (low, high) in [
            (0.0, 199.0),
            (0.5, 33.2),
            (31.9, 96.1),
            (32.0, 64.0),
            (64.5, 199.5),
            (7.0, 7.5),
        ] {
            let range = spline.over::<3>(Interval::new(low, high));
            // Excess of interval arithmetic in c₀ + t (c₁ + t c₂) over a part t of a piece: at most
            // t² |f″|/2, and correspondingly for derivatives.
            let excess = |k: i32| 0.5 * (high - low).min(1.0).powi(2) * 0.13f64.powi(k + 2);
            let mut seen = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
            for i in 0..=20_000 {
                let found = spline.at::<3>(low + (high - low) * f64::from(i) / 20_000.0);
                for (seen, v) in seen.iter_mut().zip(found.0) {
                    *seen = [seen[0].min(v), seen[1].max(v)];
                }
            }
            for (k, (range, [least, most])) in (0..).zip(range.0.iter().zip(seen)) {
                let slack = 0.02 * (most - least) + excess(k) + 1e-9;
                assert!(
                    range.low <= least && least <= range.low + slack,
                    "{low} {high}: {range:?} {least}"
                );
                assert!(
                    range.high >= most && most >= range.high - slack,
                    "{low} {high}: {range:?} {most}"
                );
            }
        }
    }

    /// Cubics are reproduced; so are parabolas and lines, from as many samples as determine them.
    #[test]
    fn polynomials_are_reproduced() {
        let places = [0.0, 0.3, 0.7, 1.5, 2.0, 2.2, 4.0];
        type Case<'a> = (&'a dyn Fn(f64) -> f64, usize, Start);
        let all: [Case; 7] = [
            (&|u| 2.0 + u - 0.5 * u * u + 0.2 * u.powi(3), 7, Start::Free),
            (&|u| 2.0 + u - 0.5 * u * u + 0.2 * u.powi(3), 4, Start::Free),
            (&|u| 2.0 + u - 0.5 * u * u, 3, Start::Free),
            (&|u| 2.0 + 0.4 * u, 2, Start::Free),
            (&|u| 2.0 - 0.5 * u * u + 0.2 * u.powi(3), 7, Start::Even),
            (&|u| 2.0 - 0.5 * u * u + 0.2 * u.powi(3), 3, Start::Even),
            (&|u| 2.0 - 0.3 * u * u, 2, Start::Even),
        ];
        for (number, (f, count, start)) in all.into_iter().enumerate() {
            let spline = spline(&places[..count], f, start);
            let last = places[count - 1];
            for i in 0..=20 {
                let u = last * f64::from(i) / 20.0;
                let found = spline.at::<1>(u).0[0];
                assert!(
                    (found - f(u)).abs() < 1e-13,
                    "{number}: {found} for {} at {u}",
                    f(u)
                );
            }
        }
    }

    /// Value, slope and second derivative are continuous at all knots, the ends included; slopes
    /// are zero where required.
    #[test]
    fn splines_are_smooth() {
        let places = [0.0, 0.4, 0.5, 1.3, 2.0, 3.5];
        for start in [Start::Free, Start::Even] {
            let spline = spline(&places, |u| 2.0 + (2.0 * u).sin(), start);
            for u in places {
                let [below, above] = [u.next_down(), u].map(|u| spline.at::<3>(u).0);
                for k in 0..3 {
                    assert!(
                        (below[k] - above[k]).abs() < 1e-12,
                        "{u}: {below:?} {above:?}"
                    );
                }
            }
            if start == Start::Even {
                assert!(spline.at::<2>(0.0).0[1].abs() < 1e-14);
            }
        }
    }

    /// Errors are of fourth order, also at the ends.
    #[test]
    fn errors_fall_with_the_fourth_power() {
        let error = |count: i32| {
            let places: Vec<f64> = (0..=count)
                .map(|i| 2.0 * f64::from(i) / f64::from(count))
                .collect();
            let spline = spline(&places, |u| 2.0 + u.cos(), Start::Even);
            let off = |i: i32| {
                let u = f64::from(i) / 500.0;
                (spline.at::<1>(u).0[0] - 2.0 - u.cos()).abs()
            };
            (0..1000).map(off).fold(0.0, f64::max)
        };
        let ratio = error(40) / error(80);
        assert!((14.0..18.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn bad_samples_are_refused() {
        let new = |samples: &[[f64; 2]]| Spline::new(samples, Start::Free).unwrap_err().to_string();
        assert!(new(&[[0.0, 1.0]]).contains("at least two"));
        assert!(new(&[[0.0, 1.0], [0.0, 1.5]]).contains("ascend"));
        assert!(new(&[[0.0, 1.0], [1.0, -1.5]]).contains("positive"));
        assert!(new(&[[0.0, 1.0], [f64::NAN, 1.5]]).contains("ascend"));
    }
}
