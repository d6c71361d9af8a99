//! Rays: state, steps, arcs.

pub mod arc;

pub use arc::Arc;
