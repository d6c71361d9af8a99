//! Connections: edges from a vertex to an emitter, to the sensor, or to another vertex
//! (docs/theory.md#connections).

mod arcs;
mod find;
mod ray;
mod search;
mod straight;
mod target;
mod throughput;

pub(crate) use arcs::ConnectionArcs;
pub(crate) use find::{FoundBranch, Weighted};
pub use ray::Connection;
pub use target::ConnectionTarget;
pub(crate) use target::environment_end;
pub use throughput::transmittance;
