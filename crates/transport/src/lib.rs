#![doc = include_str!("../README.md")]
#![warn(unreachable_pub, missing_debug_implementations)]
//!
//! Theory: docs/theory.md#radiance.

pub mod aov;
pub mod attached;
mod bins;
pub mod budget;
pub mod device;
pub mod integrator;
pub mod moments;
pub mod observe;
/// Internals that only the tests of this crate use. They may change in any version.
#[doc(hidden)]
pub mod path;
/// Internals that only the tests of this crate use. They may change in any version.
#[doc(hidden)]
pub mod photons;
pub mod render;
pub mod renderer;
pub mod scene;
pub mod sparse;
pub mod stats;
pub mod stop;
pub mod sum;
pub mod trace;

pub use bins::Bins;
pub use eikonal;
pub use observe::film::Film;
pub use observe::{derivative, film, frequency_domain, meter, polarization, sidebands, tagging};
pub use optics::{
    Orientation, Spectrum, bsdf, connection_end, emitter, medium, mueller, orientation, phase,
    sampling, sensor, shape, shared, spectrum, texture, volume,
};
pub use scene::Scene;
pub use stats::Stats;
pub use stop::Stop;
