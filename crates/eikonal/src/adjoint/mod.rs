//! Reverse mode: derivatives of the ends of rays with respect to their starts and to the fields that they go through
//! (docs/theory.md#derivatives-of-rays).
//!
//! [`AdjointRay::follow`] follows a ray and records the spans of its steps and the surfaces that it meets;
//! [`AdjointRay::pull_back`] goes back over the same steps. States are computed again by the reversed scheme, so that a
//! ray takes eight bytes for each of its steps, and these as long as it is at work. [`AdjointRay::push_forward`] is the transpose.

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
pub use flight::{Flight, FlightLimits, FlightMeeting, FlightPoint};
pub use flight_back::{FlightAdjoint, FlightDerivative};
pub use follow::{AdjointRay, RayEnd, RayFailure, RayStart};
pub use forward::{EndChange, StartChange, WorldChange};
pub use layout::{Layout, LayoutChange, LayoutDerivative};
pub use parameters::ParameterDerivative;
pub use quadric::{Quadric, QuadricDerivative};
pub use receiver::Receiver;
pub use reverse::{EndDerivative, IndexSink, StartDerivative, SurfaceDerivative};
pub use sequence::{Sequence, SequenceElement};
