//! The strategies: which vertices are joined (docs/theory.md#bidirectional).

use super::paths::{Setting, View};
use crate::connection_end::{ConnectionEnd, EndSample};
use crate::integrator::Contribution;
use crate::path::{
    Connection, ConnectionTarget, FoundBranch, LightPath, PathEdge, PathVertex, Start, Subpath,
    Vertex, Workspace, environment_end, guess,
};
use crate::sampling::{Discrete, Sampler};
use glam::DVec3;

/// Two subpaths being joined.
pub(crate) struct Joining<'a> {
    pub setting: Setting<'a>,
    pub sampler: &'a mut Sampler,
    pub ws: &'a mut Workspace,
    pub out: &'a mut Vec<Contribution>,
}

impl Joining<'_> {
    /// s = 0: emitters that the sensor subpath came upon.
    pub fn hits(&mut self, sensor: &Subpath) {
        let (setting, scene) = (self.setting, self.setting.scene);
        // Emitters on surfaces, which end the path at a vertex.
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
                let found = setting.hit(vertices, index, &end, radiance, discovery);
                self.out.extend(found);
            }
        }
        // Environments, if the subpath left the scene.
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
            let found = setting.escaped(sensor, escape, index, &end, radiance, discovery);
            self.out.extend(found);
        }
    }

    /// How easily the connections of s = 1 find the path_edge after `i` vertices, at whose end is an emitter.
    fn discovery(
        &mut self,
        sensor: &Subpath,
        i: usize,
        path_edge: &PathEdge,
        index: usize,
        end: &ConnectionEnd,
    ) -> f64 {
        let scene = self.setting.scene;
        if path_edge.discovery == 0.0 {
            return 0.0;
        }
        if i == 0 && scene.sensor().is_parallel() {
            // From a point of the emitter to the sensor's plane; from plane to plane there is nothing.
            return sensor.vertices.first().map_or(0.0, |z| {
                let (x, direction) = (sensor.start.x, sensor.start.direction);
                let target =
                    ConnectionTarget::sensor(scene, scene.sensor().end_of_ray(x, direction));
                let branch = FoundBranch {
                    geometry: &path_edge.geometry,
                    direction: path_edge.back,
                    optical_length: None,
                };
                Connection::discovery(scene, &z.vertex, &target, &branch, self.ws)
            });
        }
        let vertex = match i {
            0 => Vertex::end(&sensor.start),
            _ => sensor.vertices[i - 1].vertex,
        };
        let target = ConnectionTarget::emitter(scene, index, *end);
        let branch = FoundBranch {
            geometry: &path_edge.geometry,
            direction: path_edge.leaving,
            optical_length: None,
        };
        Connection::discovery(scene, &vertex, &target, &branch, self.ws)
    }

    /// s = 1: the last of the sensor's vertices and an emitter of each class.
    pub fn direct(&mut self, vertices: &[PathVertex]) {
        let Some((z, before)) = vertices.split_last() else {
            return;
        };
        self.sampler.at_edge(before.len());
        let (setting, scene) = (self.setting, self.setting.scene);
        if z.vertex.is_black(scene) {
            return;
        }
        // Choose an emitter of each class by a guess of what it brings, and aim at it.
        let receiver = z.vertex.receiver(scene);
        for (i, class) in scene.classes().enumerate() {
            let (choice, u) = self.sampler.next_end(i);
            let (index, chosen) = scene.choose_emitter(class, &receiver, choice);
            let emitter = &scene.emitters()[index];
            let shape = |object: usize| &scene.objects()[object].shape;
            let end = emitter.sample_end(scene.around(), shape, u);
            let target = ConnectionTarget::emitter(scene, index, end.end);
            self.connection(&z.vertex, &target, |connection| {
                setting.direct(vertices, connection, index, &end, chosen)
            });
        }
    }

    /// t = 1: vertex `j` of an emitter's subpath and the sensor.
    pub fn sensed(&mut self, light: &LightPath, j: usize) {
        let setting = self.setting;
        let sampled = setting.scene.sensor().sample_end(self.sampler.next_2d());
        let target = ConnectionTarget::sensor(setting.scene, sampled.end);
        let y = &light.subpath.vertices[j].vertex;
        self.connection(y, &target, |connection| {
            setting.sensed(light, j, connection)
        });
    }

    /// The last of the sensor's vertices and every vertex of an emitter's subpath.
    pub(crate) fn joined_to_all(&mut self, vertices: &[PathVertex], light: &LightPath) {
        for j in 0..light.subpath.vertices.len() {
            self.joined(vertices, light, j, 1.0);
        }
    }

    /// The last of the sensor's vertices and one vertex of an emitter's subpath, chosen in proportion to
    /// a guess of what it brings. A connection takes several rays, a guess takes none.
    pub(crate) fn joined_to_one(&mut self, vertices: &[PathVertex], light: &LightPath) {
        let (Some(z), u) = (vertices.last(), self.sampler.next_1d()) else {
            return;
        };
        let scene = self.setting.scene;
        // Choose y among the emitter's vertices by guesses.
        let guesses = light.subpath.vertices.iter().map(|y| guess(scene, z, y));
        let guesses: Vec<f64> = guesses.collect();
        let Ok(choice) = Discrete::new(&with_floor(guesses)) else {
            return;
        };
        // Connect to it, and divide by the probability of the choice.
        let pick = choice.sample(u);
        self.joined(vertices, light, pick.index, pick.probability);
    }

    /// The last of the sensor's vertices and vertex `j` of an emitter's subpath, if this pair was chosen
    /// with a probability.
    fn joined(&mut self, vertices: &[PathVertex], light: &LightPath, j: usize, chosen: f64) {
        let Some(z) = vertices.last() else { return };
        let setting = self.setting;
        let y = &light.subpath.vertices[j];
        if z.depth.saturating_add(y.depth) >= setting.max_depth {
            return;
        }
        let target = ConnectionTarget::vertex(&y.vertex);
        self.connection(&z.vertex, &target, |connection| {
            let found = setting.joined(vertices, light, j, connection)?;
            Some(Contribution {
                value: found.value * (1.0 / chosen),
                ..found
            })
        });
    }

    /// s = t = 1: the start of an emitter's subpath and the sensor.
    pub fn seen(&mut self, light: &LightPath) {
        let (setting, scene) = (self.setting, self.setting.scene);
        let end = scene.sensor().sample_end(self.sampler.next_2d()).end;
        if scene.emitters()[light.emitter].is_delta() {
            return;
        }
        match (end, light.emission.end) {
            (ConnectionEnd::Point { position, .. }, emission) => {
                let medium = scene.medium_of_sensor_ray(position);
                let vertex = Vertex::end(&Start::point(position, DVec3::Z, medium));
                let target = ConnectionTarget::emitter(scene, light.emitter, emission);
                self.connection(&vertex, &target, |connection| {
                    let view = View {
                        connection: *connection,
                        sensor: (position, connection.direction),
                        emitter: (connection.origin, connection.emission),
                        n: [connection.n_vertex, connection.n_end],
                    };
                    setting.seen(light, &view)
                });
            }
            (ConnectionEnd::Plane { .. }, ConnectionEnd::Point { .. }) => {
                let start = light.subpath.start;
                let vertex = Vertex::source(scene, &start, &light.emission.end);
                let target = ConnectionTarget::sensor(scene, end);
                self.connection(&vertex, &target, |connection| {
                    let view = View {
                        connection: *connection,
                        sensor: (connection.origin, connection.emission),
                        emitter: (start.x, connection.direction),
                        n: [connection.n_end, connection.n_vertex],
                    };
                    setting.seen(light, &view)
                });
            }
            // No parallel light goes exactly along parallel views.
            (ConnectionEnd::Plane { .. }, ConnectionEnd::Plane { .. }) => {}
        }
    }

    fn connection(
        &mut self,
        vertex: &Vertex,
        target: &ConnectionTarget,
        evaluate: impl Fn(&Connection) -> Option<Contribution>,
    ) {
        let scene = self.setting.scene;
        let found = Connection::each(scene, vertex, target, self.sampler, self.ws, evaluate);
        let weighted = found.into_iter().map(|(c, weight)| Contribution {
            value: c.value * weight,
            ..c
        });
        self.out.extend(weighted);
    }
}

/// Share of the choices that is left to chance: a straight line may know nothing of a curved one.
const FLOOR: f64 = 0.2;

/// Guesses, mixed with a uniform share so that none is zero.
fn with_floor(guesses: Vec<f64>) -> Vec<f64> {
    let sum: f64 = guesses.iter().sum();
    let mixed = |g: f64| (1.0 - FLOOR) * g / sum + FLOOR / guesses.len() as f64;
    if sum > 0.0 && sum.is_finite() {
        guesses.iter().map(|&g| mixed(g)).collect()
    } else {
        vec![1.0; guesses.len()]
    }
}
