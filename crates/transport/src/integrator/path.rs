//! Path tracing: sensor subpaths, next-event estimation over curved connections, and multiple
//! importance sampling against emitters that are hit by chance.

use super::Contribution;
use crate::Spectrum;
use crate::aim::{Aim, OnSurface};
use crate::emitter::Emitter;
use crate::film::PathFacts;
use crate::path::{
    Carry, Edge, End, Equiangular, Goal, Link, Sampling, Scatter, Start, Vertex, Workspace,
    environment_aim, lead_in, scatter, scatter_pdf, trace,
};
use crate::sampling::{Purpose, Sampler};
use crate::scene::Scene;
use crate::sensor::Ray;

/// The path tracer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathTracer {
    /// Longest path, in edges; `None` for no limit. 1 shows emitters only, 2 adds single scattering.
    pub max_depth: Option<u32>,
    /// Number of edges after which Russian roulette begins.
    pub rr_depth: u32,
}

impl Default for PathTracer {
    fn default() -> Self {
        PathTracer {
            max_depth: None,
            rr_depth: 5,
        }
    }
}

/// Russian roulette never lets a path go on with a larger probability than this.
const LONGEST_ROULETTE: f64 = 0.95;

/// A direction that is due to be followed, and what MIS must know of it.
struct Next {
    start: Start,
    /// Throughput, in basic radiance: n² of the sensor included.
    throughput: Spectrum,
    /// The vertex and the density with which it chose the direction; `None` if no connection
    /// competes (from the sensor, or along a specular lobe).
    from: Option<(Vertex, f64)>,
    /// How far the path has come.
    way: Way,
}

/// How long a part of a path is.
#[derive(Clone, Copy, Default)]
struct Way {
    /// Edges and specular events.
    depth: u32,
    optical_length: f64,
}

impl Way {
    /// With another edge, which passes some specular events.
    fn and(self, events: u32, optical_length: f64) -> Self {
        Way {
            depth: self.depth.saturating_add(1 + events),
            optical_length: self.optical_length + optical_length,
        }
    }
}

/// What a connection brings, and how far it goes.
struct Light {
    value: Spectrum,
    events: u32,
    optical_length: f64,
}

struct Tracing<'a> {
    scene: &'a Scene,
    sampler: &'a mut Sampler,
    ws: &'a mut Workspace,
    out: &'a mut Vec<Contribution>,
    /// Point-like emitters make it worthwhile to sample distances around them.
    equiangular: bool,
}

impl PathTracer {
    /// The contributions to the radiance that arrives along a sensor ray; their sum is unbiased.
    /// `channels` is the number of channels in use.
    pub(super) fn sample(
        &self,
        scene: &Scene,
        ray: Ray,
        channels: usize,
        (sampler, ws): (&mut Sampler, &mut Workspace),
        out: &mut Vec<Contribution>,
    ) {
        let medium = scene.medium_of_sensor_ray(ray.origin);
        let start = Start::point(ray.origin, ray.direction, medium);
        let n = scene.n(start.medium, start.x);
        let mut tracing = Tracing {
            scene,
            sampler,
            ws,
            out,
            equiangular: !scene.attractors().is_empty(),
        };
        let white = |c| if c < channels { n * n } else { 0.0 };
        let mut next = Some(Next {
            start,
            throughput: Spectrum(std::array::from_fn(white)),
            from: None,
            way: Way::default(),
        });
        while let Some(edge) = next {
            next = self.edge(&mut tracing, edge);
        }
    }

    /// Follows one edge, hands over what it finds, and scatters at its end.
    fn edge(&self, t: &mut Tracing, next: Next) -> Option<Next> {
        let lanes = next.throughput / next.throughput.sum();
        let sampling = Sampling {
            carry: Carry::Radiance,
            lanes,
            extend: t.equiangular,
            collides: true,
        };
        let edge = trace(t.scene, next.start, sampling, t.sampler, t.ws);
        let budget = self.budget(next.way.depth + 1);
        if t.equiangular && budget > 0 {
            t.around_emitter(&edge, &next, lanes, budget);
        }
        let way = next.way.and(edge.tube.events, edge.optical_length);
        if self.max_depth.is_some_and(|limit| way.depth > limit) {
            return None;
        }
        t.emission(&edge, &next, way, lanes);
        let budget = self.budget(way.depth);
        if budget == 0 {
            return None;
        }
        let vertex = Vertex::of(t.scene, &edge)?;
        let throughput = next.throughput * edge.throughput(t.scene, lanes);
        t.direct(&vertex, (&edge, way), (throughput, lanes), budget);
        let next = t.scatter(vertex, throughput, way)?;
        self.roulette(t, next)
    }

    /// How much longer a path of `depth` may get.
    fn budget(&self, depth: u32) -> u32 {
        self.max_depth
            .map_or(u32::MAX, |limit| limit.saturating_sub(depth))
    }

    /// Ends paths of little throughput by chance, without bias. The scale is the throughput of
    /// radiance, so that n² of the medium does not count.
    fn roulette(&self, t: &mut Tracing, mut next: Next) -> Option<Next> {
        if next.throughput.is_zero() {
            return None;
        }
        if next.way.depth < self.rr_depth {
            return Some(next);
        }
        let n = t
            .scene
            .n(t.scene.sensor_medium(), t.scene.sensor().position());
        let survival = (next.throughput.max() / (n * n)).min(LONGEST_ROULETTE);
        if t.sampler.next_1d_for(Purpose::Roulette) >= survival {
            return None;
        }
        next.throughput *= 1.0 / survival;
        Some(next)
    }
}

impl Tracing<'_> {
    /// Light emitted where the edge ends, weighted against the connection that competes for it.
    fn emission(&mut self, edge: &Edge, next: &Next, way: Way, lanes: Spectrum) {
        match edge.end {
            End::Surface {
                object,
                hit,
                direction,
                medium,
            } => {
                let on = OnSurface {
                    object,
                    normal: hit.normal,
                    site: self.scene.objects()[object].shape.site(&hit),
                };
                let Some((emitter, radiance, pdf)) = self.scene.emitted(&on, -direction) else {
                    return;
                };
                let n = self.scene.n(medium, hit.position);
                let aim = Aim::Point {
                    position: hit.position,
                    surface: Some(on),
                };
                let cos = hit.normal.dot(-direction);
                let weight = self.mis(edge, next, lanes, (emitter, pdf, &aim), (n, cos));
                let light = radiance / (n * n) * weight;
                self.emitted(light, (edge, next), lanes, (way, emitter));
            }
            End::Escaped { direction, medium } => {
                let n = self.scene.n(medium, edge.start.x);
                let scene = self.scene;
                for (emitter, environment) in scene.environments() {
                    let pdf = environment.pdf(direction);
                    let aim = environment_aim(scene, direction);
                    let weight = self.mis(edge, next, lanes, (emitter, pdf, &aim), (n, 1.0));
                    let light = environment.radiance(direction) / (n * n) * weight;
                    self.emitted(light, (edge, next), lanes, (way, emitter));
                }
            }
            End::Collision(_) | End::Dead => {}
        }
    }

    /// Hands over light that is emitted at the end of an edge.
    fn emitted(
        &mut self,
        light: Spectrum,
        (edge, next): (&Edge, &Next),
        lanes: Spectrum,
        (way, emitter): (Way, usize),
    ) {
        if !light.is_zero() {
            let value = light * next.throughput * edge.throughput(self.scene, lanes);
            self.hand_over(value, way, emitter);
        }
    }

    fn hand_over(&mut self, value: Spectrum, way: Way, emitter: usize) {
        self.out.push(Contribution {
            image: None,
            strategy: (0, 0),
            value,
            weight: 1.0,
            path: PathFacts {
                optical_length: way.optical_length,
                bounces: way.depth - 1,
                emitter,
            },
        });
    }

    /// Hands over a share of what connections from a vertex to an emitter bring.
    fn connected(&mut self, light: Vec<(Light, f64)>, share: f64, (way, emitter): (Way, usize)) {
        for (light, weight) in light {
            let way = way.and(light.events, light.optical_length);
            self.hand_over(light.value * (weight * share), way, emitter);
        }
    }

    /// Balance heuristic for an edge that was sampled from its start and found an emitter, where the
    /// index is `n` and the cosine `cos`, against the connections that look for such edges.
    fn mis(
        &mut self,
        edge: &Edge,
        next: &Next,
        lanes: Spectrum,
        (emitter, pdf, aim): (usize, f64, &Aim),
        (n, cos): (f64, f64),
    ) -> f64 {
        let Some((vertex, direction_pdf)) = &next.from else {
            return 1.0;
        };
        if !edge.connectable {
            return 1.0;
        }
        let goal = Goal::emitter(self.scene, emitter, *aim);
        let way = (&edge.tube, edge.start.direction, None);
        let ease = Link::ease(self.scene, (vertex, &goal), way, self.ws);
        let by_connection = self.scene.emitter_probability(emitter) * pdf * ease;
        let by_chance = edge.tube.density(*direction_pdf, n) * cos * edge.tube.survival(lanes);
        by_chance / (by_chance + by_connection)
    }

    /// Next-event estimation at the vertex where an edge ended: what it scatters of one emitter's
    /// light, chosen at random. `throughput` is that up to the vertex.
    fn direct(
        &mut self,
        vertex: &Vertex,
        (edge, way): (&Edge, Way),
        (throughput, lanes): (Spectrum, Spectrum),
        budget: u32,
    ) {
        let u = self.sampler.next_1d_for(Purpose::Emitter);
        let choice = self.scene.choose_emitter(u);
        let Some((index, probability)) = choice.filter(|_| !throughput.is_zero()) else {
            return;
        };
        let u = self.sampler.next_2d_for(Purpose::Aim);
        let light = self.connect(vertex, throughput, (index, probability, u), budget);
        if light.is_empty() {
            return;
        }
        let emitter = &self.scene.emitters()[index];
        let share = match (&edge.end, self.around(edge, emitter)) {
            (End::Collision(point), Some(around)) => {
                // The same vertex could have been placed by its distance to the emitter.
                let by_collision = Edge::collision_density(lanes, point);
                by_collision / (by_collision + around.pdf(point.length))
            }
            _ => 1.0,
        };
        self.connected(light, share, (way, index));
    }

    /// Single scattering at a point of the edge that is chosen by its distance to a point-like
    /// emitter: its light falls off as 1/r², and collisions alone would sample it with infinite
    /// variance (theory §9).
    fn around_emitter(&mut self, edge: &Edge, next: &Next, lanes: Spectrum, budget: u32) {
        let u = self.sampler.next_1d_for(Purpose::AroundEmitter);
        let choice = self.scene.choose_emitter(u);
        let u = self.sampler.next_1d_for(Purpose::Around);
        let Some((index, probability)) = choice else {
            return;
        };
        let emitter = &self.scene.emitters()[index];
        let Some(around) = self.around(edge, emitter) else {
            return;
        };
        let Some(point) = edge.at_length(around.sample(u)) else {
            return;
        };
        let albedo = self.scene.medium(point.medium).albedo.at(point.x);
        let scattering = point.rate * albedo * point.depth.exp_neg() * point.weight;
        if scattering.is_zero() {
            return;
        }
        let density = around.pdf(point.length) + Edge::collision_density(lanes, &point);
        let throughput = next.throughput * scattering / density;
        let vertex = Vertex::volume(&point);
        let u = self.sampler.next_2d_for(Purpose::AroundAim);
        let light = self.connect(&vertex, throughput, (index, probability, u), budget);
        if !light.is_empty() {
            let way = next.way.and(0, edge.optical_length_at(point.length));
            self.connected(light, 1.0, (way, index));
        }
    }

    fn around(&self, edge: &Edge, emitter: &Emitter) -> Option<Equiangular> {
        if !self.equiangular {
            return None;
        }
        Equiangular::new(edge, emitter.singularity()?)
    }

    /// What a vertex scatters of the light of an emitter that was chosen with some probability,
    /// weighted against finding it by chance, for a path of given throughput up to the vertex; `u` chooses the
    /// place on the emitter.
    fn connect(
        &mut self,
        vertex: &Vertex,
        throughput: Spectrum,
        (index, probability, u): (usize, f64, [f64; 2]),
        budget: u32,
    ) -> Vec<(Light, f64)> {
        let scene = self.scene;
        let emitter = &scene.emitters()[index];
        let shape = |object: usize| &scene.objects()[object].shape;
        let aimed = emitter.aim(scene.around(), shape, u);
        let density = probability * aimed.pdf;
        let goal = Goal::emitter(scene, index, aimed.aim);
        let behind = lead_in(scene, index);
        Link::each(scene, (vertex, &goal), self.sampler, self.ws, |link| {
            let emitted = emitter.emitted(&aimed.aim, link.origin, link.emission);
            let aimed = (&aimed.aim, density, aimed.delta);
            let value = received(scene, vertex, throughput, link, emitted, aimed);
            (link.tube.events < budget && !value.is_zero()).then_some(Light {
                value,
                events: link.tube.events,
                optical_length: link.optical_length - behind,
            })
        })
    }

    fn scatter(&mut self, vertex: Vertex, throughput: Spectrum, way: Way) -> Option<Next> {
        self.sampler.next_edge();
        let Scatter {
            start,
            weight,
            pdf,
            delta,
        } = scatter(self.scene, &vertex, self.sampler)?;
        Some(Next {
            start,
            throughput: throughput * weight,
            from: (!delta).then_some((vertex, pdf)),
            way,
        })
    }
}

/// What a link brings to the sensor, for an aim of given density; `delta` if nothing else can find
/// the emitter.
fn received(
    scene: &Scene,
    vertex: &Vertex,
    throughput: Spectrum,
    link: &Link,
    emitted: Spectrum,
    (aim, density, delta): (&Aim, f64, bool),
) -> Spectrum {
    let scattered = throughput * vertex.eval(scene, link.direction);
    let received = scattered * link.transmittance() * emitted;
    if received.is_zero() {
        return Spectrum::ZERO;
    }
    let weight = if delta {
        1.0
    } else {
        // As the edge would be sampled if scattering chose this direction.
        let lanes = scattered / scattered.sum();
        let cos = match aim {
            Aim::Point {
                surface: Some(OnSurface { normal, .. }),
                ..
            } => normal.dot(link.emission),
            _ => 1.0,
        };
        let pdf = scatter_pdf(scene, vertex, link.direction);
        let by_chance = link.tube.density(pdf, link.n_aim) * cos * link.tube.survival(lanes);
        let by_connection = density * link.ease;
        by_connection / (by_connection + by_chance)
    };
    received * (link.tube.geometry * weight / density)
}
