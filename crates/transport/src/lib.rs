//! Light transport along curved rays.

pub mod spectrum;

pub use spectrum::Spectrum;
