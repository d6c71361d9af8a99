//! Polarisation along curved rays: Stokes vectors of the light of paths.
//!
//! Estimators sample paths as if light were unpolarised. The contribution of a path is then multiplied by the Mueller matrices of its
//! events, each per what the event does to unpolarised light, in frames that are carried along the ray: as matrices from the sensor on,
//! as Stokes vectors from an emitter on. A film asks for them by [`LightParts::Stokes`](crate::film::LightParts::Stokes).
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
