//! What bidirectional estimators share: joining two subpaths in every way, and weighing the ways.

mod joining;
mod paths;
mod weight;

pub(crate) use joining::Joining;
pub use paths::Setting;
pub use weight::Heuristic;
