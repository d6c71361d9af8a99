//! Walks along curved rays: edges of paths, and sensor rays that are not scattered.

mod follow;
mod free_flight;
mod gather;
mod surface;
mod trace;
mod unscattered;

pub(crate) use follow::{FollowedRay, SeenSurface, follow, see};
pub use free_flight::{FreeFlight, FreeLeg};
pub(crate) use gather::{EmittedAlong, gather_along, gather_in_view};
pub(crate) use trace::{DrawnCollision, choose_channel, trace_to};
pub use trace::{Sampling, trace};
pub use unscattered::TraceEnding;
pub(crate) use unscattered::{Continuation, RayObserver, UnscatteredRay};
