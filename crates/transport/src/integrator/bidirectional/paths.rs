//! Whole paths: what they contribute, and the densities of all their vertices.

use super::weight::{Density, Heuristic, weight};
use crate::Spectrum;
use crate::aim::{Aim, Aimed, OnSurface};
use crate::film::PathFacts;
use crate::integrator::Contribution;
use crate::path::{Escape, LightPath, Link, Station, Step, Subpath, Vertex, lead_in};
use crate::scene::Scene;
use glam::DVec3;

/// What all paths have in common.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    pub scene: &'a Scene,
    pub lanes: Spectrum,
    pub heuristic: Heuristic,
    pub max_depth: u32,
}

/// A ray between the sensor and an emitter.
pub struct View {
    pub link: Link,
    /// Point on the sensor, and unit direction in which importance leaves it.
    pub sensor: (DVec3, DVec3),
    /// Point on the emitter, and unit direction in which light leaves it.
    pub emitter: (DVec3, DVec3),
    /// Indices at the sensor and at the emitter.
    pub n: [f64; 2],
}

/// An emitter that the sensor subpath found.
struct Found<'a> {
    step: &'a Step,
    forward: f64,
    depth: u32,
    optical_length: f64,
    /// A point on the ray of its light.
    x: DVec3,
}

/// A path, sampled in one of the ways.
struct Sampled {
    /// Where on the image it belongs.
    image: Option<[f64; 2]>,
    /// Numbers of vertices (s, t).
    strategy: (u32, u32),
    /// Edges and specular events.
    depth: u32,
    optical_length: f64,
    emitter: usize,
}

impl Setting<'_> {
    /// The sensor subpath came upon an emitter at the last of its stations. It is what `aim` stands for,
    /// with the probability of the emitter in its density, and connections find the last step with some
    /// ease.
    pub fn hit(
        &self,
        stations: &[Station],
        (index, aim): (usize, &Aimed),
        (radiance, ease): (Spectrum, f64),
    ) -> Option<Contribution> {
        let (z, before) = stations.split_last()?;
        let value = z.throughput * radiance / (z.step.n_after * z.step.n_after);
        let last = Found {
            step: &z.step,
            forward: z.forward,
            depth: z.depth,
            optical_length: z.optical_length,
            x: z.vertex.position(),
        };
        self.found((before, &last), (index, aim), (value, ease))
    }

    /// The sensor subpath left towards an environment.
    pub fn escaped(
        &self,
        sensor: &Subpath,
        escape: &Escape,
        (index, aim): (usize, &Aimed),
        (radiance, ease): (Spectrum, f64),
    ) -> Option<Contribution> {
        let step = &escape.step;
        let value = escape.throughput * radiance / (step.n_after * step.n_after);
        let last = Found {
            step,
            forward: escape.forward,
            depth: escape.depth,
            optical_length: escape.optical_length,
            x: sensor
                .stations
                .last()
                .map_or(sensor.start.x, |z| z.vertex.position()),
        };
        self.found((&sensor.stations, &last), (index, aim), (value, ease))
    }

    fn found(
        &self,
        (stations, last): (&[Station], &Found),
        (index, aim): (usize, &Aimed),
        (value, ease): (Spectrum, f64),
    ) -> Option<Contribution> {
        let step = last.step;
        let before = stations.last().map(|b| {
            let emitter = &self.scene.emitters()[index];
            let pdf = emitter.pdf_emit(self.scene.around(), &aim.aim, last.x, step.back);
            let event = b
                .vertex
                .event(self.scene, self.lanes, step.leaving, &step.tube);
            step.tube.density(pdf, step.n_before) * event
        });
        let favour = |b: &Station| self.favour(&b.vertex, index);
        let mut path = sensor_side(stations, before);
        path.push(Density {
            from_sensor: last.forward,
            from_emitter: aim.pdf,
            ease: ease * stations.last().map_or(1.0, favour),
        });
        let sampled = Sampled {
            image: None,
            strategy: (0, stations.len() as u32 + 2),
            depth: last.depth,
            optical_length: last.optical_length,
            emitter: index,
        };
        self.contribution(sampled, value, &path)
    }

    /// A link from the last of the sensor's stations to an emitter that was chosen with some probability, and then
    /// aimed at.
    pub fn direct(
        &self,
        stations: &[Station],
        link: &Link,
        (index, aim, chosen): (usize, &Aimed, f64),
    ) -> Option<Contribution> {
        let z = stations.last()?;
        let emitter = &self.scene.emitters()[index];
        let emitted = emitter.emitted(&aim.aim, link.origin, link.emission);
        let eval = z.vertex.eval(self.scene, link.direction);
        let value = z.throughput * eval * emitted * link.transmittance();
        let around = self.scene.around();
        let emission = emitter.pdf_emit(around, &aim.aim, link.origin, link.emission);
        let mut path = self.joint(stations, link, emission);
        let event = cosine(&aim.aim, link.emission) * link.tube.survival(self.lanes);
        let pdf = z.vertex.pdf(self.scene, link.direction);
        let by_chance = link.tube.density(pdf, link.n_aim) * event;
        let source = self.scene.source_probability(index);
        path.push(Density {
            from_sensor: if aim.delta { 0.0 } else { by_chance },
            from_emitter: source * aim.pdf,
            ease: link.ease * (chosen / source),
        });
        let sampled = Sampled {
            image: None,
            strategy: (1, stations.len() as u32 + 1),
            depth: z.depth.saturating_add(1 + link.tube.events),
            optical_length: z.optical_length + link.optical_length - lead_in(self.scene, index),
            emitter: index,
        };
        let factor = link.tube.geometry / (chosen * aim.pdf);
        self.contribution(sampled, value * factor, &path)
    }

    /// How much more often connections of a vertex choose an emitter than light subpaths do: the former make
    /// strategy s = 1, the latter all with more of the emitter's vertices.
    fn favour(&self, vertex: &Vertex, emitter: usize) -> f64 {
        let receiver = vertex.receiver(self.scene);
        self.scene.emitter_probability(emitter, &receiver) / self.scene.source_probability(emitter)
    }

    /// A link from the last of the sensor's stations to station `j` of an emitter's subpath.
    pub fn joined(
        &self,
        stations: &[Station],
        (light, j): (&LightPath, usize),
        link: &Link,
    ) -> Option<Contribution> {
        let (z, y) = (stations.last()?, &light.subpath.stations[j]);
        let scattered =
            z.vertex.eval(self.scene, link.direction) * y.vertex.eval(self.scene, link.emission);
        let value = z.throughput * scattered * y.throughput * link.transmittance();
        let from_y = y.vertex.pdf(self.scene, link.emission);
        let mut path = self.joint(stations, link, from_y);
        let from_z = z.vertex.pdf(self.scene, link.direction);
        let event = y
            .vertex
            .event(self.scene, self.lanes, link.emission, &link.tube);
        let arrival = link.tube.density(from_z, link.n_aim) * event;
        path.extend(self.emitter_side((light, j), (link.emission, link.ease), arrival));
        let depth = z.depth.saturating_add(y.depth);
        let sampled = Sampled {
            image: None,
            strategy: (j as u32 + 2, stations.len() as u32 + 1),
            depth: depth.saturating_add(1 + link.tube.events),
            optical_length: z.optical_length + link.optical_length + y.optical_length,
            emitter: light.emitter,
        };
        self.contribution(sampled, value * link.tube.geometry, &path)
    }

    /// A link from station `j` of an emitter's subpath to the sensor.
    pub fn sensed(&self, (light, j): (&LightPath, usize), link: &Link) -> Option<Contribution> {
        let y = &light.subpath.stations[j];
        let sensed = self.scene.sensor().sense(link.origin, link.emission)?;
        let importance = link.n_aim * link.n_aim * sensed.density;
        let value = y.throughput * y.vertex.eval(self.scene, link.direction) * link.transmittance();
        let event = y
            .vertex
            .event(self.scene, self.lanes, link.direction, &link.tube);
        let arrival = link.tube.density(sensed.density, link.n_vertex) * event;
        let path = self.emitter_side((light, j), (link.direction, link.ease), arrival);
        let sampled = Sampled {
            image: Some(sensed.image),
            strategy: (j as u32 + 2, 1),
            depth: y.depth.saturating_add(1 + link.tube.events),
            optical_length: y.optical_length + link.optical_length,
            emitter: light.emitter,
        };
        self.contribution(sampled, value * (link.tube.geometry * importance), &path)
    }

    /// The emitter is seen directly.
    pub fn seen(&self, light: &LightPath, view: &View) -> Option<Contribution> {
        let View { link, .. } = view;
        let emitter = &self.scene.emitters()[light.emitter];
        let aim = &light.emission.aim;
        let sensed = self.scene.sensor().sense(view.sensor.0, view.sensor.1)?;
        let emitted = emitter.emitted(aim, view.emitter.0, view.emitter.1);
        let importance = view.n[0] * view.n[0] * sensed.density;
        let value = emitted * self.white() * link.transmittance();
        let event = cosine(aim, view.emitter.1) * link.tube.survival(self.lanes);
        let path = [Density {
            from_sensor: link.tube.density(sensed.density, view.n[1]) * event,
            from_emitter: light.density,
            ease: link.ease,
        }];
        let sampled = Sampled {
            image: Some(sensed.image),
            strategy: (1, 1),
            depth: 1 + link.tube.events,
            optical_length: link.optical_length - lead_in(self.scene, light.emitter),
            emitter: light.emitter,
        };
        let factor = link.tube.geometry * importance / light.density;
        self.contribution(sampled, value * factor, &path)
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
        Some(Contribution {
            image: sampled.image,
            strategy: sampled.strategy,
            value,
            weight: weight(self.heuristic, path, sampled.strategy.1 as usize),
            path: PathFacts {
                optical_length: sampled.optical_length,
                bounces: sampled.depth - 1,
                emitter: sampled.emitter,
            },
        })
    }

    /// The vertices from the sensor up to one that is linked to something else, which chooses the link's
    /// direction with density `pdf`.
    fn joint(&self, stations: &[Station], link: &Link, pdf: f64) -> Vec<Density> {
        let Some((z, before)) = stations.split_last() else {
            return Vec::new();
        };
        let event = z
            .vertex
            .event(self.scene, self.lanes, link.direction, &link.tube);
        let arrival = link.tube.density(pdf, link.n_vertex) * event;
        let mut path = sensor_side(stations, Some(arrival));
        if let Some(d) = path.last_mut() {
            d.ease = z.step.ease;
        }
        if let (Some(b), [.., d, _]) = (before.last(), &mut path[..]) {
            let pdf = z.reverse_pdf(self.scene, link.direction);
            d.from_emitter = z.density_before(self.scene, self.lanes, b, pdf);
        }
        path
    }

    /// The vertices from station `j` of an emitter's subpath up to the emitter, if a link of some ease
    /// that is seen from the station in a direction samples it with density `arrival`.
    fn emitter_side(
        &self,
        (light, j): (&LightPath, usize),
        (direction, ease): (DVec3, f64),
        arrival: f64,
    ) -> Vec<Density> {
        let stations = &light.subpath.stations[..=j];
        let y = &stations[j];
        let reverse = y.reverse_pdf(self.scene, direction);
        let (mut ease, mut path) = (ease, Vec::with_capacity(j + 2));
        for (i, station) in stations.iter().enumerate().rev() {
            let from_sensor = match j - i {
                0 => arrival,
                1 => y.density_before(self.scene, self.lanes, station, reverse),
                _ => station.backward,
            };
            path.push(Density {
                from_sensor,
                from_emitter: station.forward,
                ease,
            });
            ease = match j - i {
                0 => station.step.ease,
                _ => station.ease_going_on(),
            };
        }
        let by_chance = match j {
            0 => y.density_end(self.lanes, reverse),
            _ => light.subpath.end_backward,
        };
        let delta = self.scene.emitters()[light.emitter].is_delta();
        let cosine = cosine(&light.emission.aim, stations[0].step.leaving);
        // The first vertex as the sensor's subpath would come upon it.
        let from = match stations.get(1) {
            Some(next) => next.step.leaving,
            None => direction,
        };
        ease *= self.favour(&stations[0].vertex.seen_from(from), light.emitter);
        path.push(Density {
            from_sensor: if delta { 0.0 } else { by_chance * cosine },
            from_emitter: light.density,
            ease,
        });
        path
    }

    /// One in every channel in use.
    fn white(&self) -> Spectrum {
        self.lanes.map(|p| f64::from(u8::from(p > 0.0)))
    }
}

/// The vertices of a sensor subpath that goes on from all of them; `last` is the density of the last one from the other side.
fn sensor_side(stations: &[Station], last: Option<f64>) -> Vec<Density> {
    let density = |s: &Station| Density {
        from_sensor: s.forward,
        from_emitter: s.backward,
        ease: s.ease_going_on(),
    };
    let mut path: Vec<Density> = stations.iter().map(density).collect();
    if let (Some(d), Some(last)) = (path.last_mut(), last) {
        d.from_emitter = last;
    }
    path
}

/// Cosine at the end of a path, where that lies on a surface.
fn cosine(aim: &Aim, direction: DVec3) -> f64 {
    match aim {
        Aim::Point {
            surface: Some(OnSurface { normal, .. }),
            ..
        } => normal.dot(direction).max(0.0),
        _ => 1.0,
    }
}
