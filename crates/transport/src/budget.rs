//! How much work one part of a path may take: the budgets of [rays and connections](eikonal::budget), and those of what is
//! made of them. Whatever is given up because a budget is spent is counted ([`OverBudget`](crate::stats::OverBudget), and
//! [`ConnectionCounts::capped`](crate::stats::ConnectionCounts::capped)) and reported as possible bias: its light is missing.

pub use eikonal::budget::*;

/// Specular events of one edge: light between perfect mirrors never ends.
pub(crate) const EVENTS_PER_EDGE: u32 = 1_000;

/// Edges of a random walk: between walls that absorb nothing it would go on for ever.
pub(crate) const EDGES_PER_WALK: usize = 1_000_000;

/// Random starts spent on finding a branch again that was found by one, to weigh it.
pub(crate) const TRIALS_PER_SEARCH: u32 = 1_000;

/// Steps of all these trials together.
pub(crate) const STEPS_PER_SEARCH: u64 = 4_000_000;

/// Photons that are looked at along one edge from the sensor, or around one vertex.
pub(crate) const PHOTONS_PER_GATHER: u64 = 20_000_000;
