//! Polarisation along curved rays: Stokes vectors of the light of paths.
//!
//! Estimators sample paths as if light were unpolarised. The contribution of a path is then
//! multiplied by the Mueller matrices of its events. Each matrix is relative to the effect of its
//! event on unpolarised light. Frames are transported along the ray. Paths from the sensor carry
//! matrices, paths from an emitter carry Stokes vectors. A film requests them by
//! [`LightParts::Stokes`](crate::film::LightParts::Stokes).
//!
//! Theory: docs/theory.md#stokes-vectors.

mod check;
mod connection;
mod fold;
mod frame;
mod transported;

pub use check::{depolarizing, problems};
pub(crate) use fold::{StokesFold, StokesState};
pub(crate) use transported::Transported;
