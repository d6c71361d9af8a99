//! Mie's series for the light scattered by a sphere.
//!
//! Theory: docs/theory.md#mie-scattering.

use num_complex::Complex64;

/// Number of additional orders at which the downward recurrence of logarithmic derivatives starts.
/// It starts from zero, and needs them to converge.
const EXTRA_ORDERS: usize = 16;

/// Partial waves of a sphere.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Size parameter.
    x: f64,
    /// Electric and magnetic coefficients aₙ and bₙ, from n = 1.
    coefficients: Vec<[Complex64; 2]>,
}

/// Angular functions πₙ and τₙ at a cosine, from n = 1.
pub(super) struct Angular(Vec<[f64; 2]>);

impl Series {
    /// Computes the series of a sphere with a circumference of `x` wavelengths in the surrounding
    /// medium. `m` is its index relative to the medium, with a positive imaginary part if it
    /// absorbs.
    pub(super) fn new(x: f64, m: Complex64) -> Self {
        // Compute logarithmic derivatives and Riccati–Bessel functions.
        let terms = terms(x);
        let inner = logarithmic_derivatives(m * x, terms);
        let psi = riccati_bessel(x, terms);
        // Start with χ of the orders n = −1 and 0.
        let (mut chi_before, mut chi) = (-x.sin(), x.cos());
        let mut coefficients = Vec::with_capacity(terms);
        for n in 1..=terms {
            let order = n as f64;
            let next = (2.0 * order - 1.0) / x * chi - chi_before;
            (chi_before, chi) = (chi, next);
            let xi = [(psi[n - 1], chi_before), (psi[n], chi)];
            let [xi_before, xi] = xi.map(|(psi, chi)| Complex64::new(psi, -chi));
            let of = |factor: Complex64| {
                let factor = factor + order / x;
                (factor * psi[n] - psi[n - 1]) / (factor * xi - xi_before)
            };
            // Planted error "spheres whose magnetic waves have the index of electric ones", found by morgana-transport/transport::polarization::mie::slabs_of_spheres_agree_with_electric_fields:
            // coefficients.push([of(inner[n] / m), of(inner[n])]);
            coefficients.push([of(inner[n] / m), of(inner[n] * m)]);
        }
        Series { x, coefficients }
    }

    /// Returns the number of partial waves.
    pub(super) fn terms(&self) -> usize {
        self.coefficients.len()
    }

    /// Returns the extinction over the cross-section πr².
    pub(super) fn extinction(&self) -> f64 {
        self.sum(|[a, b]| a.re + b.re)
    }

    /// Returns the scattering over the cross-section πr².
    pub(super) fn scattering(&self) -> f64 {
        self.sum(|[a, b]| a.norm_sqr() + b.norm_sqr())
    }

    fn sum(&self, of: impl Fn([Complex64; 2]) -> f64) -> f64 {
        let terms = self.coefficients.iter().zip(1..);
        let sum: f64 = terms.map(|(&c, n)| f64::from(2 * n + 1) * of(c)).sum();
        2.0 / (self.x * self.x) * sum
    }

    /// Returns the amplitudes S₁ and S₂ of fields across and in the plane of scattering.
    pub(super) fn amplitudes(&self, angular: &Angular) -> [Complex64; 2] {
        let mut sums = [Complex64::ZERO; 2];
        for ((&[a, b], &[pi, tau]), n) in self.coefficients.iter().zip(&angular.0).zip(1..) {
            let n = f64::from(n);
            let weight = (2.0 * n + 1.0) / (n * (n + 1.0));
            let [pi, tau] = [weight * pi, weight * tau];
            sums[0] += a * pi + b * tau;
            sums[1] += a * tau + b * pi;
        }
        sums
    }
}

impl Angular {
    /// Computes the functions for the first `terms` orders.
    pub(super) fn new(cos: f64, terms: usize) -> Self {
        let (mut before, mut pi) = (0.0, 1.0);
        let functions = (1..=terms).map(|n| {
            let n = n as f64;
            let tau = n * cos * pi - (n + 1.0) * before;
            let found = [pi, tau];
            let next = ((2.0 * n + 1.0) * cos * pi - (n + 1.0) * before) / n;
            (before, pi) = (pi, next);
            found
        });
        Angular(functions.collect())
    }
}

/// Returns the number of partial waves that contribute (Wiscombe 1980).
fn terms(x: f64) -> usize {
    let cube_root = x.cbrt();
    let beyond = if x <= 8.0 {
        4.0 * cube_root + 1.0
    } else {
        4.05 * cube_root + 2.0
    };
    (x + beyond).ceil() as usize
}

/// Computes ψₙ′(z)/ψₙ(z) of Riccati–Bessel functions for n from 0 to `count`, by downward
/// recurrence, which is stable.
fn logarithmic_derivatives(z: Complex64, count: usize) -> Vec<Complex64> {
    let start = count.max(terms(z.norm())) + EXTRA_ORDERS;
    let mut kept = vec![Complex64::ZERO; count + 1];
    let mut derivative = Complex64::ZERO;
    for n in (1..=start).rev() {
        let ratio = n as f64 / z;
        derivative = ratio - 1.0 / (derivative + ratio);
        if n <= count + 1 {
            kept[n - 1] = derivative;
        }
    }
    kept
}

/// Computes ψₙ(x) = x jₙ(x) for n from 0 to `terms`.
fn riccati_bessel(x: f64, terms: usize) -> Vec<f64> {
    let mut psi = vec![x.sin()];
    if x < 1.0 {
        // Use ratios, which do not cancel.
        let derivatives = logarithmic_derivatives(x.into(), terms);
        for n in 1..=terms {
            psi.push(psi[n - 1] / (derivatives[n].re + n as f64 / x));
        }
        return psi;
    }
    psi.push(psi[0] / x - x.cos());
    for n in 2..=terms {
        psi.push((2 * n - 1) as f64 / x * psi[n - 1] - psi[n - 2]);
    }
    psi
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    impl Series {
        /// Returns the mean cosine, from products of coefficients.
        pub(in super::super) fn mean_cosine(&self) -> f64 {
            let pairs = self.coefficients.windows(2).zip(1..);
            let neighbours = pairs.map(|(pair, n)| {
                let n = f64::from(n);
                let products = [0, 1].map(|k| (pair[0][k] * pair[1][k].conj()).re);
                n * (n + 2.0) / (n + 1.0) * (products[0] + products[1])
            });
            let own = self.coefficients.iter().zip(1..).map(|([a, b], n)| {
                let n = f64::from(n);
                (2.0 * n + 1.0) / (n * (n + 1.0)) * (a * b.conj()).re
            });
            let sum = neighbours.sum::<f64>() + own.sum::<f64>();
            4.0 * sum / (self.x * self.x * self.scattering())
        }

        /// Returns the backscattering efficiency 4 |S(π)|²/x².
        fn backscattering(&self) -> f64 {
            let [s1, _] = self.amplitudes(&Angular::new(-1.0, self.terms()));
            4.0 * s1.norm_sqr() / (self.x * self.x)
        }
    }

    /// Compares efficiencies of extinction, scattering and backscattering, and the mean cosine. The
    /// first case is from C. F. Bohren and D. R. Huffman, Absorption and Scattering of Light by
    /// Small Particles, 1983, appendix A. The cases with size parameters of 10, 100, 0.055, 56 and
    /// 1 are from W. J. Wiscombe, Mie scattering calculations, NCAR/TN-140+STR, 1979. The digits of
    /// all cases except the first are from miepython 3.3.0.
    #[test]
    fn agrees_with_published_efficiencies() {
        #[rustfmt::skip]
        let published = [
            (1.55, 0.0, 2.0 * PI * 0.525 / 0.6328, [3.105_43, 3.105_43, 2.925_34, 0.633_136_76]),
            (1.5, 0.0, 10.0, [2.881_999, 2.881_999, 1.695_063_6, 0.742_912_9]),
            (1.5, 0.0, 1000.0, [2.013_944_6, 2.013_944_6, 10.303_087, 0.827_881_96]),
            (1.33, 1e-5, 100.0, [2.101_320_7, 2.096_593_5, 2.146_326_5, 0.868_959_27]),
            (1.5, 1.0, 0.055, [0.101_491_03, 1.131_687_2e-5, 1.695_493_2e-5, 0.000_491_172_88]),
            (1.5, 1.0, 56.0, [2.143_188_1, 1.299_225_1, 0.172_434_28, 0.850_411_81]),
            (10.0, 10.0, 1.0, [2.532_993_1, 2.049_405, 3.308_996_5, -0.110_664_36]),
            (0.75, 0.0, 10.0, [2.232_264_8, 2.232_264_8, 0.046_584_41, 0.896_472_55]),
            (1.19, 0.0, 2.5, [0.392_401_88, 0.392_401_88, 0.057_527_46, 0.732_283_16]),
            (1.33, 0.0, 1e-3, [1.109_888_1e-13, 1.109_888_1e-13, 1.664_831_4e-13, 1.832_778_2e-7]),
            (1.5, 0.0, 4.0 * PI, [2.594_713_7, 2.594_713_7, 9.761_412_9, 0.671_999_63]),
        ];
        for (n, k, x, expected) in published {
            let s = Series::new(x, Complex64::new(n, k));
            let found = [
                s.extinction(),
                s.scattering(),
                s.backscattering(),
                s.mean_cosine(),
            ];
            for (a, b) in found.iter().zip(expected) {
                assert!((a / b - 1.0).abs() < 3e-6, "{n} + {k}i, {x}: {a} {b}");
            }
        }
    }

    /// Compares with amplitudes of miepython 3.3.0, which gives twice their conjugates, because its
    /// fields vary as e^(iωt).
    #[test]
    fn agrees_with_published_amplitudes() {
        let c = Complex64::new;
        let sphere = Series::new(10.0, c(1.5, 0.1));
        for (cos, s1, s2) in [
            (
                0.5,
                c(-1.387_510_26, -6.299_037_46),
                c(-0.056_355_69, -3.185_823_59),
            ),
            (
                0.0,
                c(2.702_100_18, -0.834_499_93),
                c(-2.045_102_50, -1.582_505_47),
            ),
            (
                -0.7,
                c(-0.701_308_39, 2.255_322_99),
                c(2.025_127_20, -1.377_993_59),
            ),
        ] {
            let found = sphere.amplitudes(&Angular::new(cos, sphere.terms()));
            assert!((found[0] - 0.5 * s1).norm() < 1e-7, "{cos}: {found:?}");
            assert!((found[1] - 0.5 * s2).norm() < 1e-7, "{cos}: {found:?}");
        }
    }

    /// Tests that small spheres are dipoles: S₂ = S₁ cos θ, Q = 8x⁴/3 |(m² − 1)/(m² + 2)|² for
    /// scattering, and 4x Im (m² − 1)/(m² + 2) for absorption.
    #[test]
    fn small_spheres_are_dipoles() {
        let m = Complex64::new(1.4, 0.3);
        let x = 1e-5;
        let sphere = Series::new(x, m);
        let dipole = (m * m - 1.0) / (m * m + 2.0);
        let scattered = 8.0 / 3.0 * x.powi(4) * dipole.norm_sqr();
        assert!((sphere.scattering() / scattered - 1.0).abs() < 1e-9);
        assert!((sphere.extinction() / (4.0 * x * dipole.im) - 1.0).abs() < 1e-9);
        for cos in [-0.9, 0.2, 0.7] {
            let [s1, s2] = sphere.amplitudes(&Angular::new(cos, sphere.terms()));
            assert!((s2 / s1 - cos).norm() < 1e-9);
        }
    }
}
