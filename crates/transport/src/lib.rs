//! Light transport along curved rays.

pub mod shape;
pub mod spectrum;

pub use spectrum::Spectrum;
