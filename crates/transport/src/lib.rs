//! Light transport along curved rays.

pub mod bsdf;
pub mod phase;
pub mod sampling;
pub mod spectrum;

pub use spectrum::Spectrum;
