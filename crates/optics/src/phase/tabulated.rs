//! Phase function from measured or computed values.

use super::PhaseError;
use super::polar::Polar;
use crate::sampling::{DistributionError, PiecewiseLinear};
use std::f64::consts::TAU;

/// Phase function that is piecewise linear in cosθ, normalised.
#[derive(Clone, Debug)]
pub struct Tabulated(PiecewiseLinear);

impl Tabulated {
    /// Creates the phase function. `cosines` are strictly increasing from −1 to 1, with any
    /// spacing. There is one value per cosine, ≥ 0 and not all zero; the scale of the values is
    /// arbitrary.
    ///
    /// # Errors
    /// Fails if the cosines do not increase from −1 to 1, or if the number of values does not
    /// match. Fails if a value is negative or not finite, or if all are zero.
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

    /// Returns the density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.0.pdf(cos) / TAU
    }

    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        let (cos, density) = self.0.sample(u);
        (Polar::from_cos(cos), density / TAU)
    }

    /// Returns the interval of the table that contains a cosine in [−1, 1], and the position in it,
    /// in [0, 1].
    pub(super) fn interval(&self, cos: f64) -> (usize, f64) {
        self.0.interval(cos).unwrap_or_default()
    }

    /// Returns the memory of the table in bytes.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }

    /// Returns the mean cosine.
    pub fn mean_cosine(&self) -> f64 {
        self.0.mean()
    }
}
