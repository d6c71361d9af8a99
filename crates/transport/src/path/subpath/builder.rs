//! Observer that records a walk as a subpath with densities
//! (docs/theory.md#subpaths-from-either-end, docs/theory.md#random-walks).

use super::vertices::{Escape, PathEdge, PathVertex, Subpath};
use crate::path::connection::{Connection, ConnectionTarget, FoundBranch};
use crate::path::random_walk::{Observer, WalkEvent};
use crate::path::segment::{End, TransportMode, Vertex};
use crate::path::workspace::Workspace;
use std::ops::ControlFlow;

/// Observer that records a walk as a subpath.
#[derive(Debug)]
pub(super) struct SubpathBuilder<'t> {
    pub subpath: Subpath,
    /// Quantity that the walk carries.
    pub mode: TransportMode,
    /// Target of connections to the end of the subpath.
    pub end: &'t ConnectionTarget<'t>,
    /// Largest number of vertices.
    pub max_vertices: usize,
    /// True if [`PathEdge::discovery`] is needed. Computing it takes connections.
    pub weighs: bool,
}

impl Observer for SubpathBuilder<'_> {
    const NEEDS_GEOMETRY: bool = true;

    fn arrive(&mut self, event: &WalkEvent, ws: &mut Workspace) -> ControlFlow<()> {
        let Some(vertex) = event.vertex else {
            self.subpath.escape = escape(event);
            return ControlFlow::Break(());
        };
        // Record the edge with e, and the vertex with p→ by eq. (density along an edge).
        let mut edge = path_edge(event, vertex);
        if self.weighs && event.edge.connectable {
            edge.discovery = self.discovery(event, vertex, &edge, ws);
        }
        let (scene, channel_pdf) = (event.scene, event.channel_pdf);
        let survival = vertex.event(scene, channel_pdf, edge.back, &edge.geometry);
        self.subpath.vertices.push(PathVertex {
            vertex: *vertex,
            edge,
            throughput: event.throughput,
            depth: event.depth,
            optical_length: event.optical_length,
            forward: edge.geometry.density(event.ray.pdf, edge.n_after) * survival,
            backward: 0.0,
            specular: event.onward.is_some_and(|ray| ray.specular),
        });
        // Compute p← of the previous vertex from the sampled direction.
        if let Some(ray) = event.onward {
            self.subpath.look_back(scene, channel_pdf, ray);
        }
        if self.subpath.vertices.len() < self.max_vertices {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    }
}

impl SubpathBuilder<'_> {
    /// Returns the probability that connections discover the edge to a new vertex. Connections
    /// start at the vertex nearer to the sensor; connections to the sensor itself start at its
    /// neighbour.
    fn discovery(
        &self,
        event: &WalkEvent,
        vertex: &Vertex,
        edge: &PathEdge,
        ws: &mut Workspace,
    ) -> f64 {
        let scene = event.scene;
        match (self.subpath.vertices.last(), self.mode) {
            (None, _) => {
                let branch = FoundBranch {
                    geometry: &edge.geometry,
                    direction: edge.back,
                    optical_length: Some(event.edge.optical_length),
                };
                Connection::discovery(scene, vertex, self.end, &branch, ws)
            }
            (Some(before), TransportMode::Importance) => {
                let target = ConnectionTarget::vertex(&before.vertex);
                let branch = FoundBranch {
                    geometry: &edge.geometry,
                    direction: edge.back,
                    optical_length: None,
                };
                Connection::discovery(scene, vertex, &target, &branch, ws)
            }
            (Some(before), TransportMode::Radiance) => {
                let target = ConnectionTarget::vertex(vertex);
                let branch = FoundBranch {
                    geometry: &edge.geometry,
                    direction: edge.leaving,
                    optical_length: None,
                };
                Connection::discovery(scene, &before.vertex, &target, &branch, ws)
            }
        }
    }
}

/// Returns the edge that led a walk to a vertex.
fn path_edge(event: &WalkEvent, vertex: &Vertex) -> PathEdge {
    let (scene, start) = (event.scene, &event.edge.start);
    PathEdge {
        geometry: event.edge.geometry,
        leaving: start.direction,
        back: -vertex.arrival(),
        n_before: scene.n(start.medium, start.x),
        n_after: scene.n(vertex.medium(), vertex.position()),
        discovery: 0.0,
        connectable: event.edge.connectable,
    }
}

/// Returns the edge by which a walk left the scene, if the walk ended this way.
fn escape(event: &WalkEvent) -> Option<Escape> {
    let edge = event.edge;
    let End::Escaped { direction, medium } = edge.end else {
        return None;
    };
    let path_edge = PathEdge {
        geometry: edge.geometry,
        leaving: edge.start.direction,
        back: -direction,
        n_before: event.scene.n(edge.start.medium, edge.start.x),
        n_after: event.scene.n(medium, edge.start.x),
        discovery: f64::from(u8::from(edge.connectable)),
        connectable: edge.connectable,
    };
    let survival = path_edge.geometry.survival(event.channel_pdf);
    Some(Escape {
        edge: path_edge,
        throughput: event.throughput,
        depth: event.depth,
        optical_length: event.optical_length,
        forward: path_edge.geometry.density(event.ray.pdf, path_edge.n_after) * survival,
    })
}
