//! Rays through a scene, without scattering.

mod fan;
mod follow;
mod write;

pub use fan::fan;
pub use follow::{Ending, Path, Tracer};
pub use write::{csv, json};
