//! Next-event estimation: which emitters a vertex is connected to, and what that brings.

use super::{Light, Next, Tracing, Way};
use crate::Spectrum;
use crate::aim::{Aim, OnSurface};
use crate::emitter::Class;
use crate::path::{Edge, End, Equiangular, Found, Goal, Link, Slot, Vertex, lead_in, scatter_pdf};
use crate::sampling::Purpose;
use crate::scene::{Receiver, Scene};

impl Tracing<'_> {
    /// Next-event estimation at the vertex where an edge ended: what it scatters of the light of one emitter of
    /// each class, chosen at random. `throughput` is that up to the vertex.
    pub(super) fn direct(
        &mut self,
        vertex: &Vertex,
        (edge, way): (&Edge, Way),
        (throughput, lanes): (Spectrum, Spectrum),
        budget: u32,
    ) {
        let scene = self.scene;
        if throughput.is_zero() || vertex.is_black(scene) {
            return;
        }
        let receiver = vertex.receiver(scene);
        for (i, class) in scene.classes().enumerate() {
            let rate = self.ws.rates.of(Slot::new(class, vertex));
            if rate < 1.0 && self.sampler.next_1d() >= rate {
                continue;
            }
            let (u, place) = self.sampler.next_aim(i);
            let (index, chosen) = scene.choose_emitter(class, &receiver, u);
            let light = self.connect(vertex, throughput, (index, rate * chosen, place), budget);
            if !light.is_empty() {
                let share = self.collided(edge, (index, chosen), lanes);
                self.connected(light, (vertex, share), (way, index));
            }
        }
    }

    /// The share of a collision at the end of an edge that is connected to an emitter, chosen there with some probability, in
    /// both ways to place the vertex: it could also have been by its distance to the emitter.
    fn collided(&self, edge: &Edge, (index, chosen): (usize, f64), lanes: Spectrum) -> f64 {
        let End::Collision(point) = &edge.end else {
            return 1.0;
        };
        let Some(around) = self.around(edge, index) else {
            return 1.0;
        };
        let by_distance = self.scene.emitter_probability(index, &along(edge));
        let by_distance = by_distance * around.pdf(point.length);
        let by_collision = edge.collision_density(lanes, point) * chosen;
        by_collision / (by_collision + by_distance)
    }

    /// Single scattering at a point of the edge that is chosen by its distance to a point-like
    /// emitter: its light falls off as 1/r², and collisions alone would sample it with infinite
    /// variance (theory §9).
    pub(super) fn around_emitter(
        &mut self,
        edge: &Edge,
        next: &Next,
        lanes: Spectrum,
        budget: u32,
    ) {
        let scene = self.scene;
        let rate = self.ws.rates.of(Slot::IN_MEDIA_TO_DELTA);
        if rate < 1.0 && self.sampler.next_1d() >= rate {
            return;
        }
        let choice = self.sampler.next_1d_for(Purpose::AroundEmitter);
        let u = self.sampler.next_1d_for(Purpose::Around);
        let (index, probability) = scene.choose_emitter(Class::Delta, &along(edge), choice);
        let Some(around) = self.around(edge, index) else {
            return;
        };
        let Some(point) = edge.at_length(around.sample(u)) else {
            return;
        };
        let albedo = scene.medium(point.medium).albedo.at(point.x);
        let scattering = point.rate * albedo * point.depth.exp_neg() * point.weight;
        if scattering.is_zero() {
            return;
        }
        let vertex = Vertex::volume(&point);
        let chosen = scene.emitter_probability(index, &vertex.receiver(scene));
        let by_collision = edge.collision_density(lanes, &point) * chosen;
        let density = probability * around.pdf(point.length) + by_collision;
        let throughput = next.throughput * scattering / density;
        let place = self.sampler.next_2d_for(Purpose::AroundAim);
        let light = self.connect(&vertex, throughput, (index, rate, place), budget);
        if !light.is_empty() {
            let way = next.way.and(0, edge.optical_length_at(point.length));
            self.connected(light, (&vertex, 1.0), (way, index));
        }
    }

    fn around(&self, edge: &Edge, emitter: usize) -> Option<Equiangular> {
        if !self.equiangular {
            return None;
        }
        let singularity = self.scene.emitters()[emitter].singularity()?;
        Equiangular::new(self.scene, edge, singularity)
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
    ) -> Found<Light> {
        let scene = self.scene;
        let emitter = &scene.emitters()[index];
        let shape = |object: usize| &scene.objects()[object].shape;
        let aimed = emitter.aim(scene.around(), shape, u);
        let density = probability * aimed.pdf;
        let goal = Goal::emitter(scene, index, aimed.aim);
        let behind = lead_in(scene, index);
        let before = self.work();
        let light = Link::each(scene, (vertex, &goal), self.sampler, self.ws, |link| {
            let emitted = emitter.emitted(&aimed.aim, link.origin, link.emission);
            let aimed = (&aimed.aim, density, aimed.delta);
            let (value, share) = received(scene, vertex, throughput, link, emitted, aimed);
            (link.tube.events < budget && !value.is_zero()).then_some(Light {
                value,
                share,
                events: link.tube.events,
                optical_length: link.optical_length - behind,
            })
        });
        self.spent(Slot::new(emitter.class(), vertex), before);
        light
    }
}

/// The part of an edge before its first specular event, as a place where light is received.
fn along(edge: &Edge) -> Receiver<'static> {
    let lead = edge.lead();
    let last = lead.last().map(|span| span.arc.position(span.theta_end));
    Receiver::Segment {
        from: edge.start.x,
        to: last.unwrap_or(edge.start.x),
    }
}

/// What a link brings to the sensor, for an aim of given density, and its share of what all ways to find it bring;
/// `delta` if nothing else can find the emitter.
fn received(
    scene: &Scene,
    vertex: &Vertex,
    throughput: Spectrum,
    link: &Link,
    emitted: Spectrum,
    (aim, density, delta): (&Aim, f64, bool),
) -> (Spectrum, f64) {
    let scattered = throughput * vertex.eval(scene, link.direction);
    let received = scattered * link.transmittance() * emitted;
    if received.is_zero() {
        return (Spectrum::ZERO, 1.0);
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
    (received * (link.tube.geometry * weight / density), weight)
}
