//! Reconstruction filters, sampled in proportion to their value.

/// A reconstruction filter, separable, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}

impl Filter {
    /// An offset from the pixel's centre with the filter as its density; `u` is uniform in [0, 1).
    pub fn sample(&self, u: f64) -> f64 {
        match *self {
            Filter::Box => u - 0.5,
            Filter::Tent { radius } => {
                let v = 2.0 * u - 1.0;
                radius * v.signum() * (1.0 - (1.0 - v.abs()).sqrt())
            }
            Filter::Gaussian { stddev } => {
                const CUT: f64 = 4.0;
                let edge = libm::erf(CUT / std::f64::consts::SQRT_2);
                stddev * std::f64::consts::SQRT_2 * inverse_erf((2.0 * u - 1.0) * edge)
            }
        }
    }
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
