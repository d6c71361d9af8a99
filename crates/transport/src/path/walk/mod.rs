//! Walks along curved rays: edges of paths, and sensor rays that are not scattered.

mod follow;
mod trace;

pub use follow::{Ending, FollowedRay, follow};
pub use trace::{Sampling, trace};
