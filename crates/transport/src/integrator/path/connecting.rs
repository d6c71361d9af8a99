//! Next-event estimation: choice of emitters for a vertex, and the light of the connections.

use super::{Light, SampledEdge, Tracing};
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, EndSample, OnSurface};
use crate::emitter::{Class, EmittedRay};
use crate::path::{
    Connection, ConnectionTarget, Edge, EdgePart, EmitterEnd, End, EndChoice, Equiangular, NeeSlot,
    PathLog, Resampling, TransportMode, Vertex, Weighted, lead_in, scatter_pdf,
};
use crate::sampling::Purpose;
use crate::scene::{Receiver, Scene};

/// Parameters of connections of a kind.
#[derive(Clone, Copy)]
struct NextEvent {
    /// Probability q of making a connection.
    rate: f64,
    /// Number of independent samples that MIS weights assume for a connection.
    samples: f64,
}

impl<L: PathLog> Tracing<'_, L> {
    /// Adds next-event estimation at the vertex at the end of an edge: scattered light of one
    /// random emitter of each class. `throughput` is the throughput up to the vertex. A connection
    /// has at most `budget` edges and events.
    pub(super) fn direct(
        &mut self,
        vertex: &Vertex,
        edge: &SampledEdge,
        throughput: Spectrum,
        budget: u32,
    ) {
        let scene = self.scene;
        if throughput.is_zero() || vertex.is_black(scene) {
            return;
        }
        let receiver = vertex.receiver(scene);
        // Skip volumes, the last class: edges gather their light.
        let connected = scene.classes().filter(|class| *class != Class::Volume);
        for (i, class) in connected.enumerate() {
            // Connect to this class with probability q, a factor of P_E.
            let rate = self.ws.rates.of(NeeSlot::new(class, vertex));
            if rate < 1.0 && self.sampler.next_1d() >= rate {
                continue;
            }
            // Choose an emitter of the class, and a point on it.
            let choice = EndChoice {
                scene,
                vertex,
                receiver: &receiver,
                class,
                rate,
            };
            let (u, place) = self.sampler.next_end(i);
            let before = self.work();
            let chosen = choice.sample(u, place, self.sampler, &mut self.ws.stats);
            self.spent(NeeSlot::new(class, vertex), before);
            let Some(end) = &chosen else { continue };
            // Find all branches to the point.
            let light = self.connect(vertex, throughput, end, rate, budget);
            if !light.is_empty() {
                // Weight the branches against the equiangular vertex, which could lie at the
                // vertex's position.
                let share = self.collided(edge, end);
                self.connected(light, vertex, None, edge.length, end.emitter, share);
            }
        }
    }

    /// Returns the MIS weight of a collision at the end of an edge that is connected to an end at
    /// an emitter. The competing technique samples the vertex by its distance to that end.
    fn collided(&self, sampled: &SampledEdge, end: &EmitterEnd) -> f64 {
        let edge = sampled.edge;
        let End::Collision(point) = &edge.end else {
            return 1.0;
        };
        let Some(around) = self.around(sampled, end.emitter, &end.sampled.end) else {
            return 1.0;
        };
        let by_distance = self.scene.emitter_probability(end.emitter, &along(edge));
        // Planted error "point lights chosen along an edge as at its end", found by morgana-transport/transport::connections::many_points_add_up:
        // let by_distance = by_distance.max(end.probability) * around.pdf(point.length);
        let by_distance = by_distance * around.pdf(point.length);
        let by_collision = edge.collision_density(sampled.channel_pdf, point) * end.probability;
        by_collision / (by_collision + by_distance)
    }

    /// Adds single scattering at a point of the edge that is sampled by its distance to a
    /// point-like emitter. The light of the emitter falls off as 1/r², and collisions alone would
    /// sample it with infinite variance (docs/theory.md#point-emitters-in-media).
    pub(super) fn around_emitter(&mut self, sampled: &SampledEdge, budget: u32) {
        let (scene, edge) = (self.scene, sampled.edge);
        // Connect with probability q.
        let rate = self.ws.rates.of(NeeSlot::IN_MEDIA_TO_DELTA);
        if rate < 1.0 && self.sampler.next_1d() >= rate {
            return;
        }
        let choice = self.sampler.next_1d_for(Purpose::AroundEmitter);
        let u = self.sampler.next_1d_for(Purpose::Around);
        // Choose a point emitter by an estimate of ∫ ds/r² along the edge.
        let line = along(edge);
        let (index, probability) = scene.emitter_choice(Class::Delta, &line).choose(choice);
        // Choose a point of the emitter, if there are several, with equal density for every vertex.
        let many = scene.emitters()[index].has_many_points();
        let sampled_end = many.then(|| self.place(index));
        let around = match &sampled_end {
            Some(end) => self.around(sampled, index, &end.end),
            None => self.around_singularity(sampled, index),
        };
        let Some(around) = around else {
            return;
        };
        // Sample the arc length s by p_e of eq. (equiangular density).
        let Some(point) = edge.at_length(around.sample(u)) else {
            return;
        };
        // Scatter at the point: e^{−τ} σ_s, with the factors of interfaces.
        let albedo = point.albedo(scene);
        let scattering = point.rate * albedo * point.depth.exp_neg() * point.weight;
        if scattering.is_zero() {
            return;
        }
        let vertex = Vertex::volume(&point);
        let chosen = scene.emitter_probability(index, &vertex.receiver(scene));
        // Combine p_e with p(s) of eq. (distance density), each times the emitter's probability.
        // Planted error "distances around lights weighed against collisions by chance where they are forced", found by morgana-transport/transport::first_vertex::means_stay:
        // let by_collision = edge.collision_density(sampled.channel_pdf, &point) * chosen / edge.forcing[0];
        let by_collision = edge.collision_density(sampled.channel_pdf, &point) * chosen;
        let density = probability * around.pdf(point.length) + by_collision;
        let throughput = sampled.next.throughput * scattering / density;
        // Connect the vertex to the emitter.
        let end = EmitterEnd {
            emitter: index,
            // The throughput already includes the probability.
            probability: 1.0,
            sampled: sampled_end.unwrap_or_else(|| self.place(index)),
            weight: 1.0,
        };
        let light = self.connect(&vertex, throughput, &end, rate, budget);
        if !light.is_empty() {
            let length = edge.optical_length_to(&point);
            let length = sampled.next.length.and(0, length);
            let on = Some(EdgePart {
                edge,
                length: point.length,
                scatters: true,
            });
            self.connected(light, &vertex, on, length, index, 1.0);
        }
    }

    /// Samples an end at a point-like emitter.
    fn place(&mut self, emitter: usize) -> EndSample {
        let (scene, place) = (self.scene, self.sampler.next_2d_for(Purpose::AroundAim));
        let shape = |object: usize| &scene.objects()[object].shape;
        scene.emitters()[emitter].sample_end(scene.around(), shape, place)
    }

    /// Returns the equiangular density around an end, if the end is at a point-like emitter.
    fn around(
        &self,
        sampled: &SampledEdge,
        emitter: usize,
        end: &ConnectionEnd,
    ) -> Option<Equiangular> {
        let point_like = self.scene.emitters()[emitter].singularity().is_some();
        match end {
            ConnectionEnd::Point { position, .. } if self.equiangular && point_like => {
                sampled.around(self.scene, *position)
            }
            _ => None,
        }
    }

    /// Returns the equiangular density around a point-like emitter that has no other ends.
    fn around_singularity(&self, sampled: &SampledEdge, emitter: usize) -> Option<Equiangular> {
        let singularity = self.scene.emitters()[emitter].singularity()?;
        self.around(sampled, emitter, &ConnectionEnd::at(singularity))
    }

    /// Connects a vertex to an end at an emitter, for a path of given throughput up to the vertex.
    /// Returns the scattered light of each branch, weighted against hits.
    fn connect(
        &mut self,
        vertex: &Vertex,
        throughput: Spectrum,
        end: &EmitterEnd,
        rate: f64,
        budget: u32,
    ) -> Weighted<Light<L::ConnectionLog>> {
        let (scene, index, sampled) = (self.scene, end.emitter, end.sampled);
        let emitter = &scene.emitters()[index];
        let next_event = NextEvent {
            rate,
            samples: Resampling::of(scene, emitter.class(), vertex).samples,
        };
        let target = ConnectionTarget::emitter(scene, index, sampled.end);
        // Sum over the branches: T f̃ e^{−τ} F̄ G × (emitted light) × weight/(P_E p_a), times the
        // weight of resampling.
        let behind = lead_in(scene, index);
        let before = self.work();
        let log = &mut *self.log;
        let light = Connection::each_with_arcs(
            scene,
            vertex,
            &target,
            self.sampler,
            self.ws,
            |connection, arcs| {
                let (start, leaves) = (connection.origin, connection.emission);
                let emitted = scene.leaving(index, &sampled.end, start, leaves);
                let (value, share) = received(
                    scene, vertex, throughput, connection, emitted, end, next_event,
                );
                (connection.geometry.events < budget && !value.is_zero()).then_some(Light {
                    value,
                    share,
                    direction: connection.direction,
                    ray: EmittedRay {
                        emitter: index,
                        end: sampled.end,
                        x: start,
                        direction: leaves,
                    },
                    connection_log: log.log_connection(TransportMode::Radiance, vertex, arcs),
                    events: connection.geometry.events,
                    optical_length: connection.optical_length - behind,
                })
            },
        );
        self.spent(NeeSlot::new(emitter.class(), vertex), before);
        light
    }
}

/// Returns the part of an edge before its first specular event, as a receiver of light.
fn along(edge: &Edge) -> Receiver<'static> {
    let lead = edge.lead();
    let last = lead.last().map(|span| span.arc.position(span.theta_end));
    Receiver::Segment {
        from: edge.start.x,
        to: last.unwrap_or(edge.start.x),
    }
}

/// Returns the light that a connection to an end carries to the sensor, and the MIS weight of the
/// connection (docs/theory.md#connection-and-chance).
fn received(
    scene: &Scene,
    vertex: &Vertex,
    throughput: Spectrum,
    connection: &Connection,
    emitted: Spectrum,
    end: &EmitterEnd,
    next_event: NextEvent,
) -> (Spectrum, f64) {
    let sampled = &end.sampled;
    let density = next_event.rate * end.probability * sampled.pdf;
    // Compute T f̃ e^{−τ} F̄ × (emitted light).
    let scattered = throughput * vertex.eval(scene, connection.direction, TransportMode::Radiance);
    let received = scattered * connection.transmittance() * emitted;
    if received.is_zero() {
        return (Spectrum::ZERO, 1.0);
    }
    let weight = if sampled.delta {
        1.0
    } else {
        // Use the channel probabilities of an edge sampled in this direction.
        let channel_pdf = scattered / scattered.sum();
        let cos = match &sampled.end {
            ConnectionEnd::Point {
                surface: Some(OnSurface { normal, .. }),
                ..
            } => normal.dot(connection.emission),
            _ => 1.0,
        };
        // Apply the balance heuristic of eq. (connection and chance): p_connection = K P_E p_a e,
        // p_chance by eq. (density along an edge).
        let pdf = scatter_pdf(scene, vertex, connection.direction);
        // Planted error "MIS density without the Jacobian in one strategy" (2 lines), found by morgana-transport/transport::connections::any_rate_is_unbiased:
        // let by_chance = pdf
        //     * cos
        let by_chance = connection.geometry.density(pdf, connection.n_end)
            * cos
            * connection.geometry.survival(channel_pdf);
        let by_connection = density * next_event.samples * connection.discovery;
        by_connection / (by_connection + by_chance)
    };
    (
        received * (connection.geometry.geometry_term * weight * end.weight / density),
        weight,
    )
}
