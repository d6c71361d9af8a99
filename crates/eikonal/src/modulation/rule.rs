//! Quadratures along panels: with n inner values, and values and derivatives at both ends, they are exact for polynomials of degree 2n + 3
//! (docs/theory.md#tagged-light).

/// The most inner values.
pub(super) const MOST_INNER: usize = 3;
/// So many of the rules are fine enough for what is asked for within panels.
pub(super) const TABULATED: usize = 3;

/// A quadrature on [0, 1].
pub(super) struct Rule {
    /// The longest panel, in wavelengths: a plane wave is integrated along it to 1e-4.
    pub longest: f64,
    /// Inner places.
    pub inner: &'static [f64],
    /// Their weights.
    pub weights: &'static [f64],
    /// Weight of both ends, and of the difference of the derivatives there.
    pub ends: f64,
    pub slopes: f64,
    /// The weights of the same places without derivatives.
    pub plain_weights: &'static [f64],
    pub plain_ends: f64,
    /// By how much, in units of m, the two differ at most if m is as smooth as a wave: half as much again as along the longest panel.
    pub allowed: f64,
}

/// √(1/28) and √(1/12), by which inner places lie off the middle.
const TWO: f64 = 0.188_982_236_504_613_6;
const THREE: f64 = 0.288_675_134_594_812_9;

/// By the number of inner values.
pub(super) const RULES: [Rule; MOST_INNER + 1] = [
    Rule {
        longest: 0.082,
        inner: &[],
        weights: &[],
        ends: 1.0 / 2.0,
        slopes: 1.0 / 12.0,
        plain_weights: &[],
        plain_ends: 1.0 / 2.0,
        allowed: 3.3e-2,
    },
    Rule {
        longest: 0.315,
        inner: &[0.5],
        weights: &[8.0 / 15.0],
        ends: 7.0 / 30.0,
        slopes: 1.0 / 60.0,
        plain_weights: &[2.0 / 3.0],
        plain_ends: 1.0 / 6.0,
        allowed: 7.6e-3,
    },
    Rule {
        longest: 0.64,
        inner: &[0.5 - TWO, 0.5 + TWO],
        weights: &[49.0 / 135.0, 49.0 / 135.0],
        ends: 37.0 / 270.0,
        slopes: 1.0 / 180.0,
        plain_weights: &[7.0 / 18.0, 7.0 / 18.0],
        plain_ends: 1.0 / 9.0,
        allowed: 2.9e-2,
    },
    Rule {
        longest: 1.02,
        inner: &[0.5 - THREE, 0.5, 0.5 + THREE],
        weights: &[9.0 / 35.0, 32.0 / 105.0, 9.0 / 35.0],
        ends: 19.0 / 210.0,
        slopes: 1.0 / 420.0,
        plain_weights: &[3.0 / 10.0, 4.0 / 15.0, 3.0 / 10.0],
        plain_ends: 1.0 / 15.0,
        allowed: 1.8e-2,
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Σ of weights times values of a function, with derivatives and without.
    fn sums(rule: &Rule, f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> [f64; 2] {
        let inner = |weights: &[f64]| {
            let terms = rule.inner.iter().zip(weights);
            terms.map(|(x, w)| w * f(*x)).sum::<f64>()
        };
        let (ends, slopes) = (f(0.0) + f(1.0), slope(0.0) - slope(1.0));
        [
            rule.ends * ends + rule.slopes * slopes + inner(rule.weights),
            rule.plain_ends * ends + inner(rule.plain_weights),
        ]
    }

    #[test]
    fn polynomials_are_exact() {
        for (n, rule) in RULES.iter().enumerate() {
            for degree in 0..=2 * n as i32 + 3 {
                let power = |x: f64, p: i32| if p < 0 { 0.0 } else { x.powi(p) };
                let slope = |x: f64| f64::from(degree) * power(x, degree - 1);
                let [found, plain] = sums(rule, |x| power(x, degree), slope);
                let expected = 1.0 / f64::from(degree + 1);
                assert!((found - expected).abs() < 1e-15, "{n}, {degree}");
                let exact = degree <= n as i32 + 1;
                assert!(!exact || (plain - expected).abs() < 1e-15, "{n}, {degree}");
            }
        }
    }

    /// In any phase.
    #[test]
    fn plane_waves_are_integrated_to_a_ten_thousandth() {
        for rule in &RULES {
            let k = TAU * rule.longest;
            for phase in [0.0, 0.4, 1.1, 2.3] {
                let wave = |x: f64| (k * (x - 0.5) + phase).cos();
                let slope = |x: f64| -k * (k * (x - 0.5) + phase).sin();
                let [found, plain] = sums(rule, wave, slope);
                let expected = 2.0 * (0.5 * k).sin() / k * phase.cos();
                assert!((found - expected).abs() < 1e-4);
                assert!((found - plain).abs() < rule.allowed);
            }
        }
    }
}
