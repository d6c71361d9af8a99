#![doc = include_str!("../README.md")]
#![warn(unreachable_pub, missing_debug_implementations)]
//!
//! The mathematics: docs/theory.md#radiance.

pub mod aov;
pub mod attached;
mod bins;
pub mod bsdf;
pub mod budget;
pub mod connection_end;
pub mod derivative;
pub mod emitter;
pub mod film;
pub mod integrator;
pub mod medium;
pub mod meter;
pub mod moments;
pub mod mueller;
pub mod orientation;
/// Internals that only the tests of this crate use: they may change in any version.
#[doc(hidden)]
pub mod path;
pub mod phase;
/// As [`path`].
#[doc(hidden)]
pub mod photons;
pub mod polarization;
pub mod render;
pub mod renderer;
pub mod sampling;
pub mod scene;
pub mod sensor;
pub mod shape;
pub mod shared;
pub mod sidebands;
pub mod sparse;
pub mod spectrum;
pub mod stats;
pub mod stop;
pub mod sum;
pub mod tagging;
pub mod texture;
pub mod trace;
pub mod volume;

pub use bins::Bins;
pub use eikonal;
pub use film::Film;
pub use orientation::Orientation;
pub use scene::Scene;
pub use spectrum::Spectrum;
pub use stats::Stats;
pub use stop::Stop;
