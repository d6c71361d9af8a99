//! Subpaths from either end, with the densities that the combination of estimators needs.
//!
//! Vertices of a whole path are x₀ (sensor) … x_k (emitter). Each has two densities: that with which it
//! is sampled from the side of the sensor, given the vertices before it, and that from the side of the
//! emitter. A subpath knows both for its vertices as far as they do not depend on what comes
//! after its last one.

use crate::Spectrum;
use crate::path::connection::{Connection, ConnectionTarget};
use crate::path::segment::{Edge, EdgeGeometry, End, Scatter, Start, TransportMode, Vertex};
use crate::path::walk::{Sampling, trace};
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::Scene;
use glam::DVec3;

/// An edge of a subpath, from the previous vertex to this one.
#[derive(Clone, Copy, Debug)]
pub struct PathEdge {
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
    /// Discovery probability of the edge: see [`Connection::discovery`]; 0 if connections do not look for it.
    pub discovery: f64,
}

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// The vertex.
    pub vertex: Vertex,
    /// The edge that led to it.
    pub edge: PathEdge,
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
pub struct Escape {
    /// The edge that left; its discovery probability is 1 if connections look for such edges.
    pub edge: PathEdge,
    /// Throughput up to there.
    pub throughput: Spectrum,
    /// Edges and specular events so far.
    pub depth: u32,
    /// Optical path length so far: see [`Edge::optical_length`].
    pub optical_length: f64,
    /// Density per steradian with which it left this way.
    pub forward: f64,
}

/// The vertices of a subpath in the order in which they were sampled; its end, on the sensor or an
/// emitter, is not among them.
#[derive(Clone, Debug)]
pub struct Subpath {
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

/// How subpaths are sampled.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// What they carry.
    pub mode: TransportMode,
    /// Channel probabilities.
    pub channel_pdf: Spectrum,
    /// Most edges and specular events.
    pub max_depth: u32,
    /// Most vertices.
    pub max_vertices: usize,
    /// Depth at which Russian roulette begins.
    pub rr_depth: u32,
    /// Whether [`PathEdge::discovery`] is wanted: it takes connections to find out.
    pub weighs: bool,
}

/// A ray with which a subpath goes on.
#[derive(Clone, Copy, Debug)]
pub struct SubpathRay {
    /// Where it starts.
    pub start: Start,
    /// Density per steradian from a point, per unit area from a plane; 1 along a specular lobe.
    pub pdf: f64,
    /// Throughput.
    pub throughput: Spectrum,
    /// Optical path length so far.
    pub optical_length: f64,
}

/// Russian roulette never lets a path go on with a larger probability than this.
const LONGEST_ROULETTE: f64 = 0.95;

impl Walker {
    /// Samples a subpath that starts with a ray. `end` is how connections aim at its end.
    pub fn walk(
        &self,
        scene: &Scene,
        ray: SubpathRay,
        end: &ConnectionTarget,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> Subpath {
        let mut subpath = Subpath {
            start: ray.start,
            vertices: Vec::new(),
            escape: None,
            end_backward: 0.0,
        };
        let sampling = Sampling {
            mode: self.mode,
            channel_pdf: self.channel_pdf,
            extend: false,
            collides: true,
            spans: self.mode == TransportMode::Importance,
            forced: false,
            splitting: false,
        };
        let (mut next, mut depth, mut passed) = (Some(ray), 0, false);
        while let Some(current) = next.take() {
            // Sample the next edge.
            let mut edge = trace(scene, current.start, sampling, sampler, ws);
            depth += 1 + edge.geometry.events;
            if depth > self.max_depth {
                if self.mode == TransportMode::Importance {
                    ws.particle_balance.cut += current.throughput.sum();
                }
                break;
            }
            // Find the vertex at its end, unless it left the scene, and the throughput T up to it.
            let throughput = current.throughput * edge.throughput(scene, self.channel_pdf);
            let optical_length = current.optical_length + edge.optical_length;
            let Some(vertex) = Vertex::of(scene, &edge) else {
                self.enter(scene, &edge, (current.throughput, Spectrum::ZERO), ws);
                edge.connectable &= !passed;
                subpath.escape = self.escape(scene, &edge, &current, (throughput, depth));
                break;
            };
            sampler.next_edge();
            // Draw a direction there.
            let scatter = vertex.scatter(scene, sampler);
            let onward = scatter.map_or(Spectrum::ZERO, |s| throughput * s.weight);
            self.enter(scene, &edge, (current.throughput, onward), ws);
            edge.connectable &= !passed;
            passed = scatter.is_some_and(|s| s.delta);
            // Record the edge and the vertex: e, and p→ by eq. (density along an edge).
            let mut path_edge = step(scene, &edge, &vertex);
            if self.weighs && edge.connectable {
                path_edge.discovery =
                    self.discovery(scene, &subpath, (&vertex, &path_edge, &edge), end, ws);
            }
            let event = vertex.event(scene, self.channel_pdf, path_edge.back, &path_edge.geometry);
            subpath.vertices.push(PathVertex {
                vertex,
                edge: path_edge,
                throughput,
                depth,
                optical_length,
                forward: path_edge.geometry.density(current.pdf, path_edge.n_after) * event,
                backward: 0.0,
                specular: passed,
            });
            let Some(scatter) = scatter else { break };
            // Now that the direction is known, so is p← of the vertex before.
            subpath.look_back(scene, self.channel_pdf, &scatter);
            if subpath.vertices.len() < self.max_vertices {
                let onward = SubpathRay {
                    start: scatter.start,
                    pdf: if passed { 1.0 } else { scatter.pdf },
                    throughput: onward,
                    optical_length,
                };
                // Play Russian roulette.
                next = self.roulette(onward, depth, ray.throughput, sampler);
            }
        }
        subpath
    }

    /// Keeps the energy balance: see [`ParticleBalance::enter`].
    fn enter(&self, scene: &Scene, edge: &Edge, powers: (Spectrum, Spectrum), ws: &mut Workspace) {
        if self.mode == TransportMode::Importance {
            ws.particle_balance
                .enter((scene, self.channel_pdf), edge, powers);
        }
    }

    /// How easily connections find the edge that led to a new vertex. They are made from the vertex
    /// nearer to the sensor, but to the sensor itself from its neighbour.
    fn discovery(
        &self,
        scene: &Scene,
        subpath: &Subpath,
        (vertex, path_edge, edge): (&Vertex, &PathEdge, &Edge),
        end: &ConnectionTarget,
        ws: &mut Workspace,
    ) -> f64 {
        match (subpath.vertices.last(), self.mode) {
            (None, _) => {
                let way = (
                    &path_edge.geometry,
                    path_edge.back,
                    Some(edge.optical_length),
                );
                Connection::discovery(scene, (vertex, end), way, ws)
            }
            (Some(before), TransportMode::Importance) => {
                let target = ConnectionTarget::vertex(&before.vertex);
                Connection::discovery(
                    scene,
                    (vertex, &target),
                    (&path_edge.geometry, path_edge.back, None),
                    ws,
                )
            }
            (Some(before), TransportMode::Radiance) => {
                let target = ConnectionTarget::vertex(vertex);
                let way = (&path_edge.geometry, path_edge.leaving, None);
                Connection::discovery(scene, (&before.vertex, &target), way, ws)
            }
        }
    }

    /// The edge by which a subpath left the scene, if that is how it ended.
    fn escape(
        &self,
        scene: &Scene,
        edge: &Edge,
        ray: &SubpathRay,
        (throughput, depth): (Spectrum, u32),
    ) -> Option<Escape> {
        let End::Escaped { direction, medium } = edge.end else {
            return None;
        };
        let path_edge = PathEdge {
            geometry: edge.geometry,
            leaving: edge.start.direction,
            back: -direction,
            n_before: scene.n(edge.start.medium, edge.start.x),
            n_after: scene.n(medium, edge.start.x),
            discovery: f64::from(u8::from(edge.connectable)),
        };
        let survival = path_edge.geometry.survival(self.channel_pdf);
        Some(Escape {
            edge: path_edge,
            throughput,
            depth,
            optical_length: ray.optical_length + edge.optical_length,
            forward: path_edge.geometry.density(ray.pdf, path_edge.n_after) * survival,
        })
    }

    /// Ends subpaths that have lost most of what they carried by chance, without bias.
    fn roulette(
        &self,
        mut ray: SubpathRay,
        depth: u32,
        initial: Spectrum,
        sampler: &mut Sampler,
    ) -> Option<SubpathRay> {
        if ray.throughput.is_zero() {
            return None;
        }
        if depth >= self.rr_depth {
            let survival = (ray.throughput.max() / initial.max()).min(LONGEST_ROULETTE);
            if sampler.next_1d() >= survival {
                return None;
            }
            ray.throughput *= 1.0 / survival;
        }
        Some(ray)
    }
}

impl Subpath {
    /// Now that it is known where the path goes on from its last vertex, so is the density with which
    /// the opposite subpath would have sampled the vertex before that.
    fn look_back(&mut self, scene: &Scene, channel_pdf: Spectrum, scatter: &Scatter) {
        let Some((last, before)) = self.vertices.split_last_mut() else {
            return;
        };
        let pdf = if scatter.delta {
            1.0
        } else {
            last.reverse_pdf(scene, scatter.start.direction)
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
    pub fn discovery_going_on(&self) -> f64 {
        if self.specular {
            0.0
        } else {
            self.edge.discovery
        }
    }

    /// Density per steradian with which a path that comes from the direction `from` would go on along
    /// the path_edge that led here, backwards.
    pub fn reverse_pdf(&self, scene: &Scene, from: DVec3) -> f64 {
        self.vertex.seen_from(from).pdf(scene, self.edge.back)
    }

    /// Density with which the vertex before this one is sampled by a ray from here of density `pdf`.
    pub fn density_before(
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
    pub fn density_end(&self, channel_pdf: Spectrum, pdf: f64) -> f64 {
        let path_edge = &self.edge;
        path_edge.geometry.density(pdf, path_edge.n_before)
            * path_edge.geometry.survival(channel_pdf)
    }
}

/// The path_edge by which a subpath came to a vertex.
fn step(scene: &Scene, edge: &Edge, vertex: &Vertex) -> PathEdge {
    PathEdge {
        geometry: edge.geometry,
        leaving: edge.start.direction,
        back: -vertex.arrival(),
        n_before: scene.n(edge.start.medium, edge.start.x),
        n_after: scene.n(vertex.medium(), vertex.position()),
        discovery: 0.0,
    }
}
