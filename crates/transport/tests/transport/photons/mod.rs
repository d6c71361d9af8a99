//! Photon maps, compared with bidirectional path tracing, and their reported errors with the
//! measured ones.
//!
//! False-alarm rate: 1e-3 for each test, over all its comparisons, with fixed seeds. References are
//! other estimators, whose own errors count.

mod agreement;
mod bias;
mod bounds;
mod merging;
mod sharing;
pub mod support;

const FAMILY: f64 = 1e-3;

fn long() -> bool {
    std::env::var_os("MORGANA_LONG_TESTS").is_some()
}
