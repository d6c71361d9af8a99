//! Walks along curved rays: edges of paths, and sensor rays that are not scattered.

mod follow;
mod gather;
mod surface;
mod trace;

pub(crate) use follow::{Ending, FollowedRay, SeenSurface, follow, see};
pub(crate) use gather::{EmittedAlong, gather_along, gather_in_view};
pub use trace::{Sampling, trace};
