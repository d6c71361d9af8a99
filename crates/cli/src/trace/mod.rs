//! Rays through a scene, without scattering.

mod fan;
mod follow;
mod lines;
mod write;

pub use fan::fan;
pub use follow::{Ending, Path, Tracer};
pub use lines::{obj, ply, vtk};
pub use write::{csv, json};
