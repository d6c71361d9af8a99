//! Reconstruction filters, sampled in proportion to their value (docs/theory.md#film).

use super::SignedFilter;
use std::f64::consts::{SQRT_2, TAU};

/// A reconstruction filter, separable, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a film has one")]
pub enum Filter {
    /// The pixel itself.
    Box,
    /// A triangle of the given radius.
    Tent {
        /// Half width.
        radius: f64,
    },
    /// A Gaussian, cut off at four standard deviations.
    Gaussian {
        /// Standard deviation.
        stddev: f64,
    },
    /// One that is negative in places.
    Signed(SignedFilter),
}

/// Where Gaussians are cut off, in standard deviations.
const CUT: f64 = 4.0;

impl Filter {
    /// An offset from the pixel's centre with the density [`Filter::pdf`]; `u` is uniform in [0, 1).
    pub fn sample(&self, u: f64) -> f64 {
        match *self {
            Filter::Box => u - 0.5,
            Filter::Tent { radius } => {
                let v = 2.0 * u - 1.0;
                radius * v.signum() * (1.0 - (1.0 - v.abs()).sqrt())
            }
            Filter::Gaussian { stddev } => {
                stddev * SQRT_2 * inverse_erf((2.0 * u - 1.0) * gaussian_mass())
            }
            Filter::Signed(filter) => filter.sample(u),
        }
    }

    /// Density of [`Filter::sample`] per pixel: the filter itself, unless that is negative in places.
    pub fn pdf(&self, offset: f64) -> f64 {
        match self {
            Filter::Signed(filter) => filter.pdf(offset),
            _ => self.value(offset),
        }
    }

    /// What a sample counts: the filter over the density of the sample.
    pub fn weight(&self, offset: f64) -> f64 {
        match self {
            Filter::Signed(filter) => {
                let pdf = filter.pdf(offset);
                // Rounding may put a sample on the edge of where the filter ends.
                if pdf > 0.0 {
                    filter.value(offset) / pdf
                } else {
                    0.0
                }
            }
            _ => 1.0,
        }
    }

    /// The filter, per pixel, zero beyond [`Filter::radius`]. The box includes its
    /// lower edge alone, so that each position belongs to one pixel.
    pub fn value(&self, offset: f64) -> f64 {
        let x = offset.abs();
        match *self {
            Filter::Box => f64::from(u8::from((-0.5..0.5).contains(&offset))),
            Filter::Tent { radius } => (1.0 - x / radius).max(0.0) / radius,
            Filter::Gaussian { stddev } if x <= self.radius() => {
                let z = x / stddev;
                (-0.5 * z * z).exp() / (stddev * TAU.sqrt() * gaussian_mass())
            }
            Filter::Gaussian { .. } => 0.0,
            Filter::Signed(filter) => filter.value(offset),
        }
    }

    /// Largest distance from the pixel's centre, along either axis, at which the filter is not zero,
    /// in pixels.
    pub fn radius(&self) -> f64 {
        match *self {
            Filter::Box => 0.5,
            Filter::Tent { radius } => radius,
            Filter::Gaussian { stddev } => CUT * stddev,
            Filter::Signed(filter) => filter.radius(),
        }
    }
}

/// Share of a Gaussian that is not cut off.
fn gaussian_mass() -> f64 {
    libm::erf(CUT / SQRT_2)
}

/// Inverse error function on (−1, 1): Winitzki's closed form, polished by Newton's method.
fn inverse_erf(y: f64) -> f64 {
    let log = (1.0 - y * y).ln();
    let a = 0.147;
    let b = 2.0 / (std::f64::consts::PI * a) + 0.5 * log;
    let mut x = y.signum() * ((b * b - log / a).sqrt() - b).max(0.0).sqrt();
    for _ in 0..3 {
        let slope = std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
        x -= (libm::erf(x) - y) / slope;
    }
    x
}
