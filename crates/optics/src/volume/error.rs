//! Errors of grids.

use crate::Spectrum;
use eikonal::Shown;

/// Reason why samples do not form a valid grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A side has no samples.
    #[error("the grid has no samples: its size is {0} × {1} × {2}")]
    Empty(usize, usize, usize),
    /// The number of values does not match the size.
    #[error("expected {expected} values for the grid's size, found {found}")]
    Length {
        /// Product of the size along each axis and the number of channels.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// The number of channels is neither one nor the number of spectral channels.
    #[error("a grid has one channel, or one per spectral channel (at most {max}); found {0}", max = Spectrum::CHANNELS)]
    Channels(usize),
    /// The transform cannot be inverted.
    #[error("the grid's transform is singular: a scale of zero?")]
    Singular,
    /// A sample is not finite or lies outside the allowed range.
    #[error(
        "the sample at voxel ({x}, {y}, {z}) is {}; expected a finite number {}",
        Shown(f64::from(*value)),
        range(*low, *high)
    )]
    Value {
        /// Voxel index along x.
        x: usize,
        /// Voxel index along y.
        y: usize,
        /// Voxel index along z.
        z: usize,
        /// The sample.
        value: f32,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
}

/// Describes a range of values, for messages.
fn range(low: f64, high: f64) -> String {
    if high < f64::MAX {
        format!("in [{low}, {high}]")
    } else {
        format!("of at least {low}")
    }
}
