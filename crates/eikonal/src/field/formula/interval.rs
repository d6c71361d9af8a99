//! Interval arithmetic: every result contains the values for all choices of numbers in the
//! arguments, rounding included (docs/theory.md#formulas).

use super::real::Real;
use crate::bounds::mul;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers from `low` to `high`. The interval contains all numbers if nothing is known, or if a
/// function has no value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::field) struct Interval {
    pub low: f64,
    pub high: f64,
}

/// Size of arguments above which rounding loses their phase within a period.
const MAX_ARGUMENT: f64 = 1e9;
/// Largest error of the place of an extremum, relative to the argument.
const EXTREMUM_ERROR: f64 = 1e-12;

impl Interval {
    /// Interval of all numbers.
    pub(in crate::field) const ALL: Interval = Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// Creates the interval from `low` to `high`; all numbers if either is NaN.
    pub(in crate::field) fn new(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            Interval::ALL
        } else {
            Interval { low, high }
        }
    }

    /// Creates an interval, widened by the rounding of sums, products and roots.
    fn rounded(low: f64, high: f64) -> Self {
        let down = if low == 0.0 { 0.0 } else { low.next_down() };
        let up = if high == 0.0 { 0.0 } else { high.next_up() };
        Interval::new(down, up)
    }

    /// Creates an interval, widened by the errors of other functions: a few units in the last
    /// place.
    fn computed(low: f64, high: f64) -> Self {
        let error = |v: f64| {
            if v.is_finite() {
                8.0 * f64::EPSILON * v.abs()
            } else {
                0.0
            }
        };
        Interval::new(low - error(low), high + error(high))
    }

    /// Returns the intersection. Both intervals must contain the result, so that only rounding can
    /// make the intersection empty.
    pub(in crate::field) fn intersection(self, other: Self) -> Self {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        if low <= high {
            Interval { low, high }
        } else {
            self
        }
    }

    /// Returns the smallest interval around both.
    pub(in crate::field) fn union(self, other: Self) -> Self {
        Interval::new(self.low.min(other.low), self.high.max(other.high))
    }

    /// Returns the largest absolute value.
    pub(in crate::field) fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Returns true if the interval contains a number.
    pub(in crate::field) fn contains(self, v: f64) -> bool {
        self.low <= v && v <= self.high
    }

    /// Returns the range of an increasing function.
    fn increasing(self, f: impl Fn(f64) -> f64) -> Self {
        Interval::computed(f(self.low), f(self.high))
    }

    /// Restricts the interval to the possible values of a function.
    fn within(self, low: f64, high: f64) -> Self {
        Interval::new(self.low.max(low), self.high.min(high))
    }

    /// Returns the range of cos(x − `at`).
    fn wave(self, at: f64, f: impl Fn(f64) -> f64) -> Self {
        let largest = self.magnitude();
        if self.high - self.low >= TAU || largest > MAX_ARGUMENT {
            return Interval::new(-1.0, 1.0);
        }
        let slack = EXTREMUM_ERROR * (1.0 + largest);
        let holds = |peak: f64| {
            let turn = |v: f64| (v - peak) / TAU;
            turn(self.high + slack).floor() >= turn(self.low - slack).ceil()
        };
        let (a, b) = (f(self.low), f(self.high));
        let ends = Interval::computed(a.min(b), a.max(b));
        Interval::new(
            if holds(at + PI) { -1.0 } else { ends.low },
            if holds(at) { 1.0 } else { ends.high },
        )
        .within(-1.0, 1.0)
    }
}

impl Add for Interval {
    type Output = Self;

    fn add(self, o: Self) -> Self {
        Interval::rounded(self.low + o.low, self.high + o.high)
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, o: Self) -> Self {
        Interval::rounded(self.low - o.high, self.high - o.low)
    }
}

impl Neg for Interval {
    type Output = Self;

    fn neg(self) -> Self {
        Interval {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, o: Self) -> Self {
        let p = [
            mul(self.low, o.low),
            mul(self.low, o.high),
            mul(self.high, o.low),
            mul(self.high, o.high),
        ];
        Interval::rounded(
            p[0].min(p[1]).min(p[2].min(p[3])),
            p[0].max(p[1]).max(p[2].max(p[3])),
        )
    }
}

impl Div for Interval {
    type Output = Self;

    fn div(self, o: Self) -> Self {
        let reciprocal = match (o.low, o.high) {
            (low, high) if low > 0.0 || high < 0.0 => Interval::rounded(1.0 / high, 1.0 / low),
            (0.0, high) if high > 0.0 => Interval::rounded(1.0 / high, f64::INFINITY),
            (low, 0.0) if low < 0.0 => Interval::rounded(f64::NEG_INFINITY, 1.0 / low),
            _ => return Interval::ALL,
        };
        self * reciprocal
    }
}

impl Real for Interval {
    fn of(value: f64) -> Self {
        Interval::new(value, value)
    }

    fn off_zero(self) -> Self {
        self
    }

    fn sign(self) -> Self {
        Interval::new(1f64.copysign(self.low), 1f64.copysign(self.high))
    }

    fn square(self) -> Self {
        self.integer_power(2)
    }

    fn integer_power(self, k: i32) -> Self {
        if k < 0 {
            return Interval::of(1.0) / self.integer_power(k.saturating_neg());
        }
        let (a, b) = (self.low.powi(k), self.high.powi(k));
        match (k % 2 == 0, self.contains(0.0)) {
            (true, true) => Interval::computed(0.0, a.max(b)),
            _ => Interval::computed(a.min(b), a.max(b)),
        }
    }

    fn real_power(self, p: f64) -> Self {
        let [a, b] = [self.low, self.high].map(|v| v.powf(p));
        Interval::computed(a.min(b), a.max(b)).valid(self.low >= 0.0)
    }

    fn sqrt(self) -> Self {
        Interval::rounded(self.low.sqrt(), self.high.sqrt())
    }

    fn exp(self) -> Self {
        self.increasing(f64::exp)
    }

    fn ln(self) -> Self {
        self.increasing(f64::ln)
    }

    fn sin(self) -> Self {
        self.wave(FRAC_PI_2, f64::sin)
    }

    fn cos(self) -> Self {
        self.wave(0.0, f64::cos)
    }

    fn tan(self) -> Self {
        let turn = |v: f64| ((v - FRAC_PI_2) / PI).floor();
        let slack = EXTREMUM_ERROR * (1.0 + self.magnitude());
        let one_branch = turn(self.low - slack) == turn(self.high + slack);
        self.increasing(f64::tan)
            .valid(one_branch && self.magnitude() < MAX_ARGUMENT)
    }

    fn asin(self) -> Self {
        self.increasing(f64::asin)
    }

    fn acos(self) -> Self {
        (-self).increasing(|v| (-v).acos())
    }

    fn atan(self) -> Self {
        self.increasing(f64::atan)
    }

    fn sinh(self) -> Self {
        self.increasing(f64::sinh)
    }

    fn cosh(self) -> Self {
        let (a, b) = (self.low.cosh(), self.high.cosh());
        let least = if self.contains(0.0) { 1.0 } else { a.min(b) };
        Interval::computed(least, a.max(b))
    }

    fn tanh(self) -> Self {
        self.increasing(f64::tanh).within(-1.0, 1.0)
    }

    fn erf(self) -> Self {
        self.increasing(libm::erf).within(-1.0, 1.0)
    }

    /// Takes extrema at the corners, unless the box touches the negative x axis.
    fn atan2(self, x: Self) -> Self {
        if self.is_cut(x) {
            return Interval::computed(-PI, PI);
        }
        let [a, b] = [x.low, x.high].map(|x| [self.low.atan2(x), self.high.atan2(x)]);
        let low = a[0].min(a[1]).min(b[0].min(b[1]));
        Interval::computed(low, a[0].max(a[1]).max(b[0].max(b[1])))
    }

    fn is_cut(self, x: Self) -> bool {
        x.low <= 0.0 && self.contains(0.0)
    }
}

impl Interval {
    /// Returns all numbers, unless `valid` is true.
    fn valid(self, valid: bool) -> Self {
        if valid { self } else { Interval::ALL }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Pair = (fn(Interval) -> Interval, fn(f64) -> f64);

    const FUNCTIONS: [Pair; 13] = [
        (Real::sqrt, f64::sqrt),
        (Real::exp, f64::exp),
        (Real::ln, f64::ln),
        (Real::sin, f64::sin),
        (Real::cos, f64::cos),
        (Real::tan, f64::tan),
        (Real::asin, f64::asin),
        (Real::acos, f64::acos),
        (Real::atan, f64::atan),
        (Real::sinh, f64::sinh),
        (Real::cosh, f64::cosh),
        (Real::tanh, f64::tanh),
        (Real::erf, libm::erf),
    ];

    /// Returns intervals with ends at multiples of 0.37, and numbers in them.
    fn cases() -> impl Iterator<Item = (Interval, Vec<f64>)> {
        (-20..20).flat_map(|i| {
            (0..20).map(move |w| {
                let at = |t: f64| 0.37 * (f64::from(i) + t * f64::from(w));
                let numbers: Vec<f64> = (0..=16).map(|k| at(f64::from(k) / 16.0)).collect();
                (Interval::new(numbers[0], numbers[16]), numbers)
            })
        })
    }

    #[test]
    fn functions_of_intervals_hold_those_of_their_numbers() {
        for (interval, numbers) in cases() {
            for (i, (of_interval, of_number)) in FUNCTIONS.iter().enumerate() {
                let range = of_interval(interval);
                for v in &numbers {
                    let value = of_number(*v);
                    let holds = range.contains(value) || (value.is_nan() && range == Interval::ALL);
                    assert!(
                        holds,
                        "function {i}: {v} in {interval:?}: {value} not in {range:?}"
                    );
                }
            }
            for k in -4..=5 {
                let range = interval.integer_power(k);
                assert!(
                    numbers
                        .iter()
                        .all(|v| v.powi(k).is_infinite() || range.contains(v.powi(k)))
                );
            }
        }
    }

    #[test]
    fn arithmetic_of_intervals_holds_that_of_their_numbers() {
        let all: Vec<_> = cases().step_by(17).collect();
        for (a, numbers) in &all {
            for (b, others) in &all {
                let ranges = [*a + *b, *a - *b, *a * *b, *a / *b];
                for x in numbers.iter().step_by(3) {
                    for y in others.iter().step_by(3) {
                        let values = [x + y, x - y, x * y, x / y];
                        for (range, value) in ranges.iter().zip(values) {
                            assert!(!value.is_finite() || range.contains(value), "{a:?} {b:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn ranges_are_no_wider_than_functions_vary() {
        let near = |a: Interval, low: f64, high: f64| {
            assert!(
                (a.low - low).abs() < 1e-12 && (a.high - high).abs() < 1e-12,
                "{a:?}"
            );
        };
        near(Interval::new(0.1, 3.0).sin(), 0.1f64.sin(), 1.0);
        near(Interval::new(1.0, 4.0).cos(), -1.0, 1f64.cos());
        near(Interval::new(-2.0, 1.0).square(), 0.0, 4.0);
        near(Interval::new(-2.0, 1.0).integer_power(3), -8.0, 1.0);
        assert_eq!(Interval::new(-1.0, 2.0).tan(), Interval::ALL);
        assert_eq!(Interval::new(-1.0, 2.0).ln(), Interval::ALL);
        assert_eq!(Interval::new(-1.0, 2.0).recip(), Interval::ALL);
    }

    impl Interval {
        fn recip(self) -> Self {
            Interval::of(1.0) / self
        }
    }
}
