//! Random walks: sample an edge, then a direction at the vertex at its end, and repeat.
//!
//! Light subpaths, sensor subpaths and the particles of meters are all random walks. They differ in
//! their observers ([`Observer`]) and in the rule by which they continue ([`Survival`]).
//!
//! Theory: docs/theory.md#random-walks, docs/theory.md#walks-through-cells.

mod balance;
mod cells;
mod observer;
mod survival;

pub use cells::{CellCollision, CellDetail, CellRun};
pub use observer::{FreeFlightEvent, Observer, WalkEvent};
pub(super) use survival::Roulette;
pub use survival::Survival;

use crate::Spectrum;
use crate::budget::EDGES_PER_WALK;
use crate::path::segment::{Start, TransportMode, Vertex};
use crate::path::walk::{DrawnCollision, FreeFlight, Sampling, trace_to};
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::{CellVolume, Scene, WalkCells};
use cells::CellWalk;
use std::cell::OnceCell;
use std::iter::repeat_n;
use std::ops::ControlFlow;

/// Parameters of random walks.
#[derive(Clone, Copy, Debug)]
pub struct RandomWalk<'a> {
    /// Scene at the instant of the walk.
    pub scene: &'a Scene,
    /// Quantity that the walk carries.
    pub mode: TransportMode,
    /// Channel probabilities, at least of the first edge.
    pub channel_pdf: Spectrum,
    /// True if the channel probabilities of later edges are in proportion to the throughput. The
    /// throughput then stays bounded where media attenuate channels differently, but the density of
    /// an edge depends on all edges before it.
    pub follows_throughput: bool,
    /// Largest number of edges and specular events.
    pub max_depth: u32,
}

/// A ray along which a walk continues.
#[derive(Clone, Copy, Debug)]
pub struct WalkRay {
    /// Start of the ray.
    pub start: Start,
    /// Density per steradian from a point, per unit area from a plane; 1 along a specular lobe.
    pub pdf: f64,
    /// True if the ray leaves along a specular lobe.
    pub specular: bool,
    /// Throughput.
    pub throughput: Spectrum,
    /// Number of edges and specular events so far.
    pub depth: u32,
    /// Optical path length so far.
    pub optical_length: f64,
}

impl<'a> RandomWalk<'a> {
    /// Returns the channel probabilities of the next edge.
    fn channel_pdf(&self, ray: &WalkRay) -> Spectrum {
        if self.follows_throughput && self.channel_pdf.is_several() {
            let total = ray.throughput.sum();
            if total > 0.0 && total.is_finite() {
                return ray.throughput / total;
            }
        }
        self.channel_pdf
    }

    /// Follows a ray, and all its copies, to the end.
    pub fn run<O: Observer>(
        &self,
        ray: WalkRay,
        observer: &mut O,
        survival: &mut impl Survival,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) {
        let (mut ray, mut waiting) = (ray, Vec::new());
        // The field may be that of another instant.
        ws.last_flight = None;
        let freely = observer.sees_free_flights() && !self.channel_pdf.is_several();
        let mut budget = EDGES_PER_WALK;
        while budget > 0 {
            let through =
                self.through_cells(&mut ray, &mut budget, observer, survival, sampler, ws);
            let copies = match through {
                Some(copies) => copies,
                None => {
                    budget = budget.saturating_sub(1);
                    let step = self.step(&mut ray, freely, observer, sampler, ws);
                    // Apply Russian roulette or splitting.
                    if step.is_continue() {
                        survive(&mut ray, survival, sampler)
                    } else {
                        0
                    }
                }
            };
            if copies > 0 {
                observer.continue_walk(copies);
                waiting.extend(repeat_n(ray, copies - 1));
            } else {
                match waiting.pop() {
                    Some(other) => ray = other,
                    None => return,
                }
            }
        }
        for ray in waiting.into_iter().chain([ray]) {
            ws.stats.lost += 1;
            ws.stats.over_budget.rays += 1;
            observer.lose(&ray);
        }
    }

    /// Follows a ray through a volume of cells, from cell to cell. Returns the number of copies of
    /// the ray. Returns `None` if the ray continues by edges: outside such volumes, where the index
    /// bends rays, or if an observer needs edges.
    #[inline]
    fn through_cells<O: Observer>(
        &self,
        ray: &mut WalkRay,
        budget: &mut usize,
        observer: &mut O,
        survival: &mut impl Survival,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> Option<usize> {
        if self.channel_pdf.is_several() || self.mode != TransportMode::Importance {
            return None;
        }
        match self.scene.cell_volume(ray.start.medium)? {
            volume @ CellVolume::Voxels(cells) => {
                let walk = self.cell_walk(volume, &**cells, observer, sampler);
                walk?.follow(ray, budget, survival, ws)
            }
            volume @ CellVolume::Tetrahedra(cells) => {
                let walk = self.cell_walk(volume, cells, observer, sampler);
                walk?.follow(ray, budget, survival, ws)
            }
        }
    }

    /// Returns a walk through cells, unless the observer needs edges.
    fn cell_walk<'w, 'o, C: WalkCells, O: Observer>(
        &'w self,
        volume: &CellVolume,
        cells: &'w C,
        observer: &'o mut O,
        sampler: &'o mut Sampler,
    ) -> Option<CellWalk<'w, 'o, C, O>> {
        let detail = observer.detail_in(volume);
        Some(CellWalk {
            walk: self,
            cells,
            detail: Some(detail).filter(|detail| *detail != CellDetail::Edges)?,
            channel: self.channel_pdf.0.iter().position(|p| *p > 0.0)?,
            observer,
            sampler,
        })
    }

    /// Samples the next edge and a direction at its end, and replaces the ray by the next ray of
    /// the walk. Breaks if the walk ends. `freely` is true if free flights need not be edges.
    #[inline]
    fn step<O: Observer>(
        &self,
        ray: &mut WalkRay,
        freely: bool,
        observer: &mut O,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> ControlFlow<()> {
        // Sample the next edge by p(s) of eq. (distance density).
        let sampling = self.sampling::<O>(self.channel_pdf(ray));
        let target = DrawnCollision::draw(self.scene, &sampling, sampler);
        if freely
            && ray.depth < self.max_depth
            && !ws.stop.is_raised()
            && let Some(flight) = FreeFlight::to(self.scene, &ray.start, target, ws)
        {
            self.fly_freely(ray, &flight, observer, sampler, ws);
            return ControlFlow::Continue(());
        }
        match self.follow(ray, sampling, target, observer, sampler, ws) {
            Some(onward) => {
                *ray = onward;
                ControlFlow::Continue(())
            }
            None => ControlFlow::Break(()),
        }
    }

    /// Follows an edge to a collision, or to its end before, and samples a direction there. Returns
    /// the next ray of the walk.
    fn follow<O: Observer>(
        &self,
        ray: &WalkRay,
        sampling: Sampling,
        target: DrawnCollision,
        observer: &mut O,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> Option<WalkRay> {
        let channel_pdf = sampling.channel_pdf;
        let mut edge = trace_to(self.scene, ray.start, sampling, target, sampler, ws);
        edge.connectable &= !ray.specular;
        if O::ALONG_SPANS && channel_pdf.is_several() {
            edge.tabulate();
        }
        let event = WalkEvent {
            scene: self.scene,
            channel_pdf,
            ray,
            edge: &edge,
            spans: edge.spans.len(),
            throughput: Spectrum::ZERO,
            depth: ray.depth.saturating_add(1 + edge.geometry.events),
            optical_length: ray.optical_length + edge.optical_length,
            vertex: None,
            onward: None,
            path: OnceCell::new(),
        };
        // End the walk if it is deeper than paths may be.
        if event.depth > self.max_depth {
            let left = self.max_depth.saturating_sub(ray.depth);
            let spans = edge.spans.partition_point(|s| s.events_before < left);
            observer.cut(&WalkEvent { spans, ..event }, ws);
            return None;
        }
        // Find the vertex at the end of the edge, if there is one, and the throughput T up to it.
        let throughput = ray.throughput * edge.throughput(self.scene, channel_pdf);
        let vertex = Vertex::of(self.scene, &edge);
        // Sample a direction at the vertex.
        let scatter = vertex.as_ref().and_then(|vertex| {
            sampler.next_edge();
            vertex.scatter(self.scene, self.mode, sampler)
        });
        let onward = scatter.map(|scatter| WalkRay {
            start: scatter.start,
            pdf: if scatter.delta { 1.0 } else { scatter.pdf },
            specular: scatter.delta,
            throughput: throughput * scatter.weight,
            depth: event.depth,
            optical_length: event.optical_length,
        });
        let event = WalkEvent {
            throughput,
            vertex: vertex.as_ref(),
            onward: onward.as_ref(),
            ..event
        };
        match observer.arrive(&event, ws) {
            ControlFlow::Continue(()) => onward,
            ControlFlow::Break(()) => None,
        }
    }

    /// Follows a free flight and samples a direction at its end. Replaces the ray by the next ray
    /// of the walk.
    #[inline]
    fn fly_freely<O: Observer>(
        &self,
        ray: &mut WalkRay,
        flight: &FreeFlight,
        observer: &mut O,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) {
        ws.stats.edges += 1;
        let optical_length = ray.optical_length + flight.optical_length;
        sampler.next_edge();
        let x = flight.end;
        let phase = &flight.matter().phase;
        let (direction, pdf) = Vertex::scatter_in_volume(phase, [x, flight.direction], sampler);
        observer.fly_freely(&FreeFlightEvent {
            scene: self.scene,
            ray,
            flight,
            optical_length,
            direction,
        });
        *ray = WalkRay {
            start: Start::point(x, direction, ray.start.medium),
            pdf,
            specular: false,
            throughput: ray.throughput * flight.albedo(),
            depth: ray.depth + 1,
            optical_length,
        };
    }

    /// Returns the sampling parameters of edges.
    fn sampling<O: Observer>(&self, channel_pdf: Spectrum) -> Sampling {
        Sampling {
            mode: self.mode,
            channel_pdf,
            extend: false,
            collides: true,
            spans: O::KEEPS_SPANS || self.mode == TransportMode::Importance,
            parts: false,
            forced: false,
            differentials: O::NEEDS_GEOMETRY,
            splitting: false,
        }
    }
}

/// Returns the number of copies with which a ray continues.
fn survive(ray: &mut WalkRay, survival: &mut impl Survival, sampler: &mut Sampler) -> usize {
    let (depth, optical_length) = (ray.depth, ray.optical_length);
    survival.copies(&mut ray.throughput, depth, optical_length, sampler)
}
