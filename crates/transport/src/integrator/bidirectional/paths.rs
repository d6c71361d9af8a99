//! Whole paths: contributions, and densities of all vertices (docs/theory.md#bidirectional,
//! docs/theory.md#vertex-merging).

use super::merging::MergeContents;
use super::weight::{Density, Heuristic, Technique, weight};
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, EndSample, OnSurface};
use crate::film::PathFacts;
use crate::integrator::Contribution;
use crate::path::{
    Connection, EmittedAlong, EmitterEnd, Escape, LightPath, PathEdge, PathVertex, Resampling,
    StrategyRates, Subpath, TransportMode, Vertex, lead_in,
};
use crate::photons::Photon;
use crate::scene::Scene;
use glam::DVec3;

/// Data shared by all paths of a sample.
#[derive(Clone, Copy)]
pub(crate) struct StrategyContext<'a> {
    pub scene: &'a Scene,
    pub channel_pdf: Spectrum,
    pub heuristic: Heuristic,
    /// Probabilities with which strategies are used.
    pub rates: StrategyRates,
    /// Weight of merging against other techniques.
    pub merging: MergeContents,
    pub max_depth: u32,
}

/// An emitter that the sensor subpath found.
struct EmitterHit<'a> {
    edge: &'a PathEdge,
    forward: f64,
    depth: u32,
    optical_length: f64,
    /// Point on the ray of the emitter's light.
    x: DVec3,
}

/// A path, with the strategy that sampled it.
struct Sampled {
    /// Position on the image.
    image: Option<[f64; 2]>,
    /// Numbers of vertices (s, t).
    strategy: (u32, u32),
    technique: Technique,
    /// Number of edges and specular events.
    depth: u32,
    optical_length: f64,
    emitter: usize,
}

impl StrategyContext<'_> {
    /// Returns the contribution of an emitter that the sensor subpath hit at its last vertex. `end`
    /// describes the point on the emitter, with a density that includes the probability of the
    /// emitter. `discovery` is the probability that connections discover the last edge.
    pub(crate) fn hit(
        &self,
        vertices: &[PathVertex],
        emitter: usize,
        end: &EndSample,
        radiance: Spectrum,
        discovery: f64,
    ) -> Option<Contribution> {
        let (z, before) = vertices.split_last()?;
        // Compute T L_e/n², where T is the throughput up to the emitter.
        let value = z.throughput * radiance / (z.edge.n_after * z.edge.n_after);
        let last = EmitterHit {
            edge: &z.edge,
            forward: z.forward,
            depth: z.depth,
            optical_length: z.optical_length,
            x: z.vertex.position(),
        };
        self.found(before, &last, emitter, end, value, discovery)
    }

    /// Returns the contribution of an environment towards which the sensor subpath escaped.
    pub(crate) fn escaped(
        &self,
        sensor: &Subpath,
        escape: &Escape,
        emitter: usize,
        end: &EndSample,
        radiance: Spectrum,
        discovery: f64,
    ) -> Option<Contribution> {
        let path_edge = &escape.edge;
        let value = escape.throughput * radiance / (path_edge.n_after * path_edge.n_after);
        let last = EmitterHit {
            edge: path_edge,
            forward: escape.forward,
            depth: escape.depth,
            optical_length: escape.optical_length,
            x: sensor
                .vertices
                .last()
                .map_or(sensor.start.x, |z| z.vertex.position()),
        };
        self.found(&sensor.vertices, &last, emitter, end, value, discovery)
    }

    /// Returns the contribution of the light `value` that arrives from a volume in view.
    pub(crate) fn seen(&self, along: &EmittedAlong, value: Spectrum) -> Option<Contribution> {
        // No other strategy finds this light, so its weight is one.
        let end = Density {
            from_sensor: 1.0,
            from_emitter: 1.0,
            discovery: 0.0,
            merging: 0.0,
        };
        let sampled = Sampled {
            image: None,
            strategy: (0, 2),
            technique: Technique::Connection { t: 2 },
            depth: along.depth,
            optical_length: along.optical_length,
            emitter: along.emitter,
        };
        self.contribution(sampled, value, &[end])
    }

    fn found(
        &self,
        vertices: &[PathVertex],
        last: &EmitterHit,
        index: usize,
        end: &EndSample,
        value: Spectrum,
        discovery: f64,
    ) -> Option<Contribution> {
        // List the densities of x₁ … x_k from both sides; x_k is the emitter's end.
        let path_edge = last.edge;
        let before = vertices.last().map(|b| {
            let emitter = &self.scene.emitters()[index];
            let pdf = emitter.pdf_emit(self.scene.around(), &end.end, last.x, path_edge.back);
            let event = b.vertex.event(
                self.scene,
                self.channel_pdf,
                path_edge.leaving,
                &path_edge.geometry,
            );
            path_edge.geometry.density(pdf, path_edge.n_before) * event
        });
        let ratio = |b: &PathVertex| self.hit_strategy_ratio(&b.vertex, index);
        let mut path = self.sensor_side(vertices, before);
        path.push(Density {
            from_sensor: last.forward,
            from_emitter: end.pdf,
            discovery: discovery * vertices.last().map_or(1.0, ratio),
            merging: 0.0,
        });
        let sampled = Sampled {
            image: None,
            strategy: (0, vertices.len() as u32 + 2),
            technique: Technique::Connection {
                t: vertices.len() + 2,
            },
            depth: last.depth,
            optical_length: last.optical_length,
            emitter: index,
        };
        self.contribution(sampled, value, &path)
    }

    /// Returns the contribution of a connection from the last sensor vertex to a sampled end at an
    /// emitter.
    pub(crate) fn direct(
        &self,
        vertices: &[PathVertex],
        connection: &Connection,
        chosen: &EmitterEnd,
    ) -> Option<Contribution> {
        let z = vertices.last()?;
        let (index, end) = (chosen.emitter, &chosen.sampled);
        let emitter = &self.scene.emitters()[index];
        let (start, direction) = (connection.origin, connection.emission);
        let emitted = self.scene.leaving(index, &end.end, start, direction);
        // Compute T f̃ e^{−τ} F̄ times the emitted radiance, intensity or irradiance.
        let eval = z
            .vertex
            .eval(self.scene, connection.direction, TransportMode::Radiance);
        let value = z.throughput * eval * emitted * connection.transmittance();
        // List the densities of x₁ … x_k. Two of them follow from the emitter's end and its ray.
        let around = self.scene.around();
        let emission = emitter.pdf_emit(around, &end.end, connection.origin, connection.emission);
        let mut path = self.connected_densities(vertices, connection, emission);
        let event =
            cosine(&end.end, connection.emission) * connection.geometry.survival(self.channel_pdf);
        let pdf = z.vertex.pdf(self.scene, connection.direction);
        let by_chance = connection.geometry.density(pdf, connection.n_end) * event;
        path.push(Density {
            from_sensor: if end.delta { 0.0 } else { by_chance },
            from_emitter: self.scene.source_probability(index) * end.pdf,
            // Planted error "one strategy does not count the candidates of its end", found by morgana-transport/transport::resampled_ends::bidirectional_furnaces:
            // discovery: connection.discovery * chosen.probability / self.scene.source_probability(index),
            // Planted error "discovery of rare branches ignored in one strategy", found by morgana-transport/transport::furnace::bidirectional_estimators:
            // discovery: 0.0 * self.strategy_ratio(&z.vertex, chosen.probability, index),
            discovery: connection.discovery
                * self.strategy_ratio(&z.vertex, chosen.probability, index),
            merging: 0.0,
        });
        let sampled = Sampled {
            image: None,
            strategy: (1, vertices.len() as u32 + 1),
            technique: Technique::Connection {
                t: vertices.len() + 1,
            },
            depth: z.depth.saturating_add(1 + connection.geometry.events),
            optical_length: z.optical_length + connection.optical_length
                - lead_in(self.scene, index),
            emitter: index,
        };
        // Multiply by G over the density of the end, and by the weight of its choice.
        let density = chosen.probability * end.pdf;
        // Planted error "resampled ends of bidirectional paths count as if drawn by chance", found by morgana-transport/transport::resampled_ends::bidirectional_furnaces:
        // let factor = connection.geometry.geometry_term / density;
        let factor = connection.geometry.geometry_term * chosen.weight / density;
        self.contribution(sampled, value * factor, &path)
    }

    /// Returns the ratio of two densities of an end at `emitter`: by connections of a vertex, which
    /// choose the emitter with `probability`, and by light subpaths. Connections make strategy s =
    /// 1, light subpaths all strategies with s > 1.
    fn strategy_ratio(&self, vertex: &Vertex, probability: f64, emitter: usize) -> f64 {
        let class = self.scene.emitters()[emitter].class();
        let samples = Resampling::of(self.scene, class, vertex).samples;
        samples * probability / self.scene.source_probability(emitter)
    }

    /// Returns the ratio of [`Self::strategy_ratio`] for an end that no connection has chosen.
    fn hit_strategy_ratio(&self, vertex: &Vertex, emitter: usize) -> f64 {
        let receiver = vertex.receiver(self.scene);
        let probability = self.scene.emitter_probability(emitter, &receiver);
        self.strategy_ratio(vertex, probability, emitter)
    }

    /// Returns the contribution of a connection from the last sensor vertex to vertex `j` of an
    /// emitter subpath.
    pub(crate) fn connected(
        &self,
        vertices: &[PathVertex],
        light: &LightPath,
        j: usize,
        connection: &Connection,
    ) -> Option<Contribution> {
        let (z, y) = (vertices.last()?, &light.subpath.vertices[j]);
        // Compute T_z f̃_z e^{−τ} F̄ f̃_y T_y; the factor G follows below.
        let scattered = z
            .vertex
            .eval(self.scene, connection.direction, TransportMode::Radiance)
            * y.vertex
                .eval(self.scene, connection.emission, TransportMode::Importance);
        let value = z.throughput * scattered * y.throughput * connection.transmittance();
        // List the densities: the sensor's vertices up to z, then the emitter's from y.
        let from_y = y.vertex.pdf(self.scene, connection.emission);
        let mut path = self.connected_densities(vertices, connection, from_y);
        let from_z = z.vertex.pdf(self.scene, connection.direction);
        let event = y.vertex.event(
            self.scene,
            self.channel_pdf,
            connection.emission,
            &connection.geometry,
        );
        // Planted error "density without the Jacobian between two subpaths", found by morgana-transport/transport::furnace::bidirectional_estimators:
        // let arrival = from_z * event;
        let arrival = connection.geometry.density(from_z, connection.n_end) * event;
        path.extend(self.emitter_side(
            light,
            j,
            connection.emission,
            connection.discovery,
            arrival,
        ));
        let depth = z.depth.saturating_add(y.depth);
        let sampled = Sampled {
            image: None,
            strategy: (j as u32 + 2, vertices.len() as u32 + 1),
            technique: Technique::Connection {
                t: vertices.len() + 1,
            },
            depth: depth.saturating_add(1 + connection.geometry.events),
            // Planted error "optical length of the emitter's subpath forgotten where subpaths are joined", found by morgana-transport/transport::layers::estimators::estimators_agree_in_every_bin:
            // optical_length: z.optical_length + connection.optical_length,
            optical_length: z.optical_length + connection.optical_length + y.optical_length,
            emitter: light.emitter,
        };
        self.contribution(sampled, value * connection.geometry.geometry_term, &path)
    }

    /// Returns the contribution of a connection from vertex `j` of an emitter subpath to the
    /// sensor.
    pub(crate) fn sensed(
        &self,
        light: &LightPath,
        j: usize,
        connection: &Connection,
    ) -> Option<Contribution> {
        let y = &light.subpath.vertices[j];
        let sensed = self
            .scene
            .sensor()
            .sense(connection.origin, connection.emission)?;
        // Compute n_s² W and T_y f̃_y e^{−τ} F̄; the factor G follows below.
        // Planted error "light image not multiplied by n² of the sensor", found by morgana-transport/transport::reciprocity::light_and_sensor:
        // let importance = sensed.density;
        let importance = connection.n_end * connection.n_end * sensed.density;
        let value = y.throughput
            * y.vertex
                .eval(self.scene, connection.direction, TransportMode::Importance)
            * connection.transmittance();
        // List the densities of the emitter's vertices; y is x₁.
        let event = y.vertex.event(
            self.scene,
            self.channel_pdf,
            connection.direction,
            &connection.geometry,
        );
        let arrival = connection
            .geometry
            .density(sensed.density, connection.n_vertex)
            * event;
        let path = self.emitter_side(
            light,
            j,
            connection.direction,
            connection.discovery,
            arrival,
        );
        let sampled = Sampled {
            image: Some(sensed.image),
            strategy: (j as u32 + 2, 1),
            technique: Technique::Connection { t: 1 },
            depth: y.depth.saturating_add(1 + connection.geometry.events),
            optical_length: y.optical_length + connection.optical_length,
            emitter: light.emitter,
        };
        self.contribution(
            sampled,
            value * (connection.geometry.geometry_term * importance),
            &path,
        )
    }

    /// Returns the contribution of the last sensor vertex merged with a close photon on an emitter
    /// subpath, without the kernel.
    pub(crate) fn merged(
        &self,
        vertices: &[PathVertex],
        light: &LightPath,
        photon: &Photon,
    ) -> Option<Contribution> {
        let (z, before) = vertices.split_last()?;
        // Compute T/σ_s p Φ/n_p², or T f̃ Φ/n_p²: eq. (photon sum).
        let scattered = match z.vertex {
            Vertex::Volume {
                x,
                direction,
                medium,
            } => {
                let medium = self.scene.medium(medium);
                let scattering = medium.extinction_along(x, direction) * medium.albedo.at(x);
                // Planted error "light scattered twice where vertices are merged in a medium", found by morgana-transport/transport::photons::merging::merging_in_fog_shows_what_no_connection_finds:
                // let inverse = |_: f64| 1.0;
                let inverse = |s: f64| if s > 0.0 { s.recip() } else { 0.0 };
                photon.phase(self.scene, direction) * scattering.map(inverse)
            }
            Vertex::Surface { .. } => photon.reflected(self.scene, &z.vertex)?,
        };
        let value = z.throughput * scattered * photon.power;
        // List the densities: the sensor's vertices before z, then the emitter's from the photon's
        // vertex, which is also z.
        let y = &light.subpath.vertices[photon.vertex];
        let mut path = self.sensor_side_before(z, before, y.edge.back);
        path.extend(self.emitter_side(
            light,
            photon.vertex,
            z.edge.back,
            z.edge.discovery,
            z.forward,
        ));
        let sampled = Sampled {
            image: None,
            strategy: (photon.vertex as u32 + 2, vertices.len() as u32 + 1),
            technique: Technique::Merging { t: vertices.len() },
            depth: z.depth.saturating_add(y.depth),
            optical_length: z.optical_length + y.optical_length,
            emitter: light.emitter,
        };
        self.contribution(sampled, value, &path)
    }

    fn contribution(
        &self,
        sampled: Sampled,
        value: Spectrum,
        path: &[Density],
    ) -> Option<Contribution> {
        if sampled.depth > self.max_depth || value.is_zero() {
            return None;
        }
        let weight = weight(self.heuristic, path, sampled.technique, &self.rates);
        Some(Contribution {
            image: sampled.image,
            strategy: sampled.strategy,
            value,
            bias: Spectrum::ZERO,
            weight: weight.own,
            shares: weight.shares,
            path: PathFacts {
                optical_length: sampled.optical_length,
                bounces: sampled.depth - 1,
                emitter: sampled.emitter,
            },
        })
    }

    /// Returns the densities of the vertices from the sensor up to a connected vertex. `pdf` is the
    /// density with which the other end samples the direction of the connection.
    fn connected_densities(
        &self,
        vertices: &[PathVertex],
        connection: &Connection,
        pdf: f64,
    ) -> Vec<Density> {
        let Some((z, before)) = vertices.split_last() else {
            return Vec::new();
        };
        let event = z.vertex.event(
            self.scene,
            self.channel_pdf,
            connection.direction,
            &connection.geometry,
        );
        let arrival = connection.geometry.density(pdf, connection.n_vertex) * event;
        let mut path = self.sensor_side_before(z, before, connection.direction);
        path.push(Density {
            from_sensor: z.forward,
            from_emitter: arrival,
            discovery: z.edge.discovery,
            merging: self.merging.at(&z.vertex),
        });
        path
    }

    /// Returns the densities of the vertices before `z` on a sensor subpath, if the path continues
    /// from `z` in `direction`.
    fn sensor_side_before(
        &self,
        z: &PathVertex,
        before: &[PathVertex],
        direction: DVec3,
    ) -> Vec<Density> {
        let last = before.last().map(|b| {
            let pdf = z.reverse_pdf(self.scene, direction);
            z.density_before(self.scene, self.channel_pdf, b, pdf)
        });
        self.sensor_side(before, last)
    }

    /// Returns the densities of the vertices from vertex `j` of an emitter subpath to the emitter.
    /// A connection leaves the vertex in `direction` and has the probability `discovery`; the
    /// sensor's side samples the vertex with density `arrival`.
    fn emitter_side(
        &self,
        light: &LightPath,
        j: usize,
        direction: DVec3,
        discovery: f64,
        arrival: f64,
    ) -> Vec<Density> {
        let vertices = &light.subpath.vertices[..=j];
        let y = &vertices[j];
        let reverse = y.reverse_pdf(self.scene, direction);
        let (mut discovery, mut path) = (discovery, Vec::with_capacity(j + 2));
        for (i, path_vertex) in vertices.iter().enumerate().rev() {
            let from_sensor = match j - i {
                0 => arrival,
                1 => y.density_before(self.scene, self.channel_pdf, path_vertex, reverse),
                _ => path_vertex.backward,
            };
            path.push(Density {
                from_sensor,
                from_emitter: path_vertex.forward,
                discovery,
                merging: match j - i {
                    0 => self.merging.at(&path_vertex.vertex),
                    _ => self.merging.going_on(path_vertex),
                },
            });
            discovery = match j - i {
                0 => path_vertex.edge.discovery,
                _ => path_vertex.discovery_going_on(),
            };
        }
        let by_chance = match j {
            0 => y.density_end(self.channel_pdf, reverse),
            _ => light.subpath.end_backward,
        };
        let delta = self.scene.emitters()[light.emitter].is_delta();
        let cosine = cosine(&light.emission.end, vertices[0].edge.leaving);
        // Orient the first vertex as if the sensor subpath arrived there.
        let from = match vertices.get(1) {
            Some(next) => next.edge.leaving,
            None => direction,
        };
        // Planted error "light subpaths do not know how often connections find their end", found by morgana-transport/transport::agreement::surfaces::shining_pictures:
        // let _ = from;
        discovery *= self.hit_strategy_ratio(&vertices[0].vertex.seen_from(from), light.emitter);
        path.push(Density {
            from_sensor: if delta { 0.0 } else { by_chance * cosine },
            from_emitter: light.density,
            discovery,
            merging: 0.0,
        });
        path
    }

    /// Returns the densities of the vertices of a sensor subpath that continues from all of them.
    /// `last` is the density of the last vertex from the emitter's side.
    fn sensor_side(&self, vertices: &[PathVertex], last: Option<f64>) -> Vec<Density> {
        let density = |s: &PathVertex| Density {
            from_sensor: s.forward,
            from_emitter: s.backward,
            discovery: s.discovery_going_on(),
            merging: self.merging.going_on(s),
        };
        let mut path: Vec<Density> = vertices.iter().map(density).collect();
        if let (Some(d), Some(last)) = (path.last_mut(), last) {
            d.from_emitter = last;
        }
        path
    }
}

/// Returns the cosine at the end of a path, or 1 if the end lies on no surface.
fn cosine(end: &ConnectionEnd, direction: DVec3) -> f64 {
    match end {
        ConnectionEnd::Point {
            surface: Some(OnSurface { normal, .. }),
            ..
        } => normal.dot(direction).max(0.0),
        _ => 1.0,
    }
}
