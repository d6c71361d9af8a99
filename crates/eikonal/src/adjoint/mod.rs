//! Reverse mode: derivatives of the ends of rays with respect to their starts and to the fields
//! that they pass (docs/theory.md#derivatives-of-rays).
//!
//! [`AdjointRay::follow`] traces a ray and records the spans of its steps and the surfaces that it
//! meets. [`AdjointRay::pull_back`] goes back over these steps. The reversed scheme recomputes the
//! states, so that a ray stores only eight bytes per step, and only while it is in use.
//! [`AdjointRay::push_forward`] is the transpose.

mod action;
mod crossing;
mod embedded;
mod flight;
mod flight_back;
mod follow;
mod forward;
mod layout;
mod parameters;
mod quadric;
mod receiver;
mod reverse;
mod sequence;
#[cfg(test)]
mod tests;

pub use crossing::FlightCrossing;
pub use embedded::Embedded;
pub use flight::{Flight, FlightIntersection, FlightLimits, FlightPoint};
pub use flight_back::{FlightAdjoint, FlightDerivative};
pub use follow::{AdjointRay, RayEnd, RayFailure, RayStart};
pub use forward::{EndChange, StartChange, WorldChange};
pub use layout::{Layout, LayoutChange, LayoutDerivative};
pub use parameters::ParameterDerivative;
pub use quadric::{DEPARTURES, Quadric, QuadricDerivative};
pub use receiver::Receiver;
pub use reverse::{EndDerivative, IndexSink, StartDerivative, SurfaceDerivative};
pub use sequence::{Sequence, SequenceElement};
