//! The strategies: which vertices are joined.

use super::paths::{Setting, View};
use crate::aim::{Aim, Aimed};
use crate::integrator::Contribution;
use crate::path::{
    Goal, LightPath, Link, Start, Station, Step, Subpath, Vertex, Workspace, environment_aim, guess,
};
use crate::sampling::{Discrete, Sampler};
use glam::DVec3;

/// Two subpaths being joined.
pub struct Joining<'a> {
    pub setting: Setting<'a>,
    pub sampler: &'a mut Sampler,
    pub ws: &'a mut Workspace,
    pub out: &'a mut Vec<Contribution>,
}

impl Joining<'_> {
    /// s = 0: emitters that the sensor subpath came upon.
    pub fn hits(&mut self, sensor: &Subpath) {
        let (setting, scene) = (self.setting, self.setting.scene);
        for i in 0..sensor.stations.len() {
            let z = &sensor.stations[i];
            if let Some((index, radiance, pdf)) = z.vertex.emitted(scene) {
                let aim = Aimed {
                    aim: z.vertex.aim(),
                    pdf: scene.source_probability(index) * pdf,
                    delta: false,
                };
                let ease = self.ease(sensor, (i, &z.step), (index, &aim.aim));
                let stations = &sensor.stations[..=i];
                let found = setting.hit(stations, (index, &aim), (radiance, ease));
                self.out.extend(found);
            }
        }
        let Some(escape) = &sensor.escape else { return };
        for (index, environment) in scene.environments() {
            let toward = -escape.step.back;
            let aim = Aimed {
                aim: environment_aim(scene, toward),
                pdf: scene.source_probability(index) * environment.pdf(toward),
                delta: false,
            };
            let place = (sensor.stations.len(), &escape.step);
            let ease = self.ease(sensor, place, (index, &aim.aim));
            let radiance = environment.radiance(toward);
            let found = setting.escaped(sensor, escape, (index, &aim), (radiance, ease));
            self.out.extend(found);
        }
    }

    /// How easily the connections of s = 1 find the step after `i` stations, at whose end is an emitter.
    fn ease(
        &mut self,
        sensor: &Subpath,
        (i, step): (usize, &Step),
        (index, aim): (usize, &Aim),
    ) -> f64 {
        let scene = self.setting.scene;
        if step.ease == 0.0 {
            return 0.0;
        }
        if i == 0 && scene.sensor().is_parallel() {
            // From a point of the emitter to the sensor's plane; from plane to plane there is nothing.
            return sensor.stations.first().map_or(0.0, |z| {
                let (x, direction) = (sensor.start.x, sensor.start.direction);
                let goal = Goal::sensor(scene, scene.sensor().aim_from(x, direction));
                let way = (&step.tube, step.back, None);
                Link::ease(scene, (&z.vertex, &goal), way, self.ws)
            });
        }
        let vertex = match i {
            0 => Vertex::end(&sensor.start),
            _ => sensor.stations[i - 1].vertex,
        };
        let goal = Goal::emitter(scene, index, *aim);
        let way = (&step.tube, step.leaving, None);
        Link::ease(scene, (&vertex, &goal), way, self.ws)
    }

    /// s = 1: the last of the sensor's stations and an emitter of each class.
    pub fn direct(&mut self, stations: &[Station]) {
        let Some((z, before)) = stations.split_last() else {
            return;
        };
        self.sampler.at_edge(before.len());
        let (setting, scene) = (self.setting, self.setting.scene);
        if z.vertex.is_black(scene) {
            return;
        }
        let receiver = z.vertex.receiver(scene);
        for (i, class) in scene.classes().enumerate() {
            let (choice, u) = self.sampler.next_aim(i);
            let (index, chosen) = scene.choose_emitter(class, &receiver, choice);
            let emitter = &scene.emitters()[index];
            let shape = |object: usize| &scene.objects()[object].shape;
            let aim = emitter.aim(scene.around(), shape, u);
            let goal = Goal::emitter(scene, index, aim.aim);
            self.link(&z.vertex, &goal, |link| {
                setting.direct(stations, link, (index, &aim, chosen))
            });
        }
    }

    /// t = 1: station `j` of an emitter's subpath and the sensor.
    pub fn sensed(&mut self, light: &LightPath, j: usize) {
        let setting = self.setting;
        let aimed = setting.scene.sensor().aim(self.sampler.next_2d());
        let goal = Goal::sensor(setting.scene, aimed.aim);
        let y = &light.subpath.stations[j].vertex;
        self.link(y, &goal, |link| setting.sensed((light, j), link));
    }

    /// The last of the sensor's stations and every station of an emitter's subpath.
    pub fn joined_to_all(&mut self, stations: &[Station], light: &LightPath) {
        for j in 0..light.subpath.stations.len() {
            self.joined(stations, (light, j), 1.0);
        }
    }

    /// The last of the sensor's stations and one station of an emitter's subpath, chosen in proportion to
    /// a guess of what it brings. A connection takes several rays, a guess takes none.
    pub fn joined_to_one(&mut self, stations: &[Station], light: &LightPath) {
        let (Some(z), u) = (stations.last(), self.sampler.next_1d()) else {
            return;
        };
        let scene = self.setting.scene;
        let guesses = light.subpath.stations.iter().map(|y| guess(scene, z, y));
        let guesses: Vec<f64> = guesses.collect();
        let Ok(choice) = Discrete::new(&with_floor(guesses)) else {
            return;
        };
        let pick = choice.sample(u);
        self.joined(stations, (light, pick.index), pick.probability);
    }

    /// The last of the sensor's stations and station `j` of an emitter's subpath, if this pair was chosen
    /// with a probability.
    fn joined(&mut self, stations: &[Station], (light, j): (&LightPath, usize), chosen: f64) {
        let Some(z) = stations.last() else { return };
        let setting = self.setting;
        let y = &light.subpath.stations[j];
        if z.depth.saturating_add(y.depth) >= setting.max_depth {
            return;
        }
        let goal = Goal::vertex(&y.vertex);
        self.link(&z.vertex, &goal, |link| {
            let found = setting.joined(stations, (light, j), link)?;
            Some(Contribution {
                value: found.value * (1.0 / chosen),
                ..found
            })
        });
    }

    /// s = t = 1: the start of an emitter's subpath and the sensor.
    pub fn seen(&mut self, light: &LightPath) {
        let (setting, scene) = (self.setting, self.setting.scene);
        let aim = scene.sensor().aim(self.sampler.next_2d()).aim;
        if scene.emitters()[light.emitter].is_delta() {
            return;
        }
        match (aim, light.emission.aim) {
            (Aim::Point { position, .. }, emission) => {
                let medium = scene.medium_of_sensor_ray(position);
                let vertex = Vertex::end(&Start::point(position, DVec3::Z, medium));
                let goal = Goal::emitter(scene, light.emitter, emission);
                self.link(&vertex, &goal, |link| {
                    let view = View {
                        link: *link,
                        sensor: (position, link.direction),
                        emitter: (link.origin, link.emission),
                        n: [link.n_vertex, link.n_aim],
                    };
                    setting.seen(light, &view)
                });
            }
            (Aim::Plane { .. }, Aim::Point { .. }) => {
                let start = light.subpath.start;
                let vertex = Vertex::source(scene, &start, &light.emission.aim);
                let goal = Goal::sensor(scene, aim);
                self.link(&vertex, &goal, |link| {
                    let view = View {
                        link: *link,
                        sensor: (link.origin, link.emission),
                        emitter: (start.x, link.direction),
                        n: [link.n_aim, link.n_vertex],
                    };
                    setting.seen(light, &view)
                });
            }
            // No parallel light goes exactly along parallel views.
            (Aim::Plane { .. }, Aim::Plane { .. }) => {}
        }
    }

    fn link(
        &mut self,
        vertex: &Vertex,
        goal: &Goal,
        evaluate: impl Fn(&Link) -> Option<Contribution>,
    ) {
        let scene = self.setting.scene;
        let found = Link::each(scene, (vertex, goal), self.sampler, self.ws, evaluate);
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
    match sum > 0.0 && sum.is_finite() {
        true => guesses.iter().map(|&g| mixed(g)).collect(),
        false => vec![1.0; guesses.len()],
    }
}
