//! Von Mises–Fisher: p = κ exp(κ(cosθ − 1)) / (2π (1 − e^{−2κ})).
//!
//! It is computed from 1 − cosθ with expm1 and log1p. Hence it neither overflows for κ = 1e6 nor
//! loses digits as κ → 0 (after Jakob, "Numerically stable sampling of the von Mises–Fisher
//! distribution on S²", 2012).

use super::PhaseError;
use super::polar::Polar;
use std::f64::consts::PI;

/// Von Mises–Fisher distribution around the forward direction.
#[derive(Clone, Copy, Debug)]
pub struct VonMisesFisher {
    kappa: f64,
    /// Density at cosθ = 1.
    peak: f64,
}

impl VonMisesFisher {
    /// Creates the distribution for `kappa`, finite and ≥ 0; 0 is isotropic.
    ///
    /// # Errors
    /// Fails if the concentration is negative or not finite.
    pub fn new(kappa: f64) -> Result<Self, PhaseError> {
        if !(kappa.is_finite() && kappa >= 0.0) {
            return Err(PhaseError::Concentration(kappa));
        }
        let peak = if kappa > 0.0 {
            kappa / (-2.0 * PI * (-2.0 * kappa).exp_m1())
        } else {
            0.25 / PI
        };
        Ok(VonMisesFisher { kappa, peak })
    }

    /// Returns the density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.density(Polar::from_cos(cos))
    }

    fn density(&self, angle: Polar) -> f64 {
        self.peak * (-self.kappa * angle.below).exp()
    }

    /// Inverts P(1 − cosθ < w) = (1 − e^{−κw})/(1 − e^{−2κ}).
    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        let below = if self.kappa > 0.0 {
            -(u * (-2.0 * self.kappa).exp_m1()).ln_1p() / self.kappa
        } else {
            2.0 * u
        };
        let angle = Polar::from_below(below);
        (angle, self.density(angle))
    }

    /// Returns the mean cosine coth κ − 1/κ.
    pub fn mean_cosine(&self) -> f64 {
        let k = self.kappa;
        if k < 0.1 {
            // Use the Taylor series, because the two terms cancel here.
            let k2 = k * k;
            return k / 3.0 * (1.0 - k2 / 15.0 * (1.0 - 2.0 * k2 / 21.0 * (1.0 - k2 / 10.0)));
        }
        1.0 / k.tanh() - 1.0 / k
    }
}
