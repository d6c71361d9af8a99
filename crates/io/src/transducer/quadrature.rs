//! Quadrature points and weights on lengths and circles (docs/theory.md#transducers).

use std::f64::consts::{PI, TAU};

/// Scales on which the integrand e^{−ikR}/R varies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Density {
    /// Wavelength of the sound.
    pub wavelength: f64,
    /// Smallest distance R.
    pub distance: f64,
}

/// Accuracy of integrals: relative errors are about e^(−`DIGITS`).
const DIGITS: f64 = 5.0;

impl Density {
    /// Returns the number of Gauss–Legendre points along a length. It is half the phase in radians
    /// between middle and end, plus the points for the pole at R = 0. The pole limits the ellipse
    /// of convergence.
    pub(super) fn along(&self, length: f64) -> f64 {
        let phase = PI * length / self.wavelength;
        let pole = 0.5 * DIGITS / (2.0 * self.distance / length).asinh();
        (0.5 * phase + 1.6 * phase.cbrt() + pole + 1.0).ceil()
    }

    /// Returns the degree of polynomials that represent the sound along a length.
    pub(super) fn degree(&self, length: f64) -> f64 {
        2.0 * self.along(length) - 1.0
    }

    /// Returns the number of points around a circle. The phase has as many harmonics as the circle
    /// has wavelengths, and the pole lies at distance R from the circle.
    pub(super) fn around(&self, radius: f64) -> f64 {
        let phase = TAU * radius / self.wavelength;
        let pole = DIGITS / (self.distance / radius).asinh();
        (phase + 3.2 * phase.cbrt() + pole + 2.0).ceil()
    }
}

/// Returns points and weights of the Gauss–Legendre rule with n points on [0, length]. Newton's
/// method finds the roots of Pₙ, starting from Tricomi's estimate.
pub(super) fn gauss_legendre(n: usize, length: f64) -> impl Iterator<Item = [f64; 2]> {
    (1..=n).map(move |i| {
        let (n, i) = (n as f64, i as f64);
        let mut x =
            (1.0 - 0.125 / (n * n) + 0.125 / (n * n * n)) * (PI * (i - 0.25) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..4 {
            let [value, below] = legendre(n as usize, x);
            slope = n * (below - x * value) / (1.0 - x * x);
            x -= value / slope;
        }
        let weight = 2.0 / ((1.0 - x * x) * slope * slope);
        [0.5 * length * (1.0 + x), 0.5 * length * weight]
    })
}

/// Returns Pₙ(x) and Pₙ₋₁(x).
fn legendre(n: usize, x: f64) -> [f64; 2] {
    (1..=n).fold([1.0, 0.0], |[p, below], k| {
        let k = k as f64;
        [((2.0 * k - 1.0) * x * p - (k - 1.0) * below) / k, p]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that the rule with n points integrates x^(2n−1) exactly.
    #[test]
    fn polynomials_are_integrated_exactly() {
        for n in [1, 2, 5, 16, 101] {
            let power = 2 * n as i32 - 1;
            let sum: f64 = gauss_legendre(n, 1.0).map(|[x, w]| w * x.powi(power)).sum();
            let exact = 1.0 / f64::from(power + 1);
            assert!((sum / exact - 1.0).abs() < 1e-12, "{n}: {sum} {exact}");
        }
    }
}
