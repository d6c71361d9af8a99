//! Rays: state, steps, arcs.

pub mod arc;
pub mod bernstein;

pub use arc::Arc;
