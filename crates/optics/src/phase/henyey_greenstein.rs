//! Henyey–Greenstein (1941): p = (1 − g²) / (4π (1 + g² − 2g cosθ)^{3/2}).

use super::PhaseError;
use super::polar::Polar;
use crate::volume::VolumeGrid;
use glam::DVec3;
use std::f64::consts::PI;

/// Henyey–Greenstein phase function of mean cosine g; g > 0 is forward.
#[derive(Clone, Copy, Debug)]
pub struct HenyeyGreenstein {
    g: f64,
}

impl HenyeyGreenstein {
    /// Isotropic scattering, g = 0.
    pub(super) const ISOTROPIC: Self = HenyeyGreenstein { g: 0.0 };

    /// Creates the phase function for `g` in (−1, 1).
    ///
    /// # Errors
    /// Fails if the mean cosine lies outside (−1, 1).
    pub fn new(g: f64) -> Result<Self, PhaseError> {
        if g.abs() < 1.0 {
            Ok(HenyeyGreenstein { g })
        } else {
            Err(PhaseError::Asymmetry(g))
        }
    }

    /// Returns the phase function with the mean cosine of a grid at `x`.
    #[inline]
    pub(super) fn of_grid(g: &VolumeGrid, x: DVec3) -> Self {
        HenyeyGreenstein { g: g.at(x)[0] }
    }

    /// Returns the mean cosine.
    pub fn g(&self) -> f64 {
        self.g
    }

    /// Returns the density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.density(Polar::from_cos(cos))
    }

    /// Returns ∂ log p/∂g at a cosine.
    pub(crate) fn log_derivative(&self, cos: f64) -> f64 {
        let g = self.g;
        let base = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cos);
        -2.0 * g / ((1.0 - g) * (1.0 + g)) - 3.0 * (g - cos) / base
    }

    /// Computes the density, with 1 + g² − 2g cosθ written as a sum of non-negative terms for
    /// either sign of g.
    fn density(&self, angle: Polar) -> f64 {
        let (g, offset) = if self.g >= 0.0 {
            (self.g, angle.below)
        } else {
            (-self.g, angle.above)
        };
        let base = (1.0 - g) * (1.0 - g) + 2.0 * g * offset;
        (1.0 - g) * (1.0 + g) / (4.0 * PI * base * base.sqrt())
    }

    /// Inverts the cumulative distribution. Let u be the probability of a smaller cosine and D = 1
    /// − g + 2gu. The usual solution is cosθ = (1 + g² − ((1 − g²)/D)²)/(2g). It factors into 1 −
    /// cosθ = 2(1 − g)²(1 − u)(1 + gu)/D² and 1 + cosθ = 2(1 + g)² u (1 − g(1 − u))/D². This form
    /// has no division by g and no cancellation.
    #[inline]
    pub(super) fn angle(&self, u: f64) -> Polar {
        let g = self.g;
        let d = 1.0 - g + 2.0 * g * u;
        let (low, high) = ((1.0 - g) / d, (1.0 + g) / d);
        Polar {
            below: 2.0 * low * low * (1.0 - u) * (1.0 + g * u),
            above: 2.0 * high * high * u * (1.0 - g * (1.0 - u)),
        }
    }

    /// Samples the angle. Returns it with the density of directions there.
    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        let angle = self.angle(u);
        (angle, self.density(angle))
    }

    /// Returns g.
    pub fn mean_cosine(&self) -> f64 {
        self.g
    }
}
