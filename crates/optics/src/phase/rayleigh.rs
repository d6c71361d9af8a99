//! Rayleigh (1871): p = 3 (1 + cos²θ) / (16π), for unpolarised light scattered by particles much
//! smaller than the wavelength.

use super::polar::Polar;
use crate::mueller::PlaneMueller;
use std::f64::consts::PI;

/// Rayleigh scattering of unpolarised light.
#[derive(Clone, Copy, Debug)]
pub struct Rayleigh;

impl Rayleigh {
    /// Returns the density per steradian.
    pub fn pdf(self, cos: f64) -> f64 {
        3.0 / (16.0 * PI) * (1.0 + cos * cos)
    }

    /// Returns the matrix of an oscillating dipole: the field perpendicular to the plane of
    /// scattering is preserved, and the field in the plane is projected.
    pub(super) fn mueller(cos: f64) -> PlaneMueller {
        PlaneMueller::of_real_amplitudes(1.0, cos)
    }

    /// Inverts the cumulative distribution (4 + 3μ + μ³)/8 of μ = cosθ by Cardano's formula. With z
    /// = 4u − 2, μ³ + 3μ = 2z has a single real root μ = a − 1/a, a³ = z + √(z² + 1).
    pub(super) fn sample(self, u: f64) -> (Polar, f64) {
        let z = 4.0 * u - 2.0;
        // Use |z|, so that nothing cancels.
        let a = libm::cbrt(z.abs() + (z * z + 1.0).sqrt());
        let cos = (a - 1.0 / a).clamp(0.0, 1.0).copysign(z);
        (Polar::from_cos(cos), self.pdf(cos))
    }
}
