//! Reconstruction filters (docs/theory.md#film).

use super::SignedFilter;
use std::f64::consts::TAU;

/// Separable reconstruction filter. Lengths are in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a film has one")]
pub enum Filter {
    /// Box that covers one pixel.
    Box,
    /// Triangle of the given radius.
    Tent {
        /// Half width, in [`Filter::RADII`].
        radius: f64,
    },
    /// Gaussian, cut off at four standard deviations.
    Gaussian {
        /// Standard deviation, a quarter of a radius in [`Filter::RADII`].
        stddev: f64,
    },
    /// Filter with negative lobes.
    Signed(SignedFilter),
}

/// Fraction of a Gaussian's integral within the cut-off: erf(4/√2).
const GAUSSIAN_MASS: f64 = 0.999_936_657_516_333_8;

impl Filter {
    /// Smallest and largest [radius](Filter::radius) of a tent or a Gaussian, in pixels. A sample
    /// contributes to all pixels under the filter, so the radius bounds the work of a sample.
    pub const RADII: [f64; 2] = [0.1, 32.0];
    /// Cut-off of Gaussians, in standard deviations.
    pub(crate) const CUT: f64 = 4.0;

    /// Samples an offset from the pixel's centre with density [`Filter::pdf`]; `u` is uniform in
    /// [0, 1).
    pub fn sample(&self, u: f64) -> f64 {
        match *self {
            Filter::Box => u - 0.5,
            Filter::Tent { radius } => {
                let v = 2.0 * u - 1.0;
                radius * v.signum() * (1.0 - (1.0 - v.abs()).sqrt())
            }
            Filter::Gaussian { stddev } => stddev * normal_quantile((u - 0.5) * GAUSSIAN_MASS),
            Filter::Signed(filter) => filter.sample(u),
        }
    }

    /// Returns the density of [`Filter::sample`], per pixel. It equals the filter, except for
    /// filters with negative lobes.
    pub fn pdf(&self, offset: f64) -> f64 {
        match self {
            Filter::Signed(filter) => filter.pdf(offset),
            _ => self.value(offset),
        }
    }

    /// Returns the weight of a sample: the filter's value divided by the sample's density.
    pub fn weight(&self, offset: f64) -> f64 {
        match self {
            Filter::Signed(filter) => {
                let pdf = filter.pdf(offset);
                // Rounding may put a sample on the edge of the filter, where the density is zero.
                if pdf > 0.0 {
                    filter.value(offset) / pdf
                } else {
                    0.0
                }
            }
            _ => 1.0,
        }
    }

    /// Returns the value of the filter, per pixel; zero beyond [`Filter::radius`]. The box includes
    /// its lower edge only, so that each position belongs to one pixel.
    pub fn value(&self, offset: f64) -> f64 {
        let x = offset.abs();
        match *self {
            Filter::Box => f64::from(u8::from((-0.5..0.5).contains(&offset))),
            Filter::Tent { radius } => (1.0 - x / radius).max(0.0) / radius,
            Filter::Gaussian { stddev } if x <= self.radius() => {
                let z = x / stddev;
                (-0.5 * z * z).exp() / (stddev * TAU.sqrt() * GAUSSIAN_MASS)
            }
            Filter::Gaussian { .. } => 0.0,
            Filter::Signed(filter) => filter.value(offset),
        }
    }

    /// Returns the largest distance from the pixel's centre, along either axis, at which the filter
    /// is not zero, in pixels.
    pub fn radius(&self) -> f64 {
        match *self {
            Filter::Box => 0.5,
            Filter::Tent { radius } => radius,
            Filter::Gaussian { stddev } => Self::CUT * stddev,
            Filter::Signed(filter) => filter.radius(),
        }
    }
}

/// Returns the quantile of the standard normal distribution at probability ½ + `q`, for |q| < ½ −
/// 1e-10, accurate to 1e-15. The rational functions are from M. J. Wichura, "Algorithm AS 241: The
/// percentage points of the normal distribution", Appl. Statist. 37, 1988.
fn normal_quantile(q: f64) -> f64 {
    if q.abs() <= 0.425 {
        return q * ratio(&CENTRAL, 0.180_625 - q * q);
    }
    let r = (-(0.5 - q.abs()).ln()).sqrt();
    ratio(&TAILS, r - 1.6).copysign(q)
}

/// Coefficients of numerator and denominator, beginning with the constant term.
type Ratio = [[f64; 8]; 2];

const CENTRAL: Ratio = [
    [
        3.387_132_872_796_366_6,
        133.141_667_891_784_38,
        1_971.590_950_306_551_3,
        13_731.693_765_509_46,
        45_921.953_931_549_87,
        67_265.770_927_008_7,
        33_430.575_583_588_13,
        2_509.080_928_730_122_7,
    ],
    [
        1.0,
        42.313_330_701_600_91,
        687.187_007_492_057_9,
        5_394.196_021_424_751,
        21_213.794_301_586_597,
        39_307.895_800_092_71,
        28_729.085_735_721_943,
        5_226.495_278_852_854,
    ],
];

const TAILS: Ratio = [
    [
        1.423_437_110_749_683_6,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        0.241_780_725_177_450_6,
        0.022_723_844_989_269_184,
        7.745_450_142_783_414e-4,
    ],
    [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        0.689_767_334_985_1,
        0.148_103_976_427_480_08,
        0.015_198_666_563_616_457,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ],
];

fn ratio([above, below]: &Ratio, x: f64) -> f64 {
    let value = |powers: &[f64; 8]| powers.iter().rev().fold(0.0, |sum, c| sum * x + c);
    value(above) / value(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::SQRT_2;

    #[test]
    fn quantiles_are_those_of_the_normal_distribution() {
        assert_eq!(GAUSSIAN_MASS, libm::erf(Filter::CUT / SQRT_2));
        for step in -999..=999 {
            let q = 0.5 * GAUSSIAN_MASS * f64::from(step) / 999.0;
            let found = normal_quantile(q);
            assert!((0.5 * libm::erf(found / SQRT_2) - q).abs() < 2e-16, "{q}");
        }
        assert!((normal_quantile(0.5 * GAUSSIAN_MASS) - Filter::CUT).abs() < 1e-11);
    }
}
