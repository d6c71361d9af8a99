//! Connections: the ray between two given points (theory §5).
//!
//! A connection is a *branch*: a pair (launch, σ) whose ray ends at the target. [`Solver`] finds the
//! primary one, that to which damped Newton iteration converges from a deterministic start.

mod guide;
mod launch;
mod shoot;
mod solver;

pub use guide::Guide;
pub use launch::Launch;
pub use shoot::{Crossing, Event, Piece, Unbounded, World};
pub use solver::{Connection, Failure, Solver};
