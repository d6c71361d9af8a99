//! Walks along curved rays: edges of paths, and sensor rays that are not scattered.

mod follow;
mod surface;
mod trace;

pub(crate) use follow::{Ending, FollowedRay, follow};
pub use trace::{Sampling, trace};
