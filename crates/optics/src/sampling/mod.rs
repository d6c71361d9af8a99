//! Sampling routines. Each consists of a sample, its inverse (where it exists) and a pdf.
//!
//! Random numbers `u` lie in [0, 1). `x_sample` maps them to the sample, `x_inverse` maps a sample
//! back to them, and `x_pdf` is the density. Directions are unit vectors with z along the axis of
//! the distribution; [`Frame`] maps them to the world.

pub mod bilinear;
mod cdf;
pub mod disc;
pub mod discrete;
pub mod frame;
pub mod grid2;
pub mod piecewise_constant;
pub mod piecewise_linear;
mod points;
pub mod sampler;
pub mod sphere;
pub mod triangle;
pub mod trilinear;

pub use bilinear::BilinearCell;
pub use discrete::Discrete;
pub use frame::Frame;
pub use grid2::Grid2;
pub(crate) use grid2::PickedCell;
pub use piecewise_constant::PiecewiseConstant;
pub use piecewise_linear::PiecewiseLinear;
pub use points::{Purpose, Replicates};
pub use sampler::Sampler;
pub use sampler::in_fraction;
pub use trilinear::TrilinearCell;

use eikonal::Shown;

/// Steps of Roberts' R₂ sequence along both axes. Its points k · step modulo 1 are evenly
/// distributed over the unit square.
pub const R2_STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Returns the first `count` points of the R₂ sequence, starting at the middle of the unit square.
pub fn evenly_spread(count: usize) -> impl Iterator<Item = [f64; 2]> {
    (0..count).map(|k| R2_STEPS.map(|step| (0.5 + k as f64 * step).fract()))
}

/// Reason why a tabulated distribution cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DistributionError {
    /// The number of values does not match the bins or nodes.
    #[error("expected {expected} values, got {got}")]
    Length {
        /// Number of values that the edges, nodes or size require.
        expected: usize,
        /// Number of values given.
        got: usize,
    },
    /// There are no bins.
    #[error("expected at least one bin")]
    Empty,
    /// A value is negative or not finite.
    #[error("expected finite values ≥ 0, got {} at index {index}", Shown(*value))]
    Value {
        /// Index of the value.
        index: usize,
        /// The value.
        value: f64,
    },
    /// Edges or nodes do not increase, or are not finite.
    #[error("expected finite, strictly increasing positions, but index {index} breaks the order")]
    Order {
        /// Index of the first edge or node that is out of order.
        index: usize,
    },
    /// An edge or node lies outside the range of the variable.
    #[error("{} lies outside {} to {}", Shown(*position), Shown(range[0]), Shown(range[1]))]
    Outside {
        /// Edge or node.
        position: f64,
        /// Smallest and largest value of the variable.
        range: [f64; 2],
    },
    /// All values are zero, or their sum overflows.
    #[error("{}", if *total > 0.0 { "the sum of all values is too large for a number" } else { "all values are 0, but one at least must be positive" })]
    Total {
        /// Sum (or integral) of the values.
        total: f64,
    },
}

/// Checks that bin edges or nodes are finite and strictly increasing.
fn check_positions(x: &[f64]) -> Result<(), DistributionError> {
    if x.len() < 2 {
        return Err(DistributionError::Empty);
    }
    if !x[0].is_finite() {
        return Err(DistributionError::Order { index: 0 });
    }
    match x
        .windows(2)
        .position(|w| !(w[1].is_finite() && w[0] < w[1]))
    {
        Some(i) => Err(DistributionError::Order { index: i + 1 }),
        None => Ok(()),
    }
}

/// Checks that values are finite and not negative.
fn check_values(values: &[f64]) -> Result<(), DistributionError> {
    match values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(index) => Err(DistributionError::Value {
            index,
            value: values[index],
        }),
        None => Ok(()),
    }
}
