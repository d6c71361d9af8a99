//! Sums over the scores of a mean, and the reliability of its estimated error
//! (docs/theory.md#effective-samples).
//!
//! A score is one independent sample: a sample of a pixel, the mean of a replicate, a sample of the
//! whole image, or the total of one particle in one bin. Pixels, layers, images and meters all use
//! these sums. Sums and maxima do not depend on the order of scores.

use crate::sum::ReproducibleSum;
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Minimum effective number of scores of a mean whose error is reliable. With ten equal scores,
/// such as arrivals in a bin, the error itself is known to a sixth.
pub const MIN_EFFECTIVE: f64 = 10.0;
/// Relative tolerance for rounding of sums.
const ROUNDING: f64 = 1e-9;
/// Tail index α of the heaviest accepted tail P(x > t) ~ t^−α. Its variance is finite and can be
/// estimated in reasonable time. The largest score may hold the fraction of the scatter that is
/// typical of this tail.
const TAIL_INDEX: f64 = 3.0;
/// Alternative limit: multiple of the fraction of the scatter that the largest of exponentially
/// distributed scores holds.
const EXPONENTIAL_MULTIPLE: f64 = 2.0;

/// Sums over scores. Their number is kept elsewhere, so that zero scores need not be added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    sum: ReproducibleSum,
    sum_of_squares: ReproducibleSum,
    /// Largest absolute value of a score.
    largest: f64,
}

impl Moments {
    /// Adds one score, which must be finite.
    pub fn add(&mut self, score: f64) {
        if score != 0.0 {
            self.add_sums([score, score * score, score.abs()]);
        }
    }

    /// Adds several scores at once, given their sum, the sum of their squares, and the largest
    /// absolute value.
    pub(crate) fn add_sums(&mut self, [sum, squares, largest]: [f64; 3]) {
        self.sum.add(sum);
        // A square that overflows a double is far beyond any meaningful variance.
        self.sum_of_squares.add(squares.min(f64::MAX));
        self.largest = self.largest.max(largest);
    }

    /// Returns the mean of `count` scores; zero if there are none.
    pub fn mean(&self, count: u64) -> f64 {
        match count {
            0 => 0.0,
            n => self.sum.value() / n as f64,
        }
    }

    /// Returns the mean of the squares of `count` scores; zero if there are none.
    pub fn mean_square(&self, count: u64) -> f64 {
        match count {
            0 => 0.0,
            // Planted error "second moments of one sample too few", found by morgana-transport/transport::second_moment::it_is_the_mean_of_squares:
            // n => self.sum_of_squares.value() / (n as f64 - 1.0),
            n => self.sum_of_squares.value() / n as f64,
        }
    }

    /// Returns the sum of the squares of the deviations of `count` scores from their mean.
    pub fn scatter(&self, count: u64) -> f64 {
        let mean = self.mean(count);
        (self.sum_of_squares.value() - mean * mean * count as f64).max(0.0)
    }

    /// Returns an unbiased estimate of the variance of the mean; infinite for fewer than two
    /// scores.
    pub fn variance_of_mean(&self, count: u64) -> f64 {
        if count < 2 {
            return f64::INFINITY;
        }
        let n = count as f64;
        self.scatter(count) / (n * (n - 1.0))
    }

    /// Returns the effective number of scores: the number of equal scores that determine the mean
    /// equally well, (Σx)²/Σx² (Kish). Zero scores do not count. Scores are assumed to have the
    /// same sign.
    pub fn effective(&self) -> f64 {
        let square = self.sum_of_squares.value();
        if square > 0.0 {
            self.sum.value().powi(2) / square
        } else {
            0.0
        }
    }

    /// Returns the part of the scatter of `count` scores that the largest score causes.
    pub fn tail(&self, count: u64) -> Tail {
        Tail {
            largest: (self.largest - self.mean(count).abs()).max(0.0).powi(2),
            scatter: self.scatter(count),
            count,
        }
    }

    /// Returns true if the error of the mean is unreliable: the largest score exceeds one part in
    /// [`MIN_EFFECTIVE`] of the sum. Every sum with fewer than [`MIN_EFFECTIVE`] effective scores
    /// is unreliable. A sum of zeros is not.
    pub fn few(&self) -> bool {
        self.largest * MIN_EFFECTIVE > self.sum.value().abs() * (1.0 + ROUNDING)
    }
}

impl AddAssign for Moments {
    /// Adds the scores of another sum.
    fn add_assign(&mut self, other: Moments) {
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
        self.largest = self.largest.max(other.largest);
    }
}

/// Part of the scatter of scores that the largest score causes. The error is estimated from the
/// scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tail {
    /// Square of the deviation of the largest score from the mean.
    pub largest: f64,
    /// Sum of the squares of the deviations of all scores from the mean.
    pub scatter: f64,
    /// Number of scores.
    pub count: u64,
}

impl Tail {
    /// Combines the tails of two independent sets of scores that are added up.
    pub fn beside(self, other: Tail) -> Tail {
        Tail {
            largest: self.largest.max(other.largest),
            scatter: self.scatter + other.scatter,
            count: self.count + other.count,
        }
    }

    /// Returns the fraction of the scatter that the largest score causes; zero if all are equal.
    pub fn share(&self) -> f64 {
        if self.scatter > 0.0 {
            (self.largest / self.scatter).min(1.0)
        } else {
            0.0
        }
    }

    /// Returns the ratio of [`Tail::share`] to the largest accepted fraction. For n scores this
    /// fraction is the larger of n^(2/α − 1) and (ln n)²/n times `EXPONENTIAL_MULTIPLE`.
    pub fn excess(&self) -> f64 {
        let n = self.count.max(2) as f64;
        let power = n.powf(2.0 / TAIL_INDEX - 1.0);
        let exponential = EXPONENTIAL_MULTIPLE * n.ln().powi(2) / n;
        self.share() / power.max(exponential)
    }

    /// Returns true if [`Tail::share`] is larger than the largest accepted fraction.
    pub fn is_heavy(&self) -> bool {
        self.excess() > 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(scores: impl IntoIterator<Item = f64>) -> (Moments, u64) {
        let mut moments = Moments::default();
        let mut count = 0;
        for score in scores {
            moments.add(score);
            count += 1;
        }
        (moments, count)
    }

    /// Returns evenly distributed numbers in (0, 1).
    fn uniform(count: u64) -> impl Iterator<Item = f64> {
        let golden = 0.618_033_988_749_894_9;
        (0..count).map(move |i| (0.5 + golden * i as f64).fract().max(1e-12))
    }

    #[test]
    fn equal_scores_count_fully_and_zeros_do_not() {
        let (moments, count) = of((0..100).map(|i| if i < 25 { 2.0 } else { 0.0 }));
        assert!((moments.effective() - 25.0).abs() < 1e-9);
        assert!((moments.mean(count) - 0.5).abs() < 1e-12);
        assert!(!moments.few());
        for (hits, few) in [(9, true), (10, false)] {
            let (moments, _) = of((0..100).map(|i| if i < hits { 0.7 } else { 0.0 }));
            assert_eq!(moments.few(), few, "{hits}");
        }
        assert!(!of([0.0; 10]).0.few());
    }

    /// A score that outweighs many others makes the effective number small, in any order and
    /// grouping.
    #[test]
    fn one_large_score_is_noticed() {
        let score = |i| if i == 700 { 150.0 } else { 1.0 };
        let scores: Vec<f64> = (0..1000).map(score).collect();
        let (moments, count) = of(scores.clone());
        assert!(moments.effective() > 50.0 && moments.few());
        assert!(moments.tail(count).share() > 0.9);
        let (mut parts, rest) = (of(scores[600..].to_vec()).0, of(scores[..600].to_vec()).0);
        parts += rest;
        assert_eq!(parts, moments);
    }

    /// Powers u^(−1/α) of uniform numbers have the tail index α. The tail is heavy where the
    /// variance is clearly infinite, and not heavy where all moments are finite.
    #[test]
    fn heavy_tails_are_told_from_light_ones() {
        for n in [64, 1000, 100_000] {
            let (heavy, count) = of(uniform(n).map(|u| u.powf(-1.0 / 1.1)));
            assert!(heavy.tail(count).is_heavy(), "{n}: {:?}", heavy.tail(count));
            let (light, count) = of(uniform(n).map(|u| -u.ln()));
            assert!(
                !light.tail(count).is_heavy(),
                "{n}: {:?}",
                light.tail(count)
            );
            assert!(!light.few(), "{n}");
            let (even, count) = of(uniform(n));
            assert!(!even.tail(count).is_heavy(), "{n}");
        }
    }
}
