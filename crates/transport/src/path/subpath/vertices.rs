//! Subpaths from either end, with the densities that multiple importance sampling needs.
//!
//! The vertices of a whole path are x₀ (sensor) … x_k (emitter). Each vertex has two densities: one
//! for sampling from the sensor's side, given the vertices nearer to the sensor, and one for
//! sampling from the emitter's side. A subpath stores both densities of its vertices, as far as
//! they do not depend on what follows its last vertex.

use crate::Spectrum;
use crate::path::random_walk::WalkRay;
use crate::path::segment::{EdgeGeometry, Start, Vertex};
use crate::scene::Scene;
use glam::DVec3;

/// An edge of a subpath, from the previous vertex to this one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathEdge {
    /// Geometry and optical depth of the edge.
    pub geometry: EdgeGeometry,
    /// Unit direction at the previous vertex, towards this one.
    pub leaving: DVec3,
    /// Unit direction at this vertex, towards the previous one.
    pub back: DVec3,
    /// Index at the previous vertex, on the side where the edge leaves it.
    pub n_before: f64,
    /// Index at this vertex, on the side where the edge arrives.
    pub n_after: f64,
    /// Discovery probability of the edge: see [`crate::path::Connection::discovery`]; 0 if
    /// connections do not search for the edge, or if the subpath does not weigh strategies.
    pub discovery: f64,
    /// True if connections search for edges like this one.
    pub connectable: bool,
}

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// Position and scattering of the vertex.
    pub vertex: Vertex,
    /// Edge that led to the vertex.
    pub(crate) edge: PathEdge,
    /// Throughput up to the vertex, including its scattering coefficient.
    pub throughput: Spectrum,
    /// Number of edges and specular events up to the vertex.
    pub depth: u32,
    /// Optical path length up to the vertex.
    pub optical_length: f64,
    /// Density with which the subpath sampled the vertex.
    pub forward: f64,
    /// Density with which the opposite subpath would sample the vertex. It is known when the
    /// subpath has two further vertices.
    pub backward: f64,
    /// True if the subpath continues from the vertex along a specular lobe.
    pub specular: bool,
}

/// Escape of a subpath from the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Escape {
    /// Edge that left the scene. Its discovery probability is 1 if connections search for edges
    /// like this one.
    pub edge: PathEdge,
    /// Throughput up to the escape.
    pub throughput: Spectrum,
    /// Number of edges and specular events up to the escape.
    pub depth: u32,
    /// Optical path length up to the escape: see [`crate::path::Edge::optical_length`].
    pub optical_length: f64,
    /// Density per steradian of the direction of escape.
    pub forward: f64,
}

/// Vertices of a subpath in the order in which they were sampled. The end on the sensor or on an
/// emitter is not among them.
#[derive(Clone, Debug)]
pub(crate) struct Subpath {
    /// Start of the subpath.
    pub start: Start,
    /// Vertices of the subpath.
    pub vertices: Vec<PathVertex>,
    /// Escape from the scene, if the subpath ended with one.
    pub escape: Option<Escape>,
    /// Density with which the opposite subpath would sample the end from the first vertex, without
    /// the cosine there.
    pub end_backward: f64,
}

impl Subpath {
    /// Makes a subpath that has only a start.
    pub(super) fn new(start: Start) -> Self {
        Subpath {
            start,
            vertices: Vec::new(),
            escape: None,
            end_backward: 0.0,
        }
    }

    /// Computes the density with which the opposite subpath would sample the second-last vertex.
    /// The density is known once the ray `onward` from the last vertex is sampled.
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
    /// Returns the probability that connections discover the edge to this vertex, for a path that
    /// continues like the subpath. It is 0 at a specular lobe, where no connection starts or ends.
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

    /// Returns the density per steradian with which a path arriving from the direction `from` would
    /// continue backwards along the edge to this vertex.
    pub(crate) fn reverse_pdf(&self, scene: &Scene, from: DVec3) -> f64 {
        // Planted error "reverse density of the direction in which the path came", found by morgana-transport/transport::furnace::bidirectional_estimators:
        // self.vertex.seen_from(from).pdf(scene, -self.edge.back)
        self.vertex.seen_from(from).pdf(scene, self.edge.back)
    }

    /// Returns the density with which the vertex before this one is sampled by a ray from here of
    /// density `pdf`.
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

    /// Returns the density, as in [`PathVertex::density_before`], for the end of the subpath,
    /// without the cosine there.
    pub(crate) fn density_end(&self, channel_pdf: Spectrum, pdf: f64) -> f64 {
        let path_edge = &self.edge;
        path_edge.geometry.density(pdf, path_edge.n_before)
            * path_edge.geometry.survival(channel_pdf)
    }
}
