//! Isotropic scattering: 1/(4π).

use super::polar::Polar;
use std::f64::consts::PI;

/// Isotropic phase function.
#[derive(Clone, Copy, Debug)]
pub struct Isotropic;

impl Isotropic {
    /// Returns the density 1/(4π) per steradian.
    pub fn pdf(self) -> f64 {
        0.25 / PI
    }

    pub(super) fn sample(self, u: f64) -> (Polar, f64) {
        (Polar::from_below(2.0 * u), self.pdf())
    }
}
