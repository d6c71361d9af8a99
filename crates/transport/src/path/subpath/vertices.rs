//! Subpaths from either end, with the densities that the combination of estimators needs.
//!
//! Vertices of a whole path are x₀ (sensor) … x_k (emitter). Each has two densities: that with which it
//! is sampled from the side of the sensor, given the vertices before it, and that from the side of the
//! emitter. A subpath knows both for its vertices as far as they do not depend on what comes
//! after its last one.

use crate::Spectrum;
use crate::path::random_walk::WalkRay;
use crate::path::segment::{EdgeGeometry, Start, Vertex};
use crate::scene::Scene;
use glam::DVec3;

/// An edge of a subpath, from the previous vertex to this one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathEdge {
    /// Geometry and depth.
    pub geometry: EdgeGeometry,
    /// Unit direction at the previous vertex, towards this one.
    pub leaving: DVec3,
    /// Unit direction at this vertex, towards the previous one.
    pub back: DVec3,
    /// Index at the previous vertex, on the side where the edge leaves it.
    pub n_before: f64,
    /// Index at this vertex, on the side where the edge arrives.
    pub n_after: f64,
    /// Discovery probability of the edge: see [`crate::path::Connection::discovery`]; 0 if connections do not look for it.
    pub discovery: f64,
}

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// The vertex.
    pub vertex: Vertex,
    /// The edge that led to it.
    pub(crate) edge: PathEdge,
    /// Throughput up to the vertex, its scattering coefficient included.
    pub throughput: Spectrum,
    /// Edges and specular events so far.
    pub depth: u32,
    /// Optical path length so far.
    pub optical_length: f64,
    /// Density with which the subpath sampled it.
    pub forward: f64,
    /// Density with which the opposite subpath would sample it; known once the subpath has gone on for
    /// two more vertices.
    pub backward: f64,
    /// Whether the subpath goes on from it by a specular lobe.
    pub specular: bool,
}

/// Where a subpath left the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Escape {
    /// The edge that left; its discovery probability is 1 if connections look for such edges.
    pub edge: PathEdge,
    /// Throughput up to there.
    pub throughput: Spectrum,
    /// Edges and specular events so far.
    pub depth: u32,
    /// Optical path length so far: see [`crate::path::Edge::optical_length`].
    pub optical_length: f64,
    /// Density per steradian with which it left this way.
    pub forward: f64,
}

/// The vertices of a subpath in the order in which they were sampled; its end, on the sensor or an
/// emitter, is not among them.
#[derive(Clone, Debug)]
pub(crate) struct Subpath {
    /// Where it started.
    pub start: Start,
    /// The vertices.
    pub vertices: Vec<PathVertex>,
    /// Where it left the scene, if it did.
    pub escape: Option<Escape>,
    /// Density with which the opposite subpath would sample the end from the first vertex, but for the
    /// cosine there.
    pub end_backward: f64,
}

impl Subpath {
    /// Nothing but a start.
    pub(super) fn new(start: Start) -> Self {
        Subpath {
            start,
            vertices: Vec::new(),
            escape: None,
            end_backward: 0.0,
        }
    }

    /// Now that it is known where the path goes on from its last vertex, so is the density with which
    /// the opposite subpath would have sampled the vertex before that.
    pub(super) fn look_back(&mut self, scene: &Scene, channel_pdf: Spectrum, onward: &WalkRay) {
        let Some((last, before)) = self.vertices.split_last_mut() else {
            return;
        };
        let pdf = if onward.specular {
            1.0
        } else {
            last.reverse_pdf(scene, onward.start.direction)
        };
        match before.last_mut() {
            Some(before) => before.backward = last.density_before(scene, channel_pdf, before, pdf),
            None => self.end_backward = last.density_end(channel_pdf, pdf),
        }
    }
}

impl PathVertex {
    /// How easily connections find the edge that led here, for a path that goes on as the subpath does: no
    /// connection starts or ends where light is reflected as by a mirror.
    pub(crate) fn discovery_going_on(&self) -> f64 {
        if self.specular {
            // Planted error "edges beside mirror lobes taken for such that connections find" (3 lines), found by morgana-transport/transport::agreement::surfaces::partial_mirrors:
            // self.edge.discovery
            // } else {
            // self.edge.discovery
            0.0
        } else {
            self.edge.discovery
        }
    }

    /// Density per steradian with which a path that comes from the direction `from` would go on along
    /// the edge that led here, backwards.
    pub(crate) fn reverse_pdf(&self, scene: &Scene, from: DVec3) -> f64 {
        // Planted error "reverse density of the direction in which the path came", found by morgana-transport/transport::furnace::bidirectional_estimators:
        // self.vertex.seen_from(from).pdf(scene, -self.edge.back)
        self.vertex.seen_from(from).pdf(scene, self.edge.back)
    }

    /// Density with which the vertex before this one is sampled by a ray from here of density `pdf`.
    pub(crate) fn density_before(
        &self,
        scene: &Scene,
        channel_pdf: Spectrum,
        before: &PathVertex,
        pdf: f64,
    ) -> f64 {
        let path_edge = &self.edge;
        let event = before
            .vertex
            .event(scene, channel_pdf, path_edge.leaving, &path_edge.geometry);
        path_edge.geometry.density(pdf, path_edge.n_before) * event
    }

    /// As [`PathVertex::density_before`] for the end of the subpath, but for the cosine there.
    pub(crate) fn density_end(&self, channel_pdf: Spectrum, pdf: f64) -> f64 {
        let path_edge = &self.edge;
        path_edge.geometry.density(pdf, path_edge.n_before)
            * path_edge.geometry.survival(channel_pdf)
    }
}
