//! Single rays without scattering: rays from given starts through a scene or a field, and rays
//! between two points.

mod branches;
mod follow;
mod free;
mod line;

pub use crate::path::TraceEnding;
pub use branches::{Branch, Branches, branches};
pub use follow::{Path, TracePoint, Tracer};
pub use free::follow_field;
