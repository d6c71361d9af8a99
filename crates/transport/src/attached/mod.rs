//! Derivatives of images by the refractive index of media that scatter.
//!
//! Paths are followed from the sensor with the same random numbers for any index. Their vertices
//! move with the index: each path is a smooth function of it (attached sampling). These quantities
//! change with the index:
//!
//! - the course of each flight,
//! - the position of each collision, the extinction and albedo there, and the direction after it,
//! - the reflectance of boundaries,
//! - the position and direction at which light is met.
//!
//! One sweep backwards along the path carries the derivative of its contribution by position and
//! velocity through flights, collisions and boundaries. Along the path it adds to the sums of the
//! index.
//!
//! If the contribution of a path were discontinuous when its vertices move, a boundary term would
//! be missing. `check` refuses scenes with discontinuities.
//!
//! Theory: docs/theory.md#derivatives-by-the-index-behind-scattering.

mod arrival;
mod back;
mod boundaries;
mod boundary;
mod check;
mod error;
mod fresnel;
mod majorant;
mod plan;
mod record;
#[cfg(test)]
mod tests;
mod walk;

pub(crate) use check::check;
pub use error::IndexDerivativeError;
pub(crate) use majorant::Majorants;
pub(crate) use plan::IndexPlan;
pub(crate) use record::AttachedPath;
pub(crate) use walk::AttachedWalk;
