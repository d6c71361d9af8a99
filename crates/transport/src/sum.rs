//! Sums whose bits do not depend on the order or the grouping of the numbers added.
//!
//! The method is after Demmel, Ahrens and Nguyen, "Efficient Reproducible Floating Point Summation
//! and BLAS" (2016). Numbers are cut into digits at places that do not depend on other numbers. The
//! digits of one place are added up as integers, which is exact. Only the two highest places of all
//! numbers are kept. The neglected part is less than 2⁻³³ of the largest number for each number
//! added, independent of order. So a render in one piece, an interrupted and resumed render, and a
//! render in many parts on many machines give the same image.

use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Bits per digit.
const DIGIT: u32 = 32;
/// Low bits of each word that hold half of the place's number; the sum of digits is stored above
/// them.
const TAG: u32 = 3;
/// Constant 1.5 · 2⁵², whose addition rounds numbers below 2⁵¹ to integers.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Reproducible sum of doubles. Numbers below 10⁻²⁹⁸ count as zero.
///
/// ```
/// use morgana_transport::sum::ReproducibleSum;
/// let numbers = [1e16, 1.0, -1e16, 0.5];
/// let sum = |order: [usize; 4]| {
///     let mut sum = ReproducibleSum::default();
///     order.iter().for_each(|&i| sum.add(numbers[i]));
///     sum.value()
/// };
/// assert_eq!(sum([0, 1, 2, 3]), sum([3, 1, 0, 2]));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReproducibleSum {
    /// Sums of the digits at the highest place and at the one below, each shifted by three bits
    /// that hold the place's number.
    words: [i64; 2],
}

impl ReproducibleSum {
    /// Maximum number of numbers that a sum can add.
    pub const MAX_NUMBERS: u64 = 1 << 27;

    /// Adds a number, which must be finite.
    pub fn add(&mut self, value: f64) {
        let place = (value.to_bits() >> 52 & 0x7FF) as i64 / i64::from(DIGIT);
        if place == 0 {
            return;
        }
        let mut below = self.place() - place;
        if below < 0 {
            self.raise(place);
            below = 0;
        }
        if below > 1 {
            return;
        }
        // Scale to units of the place, whose powers of two are exact.
        let scaled = value * unit(-place);
        let (high, digit) = rounded(scaled);
        if below == 1 {
            self.words[1] += digit << TAG;
            return;
        }
        let (_, low) = rounded((scaled - high) * f64::from(DIGIT).exp2());
        self.words[0] += digit << TAG;
        self.words[1] += low << TAG;
    }

    /// Returns the sum, rounded once.
    pub fn value(self) -> f64 {
        let [high, low] = self.words.map(|word| i128::from(word >> TAG));
        let place = self.place();
        if place == 0 {
            return 0.0;
        }
        let digits = (high << DIGIT) + low;
        digits as f64 / f64::from(DIGIT).exp2() * unit(place)
    }

    /// Returns the number of the highest place; 0 for an empty sum.
    fn place(self) -> i64 {
        let [high, low] = self.words.map(|word| word & 7);
        high << TAG | low
    }

    /// Moves to a higher place, and drops lower digits.
    fn raise(&mut self, place: i64) {
        let kept = match place - self.place() {
            1 => self.words[0] >> TAG,
            _ => 0,
        };
        self.words = [place >> TAG, kept << TAG | place & 7];
    }
}

impl AddAssign for ReproducibleSum {
    /// Adds all numbers of another sum.
    fn add_assign(&mut self, mut other: ReproducibleSum) {
        let place = self.place().max(other.place());
        for sum in [&mut *self, &mut other] {
            if sum.place() < place {
                sum.raise(place);
            }
        }
        for (word, other) in self.words.iter_mut().zip(other.words) {
            *word += other >> TAG << TAG;
        }
    }
}

/// Returns the unit of a place, or its reciprocal if the number is negative. It is the double whose
/// stored exponent is a whole number of digits.
fn unit(place: i64) -> f64 {
    let exponent = match place {
        0.. => place * i64::from(DIGIT),
        _ => 2046 + place * i64::from(DIGIT),
    };
    f64::from_bits((exponent as u64) << 52)
}

/// Rounds a number below 2⁵¹ to the nearest integer, ties to even. Returns it as a double and as an
/// integer.
fn rounded(value: f64) -> (f64, i64) {
    let shifted = value + ROUNDER;
    let integer = shifted.to_bits() as i64 - ROUNDER.to_bits() as i64;
    (shifted - ROUNDER, integer)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(numbers: impl IntoIterator<Item = f64>) -> ReproducibleSum {
        let mut sum = ReproducibleSum::default();
        numbers.into_iter().for_each(|v| sum.add(v));
        sum
    }

    /// Returns numbers of either sign over sixty decades.
    fn numbers(count: u64) -> Vec<f64> {
        let number = |i: u64| {
            let bits = i.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mixed = (bits ^ bits >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let uniform = |shift: u32| (mixed >> shift & 0xFFFF) as f64 / 65536.0;
            (uniform(0) - 0.5) * 10f64.powf(60.0 * uniform(16) - 30.0)
        };
        (0..count).map(number).collect()
    }

    #[test]
    fn bits_do_not_depend_on_order() {
        let numbers = numbers(1000);
        let forward = sum(numbers.iter().copied());
        let mut sorted = numbers.clone();
        for order in [
            |a: &f64, b: &f64| a.total_cmp(b),
            |a: &f64, b: &f64| b.abs().total_cmp(&a.abs()),
        ] {
            sorted.sort_by(order);
            assert_eq!(sum(sorted.iter().copied()), forward);
        }
        assert_eq!(sum(numbers.into_iter().rev()), forward);
    }

    #[test]
    fn bits_do_not_depend_on_grouping() {
        let numbers = numbers(1000);
        let whole = sum(numbers.iter().copied());
        for size in [1, 7, 333] {
            let mut parts: Vec<ReproducibleSum> =
                numbers.chunks(size).map(|c| sum(c.to_vec())).collect();
            parts.reverse();
            let mut merged = ReproducibleSum::default();
            parts.into_iter().for_each(|part| merged += part);
            assert_eq!(merged, whole);
        }
    }

    /// The bound in the module's documentation holds for numbers whose exact sum is known.
    #[test]
    fn it_is_as_exact_as_promised() {
        for exponent in (-280..280).step_by(7) {
            let scale = 10f64.powi(exponent);
            let n = 1000;
            let value = sum((1..=n).map(|i| scale * f64::from(i))).value();
            let exact = scale * f64::from(n * (n + 1) / 2);
            let bound = scale * f64::from(n) * f64::from(n) * 2f64.powi(-33);
            assert!((value - exact).abs() <= bound, "{exponent}: {value}");
        }
        assert_eq!(sum([0.1]).value(), 0.1);
        assert_eq!(sum([0.75, -0.25, 1e-320, 0.0, -0.0]).value(), 0.5);
        assert_eq!(sum([f64::MAX]).value(), f64::MAX);
        assert_eq!(ReproducibleSum::default().value(), 0.0);
    }

    /// The largest digits do not overflow, in either direction.
    #[test]
    fn there_is_room_for_the_most_numbers() {
        for sign in [1.0, -1.0] {
            let value = sign * (2f64.powi(33) - 2f64.powi(-19));
            let mut total = sum([value]);
            let mut n = 1u64;
            while n < ReproducibleSum::MAX_NUMBERS {
                total += total;
                n *= 2;
            }
            assert_eq!(total.value(), value * n as f64);
        }
    }
}
