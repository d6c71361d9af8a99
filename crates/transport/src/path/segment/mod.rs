//! Vertices and the edges between them: positions, lengths and geometry terms.

mod boundary;
mod differentials;
mod edge;
mod edge_geometry;
mod equiangular;
mod length;
mod share;
mod vertex;

pub(in crate::path) use boundary::leave;
pub(crate) use boundary::surface_at;
pub(in crate::path) use differentials::RayDifferentials;
pub(crate) use edge::Front;
pub use edge::{Edge, End, Point, Span, Split, Start, TransportMode};
pub use edge_geometry::EdgeGeometry;
pub(crate) use equiangular::Equiangular;
pub use length::lead_in;
pub(in crate::path) use length::to_entrance;
pub(crate) use share::{collided, share};
pub(crate) use vertex::Scatter;
pub use vertex::Vertex;
