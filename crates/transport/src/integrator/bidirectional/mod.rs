//! Parts shared by bidirectional estimators: connecting two subpaths in every way, and weighting
//! the strategies.

mod joining;
mod merging;
mod paths;
mod weight;

pub use joining::Connections;
pub(crate) use joining::Joining;
pub(super) use merging::MergeContents;
pub(crate) use merging::{LightMap, Merging};
pub(super) use paths::StrategyContext;
pub use weight::Heuristic;
