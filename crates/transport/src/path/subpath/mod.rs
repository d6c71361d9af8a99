//! Subpaths from the sensor and from emitters, vertex by vertex, and where they begin.

mod builder;
mod ends;
mod guess;
mod toward_emitters;
mod vertices;

pub use ends::{Bounds, LightPath, emit, sensor_path};
pub use guess::guess;
pub use toward_emitters::{scatter, scatter_pdf};
pub use vertices::{Escape, PathEdge, PathVertex, Subpath};
