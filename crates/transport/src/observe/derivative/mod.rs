//! Derivatives of light by what the scene is made of: coefficients of media, colours of surfaces, emission.
//!
//! What a path brings is a product of factors f over the density p with which it was sampled. Sampling is held fixed, so that its
//! derivative is itself times Σ ∂ log f. A path takes note of its factors (its tape); from what each of its contributions is worth to a
//! linear functional of the image, one sweep back adds the derivatives by all parameters.
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
