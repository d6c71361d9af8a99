//! Starts of rays, and files of rays.

mod fan;
mod lines;
mod write;

pub use fan::fan;
pub use lines::{obj, ply, vtk};
pub use write::{csv, json};
