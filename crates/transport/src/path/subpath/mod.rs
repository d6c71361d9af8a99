//! Subpaths from the sensor and from emitters: starts and vertices.

mod builder;
mod emitter_end;
mod ends;
mod guess;
mod toward_emitters;
mod vertices;

pub(crate) use emitter_end::{EmitterEnd, EndChoice, Resampling};
pub use ends::{Bounds, emit};
pub(crate) use ends::{LightPath, sensor_path};
pub use guess::guess;
pub(crate) use toward_emitters::{scatter, scatter_pdf};
pub use vertices::PathVertex;
pub(crate) use vertices::{Escape, PathEdge, Subpath};
