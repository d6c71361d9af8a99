//! Tests with means of independent batches, for estimators with dependent samples or dependent
//! pixels.
//!
//! The tests assume only that batch means are independent and nearly normal. Student's t accounts
//! for standard errors that are estimated from few batches.

use crate::moments::Moments;
use crate::z_test::{two_sample_z, z_score};
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::erf::erfc_inv;
use std::f64::consts::SQRT_2;

/// Returns mean and standard error of a few independent batch means.
pub fn moments(batches: &[f64]) -> Moments {
    let mut moments = Moments::default();
    for batch in batches {
        moments.push(*batch);
    }
    moments
}

/// Returns the two-sided p-value of the hypothesis that two sets of batches have one mean (Welch
/// 1947). For normal batches, the p-value is uniform up to an error of order 1/batches², whatever
/// the variances.
///
/// A difference up to `round_off` times the larger |mean| counts as zero.
pub fn welch(a: &[f64], b: &[f64], round_off: f64) -> f64 {
    let (a, b) = (moments(a), moments(b));
    let (va, vb) = (a.standard_error().powi(2), b.standard_error().powi(2));
    let scale = a.mean().abs().max(b.mean().abs());
    let difference = a.mean() - b.mean();
    if difference.abs() <= round_off * scale {
        return 1.0;
    }
    let share = |v: f64, m: &Moments| v * v / (m.count() as f64 - 1.0);
    let freedom = (va + vb).powi(2) / (share(va, &a) + share(vb, &b));
    student(z_score(difference, (va + vb).sqrt(), 0.0), freedom)
}

/// Returns the z of the difference between two means of `batches` batches, each given with its
/// standard error. It is the normal deviate with the p-value of Welch's t (1947).
pub fn welch_z(a: (f64, f64), b: (f64, f64), batches: usize) -> f64 {
    let t = two_sample_z(a.0, a.1, b.0, b.1);
    if t == 0.0 || !t.is_finite() {
        return t;
    }
    let (va, vb) = (a.1.powi(2), b.1.powi(2));
    let freedom = (batches as f64 - 1.0) * (va + vb).powi(2) / (va * va + vb * vb);
    (SQRT_2 * erfc_inv(student(t, freedom))).copysign(t)
}

/// Returns the two-sided p-value of the hypothesis that batches have the mean `expected`. A
/// difference up to `round_off` times |expected| counts as zero.
pub fn one_sample(batches: &[f64], expected: f64, round_off: f64) -> f64 {
    let m = moments(batches);
    if (m.mean() - expected).abs() <= round_off * expected.abs() {
        return 1.0;
    }
    student(m.z(expected), m.count() as f64 - 1.0)
}

/// Returns the |t| that a correct program exceeds with probability `rate`.
pub fn critical_t(rate: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| -t.inverse_cdf(0.5 * rate))
}

fn student(t: f64, freedom: f64) -> f64 {
    if t.is_infinite() {
        return 0.0;
    }
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |d| 2.0 * d.cdf(-t.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    fn batches(rng: &mut Rng, n: usize, mean: f64, deviation: f64) -> Vec<f64> {
        // A sum of twelve uniforms has variance 1.
        let normal = |rng: &mut Rng| rng.uniform::<12>().iter().sum::<f64>() - 6.0;
        (0..n).map(|_| mean + deviation * normal(rng)).collect()
    }

    #[test]
    fn known_quantiles() {
        assert!((critical_t(0.05, 10.0) - 2.228_138_852).abs() < 1e-6);
        assert!((student(2.228_138_852, 10.0) - 0.05).abs() < 1e-8);
        let z = welch_z((-2.228_138_852, 1.0), (0.0, 0.0), 11);
        assert!((z + 1.959_963_985).abs() < 1e-6);
        assert!(welch_z((9.0, 1.0), (0.0, 1.0), 32) > 5.0);
        assert_eq!(welch_z((1.0, 0.0), (1.0, 0.0), 32), 0.0);
        assert_eq!(welch_z((1.0, 0.0), (0.0, 0.0), 32), f64::INFINITY);
        assert!(welch_z((f64::NAN, 1.0), (0.0, 1.0), 32).is_nan());
    }

    /// Expected p-values are from SciPy 1.16: `ttest_ind` with unequal variances and sizes,
    /// `ttest_ind_from_stats`, `ttest_1samp`.
    #[test]
    fn p_values_are_those_of_another_library() {
        let (a, b) = ([1.0, 2.0, 4.0, 8.0], [2.0, 3.0, 9.0, 11.0, 17.0]);
        assert!((welch(&a, &b, 0.0) - 0.190_061_758_867_440_1).abs() < 1e-9);
        let z = welch_z((3.0, 0.5), (1.5, 0.25), 8);
        assert!((z - 2.282_996_811_949_641_5).abs() < 1e-9, "{z}");
        assert!((one_sample(&a, 2.5, 0.0) - 0.478_430_170_110_334_3).abs() < 1e-9);
    }

    /// Differences of the mean up to the given fraction count as zero; larger differences are
    /// detected.
    #[test]
    fn differences_by_rounding_are_none() {
        let near = |mean: f64| [mean, mean, mean, mean];
        assert_eq!(welch(&near(10.0), &near(10.1), 0.02), 1.0);
        assert_eq!(welch(&near(10.0), &near(10.1), 0.005), 0.0);
        assert_eq!(one_sample(&near(10.1), 10.0, 0.02), 1.0);
        assert_eq!(one_sample(&near(10.1), 10.0, 0.005), 0.0);
    }

    /// Runs 4000 comparisons of 16 with 16 batches of different spread. Rejections at 1 % and 0.1 %
    /// must be within 4 standard deviations of the binomial distribution.
    #[test]
    fn rejects_as_often_as_it_says() {
        let mut rng = Rng::new(5);
        let runs = 4000;
        let ps: Vec<f64> = (0..runs)
            .map(|_| {
                let a = batches(&mut rng, 16, 1.0, 0.1);
                welch(&a, &batches(&mut rng, 16, 1.0, 0.4), 0.0)
            })
            .collect();
        for rate in [0.01, 0.001] {
            let found = ps.iter().filter(|p| **p < rate).count() as f64;
            let expected = rate * runs as f64;
            assert!(
                (found - expected).abs() < 4.0 * expected.sqrt(),
                "{found} at {rate}"
            );
        }
    }

    #[test]
    fn finds_a_shift() {
        let mut rng = Rng::new(6);
        let a = batches(&mut rng, 16, 1.0, 0.1);
        let b = batches(&mut rng, 16, 1.3, 0.1);
        assert!(welch(&a, &b, 0.0) < 1e-5);
        assert!(one_sample(&a, 1.0, 0.0) > 1e-3);
        assert!(one_sample(&b, 1.0, 0.0) < 1e-5);
        assert_eq!(welch(&[1.0; 4], &[1.0; 4], 0.0), 1.0);
        assert_eq!(welch(&[1.0; 4], &[1.1; 4], 1e-9), 0.0);
    }
}
