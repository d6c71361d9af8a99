//! Tests of means against known values and against each other.
//!
//! All tests assume that the mean is normally distributed with the given standard error, so use
//! enough samples.

use crate::family::sidak;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::SQRT_2;

/// Returns (value − expected) / standard error.
///
/// A zero standard error gives 0 for exact agreement and ±∞ for any difference, never NaN.
pub fn z_score(value: f64, standard_error: f64, expected: f64) -> f64 {
    let difference = value - expected;
    if difference == 0.0 {
        0.0
    } else {
        difference / standard_error
    }
}

/// Returns the z of the difference between two independent means, each with its standard error.
pub fn two_sample_z(a: f64, se_a: f64, b: f64, se_b: f64) -> f64 {
    z_score(a, se_a.hypot(se_b), b)
}

/// Returns the two-sided p-value of a single z, uniform for a standard normal z.
pub fn p_value(z: f64) -> f64 {
    erfc(z.abs() / SQRT_2)
}

/// Returns the |z| that the largest of `n` standard normal z exceeds with probability
/// `family_rate`. The result is exact for independent z, and conservative for correlated z.
pub fn threshold(family_rate: f64, n: usize) -> f64 {
    SQRT_2 * erfc_inv(sidak(family_rate, n))
}

/// Compares the largest |z| with [`threshold`]. The false-alarm rate is at most `family_rate`.
///
/// # Errors
/// Returns an error for a |z| that exceeds the threshold or is NaN.
pub fn max_abs_z(zs: &[f64], family_rate: f64) -> Result<(), String> {
    let limit = threshold(family_rate, zs.len());
    // Comparisons with NaN are false: test for "within", not for "beyond".
    match zs
        .iter()
        .enumerate()
        .find(|(_, z)| !matches!(z.abs().partial_cmp(&limit), Some(o) if o.is_le()))
    {
        None => Ok(()),
        Some((i, z)) => Err(format!(
            "z[{i}] = {z} beyond ±{limit:.2} (largest of {})",
            zs.len()
        )),
    }
}

/// Returns the p-value of Σz² against χ² with as many degrees of freedom as there are z. It detects
/// many small deviations, where [`max_abs_z`] detects a large one. Only the upper tail is tested.
/// For independent standard normal z the p-value is uniform, so a test at level α has the
/// false-alarm rate α.
pub fn chi_square_of_z(zs: &[f64]) -> f64 {
    let statistic: f64 = zs.iter().map(|z| z * z).sum();
    upper_tail(statistic, zs.len())
}

/// Returns P(χ²_dof > statistic); NaN if the statistic is NaN.
pub(crate) fn upper_tail(statistic: f64, dof: usize) -> f64 {
    if statistic.is_nan() {
        return f64::NAN;
    }
    if statistic.is_infinite() {
        return 0.0;
    }
    ChiSquared::new(dof as f64)
        .expect("at least one degree of freedom")
        .sf(statistic)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// Returns a sum of twelve uniform numbers: variance 1, and close to normal for |z| < 3.
    fn nearly_normal(rng: &mut Rng) -> f64 {
        rng.uniform::<12>().iter().sum::<f64>() - 6.0
    }

    #[test]
    fn known_quantiles() {
        assert!((p_value(1.959963984540054) - 0.05).abs() < 1e-9);
        assert!((threshold(0.05, 1) - 1.959963984540054).abs() < 1e-9);
        assert!((upper_tail(3.841458820694124, 1) - 0.05).abs() < 1e-9);
        assert_eq!(z_score(1.0, 0.0, 1.0), 0.0);
        assert_eq!(z_score(2.0, 0.0, 1.0), f64::INFINITY);
        assert_eq!(two_sample_z(1.0, 3.0, 6.0, 4.0), -1.0);
    }

    #[test]
    fn accepts_the_null_and_finds_a_shift() {
        let mut rng = Rng::new(7);
        let zs: Vec<f64> = (0..200).map(|_| nearly_normal(&mut rng)).collect();
        assert!(max_abs_z(&zs, 1e-3).is_ok());
        assert!(chi_square_of_z(&zs) > 1e-3);
        let wide: Vec<f64> = zs.iter().map(|z| 1.4 * z).collect();
        assert!(
            chi_square_of_z(&wide) < 1e-6,
            "a 40% understated error is found"
        );
        let mut outlier = zs.clone();
        outlier[17] = 5.5;
        assert!(max_abs_z(&outlier, 1e-3).is_err());
        outlier[17] = f64::NAN;
        assert!(max_abs_z(&outlier, 1e-3).is_err());
    }
}
