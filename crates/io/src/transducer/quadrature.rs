//! Points and weights of integrals over lengths and circles (docs/theory.md#transducers).

use std::f64::consts::{PI, TAU};

/// What the integrand e^{−ikR}/R varies with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Density {
    /// Of the sound.
    pub wavelength: f64,
    /// The least distance R.
    pub distance: f64,
}

/// Relative errors of integrals are some e^(−`DIGITS`).
const DIGITS: f64 = 5.0;

impl Density {
    /// Number of Gauss–Legendre points along a length: half of the phase in radians between middle and end, and as many as the pole
    /// at R = 0 wants, about which the ellipse of convergence passes.
    pub(super) fn along(&self, length: f64) -> f64 {
        let phase = PI * length / self.wavelength;
        let pole = 0.5 * DIGITS / (2.0 * self.distance / length).asinh();
        (0.5 * phase + 1.6 * phase.cbrt() + pole + 1.0).ceil()
    }

    /// Degree of polynomials that the sound is along a length.
    pub(super) fn degree(&self, length: f64) -> f64 {
        2.0 * self.along(length) - 1.0
    }

    /// Number of points around a circle: the phase has as many harmonics as the circle has wavelengths; the pole lies R from it.
    pub(super) fn around(&self, radius: f64) -> f64 {
        let phase = TAU * radius / self.wavelength;
        let pole = DIGITS / (self.distance / radius).asinh();
        (phase + 3.2 * phase.cbrt() + pole + 2.0).ceil()
    }
}

/// Places and weights of the Gauss–Legendre rule with n points on [0, length]: roots of Pₙ by Newton's method from Tricomi's guess.
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

/// Pₙ(x) and Pₙ₋₁(x).
fn legendre(n: usize, x: f64) -> [f64; 2] {
    (1..=n).fold([1.0, 0.0], |[p, below], k| {
        let k = k as f64;
        [((2.0 * k - 1.0) * x * p - (k - 1.0) * below) / k, p]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rule with n points integrates x^(2n−1) exactly.
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
