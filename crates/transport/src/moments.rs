//! Sums of the scores of a mean, and how far the error that they give can be trusted (docs/theory.md#effective-samples).
//!
//! A score is what one independent sample brings: a sample of a pixel, the mean of a replicate, a sample of the whole
//! image, or all that one particle leaves in one bin. Pixels, layers, images and meters all use these sums. No sum and no
//! maximum depends on the order in which scores come.

use crate::sum::ReproducibleSum;
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// A mean is not to be trusted with its error unless it comes from so many scores of the size of the largest: of ten equal ones,
/// say arrivals in a bin, the error itself is known to a sixth.
pub const LEAST_EFFECTIVE: f64 = 10.0;
/// Sums are rounded.
const ROUNDING: f64 = 1e-9;
/// A single score may hold as much of the scatter as the largest of scores with a tail P(x > t) ~ t^−α of this index, whose
/// variance is finite and known in reasonable time,
const TAIL_INDEX: f64 = 3.0;
/// or so many times the share of the largest of exponentially distributed ones.
const TIMES_EXPONENTIAL: f64 = 2.0;

/// Sums over scores. Their number is kept elsewhere, for scores of zero need not be added.
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

    /// Adds several scores at once: their sum, the sum of their squares, and the largest absolute value.
    pub(crate) fn add_sums(&mut self, [sum, squares, largest]: [f64; 3]) {
        self.sum.add(sum);
        // A square that is too large for a double is far beyond all that can be told of a variance.
        self.sum_of_squares.add(squares.min(f64::MAX));
        self.largest = self.largest.max(largest);
    }

    /// Mean of `count` scores; zero of none.
    pub fn mean(&self, count: u64) -> f64 {
        match count {
            0 => 0.0,
            n => self.sum.value() / n as f64,
        }
    }

    /// Mean of the squares of `count` scores; zero of none.
    pub fn mean_square(&self, count: u64) -> f64 {
        match count {
            0 => 0.0,
            // Planted error "second moments of one sample too few", found by morgana-transport/transport::second_moment::it_is_the_mean_of_squares:
            // n => self.sum_of_squares.value() / (n as f64 - 1.0),
            n => self.sum_of_squares.value() / n as f64,
        }
    }

    /// Sum of the squares of the deviations of `count` scores from their mean.
    pub fn scatter(&self, count: u64) -> f64 {
        let mean = self.mean(count);
        (self.sum_of_squares.value() - mean * mean * count as f64).max(0.0)
    }

    /// Unbiased estimate of the variance of the mean; infinite for fewer than two scores.
    pub fn variance_of_mean(&self, count: u64) -> f64 {
        if count < 2 {
            return f64::INFINITY;
        }
        let n = count as f64;
        self.scatter(count) / (n * (n - 1.0))
    }

    /// How many equal scores would make a mean that is known as well: (Σx)²/Σx² (Kish), not counting those of zero. Scores are
    /// taken to have the same sign.
    pub fn effective(&self) -> f64 {
        let square = self.sum_of_squares.value();
        if square > 0.0 {
            self.sum.value().powi(2) / square
        } else {
            0.0
        }
    }

    /// How much of the scatter of `count` scores comes from the largest.
    pub fn tail(&self, count: u64) -> Tail {
        Tail {
            largest: (self.largest - self.mean(count).abs()).max(0.0).powi(2),
            scatter: self.scatter(count),
            count,
        }
    }

    /// Whether the error of the mean is not to be trusted: the largest score is more than one part in [`LEAST_EFFECTIVE`] of the sum.
    /// So it is, too, wherever there are fewer effective scores than that. A mean of nothing but zeros is not flagged.
    pub fn few(&self) -> bool {
        self.largest * LEAST_EFFECTIVE > self.sum.value().abs() * (1.0 + ROUNDING)
    }
}

impl AddAssign for Moments {
    /// Scores of another sum.
    fn add_assign(&mut self, other: Moments) {
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
        self.largest = self.largest.max(other.largest);
    }
}

/// How much of the scatter of scores, from which their error is told, comes from the largest of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tail {
    /// Largest square of a deviation.
    pub largest: f64,
    /// Sum of the squares of all deviations.
    pub scatter: f64,
    /// Number of scores.
    pub count: u64,
}

impl Tail {
    /// That of independent scores beside others, which are added up.
    pub fn beside(self, other: Tail) -> Tail {
        Tail {
            largest: self.largest.max(other.largest),
            scatter: self.scatter + other.scatter,
            count: self.count + other.count,
        }
    }

    /// Share of the largest score in the scatter; zero if all are alike.
    pub fn share(&self) -> f64 {
        if self.scatter > 0.0 {
            (self.largest / self.scatter).min(1.0)
        } else {
            0.0
        }
    }

    /// That share as a multiple of the largest that light tails leave: n^(2/α − 1) or (ln n)²/n of n scores.
    pub fn excess(&self) -> f64 {
        let n = self.count.max(2) as f64;
        let power = n.powf(2.0 / TAIL_INDEX - 1.0);
        let exponential = TIMES_EXPONENTIAL * n.ln().powi(2) / n;
        self.share() / power.max(exponential)
    }

    /// True if the share is larger than light tails leave.
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

    /// Numbers in (0, 1) that are spread like random ones.
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

    /// Scores of which one outweighs many are worth few, in whichever order and grouping they come.
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

    /// Powers u^(−1/α) of uniform numbers have the tail index α: heavy where the variance is infinite by far, and not where all
    /// moments are finite.
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
