//! Rays: steps, tangents, the flow through one field, and events along it (docs/theory.md#rays).

pub mod arc;
pub mod bernstein;
mod carried;
pub mod cost;
pub mod depth;
pub mod flow;
pub mod march;
pub mod short;
pub mod step;
pub mod tangent;

pub use arc::{Arc, LengthAlong};
pub use cost::steps_between;
pub use depth::Profile;
pub use flow::{Flow, Tolerance, Work};
pub use march::{March, StopCondition, march};
pub use short::{ShortRay, ShortStep};
pub(crate) use step::{DRIFT, EVALUATIONS_PER_STEP, KICK, STAGES};
pub use step::{Node, Step};
pub use tangent::{Tangents, Variation, perpendicular_basis};
