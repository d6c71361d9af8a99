#![doc = include_str!("../README.md")]
#![warn(unreachable_pub, missing_debug_implementations)]
//!
//! The mathematics: docs/theory.md#rays.

pub mod adjoint;
pub mod bounds;
pub mod budget;
pub mod certificate;
pub mod connect;
pub mod difference;
mod direction;
pub mod field;
pub mod interface;
mod lanes;
mod modulation;
pub mod ray;
mod shown;

pub use bounds::{Aabb, FieldBounds};
pub use certificate::Uniqueness;
pub use connect::{ConnectingRay, Failure, Solver, World};
pub use difference::{PathDifference, Reference};
pub use field::{Field, Jet};
pub use modulation::{ModulationPanel, ModulationQuadrature};
pub use ray::{Tolerance, Work};
pub use shown::Shown;
