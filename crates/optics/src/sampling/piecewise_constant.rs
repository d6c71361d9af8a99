//! 1-D density that is constant on each of several intervals.

use super::cdf::Cdf;
use super::{DistributionError, check_positions, check_values};

/// Density proportional to values given on intervals.
#[derive(Clone, Debug)]
pub struct PiecewiseConstant {
    edges: Vec<f64>,
    cdf: Cdf,
}

impl PiecewiseConstant {
    /// Creates the density. `edges` are finite and strictly increasing, one more than `values`. The
    /// values are finite, ≥ 0 and not all zero.
    ///
    /// # Errors
    /// Fails if there are fewer than two edges, or if edges are not finite or do not increase.
    /// Fails if the number of values does not match the bins. Fails if a value is negative or not
    /// finite, or if the values are all zero or too large to be added.
    pub fn new(edges: Vec<f64>, values: &[f64]) -> Result<Self, DistributionError> {
        check_positions(&edges)?;
        if values.len() + 1 != edges.len() {
            return Err(DistributionError::Length {
                expected: edges.len() - 1,
                got: values.len(),
            });
        }
        check_values(values)?;
        let cdf = Cdf::new(edges.windows(2).zip(values).map(|(e, v)| v * (e[1] - e[0])))?;
        Ok(PiecewiseConstant { edges, cdf })
    }

    /// Samples a position. Returns it with its density.
    pub fn sample(&self, u: f64) -> (f64, f64) {
        let (i, t) = self.cdf.locate(u);
        let (a, b) = (self.edges[i], self.edges[i + 1]);
        (a + t * (b - a), self.cdf.probability(i) / (b - a))
    }

    /// Inverts [`PiecewiseConstant::sample`]: returns the `u` that it maps to a position. Returns 0
    /// or 1 for positions below or above all intervals.
    pub fn inverse(&self, x: f64) -> f64 {
        match self.interval(x) {
            Some(i) => {
                let (a, b) = (self.edges[i], self.edges[i + 1]);
                self.cdf.unlocate(i, (x - a) / (b - a))
            }
            None if x < self.edges[0] => 0.0,
            None => 1.0,
        }
    }

    /// Returns the normalised density; 0 outside.
    pub fn pdf(&self, x: f64) -> f64 {
        self.interval(x).map_or(0.0, |i| {
            self.cdf.probability(i) / (self.edges[i + 1] - self.edges[i])
        })
    }

    /// Returns the integral of the values before normalisation.
    pub fn integral(&self) -> f64 {
        self.cdf.total()
    }

    fn interval(&self, x: f64) -> Option<usize> {
        let last = self.edges.len() - 1;
        if !(self.edges[0]..=self.edges[last]).contains(&x) {
            return None;
        }
        Some((self.edges.partition_point(|&e| e <= x) - 1).min(last - 1))
    }
}
