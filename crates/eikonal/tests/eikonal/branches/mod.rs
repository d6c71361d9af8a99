//! Every branch between two points: the dense search against tables, closed forms and reciprocity.
//!
//! `MORGANA_LONG_TESTS=1` searches all pairs of the tables instead of a third.

mod ball;
mod finest;
mod inside;
mod listed;
mod refused;
mod slab;
mod starts;
mod world;

fn long() -> bool {
    std::env::var_os("MORGANA_LONG_TESTS").is_some()
}
