//! Walks along curved rays: edges of paths, and sensor rays that are not scattered.

mod follow;
mod surface;
mod trace;

pub(crate) use follow::{Ending, FollowedRay, SeenSurface, follow, see};
pub use trace::{Sampling, trace};
