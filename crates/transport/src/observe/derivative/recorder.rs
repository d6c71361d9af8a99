//! What takes note of the factors of paths.

use crate::emitter::EmittedRay;
use crate::path::{ConnectionArcs, Edge, RayPart, Vertex};
use glam::DVec3;

/// Takes note of the factors of which a path's contributions are products. Those of the path itself stay for all contributions to
/// come; those put *aside* belong to the next one alone. A static type: one that takes no notes costs nothing.
pub(crate) trait FactorRecorder {
    /// The arcs of a connection, as they are kept.
    type Way;

    /// Whether [`follow`](Self::follow) looks at the spans of its edge. Edges of which parts are put aside always keep them.
    const NEEDS_SPANS: bool;

    /// Whether `follow` looks at the parts of its edge up to its end.
    const NEEDS_PARTS: bool;

    /// Keeps the arcs of a connection from a vertex, which may be in either order.
    fn way(&mut self, vertex: &Vertex, arcs: ConnectionArcs) -> Self::Way;

    /// The path follows an edge, and is scattered if it collides at its end. `parts` are its arcs up to there, none unless they are
    /// [needed](Self::NEEDS_PARTS).
    fn follow(&mut self, edge: &Edge, parts: &[RayPart]);

    /// The path turns at a vertex, perhaps along a specular lobe.
    fn turn(&mut self, vertex: &Vertex, direction: DVec3, specular: bool);

    /// Puts aside the part of an edge up to an arc length, and a scattering there.
    fn aside_follow(&mut self, edge: &Edge, length: f64);

    /// Puts aside the part of an edge up to an arc length, where light is emitted.
    fn aside_reach(&mut self, edge: &Edge, length: f64);

    /// Puts a turn at a vertex aside, and the connection after it.
    fn aside_connect(&mut self, vertex: &Vertex, direction: DVec3, way: &Self::Way);

    /// The path has made a contribution: light of an emitter's ray.
    fn contribute(&mut self, ray: &EmittedRay);
}

/// Takes no notes.
impl FactorRecorder for () {
    type Way = ();
    const NEEDS_SPANS: bool = false;
    const NEEDS_PARTS: bool = false;

    fn way(&mut self, _vertex: &Vertex, _arcs: ConnectionArcs) {}
    fn follow(&mut self, _edge: &Edge, _parts: &[RayPart]) {}
    fn turn(&mut self, _vertex: &Vertex, _direction: DVec3, _specular: bool) {}
    fn aside_follow(&mut self, _edge: &Edge, _length: f64) {}
    fn aside_connect(&mut self, _vertex: &Vertex, _direction: DVec3, _way: &()) {}
    fn aside_reach(&mut self, _edge: &Edge, _length: f64) {}
    fn contribute(&mut self, _ray: &EmittedRay) {}
}
