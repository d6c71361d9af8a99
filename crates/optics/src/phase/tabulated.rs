//! Phase function from measured or computed values.

use super::PhaseError;
use super::polar::Polar;
use crate::sampling::{DistributionError, PiecewiseLinear};
use std::f64::consts::TAU;

/// Piecewise linear in cosθ, normalised.
#[derive(Clone, Debug)]
pub struct Tabulated(PiecewiseLinear);

impl Tabulated {
    /// `cosines` strictly increasing from −1 to 1, any spacing; `values` ≥ 0, as many, not all zero;
    /// their scale does not matter.
    ///
    /// # Errors
    /// Cosines that do not increase from −1 to 1; values that are not as many, negative, not finite, or all zero.
    pub fn new(cosines: Vec<f64>, values: &[f64]) -> Result<Self, PhaseError> {
        let (first, last) = match (cosines.first(), cosines.last()) {
            (Some(&first), Some(&last)) => (first, last),
            _ => return Err(PhaseError::Table(DistributionError::Empty)),
        };
        if first != -1.0 || last != 1.0 {
            return Err(PhaseError::Span { first, last });
        }
        Ok(Tabulated(PiecewiseLinear::new(cosines, values)?))
    }

    /// Density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.0.pdf(cos) / TAU
    }

    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        let (cos, density) = self.0.sample(u);
        (Polar::from_cos(cos), density / TAU)
    }

    /// The interval of the table that holds a cosine in [−1, 1], and where in it, in [0, 1].
    pub(super) fn interval(&self, cos: f64) -> (usize, f64) {
        self.0.interval(cos).unwrap_or_default()
    }

    /// Bytes of the table.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }

    /// Mean of the cosine.
    pub fn mean_cosine(&self) -> f64 {
        self.0.mean()
    }
}
