#![doc = include_str!("../README.md")]
#![warn(unreachable_pub, missing_debug_implementations)]
//!
//! Theory: docs/theory.md#radiance.

pub mod bsdf;
pub mod connection_end;
pub mod emitter;
pub mod medium;
pub mod mueller;
pub mod orientation;
pub mod phase;
pub mod sampling;
pub mod sensor;
pub mod shape;
pub mod shared;
pub mod spectrum;
pub mod texture;
pub mod volume;

pub use eikonal;
pub use orientation::Orientation;
pub use spectrum::Spectrum;
