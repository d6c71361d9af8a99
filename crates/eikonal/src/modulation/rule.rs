//! Quadratures along panels, from values and derivatives at both ends and inner values. Their
//! weights minimise the largest error over plane waves along the panel, from the wavelength of the
//! sound upwards (docs/theory.md#tagged-light). `scripts/fit_quadratures.py` computes the numbers.

/// Maximum number of inner values.
pub(super) const MAX_INNER: usize = 3;
/// Number of rules that are accurate enough within panels.
pub(super) const TABULATED_RULES: usize = 3;
/// Maximum number of coefficients of the polynomials within panels.
pub(super) const COEFFICIENTS: usize = TABULATED_RULES + 3;

/// A quadrature on [0, 1].
#[derive(Debug)]
pub(super) struct Rule {
    /// Longest panel, in wavelengths, along which the rule integrates a plane wave to 1e-4.
    pub longest: f64,
    /// Inner places, padded with zeros.
    pub inner: [f64; MAX_INNER],
    /// Number of inner places.
    pub inner_count: usize,
    /// Weights of the inner places, padded with zeros.
    pub weights: [f64; MAX_INNER],
    /// Weight of the sum of the values at the two ends. `slopes` is the weight of the difference of
    /// the derivatives at the ends.
    pub ends: f64,
    pub slopes: f64,
    /// Weights of the inner places in a quadrature without derivatives. `plain_ends` is the weight
    /// of the values at the ends.
    pub plain_weights: [f64; MAX_INNER],
    pub plain_ends: f64,
    /// Largest difference of the two quadratures, in units of m, if m is as smooth as a wave: 1.5
    /// times the difference along the longest panel.
    pub allowed: f64,
    /// Longest panel, in wavelengths, along which the rule integrates a plane wave up to any place
    /// x to 1e-3; 0 for rules that are not used within panels.
    pub longest_within: f64,
    /// Coefficients of the integral ∫₀ˣ over x as a polynomial in x. They apply to the value and
    /// the derivative at the start, the value and the derivative at the end, and the inner values.
    pub within: Polynomials,
}

/// Coefficients of powers of x, for each known value.
type Polynomials = [[f64; COEFFICIENTS]; COEFFICIENTS];

/// Rules by their number of inner values.
pub(super) const RULES: [Rule; MAX_INNER + 1] = [
    Rule {
        longest: 0.12,
        inner: [0.0, 0.0, 0.0],
        inner_count: 0,
        weights: [0.0, 0.0, 0.0],
        ends: 0.499_971_71,
        slopes: 0.084_126_59,
        plain_weights: [0.0, 0.0, 0.0],
        plain_ends: 0.512_100_94,
        allowed: 3.6e-2,
        longest_within: 0.12,
        within: [
            [1.0, 0.0, -0.981_267_315, 0.486_952_185, 0.0, 0.0],
            [0.0, 0.503_872_459, -0.661_220_63, 0.244_434_521, 0.0, 0.0],
            [0.0, -0.000_451_365, 0.981_956_4, -0.487_246_403, 0.0, 0.0],
            [0.0, -0.005_245_211, -0.315_966_884, 0.240_045_253, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ],
    },
    Rule {
        longest: 0.5,
        inner: [0.5, 0.0, 0.0],
        inner_count: 1,
        weights: [0.524_223_92, 0.0, 0.0],
        ends: 0.237_862_15,
        slopes: 0.017_896_6,
        plain_weights: [0.640_990_69, 0.0, 0.0],
        plain_ends: 0.181_690_11,
        allowed: 6.6e-3,
        longest_within: 0.5,
        within: [
            [
                1.0,
                0.044_840_955,
                -3.675_906_25,
                4.396_165_644,
                -1.527_846_145,
                0.0,
            ],
            [
                0.0,
                0.511_121_834,
                -1.290_081_87,
                1.126_859_621,
                -0.330_285_255,
                0.0,
            ],
            [
                0.0,
                -0.015_894_535,
                -1.626_463_697,
                3.501_857_7,
                -1.622_693_375,
                0.0,
            ],
            [
                0.0,
                0.027_394_746,
                0.257_644_626,
                -0.689_853_67,
                0.387_195_299,
                0.0,
            ],
            [0.0, 0.0, 5.178_470_984, -7.733_526_437, 3.081_434_565, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ],
    },
    Rule {
        longest: 1.07,
        inner: [0.317_9, 0.682_1, 0.0],
        inner_count: 2,
        weights: [0.353_658_9, 0.353_658_9, 0.0],
        ends: 0.146_321_38,
        slopes: 0.006_677_35,
        plain_weights: [0.367_678_36, 0.367_678_36, 0.0],
        plain_ends: 0.146_589_18,
        allowed: 4.3e-2,
        longest_within: 0.8,
        within: [
            [
                1.0,
                0.266_329_95,
                -10.484_724_805,
                21.711_191_016,
                -17.095_785_524,
                4.746_734_256,
            ],
            [
                0.0,
                0.564_271_544,
                -2.428_406_549,
                3.926_163_898,
                -2.774_521_348,
                0.718_717_589,
            ],
            [
                0.0,
                -0.088_931_66,
                3.313_596_663,
                -12.719_500_624,
                15.764_202_286,
                -6.121_862_973,
            ],
            [
                0.0,
                0.015_379_442,
                -0.529_263_388,
                2.051_973_736,
                -2.633_219_254,
                1.088_390_163,
            ],
            [
                0.0,
                -0.531_426_532,
                15.624_179_667,
                -38.332_592_52,
                34.004_218_279,
                -10.407_225_346,
            ],
            [
                0.0,
                0.283_909_472,
                -7.984_850_965,
                28.240_388_476,
                -31.572_807_148,
                11.384_455_71,
            ],
        ],
    },
    Rule {
        // Planted error "panels of sound longer than their rules reach", found by morgana-eikonal/lib::modulation::rule::tests::plane_waves_are_integrated_to_a_ten_thousandth:
        // longest: 2.3,
        longest: 1.77,
        inner: [0.225_9, 0.5, 0.774_1],
        inner_count: 3,
        weights: [0.255_149_64, 0.283_285_19, 0.255_149_64],
        ends: 0.103_180_91,
        slopes: 0.003_323_06,
        plain_weights: [0.275_881_34, 0.269_785_73, 0.275_881_34],
        plain_ends: 0.096_880_43,
        allowed: 2.3e-2,
        longest_within: 0.0,
        within: [[0.0; COEFFICIENTS]; COEFFICIENTS],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A plane wave along a panel in a phase, with its derivative and integral.
    struct Wave {
        k: f64,
        phase: f64,
    }

    impl Wave {
        /// Returns waves of all wavelengths up to the longest panel, in several phases.
        fn all(longest: f64) -> impl Iterator<Item = Wave> {
            (0..=200).flat_map(move |i| {
                let k = TAU * longest * f64::from(i) / 200.0;
                [0.0, 0.4, 1.1, 2.3].map(|phase| Wave { k, phase })
            })
        }

        fn angle(&self, x: f64) -> f64 {
            self.k * (x - 0.5) + self.phase
        }

        fn at(&self, x: f64) -> f64 {
            self.angle(x).cos()
        }

        fn slope(&self, x: f64) -> f64 {
            -self.k * self.angle(x).sin()
        }

        fn until(&self, x: f64) -> f64 {
            let half = 0.5 * self.k * x;
            let mean = if half == 0.0 { 1.0 } else { half.sin() / half };
            x * mean * self.at(0.5 * x)
        }
    }

    #[test]
    fn plane_waves_are_integrated_to_a_ten_thousandth() {
        for rule in &RULES {
            for wave in Wave::all(rule.longest) {
                let inner = |weights: &[f64; MAX_INNER]| {
                    let terms = rule.inner.iter().zip(weights);
                    terms.map(|(x, w)| w * wave.at(*x)).sum::<f64>()
                };
                let ends = wave.at(0.0) + wave.at(1.0);
                let slopes = rule.slopes * (wave.slope(0.0) - wave.slope(1.0));
                let found = rule.ends * ends + slopes + inner(&rule.weights);
                let plain = rule.plain_ends * ends + inner(&rule.plain_weights);
                assert!((found - wave.until(1.0)).abs() < 1e-4, "{}", wave.k);
                assert!((found - plain).abs() < rule.allowed / 1.4, "{}", wave.k);
            }
        }
    }

    #[test]
    fn plane_waves_are_integrated_up_to_any_place_to_a_thousandth() {
        for rule in &RULES[..TABULATED_RULES] {
            for wave in Wave::all(rule.longest_within) {
                let ends = [0.0, 1.0].map(|x| [wave.at(x), wave.slope(x)]);
                let inner = rule.inner.iter().map(|x| wave.at(*x));
                let known: Vec<_> = ends.into_iter().flatten().chain(inner).collect();
                for x in [0.05, 0.1, 0.35, 0.5, 0.8, 1.0] {
                    let integral = |powers: &[f64; COEFFICIENTS]| {
                        powers.iter().rev().fold(0.0, |sum, c| sum * x + c) * x
                    };
                    let terms = known.iter().zip(&rule.within);
                    let found: f64 = terms.map(|(value, powers)| value * integral(powers)).sum();
                    assert!((found - wave.until(x)).abs() < 1e-3, "{}, {x}", wave.k);
                }
            }
        }
    }
}
