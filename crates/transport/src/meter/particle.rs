//! The way of one particle from its emitter to its end (docs/theory.md#meters).

use super::flight::{Collision, Flight, Passing};
use super::{Recorder, Setup};
use crate::Spectrum;
use crate::budget::EDGES_PER_PARTICLE;
use crate::path::{
    Edge, End, ParticleBalance, Point, Sampling, Span, SubpathRay, TransportMode, Vertex,
    Workspace, collided, emit, share, trace,
};
use crate::sampling::Sampler;
use crate::scene::Scene;
use glam::DVec3;

/// Russian roulette is played when a particle has less than this share of the power that it should have.
const SMALL: f64 = 0.1;
/// A particle that has more than so many times that power is divided, if meters have gates,
const LARGE: f64 = 2.0;
/// into no more than so many at once,
const MOST_AT_ONCE: f64 = 16.0;
/// as long as no more than so many have come of one that an emitter has sent.
const MOST_COPIES: usize = 10_000;

/// A particle on its way.
pub(super) struct Particle<'a, 'r> {
    pub setup: &'a Setup<'a>,
    /// The scene at the particle's instant.
    scene: &'a Scene,
    pub recorder: Recorder<'r>,
    pub particle_balance: ParticleBalance,
    /// Edges and specular events so far.
    depth: u32,
    /// Optical path length so far.
    optical_length: f64,
    /// Particles that have come of it so far.
    copies: usize,
}

/// A particle that waits to go on, with its edges and specular events so far.
type Waiting = (SubpathRay, u32);

impl<'a, 'r> Particle<'a, 'r> {
    /// The particle of this number.
    pub fn new(setup: &'a Setup<'a>, number: u64, recorder: Recorder<'r>) -> Self {
        Particle {
            setup,
            scene: setup.scene.at(number),
            recorder,
            particle_balance: ParticleBalance::default(),
            depth: 0,
            optical_length: 0.0,
            copies: 1,
        }
    }

    /// Emits it and follows it, and all that it is divided into, to its end.
    pub fn run(&mut self, sampler: &mut Sampler, ws: &mut Workspace) {
        let setup = self.setup;
        // Emit the particle: choose the emitter by P_E, and draw an end and a ray; the power is Φ_E.
        let pick = setup.choice.sample(sampler.next_1d());
        let u = (sampler.next_2d(), sampler.next_2d());
        let white = setup.channel_pdf.map(|p| f64::from(u8::from(p > 0.0)));
        let Some((_, ray)) = emit(self.scene, (pick.index, pick.probability), white, u) else {
            return;
        };
        // Follow it, and all that it is divided into, edge by edge.
        let (initial, mut waiting) = (ray.throughput.sum(), vec![(ray, 0)]);
        let sampling = Sampling {
            mode: TransportMode::Importance,
            channel_pdf: setup.channel_pdf,
            extend: false,
            collides: true,
            spans: true,
            forced: false,
            splitting: false,
        };
        for _ in 0..EDGES_PER_PARTICLE {
            let Some((ray, depth)) = waiting.pop() else {
                return;
            };
            (self.optical_length, self.depth) = (ray.optical_length, depth);
            // Sample the next edge by p(s) of eq. (distance density).
            let mut edge = trace(self.scene, ray.start, sampling, sampler, ws);
            edge.tabulate();
            // Score the edge and its end, and play Russian roulette or divide.
            if let Some(onward) = self.edge(&edge, ray.throughput, sampler) {
                self.go_on_as(onward, initial, sampler, &mut waiting);
            }
        }
        for (ray, _) in waiting {
            ws.stats.lost += 1;
            ws.stats.over_budget.rays += 1;
            self.particle_balance.lost += ray.throughput.sum();
        }
    }

    /// Takes note of an edge, and of its end. Returns how the particle goes on.
    fn edge(&mut self, edge: &Edge, power: Spectrum, sampler: &mut Sampler) -> Option<SubpathRay> {
        let mut left = power;
        for (i, span) in edge.spans.iter().enumerate() {
            let depth = self.depth.saturating_add(1 + span.events_before);
            left = power * self.share_before(span);
            if depth > self.setup.max_depth {
                self.particle_balance
                    .passed(self.setup.channel_pdf, &edge.spans[..=i], power);
                self.particle_balance.cut += left.sum();
                return None;
            }
            let collision = match edge.end {
                End::Collision(point) if i + 1 == edge.spans.len() => Some(point),
                _ => None,
            };
            let theta_end = collision.map_or(span.theta_end, |point| point.theta);
            // Score the flight along the span, up to the collision if there is one.
            let flight = Flight {
                scene: self.scene,
                channel_pdf: self.setup.channel_pdf,
                span,
                theta_end,
                power,
                optical_length: self.optical_length,
            };
            self.recorder.fly(&flight);
            self.optical_length += span.arc.optical_length(theta_end);
            left = flight.power_at(theta_end);
            // Score the passage through a smooth surface to the next span.
            if let (None, Some(next)) = (collision, edge.spans.get(i + 1)) {
                self.go_on((span, next), left, power * self.share_before(next));
            }
        }
        self.depth = self.depth.saturating_add(1 + edge.geometry.events);
        // Score the end, scatter there, and enter what power is lost into the energy balance.
        let onward = self.end(edge, (power, left), sampler);
        let after = onward.map_or(Spectrum::ZERO, |ray| ray.throughput);
        let how = (self.scene, self.setup.channel_pdf);
        self.particle_balance.enter(how, edge, (power, after));
        onward
    }

    /// Share of an edge's power that is left at the start of a span, over the probability of getting there.
    fn share_before(&self, span: &Span) -> Spectrum {
        span.weight_before * share(self.setup.channel_pdf, span.depth_before)
    }

    /// From one span to the next, perhaps by way of a smooth surface or a boundary.
    fn go_on(&mut self, (span, next): (&Span, &Span), before: Spectrum, after: Spectrum) {
        if span.surface.is_some() {
            let arrival = span.arc.velocity(span.theta_end).normalize();
            let onward = next.arc.velocity(0.0).normalize();
            self.surface(span, (arrival, before), Some((onward, after)));
        }
    }

    /// Shows the meters a surface at the end of a span: directions and powers before and after.
    fn surface(
        &mut self,
        span: &Span,
        before: (DVec3, Spectrum),
        after: Option<(DVec3, Spectrum)>,
    ) {
        let Some((object, meeting)) = span.surface else {
            return;
        };
        let hit = self.scene.hit(object, &meeting);
        let opaque = self.scene.objects()[object].bsdf.is_opaque();
        let seen = if opaque { Some(before) } else { after };
        let Some((direction, power)) = seen else {
            return;
        };
        let side = |d: DVec3| hit.normal.dot(d) > 0.0;
        if opaque || side(direction) == side(before.0) {
            self.recorder.pass(&Passing {
                object,
                hit,
                direction,
                power,
                optical_length: self.optical_length,
            });
        }
    }

    /// What happens at the end of an edge that started with `power` and has `left` some.
    fn end(
        &mut self,
        edge: &Edge,
        (power, left): (Spectrum, Spectrum),
        sampler: &mut Sampler,
    ) -> Option<SubpathRay> {
        let scene = self.scene;
        match &edge.end {
            End::Collision(point) => {
                // Score the collision; w is multiplied by σ_s T/p(s).
                let collision = self.collision(point, power);
                self.recorder.collide(&collision);
                let scatter = Vertex::volume(point).scatter(scene, sampler)?;
                Some(SubpathRay {
                    start: scatter.start,
                    pdf: scatter.pdf,
                    throughput: collision.scattered(),
                    optical_length: self.optical_length,
                })
            }
            End::Surface { direction, .. } => {
                // Scatter at the surface, and score what passes through it.
                let scatter = Vertex::of(scene, edge)?.scatter(scene, sampler);
                let onward = scatter.map(|s| (s.start, s.pdf, left * s.weight));
                if let Some(span) = edge.spans.last() {
                    let beyond = onward.map(|(start, _, power)| (start.direction, power));
                    self.surface(span, (*direction, left), beyond);
                }
                onward.map(|(start, pdf, throughput)| SubpathRay {
                    start,
                    pdf,
                    throughput,
                    optical_length: self.optical_length,
                })
            }
            End::Escaped { .. } => None,
            End::Dead if edge.lost => None,
            End::Dead => {
                if let Some(span) = edge.spans.last() {
                    let arrival = span.arc.velocity(span.theta_end).normalize();
                    self.surface(span, (arrival, left), None);
                }
                None
            }
        }
    }

    fn collision(&self, point: &Point, power: Spectrum) -> Collision<'a> {
        Collision {
            scene: self.scene,
            point: *point,
            path: power * collided(self.setup.channel_pdf, point),
            optical_length: self.optical_length,
        }
    }

    /// Ends a particle that has lost most of its power by chance, or divides one that has more left than others, without bias.
    fn go_on_as(
        &mut self,
        mut ray: SubpathRay,
        initial: f64,
        sampler: &mut Sampler,
        waiting: &mut Vec<Waiting>,
    ) {
        if ray.throughput.is_zero() {
            return;
        }
        // The power w over what the window W(L) wants.
        let left = ray.throughput.sum() / initial;
        let window = self.setup.window.as_ref();
        let worth = left / window.map_or(1.0, |w| w.share(self.optical_length));
        let mut copies = 1;
        // Survive with probability w/W if there is little, or divide into round(w/W) if there is much.
        if self.depth >= self.setup.rr_depth && worth < SMALL {
            if sampler.next_1d() >= worth {
                return;
            }
            ray.throughput *= 1.0 / worth;
        } else if window.is_some() && worth > LARGE && self.copies < MOST_COPIES {
            copies = worth.min(MOST_AT_ONCE).round() as usize;
            ray.throughput *= 1.0 / copies as f64;
            self.copies += copies - 1;
        }
        waiting.extend((0..copies).map(|_| (ray, self.depth)));
    }
}
