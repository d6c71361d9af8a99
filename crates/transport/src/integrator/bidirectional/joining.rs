//! Strategies: connection (docs/theory.md#bidirectional) and merging
//! (docs/theory.md#vertex-merging) of vertices.

use super::merging::Merging;
use super::paths::StrategyContext;
use crate::Spectrum;
use crate::budget::PHOTONS_PER_GATHER;
use crate::connection_end::{ConnectionEnd, EndSample};
use crate::emitter::EmittedRay;
use crate::integrator::Contribution;
use crate::path::{
    BranchPoint, Connection, ConnectionArcs, ConnectionTarget, Edge, EdgePart, EmittedAlong,
    EmitterEnd, EndChoice, FoundBranch, FoundPath, LightPath, PathEdge, PathLog, PathVertex,
    StrategyKind, Subpath, SubpathEnd, TransportMode, Vertex, Workspace, environment_end,
    gather_in_view, guess,
};
use crate::photons::Photon;
use crate::sampling::{Discrete, Sampler};
use glam::DVec3;
use std::collections::BTreeMap;

/// Selection of the vertices of two subpaths to connect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Connections {
    /// Connect every vertex of the sensor subpath to every vertex of the emitter subpath.
    All,
    /// Connect every vertex of the sensor subpath to one vertex of the emitter subpath, chosen by
    /// an estimate of the contribution. This is the better choice where rays bend, because finding
    /// a connection takes several rays.
    #[default]
    Resampled,
}

/// State of connecting two subpaths.
pub(crate) struct Joining<'a, L> {
    pub context: StrategyContext<'a>,
    pub sampler: &'a mut Sampler,
    pub ws: &'a mut Workspace,
    pub out: &'a mut Vec<Contribution>,
    /// Receives the paths of all contributions.
    pub log: &'a mut L,
}

/// Two ends of a connection.
#[derive(Clone, Copy)]
enum Ends<'a> {
    /// Vertex number `i` of the sensor subpath, and a sampled end at an emitter.
    Direct {
        i: usize,
        z: &'a Vertex,
        end: &'a EmitterEnd,
    },
    /// Vertex number `j` of the light subpath, and the sensor.
    Sensed { j: usize, y: &'a Vertex },
    /// Vertex number `i` of the sensor subpath, and vertex number `j` of the light subpath.
    Joined {
        i: usize,
        z: &'a Vertex,
        j: usize,
        y: &'a Vertex,
    },
}

/// Contribution of a connection, with the data from which its factors follow.
struct Connected<W> {
    contribution: Contribution,
    connection_log: W,
    /// Start of the ray at the end of the connection, and the directions in which the connection
    /// leaves the vertex and its end.
    origin: DVec3,
    direction: DVec3,
    emission: DVec3,
}

impl<'a> Ends<'a> {
    /// Returns the vertex that the connection is made from.
    fn vertex(&self) -> &'a Vertex {
        match self {
            Ends::Direct { z, .. } | Ends::Joined { z, .. } => z,
            Ends::Sensed { y, .. } => y,
        }
    }

    /// Returns the subpath to which this vertex belongs.
    fn mode(&self) -> TransportMode {
        match self {
            Ends::Direct { .. } | Ends::Joined { .. } => TransportMode::Radiance,
            Ends::Sensed { .. } => TransportMode::Importance,
        }
    }

    /// Logs the path of the connection.
    fn tell<L: PathLog>(&self, connected: &Connected<L::ConnectionLog>, log: &mut L) {
        let turned = |number: usize, vertex: &'a Vertex, direction: DVec3| {
            Some(SubpathEnd {
                turn: Some((vertex, direction)),
                ..SubpathEnd::at(BranchPoint::Vertex(number))
            })
        };
        let (sensor, light, ray) = match *self {
            Ends::Direct { i, z, end } => {
                let ray = EmittedRay {
                    emitter: end.emitter,
                    end: end.sampled.end,
                    x: connected.origin,
                    direction: connected.emission,
                };
                (turned(i, z, connected.direction), None, Some(ray))
            }
            Ends::Sensed { j, y } => (None, turned(j, y, connected.direction), None),
            Ends::Joined { i, z, j, y } => {
                let sensor = turned(i, z, connected.direction);
                (sensor, turned(j, y, connected.emission), None)
            }
        };
        log.contribute(&FoundPath {
            sensor,
            light,
            connection_log: Some(&connected.connection_log),
            ray: ray.as_ref(),
        });
    }
}

impl<L: PathLog> Joining<'_, L> {
    /// Evaluates all strategies.
    pub(crate) fn all(
        &mut self,
        sensor: &Subpath,
        light: Option<&LightPath>,
        connections: Connections,
    ) {
        // s = 0: add the emitters that the sensor subpath hits.
        self.hits(sensor);
        let mut cost = self.ws.stats().cost();
        let mut spent = |ws: &Workspace| {
            let before = std::mem::replace(&mut cost, ws.stats().cost());
            cost - before
        };
        // s = 1: connect each sensor vertex to a newly sampled emitter.
        for i in 0..sensor.vertices.len() {
            self.direct(&sensor.vertices[..=i]);
        }
        self.ws.strategy_work.direct += spent(self.ws);
        let Some(light) = light else { return };
        // t = 1: connect each emitter vertex to the sensor.
        for j in 0..light.subpath.vertices.len() {
            self.sensed(light, j);
        }
        self.ws.strategy_work.sensed += spent(self.ws);
        // s, t ≥ 2: connect the vertices of both subpaths.
        for i in 0..sensor.vertices.len() {
            let vertices = &sensor.vertices[..=i];
            match connections {
                Connections::All => self.connected_to_all(vertices, light),
                Connections::Resampled => self.connected_to_one(vertices, light),
            }
        }
        self.ws.strategy_work.joined += spent(self.ws);
    }

    /// Adds emitters that the sensor subpath hit (s = 0).
    pub(crate) fn hits(&mut self, sensor: &Subpath) {
        let (context, scene) = (self.context, self.context.scene);
        // Add emitters on surfaces, which end the path at a vertex.
        for i in 0..sensor.vertices.len() {
            let z = &sensor.vertices[i];
            if let Some((index, radiance, pdf)) = z.vertex.emitted(scene) {
                let end = EndSample {
                    end: z.vertex.as_end(),
                    pdf: scene.source_probability(index) * pdf,
                    delta: false,
                };
                let discovery = self.discovery(sensor, i, &z.edge, index, &end.end);
                let vertices = &sensor.vertices[..=i];
                let ray = EmittedRay {
                    emitter: index,
                    end: end.end,
                    x: z.vertex.position(),
                    direction: z.edge.back,
                };
                let found = context.hit(vertices, index, &end, radiance, discovery);
                self.hit(i, ray, found);
            }
        }
        self.in_view(sensor);
        // Add environments, if the subpath left the scene.
        let Some(escape) = &sensor.escape else { return };
        for (index, environment) in scene.environments() {
            let toward = -escape.edge.back;
            let end = EndSample {
                end: environment_end(scene, toward),
                pdf: scene.source_probability(index) * environment.pdf(toward),
                delta: false,
            };
            let i = sensor.vertices.len();
            let discovery = self.discovery(sensor, i, &escape.edge, index, &end.end);
            let radiance = environment.radiance(toward);
            let found = context.escaped(sensor, escape, index, &end, radiance, discovery);
            let ray = EmittedRay {
                emitter: index,
                end: end.end,
                x: sensor.start.x,
                direction: -toward,
            };
            self.hit(i, ray, found);
        }
    }

    /// Adds the light of an emitter's ray that an edge of the sensor subpath found, if it found
    /// any.
    fn hit(&mut self, edge: usize, ray: EmittedRay, found: Option<Contribution>) {
        let Some(found) = found else { return };
        self.log.contribute(&FoundPath {
            sensor: Some(SubpathEnd::at(BranchPoint::Vertex(edge))),
            light: None,
            connection_log: None,
            ray: Some(&ray),
        });
        self.out.push(found);
    }

    /// Adds volumes that emit in view of the sensor, which no strategy with s > 0 finds.
    fn in_view(&mut self, sensor: &Subpath) {
        let (context, start) = (self.context, sensor.start);
        let (out, log) = (&mut *self.out, &mut *self.log);
        let n = context.scene.n(start.medium, start.x);
        let white = context.channel_pdf.map(|p| f64::from(u8::from(p > 0.0)));
        let (scene, channel_pdf) = (context.scene, context.channel_pdf);
        let found = |along: EmittedAlong, passed: &[Edge], last: &Edge| {
            let value = along.light * white * (n * n);
            if let Some(found) = context.seen(&along, value) {
                let ray = EmittedRay::within(along.emitter, along.x);
                let part = EdgePart {
                    edge: last,
                    length: along.length,
                    scatters: false,
                };
                log.contribute(&FoundPath {
                    sensor: Some(SubpathEnd {
                        passed,
                        part: Some(part),
                        ..SubpathEnd::at(BranchPoint::Start)
                    }),
                    light: None,
                    connection_log: None,
                    ray: Some(&ray),
                });
                out.push(found);
            }
        };
        gather_in_view(scene, start, channel_pdf, self.sampler, self.ws, found);
    }

    /// Returns the probability that connections with s = 1 discover the edge `path_edge` after `i`
    /// vertices, which ends at an emitter.
    fn discovery(
        &mut self,
        sensor: &Subpath,
        i: usize,
        path_edge: &PathEdge,
        index: usize,
        end: &ConnectionEnd,
    ) -> f64 {
        let scene = self.context.scene;
        // Only hits find an emitter in view.
        if i == 0 || path_edge.discovery == 0.0 {
            return 0.0;
        }
        let vertex = sensor.vertices[i - 1].vertex;
        let target = ConnectionTarget::emitter(scene, index, *end);
        let branch = FoundBranch {
            geometry: &path_edge.geometry,
            direction: path_edge.leaving,
            optical_length: None,
        };
        Connection::discovery(scene, &vertex, &target, &branch, self.ws)
    }

    /// Samples whether a strategy with the given probability is used.
    fn uses(&mut self, probability: f64) -> bool {
        probability >= 1.0 || self.sampler.next_1d() < probability
    }

    /// Connects the last sensor vertex to an emitter of each class (s = 1).
    fn direct(&mut self, vertices: &[PathVertex]) {
        let Some((z, before)) = vertices.split_last() else {
            return;
        };
        self.sampler.at_edge(before.len());
        let (context, scene) = (self.context, self.context.scene);
        if z.vertex.is_black(scene) {
            return;
        }
        // Choose an emitter of each class, and a point on it, by an estimate of the contribution.
        let receiver = z.vertex.receiver(scene);
        let used = context.rates.direct;
        for (i, class) in scene.classes().enumerate() {
            let (u, place) = self.sampler.next_end(i);
            if !self.uses(used) {
                continue;
            }
            let choice = EndChoice {
                scene,
                vertex: &z.vertex,
                receiver: &receiver,
                class,
                rate: used,
            };
            let Some(end) = choice.sample(u, place, self.sampler, &mut self.ws.stats) else {
                continue;
            };
            let target = ConnectionTarget::emitter(scene, end.emitter, end.sampled.end);
            let ends = Ends::Direct {
                i: before.len(),
                z: &z.vertex,
                end: &end,
            };
            self.connection(ends, &target, used, |connection| {
                context.direct(vertices, connection, &end)
            });
        }
    }

    /// Connects vertex `j` of an emitter subpath to the sensor (t = 1).
    pub(crate) fn sensed(&mut self, light: &LightPath, j: usize) {
        let context = self.context;
        if !self.uses(context.rates.sensed) {
            return;
        }
        let sampled = context.scene.sensor().sample_end(self.sampler.next_2d());
        let target = ConnectionTarget::sensor(context.scene, sampled.end);
        let y = &light.subpath.vertices[j].vertex;
        let used = context.rates.of(StrategyKind::Sensed);
        self.connection(Ends::Sensed { j, y }, &target, used, |connection| {
            context.sensed(light, j, connection)
        });
    }

    /// Connects the last sensor vertex to every vertex of an emitter subpath.
    fn connected_to_all(&mut self, vertices: &[PathVertex], light: &LightPath) {
        for j in 0..light.subpath.vertices.len() {
            if self.uses(self.context.rates.joined) {
                self.connected(vertices, light, j, 1.0);
            }
        }
    }

    /// Connects the last sensor vertex to one vertex of an emitter subpath, chosen in proportion to
    /// an estimate of the contribution. A connection takes several rays, an estimate takes none.
    fn connected_to_one(&mut self, vertices: &[PathVertex], light: &LightPath) {
        let (Some(z), u) = (vertices.last(), self.sampler.next_1d()) else {
            return;
        };
        if !self.uses(self.context.rates.joined) {
            return;
        }
        let scene = self.context.scene;
        // Choose y among the emitter vertices by these estimates.
        let guesses = light.subpath.vertices.iter().map(|y| guess(scene, z, y));
        let guesses: Vec<f64> = guesses.collect();
        let Ok(choice) = Discrete::new(&with_floor(guesses)) else {
            return;
        };
        // Connect to y, and divide by the probability of the choice.
        let pick = choice.sample(u);
        self.connected(vertices, light, pick.index, pick.probability);
    }

    /// Connects the last sensor vertex to vertex `j` of an emitter subpath, given the probability
    /// `chosen` with which this pair was chosen.
    fn connected(&mut self, vertices: &[PathVertex], light: &LightPath, j: usize, chosen: f64) {
        let Some(z) = vertices.last() else { return };
        let context = self.context;
        let y = &light.subpath.vertices[j];
        if z.depth.saturating_add(y.depth) >= context.max_depth {
            return;
        }
        let target = ConnectionTarget::vertex(&y.vertex);
        let used = chosen * context.rates.of(StrategyKind::Joined);
        let ends = Ends::Joined {
            i: vertices.len() - 1,
            z: &z.vertex,
            j,
            y: &y.vertex,
        };
        self.connection(ends, &target, used, |connection| {
            context.connected(vertices, light, j, connection)
        });
    }

    /// Merges the last sensor vertex with all close vertices of light subpaths.
    pub(crate) fn merged(&mut self, vertices: &[PathVertex], merging: &Merging) {
        let (Some(z), context) = (vertices.last(), self.context) else {
            return;
        };
        if z.vertex.is_black(context.scene) || z.throughput.is_zero() {
            return;
        }
        let (x, kernel) = (z.vertex.position(), merging.kernel(&z.vertex));
        let photons = &merging.light.photons;
        let tree = match z.vertex {
            Vertex::Volume { .. } => &photons.volume,
            Vertex::Surface { .. } => &photons.surface,
        };
        // Sum the contributions separately for each layer of the film.
        let mut sums: BTreeMap<usize, Contribution> = BTreeMap::new();
        let (mut looked_at, stop) = (0, &self.ws.stop);
        let mut is_given_up = false;
        tree.visit(
            |bounds| bounds.nearest_distance(x) < kernel.radius(),
            |photon: &Photon| {
                looked_at += 1;
                is_given_up |= looked_at > PHOTONS_PER_GATHER || stop.is_raised();
                let (Some((kernel, bias)), false) = (kernel.between(photon.x, x), is_given_up)
                else {
                    return;
                };
                let light = merging.light.path(photon.path);
                let Some(found) = light.and_then(|light| context.merged(vertices, light, photon))
                else {
                    return;
                };
                let weighted = found.weighted();
                let sum = sums
                    .entry(merging.decomposition.layer(&found.path))
                    .or_insert(Contribution {
                        value: Spectrum::ZERO,
                        weight: 1.0,
                        ..found
                    });
                sum.value += weighted * kernel;
                sum.bias += weighted * bias;
            },
        );
        self.out.extend(sums.into_values());
        self.ws.stats.over_budget.gathers += u64::from(is_given_up);
    }

    /// Adds the contributions of a connection that is made with some probability.
    fn connection(
        &mut self,
        ends: Ends,
        target: &ConnectionTarget,
        probability: f64,
        evaluate: impl Fn(&Connection) -> Option<Contribution>,
    ) {
        let (scene, log) = (self.context.scene, &mut *self.log);
        let evaluate = |connection: &Connection, arcs: ConnectionArcs| {
            evaluate(connection).map(|contribution| Connected {
                contribution,
                connection_log: log.log_connection(ends.mode(), ends.vertex(), arcs),
                origin: connection.origin,
                direction: connection.direction,
                emission: connection.emission,
            })
        };
        let (sampler, ws) = (&mut *self.sampler, &mut *self.ws);
        let found = Connection::each_with_arcs(scene, ends.vertex(), target, sampler, ws, evaluate);
        for (connected, weight) in found {
            ends.tell(&connected, self.log);
            let contribution = connected.contribution;
            self.out.push(Contribution {
                value: contribution.value * (weight / probability),
                ..contribution
            });
        }
    }
}

/// Fraction of uniform choices. Estimates along straight lines may be wrong for curved rays.
const UNIFORM_FRACTION: f64 = 0.2;

/// Mixes estimates with a uniform fraction, so that none is zero.
fn with_floor(guesses: Vec<f64>) -> Vec<f64> {
    let sum: f64 = guesses.iter().sum();
    let mixed =
        |g: f64| (1.0 - UNIFORM_FRACTION) * g / sum + UNIFORM_FRACTION / guesses.len() as f64;
    if sum > 0.0 && sum.is_finite() {
        guesses.iter().map(|&g| mixed(g)).collect()
    } else {
        vec![1.0; guesses.len()]
    }
}
