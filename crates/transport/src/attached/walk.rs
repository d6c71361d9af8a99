//! Walk from the sensor: flights, collisions and boundaries, which are recorded
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::IndexPlan;
use super::majorant::{Majorants, probability};
use super::record::{AttachedPath, Beyond, SampledChannel, Scattering, Segment, SegmentEnd};
use crate::Spectrum;
use crate::budget::EDGES_PER_WALK;
use crate::path::choose_channel;
use crate::sampling::{Purpose, Sampler};
use crate::scene::{MediumId, Scene};
use crate::sensor::SensorRay;
use crate::shape::Hit;
use crate::stats::Stats;
use eikonal::Tolerance;
use eikonal::adjoint::{FlightIntersection, FlightLimits, FlightPoint};
use eikonal::connect::World;
use glam::DVec3;
use std::ops::{ControlFlow, Range};

/// Optical depth of a boundary beyond which it does not affect collisions: a fraction e^−24 of the
/// light reaches it.
const MAX_OPTICAL_DEPTH: f64 = 24.0;
/// Maximum arc length of a flight through clear matter, in radii of the scene.
const MAX_FLIGHT: f64 = 64.0;
/// Maximum survival probability of Russian roulette.
const MAX_SURVIVAL: f64 = 0.95;

/// Scene and parameters of walks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttachedWalk<'a> {
    pub scene: &'a Scene,
    pub plan: &'a IndexPlan,
    pub majorants: &'a Majorants,
    pub tolerance: Tolerance,
    /// Number of channels in use.
    pub channels: usize,
    /// Longest path, in edges and specular events.
    pub max_depth: u32,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
}

/// Intersection with an object.
pub(super) type Met = FlightIntersection<(usize, Hit)>;

/// Path under construction.
pub(super) struct Walking<'a, 'p> {
    pub walk: &'p AttachedWalk<'a>,
    pub path: &'p mut AttachedPath,
    pub sampler: &'p mut Sampler,
    pub stats: &'p mut Stats,
    pub x: DVec3,
    pub v: DVec3,
    /// Direction at the start of the next segment; `None` if it continues with the velocity.
    pub direction: Option<DVec3>,
    pub medium: MediumId,
    pub throughput: Spectrum,
    /// Number of edges and specular events so far.
    pub depth: u32,
    /// Number of specular events on this edge.
    pub events: u32,
    /// Channel in which the current segment is sampled.
    pub sampled: SampledChannel,
}

impl<'a> AttachedWalk<'a> {
    /// Follows a path from the sensor until it reaches an emitter or is terminated.
    pub(crate) fn follow(
        &self,
        ray: SensorRay,
        sampler: &mut Sampler,
        stats: &mut Stats,
        path: &mut AttachedPath,
    ) {
        path.clear();
        path.origin = ray.origin;
        let medium = self.scene.medium_of_sensor_ray(ray.origin);
        let n = self.scene.n(medium, ray.origin);
        let white = |c| if c < self.channels { n * n } else { 0.0 };
        let mut walking = Walking {
            walk: self,
            path,
            sampler,
            stats,
            x: ray.origin,
            v: ray.direction * n,
            direction: Some(ray.direction),
            medium,
            throughput: Spectrum(std::array::from_fn(white)),
            depth: 0,
            events: 0,
            sampled: SampledChannel::GREY,
        };
        let unit = n * n;
        for _ in 0..EDGES_PER_WALK {
            if walking.segment(unit).is_break() {
                return;
            }
        }
        stats.lost += 1;
        stats.over_budget.rays += 1;
    }
}

impl Walking<'_, '_> {
    /// Follows a segment and handles its end. `unit` is the throughput at the sensor.
    fn segment(&mut self, unit: f64) -> ControlFlow<()> {
        let scene = self.walk.scene;
        let extinctions = self.walk.majorants.of(self.medium);
        self.sampled = self.draw(extinctions);
        let extinction = extinctions[self.sampled.channel];
        let rank = self.sampler.next_1d_for(Purpose::Distance);
        let depth = -(-rank).ln_1p();
        let length = if extinction > 0.0 {
            MAX_OPTICAL_DEPTH.max(depth) / extinction
        } else {
            MAX_FLIGHT * scene.around().radius
        };
        let Some((end, met)) = self.fly(length) else {
            return self.lose();
        };
        if extinction > 0.0 {
            // Compute the probability of a collision before the end: 1 if the end is deep.
            let before = met.map_or(1.0, |_| -(-extinction * end.length).exp_m1());
            if rank < before {
                let beyond = met.map(|met| Beyond {
                    end,
                    normal: met.normal,
                    length: rank * (1.0 - before) / (before * (1.0 - rank)),
                    log: extinction * (1.0 - before) / before,
                });
                let length = depth / extinction;
                self.weigh(extinctions, length, true);
                return self.collide(length, beyond, unit);
            }
        }
        self.weigh(extinctions, end.length, false);
        match met {
            Some(met) => self.meet(end, &met),
            None if scene.field(self.medium).is_constant() => self.leave(end),
            None => self.lose(),
        }
    }

    /// Samples the channel whose extinction determines the end of a segment.
    fn draw(&mut self, extinctions: Spectrum) -> SampledChannel {
        let own = &extinctions.0[..self.walk.channels];
        if own.iter().all(|sigma| *sigma == own[0]) {
            return SampledChannel::GREY;
        }
        let pdf = self.throughput / self.throughput.sum();
        let u = self.sampler.next_1d_for(Purpose::Channel);
        SampledChannel {
            channel: choose_channel(pdf, u),
            posterior: pdf,
        }
    }

    /// Weights the channels by their densities of the segment's end, given its length and whether
    /// it ends with a collision.
    fn weigh(&mut self, extinctions: Spectrum, length: f64, collides: bool) {
        let own = extinctions[self.sampled.channel];
        // Compute ratios to the density in the sampled channel.
        let relative = extinctions.map(|sigma| {
            let rate = if collides { sigma / own } else { 1.0 };
            rate * ((own - sigma) * length).exp()
        });
        let all = (self.sampled.posterior * relative).sum();
        self.throughput *= relative / all;
        self.sampled.posterior *= relative / all;
    }

    /// Follows the ray to the first surface, or for a length.
    fn fly(&mut self, length: f64) -> Option<(FlightPoint, Option<Met>)> {
        let (scene, walk) = (self.walk.scene, self.walk);
        self.stats.edges += 1;
        let limits = FlightLimits {
            tolerance: walk.tolerance,
            resolved: walk.plan.has(self.medium),
            length,
        };
        let meets = |arc: &eikonal::ray::Arc| {
            let (object, hit) = scene.first_hit(arc)?;
            Some(FlightIntersection {
                theta: hit.theta,
                position: hit.position,
                normal: hit.normal,
                what: (object, hit),
            })
        };
        let work = &mut self.stats.work;
        let field = scene.field(self.medium);
        let flown = self
            .path
            .flight
            .follow(field, [self.x, self.v], &limits, work, meets);
        flown.ok()
    }

    /// Terminates the path as lost.
    pub(super) fn lose(&mut self) -> ControlFlow<()> {
        self.stats.lost += 1;
        ControlFlow::Break(())
    }

    /// Ends the segment with the steps of the last flight.
    pub(super) fn end(&mut self, end: SegmentEnd) {
        let spans = self.path.keep();
        self.end_after(spans, end);
    }

    pub(super) fn end_after(&mut self, spans: Range<usize>, end: SegmentEnd) {
        self.path.segments.push(Segment {
            medium: self.medium,
            spans,
            direction: self.direction,
            sampled: self.sampled,
            end,
        });
    }

    /// Collides after a length, and continues: in a new direction after a real collision, otherwise
    /// as before.
    fn collide(&mut self, length: f64, boundary: Option<Beyond>, unit: f64) -> ControlFlow<()> {
        let field = self.walk.scene.field(self.medium);
        let resolved = self.walk.plan.has(self.medium);
        let (vertex, step, span) = self.path.flight.at(field, resolved, length);
        let is_real = self.is_real(vertex.x);
        let onward = if is_real {
            Some(self.scatter(&vertex)?)
        } else {
            None
        };
        self.end(SegmentEnd::Scattered(Scattering {
            vertex,
            step,
            span,
            onward,
            boundary,
        }));
        self.x = vertex.x;
        self.v = onward.map_or(vertex.v, |onward| onward * field.n(vertex.x));
        self.direction = onward;
        if is_real {
            self.roulette(unit)
        } else if self.throughput.is_zero() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Decides whether a collision by the majorant is real.
    fn is_real(&mut self, x: DVec3) -> bool {
        let walk = self.walk;
        let Some(acceptance_ratio) = walk.majorants.acceptance_ratio(walk.scene, self.medium)
        else {
            return true;
        };
        let share = acceptance_ratio.at(x);
        let probability = probability((self.throughput * share).sum() / self.throughput.sum());
        let is_real = self.sampler.next_1d() < probability;
        self.throughput *= if is_real {
            share / probability
        } else {
            share.map(|share| (1.0 - share) / (1.0 - probability))
        };
        is_real
    }

    /// Samples the direction after a real collision, unless the path ends there.
    fn scatter(&mut self, vertex: &FlightPoint) -> ControlFlow<(), DVec3> {
        let walk = self.walk;
        let medium = walk.scene.medium(self.medium);
        self.depth = self.depth.saturating_add(1);
        if self.depth >= walk.max_depth {
            return ControlFlow::Break(());
        }
        self.throughput *= medium.albedo.at(vertex.x);
        self.sampler.next_edge();
        self.events = 0;
        let u = self.sampler.next_2d_for(Purpose::Direction);
        let (onward, _) = medium.phase.sample(vertex.x, vertex.v.normalize(), u);
        ControlFlow::Continue(onward)
    }

    /// Terminates paths by Russian roulette.
    fn roulette(&mut self, unit: f64) -> ControlFlow<()> {
        let relative = self.throughput.max() / unit;
        let survival = if self.depth >= self.walk.rr_depth {
            relative.min(MAX_SURVIVAL)
        } else {
            1.0
        };
        if relative <= 0.0 || self.sampler.next_1d_for(Purpose::Roulette) >= survival {
            return ControlFlow::Break(());
        }
        self.throughput *= 1.0 / survival;
        ControlFlow::Continue(())
    }
}
