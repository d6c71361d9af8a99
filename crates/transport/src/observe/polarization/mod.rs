//! Polarisation along curved rays: Stokes vectors of what paths bring.
//!
//! A path of [`PathTracer`](crate::integrator::PathTracer) is sampled as if light were unpolarised. What it brings is then multiplied by the
//! Mueller matrices of its events, each per what the event does to unpolarised light, in frames that are carried along the ray. A film asks
//! for it by [`LightParts::Stokes`](crate::film::LightParts::Stokes).
//!
//! Theory: docs/theory.md#stokes-vectors.

mod check;
mod frame;
mod recorder;
mod transported;

pub use check::{depolarizing, problems};
pub(crate) use recorder::StokesRecorder;
