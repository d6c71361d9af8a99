//! 1-D density that is linear between nodes.

use super::cdf::Cdf;
use super::{DistributionError, check_positions, check_values};

/// Density proportional to the linear interpolant of values at nodes.
#[derive(Clone, Debug)]
pub struct PiecewiseLinear {
    nodes: Vec<f64>,
    /// Normalised density at the nodes.
    density: Vec<f64>,
    cdf: Cdf,
}

impl PiecewiseLinear {
    /// Creates the density. `nodes` (two or more) are finite and strictly increasing. There is one
    /// value per node, finite, ≥ 0 and not all zero.
    ///
    /// # Errors
    /// Fails if there are fewer than two nodes, or if nodes are not finite or do not increase.
    /// Fails if the number of values does not match the nodes. Fails if a value is negative or not
    /// finite, or if the values are all zero or too large to be added.
    pub fn new(nodes: Vec<f64>, values: &[f64]) -> Result<Self, DistributionError> {
        check_positions(&nodes)?;
        if values.len() != nodes.len() {
            return Err(DistributionError::Length {
                expected: nodes.len(),
                got: values.len(),
            });
        }
        check_values(values)?;
        let areas = nodes
            .windows(2)
            .zip(values.windows(2))
            .map(|(x, f)| 0.5 * (f[0] + f[1]) * (x[1] - x[0]));
        let cdf = Cdf::new(areas)?;
        let density = values.iter().map(|v| v / cdf.total()).collect();
        Ok(PiecewiseLinear {
            nodes,
            density,
            cdf,
        })
    }

    /// Samples a position. Returns it with its density.
    pub fn sample(&self, u: f64) -> (f64, f64) {
        let (i, r) = self.cdf.locate(u);
        let (f0, f1) = (self.density[i], self.density[i + 1]);
        // Solve f0 t + (f1 − f0) t²/2 = r (f0 + f1)/2, in the form without cancellation. f² is
        // linear in r, so the denominator of the root is f0 plus the density at the sample.
        let f = (f0 * f0 + r * (f1 * f1 - f0 * f0)).max(0.0).sqrt();
        let t = if r > 0.0 {
            (r * (f0 + f1) / (f0 + f)).min(1.0)
        } else {
            0.0
        };
        (self.nodes[i] + t * (self.nodes[i + 1] - self.nodes[i]), f)
    }

    /// Inverts [`PiecewiseLinear::sample`]: returns the `u` that it maps to a position. Returns 0
    /// or 1 for positions below or above all nodes.
    pub fn inverse(&self, x: f64) -> f64 {
        match self.interval(x) {
            Some((i, t)) => {
                let (f0, f1) = (self.density[i], self.density[i + 1]);
                let sum = f0 + f1;
                let r = if sum > 0.0 {
                    t * (2.0 * f0 + t * (f1 - f0)) / sum
                } else {
                    0.0
                };
                self.cdf.unlocate(i, r)
            }
            None if x < self.nodes[0] => 0.0,
            None => 1.0,
        }
    }

    /// Returns the normalised density; 0 outside.
    pub fn pdf(&self, x: f64) -> f64 {
        self.interval(x).map_or(0.0, |(i, t)| {
            (1.0 - t) * self.density[i] + t * self.density[i + 1]
        })
    }

    /// Returns the integral of the interpolant before normalisation.
    pub fn integral(&self) -> f64 {
        self.cdf.total()
    }

    /// Returns the mean position ∫x·pdf(x)dx.
    pub fn mean(&self) -> f64 {
        self.nodes
            .windows(2)
            .zip(self.density.windows(2))
            .map(|(x, f)| {
                let h = x[1] - x[0];
                h * (0.5 * x[0] * (f[0] + f[1]) + h * (f[0] + 2.0 * f[1]) / 6.0)
            })
            .sum()
    }

    /// Returns the memory of the table in bytes.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.density) + self.cdf.memory()
    }

    /// Returns the interval that contains `x`, and the position in it, in [0, 1].
    pub(crate) fn interval(&self, x: f64) -> Option<(usize, f64)> {
        let last = self.nodes.len() - 1;
        if !(self.nodes[0]..=self.nodes[last]).contains(&x) {
            return None;
        }
        let i = (self.nodes.partition_point(|&n| n <= x) - 1).min(last - 1);
        Some((i, (x - self.nodes[i]) / (self.nodes[i + 1] - self.nodes[i])))
    }
}
