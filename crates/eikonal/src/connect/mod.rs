//! Connections: the rays between two given points (docs/theory.md#connections).
//!
//! A connection is a *branch*: a ray of a family with an optical path length at which it ends at
//! the target. The ray is refracted or reflected at interfaces according to a [`Pattern`].
//! [`Solver`] finds the primary branch, to which damped Newton iteration converges from a
//! deterministic initial guess. It finds other branches from other guesses: random ones, or points
//! along a [`Guide`]. All branches through the surface of a [`Ball`] are known.

mod approach;
mod ball;
mod begin;
mod bend;
mod closest;
mod collocate;
mod connection;
mod edges;
mod family;
mod fermat;
mod guide;
mod multistart;
mod newton;
mod pattern;
mod radial;
mod random;
mod shoot;
mod solver;
mod start;
mod wall;
mod world;

pub use ball::{Ball, Outside};
pub use connection::{ConnectingRay, Failure};
pub use family::RayFamily;
pub use guide::Guide;
pub use multistart::All;
pub use pattern::Pattern;
pub use radial::{BallRay, PassingRay, RadialBall};
pub use random::{random_direction, random_foot};
pub use solver::Solver;
pub use start::{Followed, InitialGuess, Reach};
pub use wall::WallGuess;
pub use world::{Crossing, Event, Piece, Unbounded, World};
