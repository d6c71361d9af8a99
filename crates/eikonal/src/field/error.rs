//! Errors in the parameters of fields.

use crate::Shown;
use crate::direction::unit;
use glam::DVec3;
use thiserror::Error;

/// A parameter from which no valid field can be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FieldError {
    /// A number is NaN or infinite.
    #[error("{what} must be a finite number, but is {}", Shown(*value))]
    NotFinite {
        /// Name of the parameter.
        what: &'static str,
        /// Value of the parameter.
        value: f64,
    },
    /// A number that must be positive is not.
    #[error("{what} must be positive and finite, but is {}", Shown(*value))]
    NotPositive {
        /// Name of the parameter.
        what: &'static str,
        /// Value of the parameter.
        value: f64,
    },
    /// A number that may be zero is negative.
    #[error("{what} must be 0 or more and finite, but is {}", Shown(*value))]
    Negative {
        /// Name of the parameter.
        what: &'static str,
        /// Value of the parameter.
        value: f64,
    },
    /// A vector has a component that is NaN or infinite.
    #[error("{what} must have finite components, but is {}", Shown(*value))]
    VectorNotFinite {
        /// Name of the parameter.
        what: &'static str,
        /// Value of the parameter.
        value: DVec3,
    },
    /// A direction has no length.
    #[error("{what} must be a non-zero vector, but is {}", Shown(*value))]
    ZeroVector {
        /// Name of the parameter.
        what: &'static str,
        /// Value of the parameter.
        value: DVec3,
    },
    /// The direction of φ = 0 lies along the axis.
    #[error("reference direction {} must not be parallel to the axis {}", Shown(*reference), Shown(*axis))]
    ParallelReference {
        /// Direction given for φ = 0.
        reference: DVec3,
        /// Direction of the axis.
        axis: DVec3,
    },
    /// A grid without samples.
    #[error("a grid must have at least one sample along each axis, but has {dims:?}")]
    EmptyGrid {
        /// Number of samples along x, y, z.
        dims: [usize; 3],
    },
    /// A grid too large to be addressed.
    #[error("a grid of {dims:?} samples is too large to be held in memory")]
    GridTooLarge {
        /// Number of samples along x, y, z.
        dims: [usize; 3],
    },
    /// A box without volume, or an unbounded one.
    #[error(
        "the box of a grid must be finite with a positive size along each axis, but is {} to {}",
        Shown(*min),
        Shown(*max)
    )]
    BadBox {
        /// Smallest corner.
        min: DVec3,
        /// Largest corner.
        max: DVec3,
    },
    /// The number of samples differs from the size of the grid.
    #[error("a grid of {dims:?} needs {expected} samples, but {actual} are given")]
    SampleCount {
        /// Number of samples along x, y, z.
        dims: [usize; 3],
        /// Product of the numbers of samples along the axes.
        expected: usize,
        /// Number of samples given.
        actual: usize,
    },
    /// A sample is not an index.
    #[error("sample {index:?} must be a positive finite refractive index, but is {}", Shown(*value))]
    BadSample {
        /// Position of the sample along x, y, z, from zero.
        index: [usize; 3],
        /// Value of the sample.
        value: f64,
    },
    /// A table with fewer than two samples.
    #[error("a table must have at least two samples, but has {0}")]
    FewSamples(usize),
    /// A table with places that do not ascend.
    #[error("the coordinates in a table must ascend, but {} is followed by {}", Shown(*.0), Shown(*.1))]
    NotAscending(f64, f64),
    /// A sample of a table is not an index.
    #[error("the index at {} must be positive and finite, but is {}", Shown(*at), Shown(*value))]
    BadTableIndex {
        /// Place of the sample.
        at: f64,
        /// Value of the sample.
        value: f64,
    },
    /// A transform that cannot be inverted.
    #[error(
        "the transform must be finite and invertible, but its singular values reach from {} to {}",
        Shown(*smallest),
        Shown(*largest)
    )]
    SingularTransform {
        /// Smallest singular value of the linear part.
        smallest: f64,
        /// Largest singular value of the linear part.
        largest: f64,
    },
}

/// Returns `value`, if it is finite.
pub(super) fn finite(what: &'static str, value: f64) -> Result<f64, FieldError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(FieldError::NotFinite { what, value })
    }
}

/// Returns `value`, if it is positive and finite.
pub(super) fn positive(what: &'static str, value: f64) -> Result<f64, FieldError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(FieldError::NotPositive { what, value })
    }
}

/// Returns `value`, if it is zero or positive, and finite.
pub(super) fn not_negative(what: &'static str, value: f64) -> Result<f64, FieldError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(FieldError::Negative { what, value })
    }
}

/// Returns `value`, if all its components are finite.
pub(super) fn finite_vector(what: &'static str, value: DVec3) -> Result<DVec3, FieldError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(FieldError::VectorNotFinite { what, value })
    }
}

/// Returns the unit vector along `value`.
pub(super) fn direction(what: &'static str, value: DVec3) -> Result<DVec3, FieldError> {
    unit(finite_vector(what, value)?).ok_or(FieldError::ZeroVector { what, value })
}
