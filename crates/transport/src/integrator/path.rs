//! Path tracing: sensor subpaths, next-event estimation over curved connections, and multiple
//! importance sampling against emitters that sensor subpaths hit.
//!
//! Theory: docs/theory.md#path.

mod connecting;
mod indirect;
mod roulette;
mod state;

use self::state::{Next, PathLength, SampledEdge};
use super::Contribution;
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::EmittedRay;
use crate::film::PathFacts;
use crate::path::{
    BranchPoint, Connection, ConnectionTarget, EdgePart, EmittedAlong, End, FoundBranch, FoundPath,
    NeeSlot, PathLog, Resampling, Sampling, SplitSample, Start, SubpathEnd, TransportMode, Vertex,
    Weighted, Workspace, environment_end, gather_along, scatter, trace,
};
use crate::photons::PhotonsAround;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;
use glam::DVec3;
use smallvec::SmallVec;
use std::cell::Cell;

/// The path tracer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathTracer {
    /// Longest path, in edges and specular events; `None` for no limit. 1 shows emitters only, 2
    /// adds single scattering.
    pub max_depth: Option<u32>,
    /// Number of edges and specular events after which any path may end by Russian roulette. Paths
    /// with too small an expected contribution for their work may end before.
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

/// Probability of computing the discovery probability of an edge that hit an emitter, divided by
/// the largest MIS weight that connections may have. Small weights are thus computed rarely.
const DISCOVERY_OVERSAMPLING: f64 = 4.0;

/// Light from a connection, and its length.
struct Light<W> {
    value: Spectrum,
    /// MIS weight of the connection against hits.
    share: f64,
    /// Unit direction in which the connection leaves the vertex.
    direction: DVec3,
    /// Ray of the emitter.
    ray: EmittedRay,
    events: u32,
    optical_length: f64,
    /// Arcs of the connection, as the log stores them.
    connection_log: W,
}

/// An emitter that an edge hit.
struct FoundEmitter {
    emitter: usize,
    radiance: Spectrum,
    /// Density with which connections would sample the end.
    pdf: f64,
    end: ConnectionEnd,
    /// Unit direction in which the light leaves the emitter.
    direction: DVec3,
    /// Index and cosine at the end.
    n: f64,
    cos: f64,
}

/// Destinations for the results of paths.
pub(crate) struct PathFinds<'a, L> {
    /// Contributions.
    pub out: &'a mut Vec<Contribution>,
    /// Events of the paths.
    pub log: &'a mut L,
}

/// Sensor ray along which paths are sampled.
#[derive(Clone, Copy)]
pub(crate) struct PathRequest<'a> {
    /// Scene at the instant of the sample.
    pub scene: &'a Scene,
    /// Sensor ray.
    pub ray: SensorRay,
    /// Number of channels in use.
    pub channels: usize,
    /// Photons that bring the light that is scattered more than once; `None` if paths go on.
    pub photons: Option<PhotonsAround<'a>>,
}

struct Tracing<'a, L> {
    scene: &'a Scene,
    sampler: &'a mut Sampler,
    ws: &'a mut Workspace,
    out: &'a mut Vec<Contribution>,
    /// True if the scene has point-like emitters, so that distances are sampled around them.
    equiangular: bool,
    /// Split branch that is followed later, and the probability with which an unsplit path takes
    /// it.
    split: Option<(Next, f64)>,
    log: &'a mut L,
    /// Photons that bring the light that is scattered more than once; `None` if paths go on.
    photons: Option<PhotonsAround<'a>>,
}

impl PathTracer {
    /// Samples contributions to the radiance that arrives along a sensor ray; their sum is
    /// unbiased. `channels` is the number of channels in use. Split edges are not logged.
    pub(crate) fn sample(
        &self,
        scene: &Scene,
        ray: SensorRay,
        channels: usize,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        finds: PathFinds<impl PathLog>,
    ) {
        let request = PathRequest {
            scene,
            ray,
            channels,
            photons: None,
        };
        self.sample_requested(request, sampler, ws, finds);
    }

    /// Samples contributions like [`PathTracer::sample`]. With photons, paths end after they have
    /// been scattered once, and photons bring the rest of the light.
    fn sample_requested(
        &self,
        request: PathRequest,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        finds: PathFinds<impl PathLog>,
    ) {
        let PathRequest {
            scene,
            ray,
            channels,
            photons,
        } = request;
        let medium = scene.medium_of_sensor_ray(ray.origin);
        // Start at the sensor, with throughput T = n_s².
        let start = Start::point(ray.origin, ray.direction, medium);
        let n = scene.n(start.medium, start.x);
        // Planted error "radiance weighted by 1/n² of the sensor instead of n²", found by morgana-transport/transport::furnace::luneburg_ball_of_fog:
        // let white = |c| if c < channels { 1.0 / (n * n) } else { 0.0 };
        let white = |c| if c < channels { n * n } else { 0.0 };
        let mut next = Next {
            start,
            throughput: Spectrum(std::array::from_fn(white)),
            from: None,
            length: PathLength::default(),
            gathers: true,
            is_last: false,
        };
        let mut tracing = Tracing {
            scene,
            sampler,
            ws,
            out: finds.out,
            equiangular: !scene.point_like_emitters().is_empty(),
            split: None,
            log: finds.log,
            photons,
        };
        // Follow the path to its end. Then follow the other branch if the first edge was split.
        self.follow(&mut tracing, &mut next);
        if let Some((mut split, reflectance)) = tracing.split.take() {
            tracing.ws.split = Some(SplitSample {
                before: tracing.out.len(),
                reflectance,
                cost: tracing.ws.stats().cost(),
            });
            // Two paths of one sample must not share the points of its set.
            tracing.sampler.leave_replicate();
            self.follow(&mut tracing, &mut split);
        }
    }

    /// Follows a path to its end, edge by edge, and updates `next` in place.
    fn follow(&self, t: &mut Tracing<impl PathLog>, next: &mut Next) {
        while self.edge(t, next) {}
        t.end();
    }

    /// Follows one edge, adds the light that it finds, and scatters at its end. Returns true if the
    /// path continues along `next`, which is updated in place because it is large.
    fn edge<L: PathLog>(&self, t: &mut Tracing<L>, next: &mut Next) -> bool {
        // Add the light that volumes emit along the edge.
        if next.gathers {
            t.gather(next, self.budget(next.length.depth));
        }
        // Sample the next edge: its length by p(s) of eq. (distance density), with channel
        // probabilities w_c in proportion to T.
        let channel_pdf = next.throughput / next.throughput.sum();
        let budget = self.budget(next.length.depth + 1);
        let first_vertex = t.ws.first_vertex;
        let forced = next.length.edges < first_vertex.forced_collisions && budget > 0;
        let equiangular = t.equiangular && !next.is_last;
        let sampling = Sampling {
            mode: TransportMode::Radiance,
            channel_pdf,
            extend: equiangular || forced,
            collides: true,
            spans: equiangular || forced || L::NEEDS_SPANS,
            parts: L::NEEDS_PARTS,
            forced,
            // Hits compete with connections only if paths can meet emitters.
            // Planted error "neighbours of edges ignored where chance competes with connections", found by morgana-transport/transport::connections::any_rate_is_unbiased:
            // differentials: false,
            differentials: next.from.is_some() && t.scene.emitters_can_be_met(),
            splitting: first_vertex.splitting && next.length.edges == 0,
        };
        let edge = trace(t.scene, next.start, sampling, t.sampler, t.ws);
        let edge = SampledEdge {
            edge: &edge,
            next,
            channel_pdf,
            length: next.length.and(edge.geometry.events, edge.optical_length),
            around: Cell::new(None),
        };
        // Sample a vertex on the edge by p_e of eq. (equiangular density), and connect it to a
        // point emitter.
        if equiangular && budget > 0 {
            t.around_emitter(&edge, budget);
        }
        t.log
            .follow(TransportMode::Radiance, edge.edge, &t.ws.edge_parts);
        // Store the other branch of a split edge.
        if let Some(split) = &edge.edge.split {
            t.split = next.split_off(split).map(|next| (next, split.probability));
        }
        if self
            .max_depth
            .is_some_and(|limit| edge.length.depth > limit)
        {
            return false;
        }
        // Add light emitted at the end of the edge, with the weight of hits in
        // eq. (connection and chance).
        t.emission(&edge);
        let budget = self.budget(edge.length.depth);
        if budget == 0 {
            return false;
        }
        // Find the vertex at the end of the edge, and T up to the vertex.
        let Some(vertex) = Vertex::of(t.scene, edge.edge) else {
            return false;
        };
        let throughput = edge.next.throughput * edge.edge.throughput(t.scene, channel_pdf);
        // Connect the vertex to one emitter of each class.
        if !next.is_last {
            t.direct(&vertex, &edge, throughput, budget);
            t.indirect(&vertex, &edge, budget);
        }
        // Sample a direction by p_ω, and apply Russian roulette.
        let length = edge.length;
        t.scatter(vertex, throughput, length, next) && self.roulette(t, next)
    }

    /// Returns the number of edges and events by which a path of `depth` may still grow.
    fn budget(&self, depth: u32) -> u32 {
        self.max_depth
            .map_or(u32::MAX, |limit| limit.saturating_sub(depth))
    }
}

impl<L: PathLog> Tracing<'_, L> {
    /// Adds light emitted at the end of the edge, weighted against competing connections
    /// (docs/theory.md#radiance).
    fn emission(&mut self, edge: &SampledEdge) {
        let scene = self.scene;
        match edge.edge.end {
            End::Surface {
                object,
                hit,
                direction,
                medium,
            } => {
                let on = OnSurface {
                    object,
                    normal: hit.normal,
                    site: scene.objects()[object].shape.site(&hit),
                };
                let Some((emitter, radiance, pdf)) = scene.emitted(&on, -direction) else {
                    return;
                };
                // Add L_e/n² of a surface that emits.
                let found = FoundEmitter {
                    emitter,
                    radiance,
                    pdf,
                    end: ConnectionEnd::Point {
                        position: hit.position,
                        surface: Some(on),
                    },
                    direction: -direction,
                    n: scene.n(medium, hit.position),
                    cos: hit.normal.dot(-direction),
                };
                self.emitted(edge, &found);
            }
            End::Escaped { direction, medium } => {
                // Add L_e/n² of the environments in the direction of escape.
                let n = scene.n(medium, edge.edge.start.x);
                for (emitter, environment) in scene.environments() {
                    let found = FoundEmitter {
                        emitter,
                        radiance: environment.radiance(direction),
                        pdf: environment.pdf(direction),
                        end: environment_end(scene, direction),
                        direction: -direction,
                        n,
                        cos: 1.0,
                    };
                    self.emitted(edge, &found);
                }
            }
            End::Collision(_) | End::Dead => {}
        }
    }

    /// Adds light that volumes emit along an edge, over at most `budget` edges and events.
    fn gather(&mut self, next: &Next, budget: u32) {
        if self.scene.volume_lights().next().is_none() {
            return;
        }
        let mut all: SmallVec<[EmittedAlong; 4]> = SmallVec::new();
        let channel_pdf = next.throughput / next.throughput.sum();
        let edge = gather_along(
            self.scene,
            next.start,
            channel_pdf,
            self.sampler,
            self.ws,
            |along, _| all.push(along),
        );
        for along in all.iter().filter(|along| along.depth <= budget) {
            let value = along.light * next.throughput;
            if let Some(nee_training) = &mut self.ws.nee_training {
                nee_training.apart(value.sum());
            }
            let length = next.length.and(along.depth - 1, along.optical_length);
            let part = EdgePart {
                edge: &edge,
                length: along.length,
                scatters: false,
            };
            let end = SubpathEnd {
                part: Some(part),
                ..SubpathEnd::at(BranchPoint::Last)
            };
            let ray = EmittedRay::within(along.emitter, along.x);
            self.hand_over(value, length, end, None, &ray);
        }
    }

    /// Adds the light of an emitter at the end of an edge, with its MIS weight.
    fn emitted(&mut self, edge: &SampledEdge, found: &FoundEmitter) {
        let weight = self.mis(edge, found);
        // Planted error "emission not divided by n² of the emitter", found by morgana-transport/transport::slabs::graded_slab_between_black_plates:
        // let light = found.radiance * weight;
        let light = found.radiance / (found.n * found.n) * weight;
        if light.is_zero() {
            return;
        }
        let value =
            light * edge.next.throughput * edge.edge.throughput(self.scene, edge.channel_pdf);
        if let Some(nee_training) = &mut self.ws.nee_training {
            match &edge.next.from {
                Some((vertex, _)) => {
                    let class = self.scene.emitters()[found.emitter].class();
                    let slot = NeeSlot::new(class, vertex);
                    nee_training.chance(slot, value.sum(), 1.0 - weight);
                }
                None => nee_training.apart(value.sum()),
            }
        }
        let ray = EmittedRay {
            emitter: found.emitter,
            end: found.end,
            x: match found.end {
                ConnectionEnd::Point { position, .. } => position,
                ConnectionEnd::Plane { through, .. } => through,
            },
            direction: found.direction,
        };
        let end = SubpathEnd::at(BranchPoint::Last);
        self.hand_over(value, edge.length, end, None, &ray);
    }

    /// Adds a contribution of an emitter's ray that arrives at the end of the path, or by a
    /// connection from there.
    fn hand_over(
        &mut self,
        value: Spectrum,
        length: PathLength,
        end: SubpathEnd,
        connection_log: Option<&L::ConnectionLog>,
        ray: &EmittedRay,
    ) {
        self.log.contribute(&FoundPath {
            sensor: Some(end),
            light: None,
            connection_log,
            ray: Some(ray),
        });
        self.out.push(Contribution {
            image: None,
            strategy: (0, 0),
            value,
            bias: Spectrum::ZERO,
            weight: 1.0,
            shares: Default::default(),
            path: PathFacts {
                optical_length: length.optical_length,
                bounces: length.depth - 1,
                emitter: ray.emitter,
            },
        });
    }

    /// Adds the light of connections from a vertex to an emitter, times `share`. `length` is the
    /// length of the path up to the vertex. The vertex lies at the end of the last edge, or at the
    /// end of the part `on` of the next edge.
    fn connected(
        &mut self,
        light: Weighted<Light<L::ConnectionLog>>,
        vertex: &Vertex,
        on: Option<EdgePart>,
        length: PathLength,
        emitter: usize,
        share: f64,
    ) {
        let slot = NeeSlot::new(self.scene.emitters()[emitter].class(), vertex);
        if let Some(nee_training) = &mut self.ws.nee_training {
            let branch = |(light, weight): &(Light<L::ConnectionLog>, f64)| {
                (light.value.sum() * weight * share, light.share)
            };
            nee_training.connection(slot, light.iter().map(branch));
        }
        for (light, weight) in light {
            let end = SubpathEnd {
                part: on,
                turn: Some((vertex, light.direction)),
                ..SubpathEnd::at(BranchPoint::Last)
            };
            let length = length.and(light.events, light.optical_length);
            let value = light.value * (weight * share);
            self.hand_over(value, length, end, Some(&light.connection_log), &light.ray);
        }
    }

    /// Returns the weight of an edge that hit an emitter, by the balance heuristic against
    /// connections that search for such edges. See docs/theory.md#connection-and-chance.
    fn mis(&mut self, sampled: &SampledEdge, found: &FoundEmitter) -> f64 {
        let (edge, emitter) = (sampled.edge, found.emitter);
        let Some((vertex, direction_pdf)) = &sampled.next.from else {
            return 1.0;
        };
        // Planted error "failed connections not compensated by chance hits" (2 lines), found by morgana-transport/transport::furnace::many_reflections_in_a_block_of_glass:
        // if !edge.connectable {
        //     return 0.0;
        if !edge.connectable {
            return 1.0;
        }
        let class = self.scene.emitters()[emitter].class();
        let slot = NeeSlot::new(class, vertex);
        // Compute p_connection = K P_E p_a, up to the factor e.
        let samples = Resampling::of(self.scene, class, vertex).samples;
        let chosen = self
            .scene
            .emitter_probability(emitter, &vertex.receiver(self.scene));
        // Planted error "choice among many lights taken for an even one in the weights of chance", found by morgana-transport/transport::connections::many_lights:
        // let by_connection = self.ws.rates.of(slot) * (chosen * 0.0 + 1.0 / 30.0) * found.pdf * samples;
        // Planted error "probability of a connection not in its weight", found by morgana-transport/transport::connections::any_rate_is_unbiased:
        // let by_connection = chosen * found.pdf * samples;
        let by_connection = self.ws.rates.of(slot) * chosen * found.pdf * samples;
        // Compute p_chance by eq. (density along an edge) with the density p_ω of the direction.
        let survival = edge.geometry.survival(sampled.channel_pdf);
        let by_chance = edge.geometry.density(*direction_pdf, found.n) * found.cos * survival;
        let most = by_connection / (by_connection + by_chance);
        // If the weight of connections is small, compute it only with some probability.
        let evaluated = if self.scene.is_straight() || self.ws.nee_training.is_some() {
            1.0
        } else {
            (DISCOVERY_OVERSAMPLING * most).min(1.0)
        };
        if evaluated < 1.0 && self.sampler.next_1d() >= evaluated {
            return 1.0;
        }
        // Compute e, the probability that connections discover the edge.
        let before = self.work();
        let target = ConnectionTarget::emitter(self.scene, emitter, found.end);
        let branch = FoundBranch {
            geometry: &edge.geometry,
            direction: edge.start.direction,
            optical_length: None,
        };
        let discovery = Connection::discovery(self.scene, vertex, &target, &branch, self.ws);
        self.spent(slot, before);
        let share = by_connection * discovery / (by_connection * discovery + by_chance);
        // Planted error "weights that were asked for seldom not made up for", found by morgana-transport/transport::connections::any_rate_is_unbiased:
        // 1.0 - share
        1.0 - share / evaluated
    }

    /// Returns the work so far, if a pilot needs it.
    fn work(&self) -> Option<f64> {
        self.ws
            .nee_training
            .as_ref()
            .map(|_| self.ws.stats().cost())
    }

    /// Records the work of connections of a kind for a pilot, given the work before.
    fn spent(&mut self, slot: NeeSlot, before: Option<f64>) {
        let after = self.work();
        if let (Some(nee_training), Some(before), Some(after)) =
            (&mut self.ws.nee_training, before, after)
        {
            nee_training.work(slot, after - before);
        }
    }

    /// Samples the next ray at a vertex, given the throughput up to it. Returns true if the path
    /// continues.
    fn scatter(
        &mut self,
        vertex: Vertex,
        throughput: Spectrum,
        length: PathLength,
        next: &mut Next,
    ) -> bool {
        self.sampler.next_edge();
        let Some(scattered) = scatter(self.scene, &vertex, self.sampler) else {
            return false;
        };
        self.log.turn(
            TransportMode::Radiance,
            &vertex,
            scattered.start.direction,
            scattered.delta,
        );
        if self.photons.is_some() && !scattered.delta {
            // Photons bring the scattered light: follow the ray once more, to emitters.
            if next.is_last || !self.finds_emitters() {
                return false;
            }
            next.is_last = true;
        }
        next.start = scattered.start;
        next.throughput = throughput * scattered.weight;
        next.from = if scattered.delta {
            None
        } else {
            Some((vertex, scattered.pdf))
        };
        next.length = length;
        next.gathers = true;
        true
    }
}
