//! Estimates that pilots learn from a scene before it is rendered. Any values are unbiased.

mod adjoint;
mod adjoint_training;
mod nee_rates;
mod strategy_rates;

pub use adjoint::AdjointEstimate;
pub use adjoint_training::{AdjointTraining, PathTally};
pub(crate) use nee_rates::NeeSlot;
pub use nee_rates::{Levels, NeeRates, NeeTraining};
pub use strategy_rates::{
    StrategyFind, StrategyKind, StrategyRates, StrategySample, StrategyShares, StrategyTraining,
    StrategyWork,
};
