//! Running mean and variance.

/// Mean, variance and standard error of a stream of numbers (Welford's update).
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    count: u64,
    mean: f64,
    m2: f64,
}

impl Moments {
    /// Adds one value.
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let delta = x - self.mean;
        self.mean += delta / self.count as f64;
        self.m2 += delta * (x - self.mean);
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Sample mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased sample variance; infinite for fewer than two values.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            f64::INFINITY
        } else {
            self.m2 / (self.count - 1) as f64
        }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1) as f64).sqrt()
    }

    /// Returns (mean − expected) / standard error; see [`crate::z_test::z_score`].
    pub fn z(&self, expected: f64) -> f64 {
        crate::z_test::z_score(self.mean(), self.standard_error(), expected)
    }
}

#[cfg(test)]
mod tests {
    use super::Moments;

    #[test]
    fn matches_the_definition() {
        let mut m = Moments::default();
        [1.0, 2.0, 4.0, 9.0].into_iter().for_each(|x| m.push(x));
        assert_eq!(m.mean(), 4.0);
        assert!((m.variance() - 38.0 / 3.0).abs() < 1e-14);
        assert!((m.standard_error() - (38.0 / 12.0f64).sqrt()).abs() < 1e-14);
    }
}
