//! Curved rays in media whose refractive index varies continuously.
//!
//! With the Hamiltonian parameter σ (dσ = ds/n) and |v| = n a ray obeys Newton's equation
//! dx/dσ = v, dv/dσ = ½∇(n²) (docs/theory.md#rays). This crate knows fields, rays, interfaces and
//! connections; it knows no light, reads no file and starts no thread.

pub mod bounds;
pub mod budget;
pub mod certificate;
pub mod connect;
pub mod difference;
pub mod field;
pub mod interface;
mod lanes;
pub mod ray;
mod shown;

pub use bounds::{Aabb, FieldBounds};
pub use certificate::Uniqueness;
pub use connect::{ConnectingRay, Failure, Solver, World};
pub use difference::{PathDifference, Reference};
pub use field::{Field, Jet};
pub use ray::{Tolerance, Work};
pub use shown::Shown;
