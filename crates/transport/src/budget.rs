//! Limits on the work of one part of a path: the budgets of [rays and
//! connections](eikonal::budget), and the budgets of larger parts. Parts that exceed a budget are
//! counted ([`OverBudget`](crate::stats::OverBudget) and
//! [`ConnectionCounts::capped`](crate::stats::ConnectionCounts::capped)). They are reported as
//! possible bias, because their light is missing.

pub use eikonal::budget::*;

/// Maximum number of specular events of one edge. Between perfect mirrors, an edge would never end.
pub(crate) const EVENTS_PER_EDGE: u32 = 1_000;

/// Maximum number of edges of a random walk. Between walls without absorption, a walk would never
/// end.
pub(crate) const EDGES_PER_WALK: usize = 1_000_000;

/// Maximum number of random starts that search for a branch again, to estimate the branch's weight.
pub(crate) const TRIALS_PER_SEARCH: u32 = 1_000;

/// Maximum number of ray steps of all random starts that estimate the weight of one branch.
pub(crate) const STEPS_PER_SEARCH: u64 = 4_000_000;

/// Maximum number of photons that are examined along one edge from the sensor, or around one
/// vertex.
pub(crate) const PHOTONS_PER_GATHER: u64 = 20_000_000;
