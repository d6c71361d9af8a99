//! Derivatives of images by the refractive index of media that scatter.
//!
//! Paths are followed from the sensor with the same random numbers whatever the index: their vertices move with it, each path being a smooth
//! map of the index (attached sampling). What moves is the way of each flight, the place of each collision, the extinction and the albedo
//! there, the direction after it, what boundaries reflect, and where and in which direction light is met. One sweep back along the path carries the derivative of what it
//! brings by position and velocity through flights, collisions and boundaries, and adds to the sums of the index on its way.
//!
//! Where what a path brings jumps when its vertices move, a boundary term would be missing: `check` refuses such scenes.
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
