//! Statistical and numerical helpers for tests.
//!
//! This crate is only a development dependency. It imports none of the crates that it tests, so
//! that an error in those crates cannot hide itself here. Directions are plain `[f64; 3]` arrays.
//!
//! Every test states its false-alarm rate: the probability that it fails although the code is
//! correct. Seeds are fixed, so a test either always passes or always fails for a given build. The
//! false-alarm rate refers to the choice of the seed.

pub mod batches;
pub mod chi_square;
pub mod convergence;
pub mod direction;
pub mod family;
pub mod moments;
pub mod quadrature;
pub mod rng;
pub mod z_test;

pub use chi_square::{ChiSquareFailure, Mass, Report, Table, uniform_edges};
pub use convergence::{OrderFit, fit_order};
pub use direction::DirectionTable;
pub use family::{Family, sidak};
pub use moments::Moments;
pub use rng::Rng;

/// Returns `full` where planted errors are searched and under `MORGANA_LONG_TESTS`, else `few`. The
/// environment variable `MORGANA_FULL_SAMPLES` is that of `scripts/planted.py`.
pub fn samples(full: u64, few: u64) -> u64 {
    let is_set = |name: &str| std::env::var_os(name).is_some();
    if is_set("MORGANA_FULL_SAMPLES") || is_set("MORGANA_LONG_TESTS") {
        full
    } else {
        few
    }
}
