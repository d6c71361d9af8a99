//! Derivatives of light by the properties of the scene: coefficients of media, colours of surfaces,
//! emission.
//!
//! The contribution of a path is a product of factors f over the density p with which it was
//! sampled. Sampling is held fixed, so the contribution's derivative is the contribution times Σ ∂
//! log f. A path records its factors (its tape). Given the weight of each contribution in a linear
//! functional of the image, one sweep backwards adds the derivatives by all parameters.
//!
//! Theory: docs/theory.md#derivatives-of-light.

mod chart;
mod error;
mod parameter;
mod sums;
mod tape;

pub use error::DerivativeError;
pub(crate) use parameter::Plan;
pub use parameter::RadiometricParameter;
pub(crate) use sums::Sums;
pub(crate) use tape::Tape;
