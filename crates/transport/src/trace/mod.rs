//! Single rays through a scene, without scattering: those of given starts, and those between two points.

mod branches;
mod follow;

pub use branches::{Branch, Branches, branches};
pub use follow::{Ending, Path, Point, Tracer};
