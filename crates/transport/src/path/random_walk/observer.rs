//! Observers of random walks (docs/theory.md#random-walks, docs/theory.md#walks-through-cells).

use super::{CellCollision, CellDetail, CellRun, WalkRay};
use crate::Spectrum;
use crate::path::segment::{Edge, Point, Span, Vertex, collided};
use crate::path::walk::FreeFlight;
use crate::path::workspace::Workspace;
use crate::scene::{CellVolume, Scene};
use glam::DVec3;
use std::cell::OnceCell;
use std::ops::ControlFlow;

/// Observes a random walk. An observer draws none of the walk's random numbers, so that the walk
/// does not depend on its observers.
pub trait Observer {
    /// True if the observer queries attenuation all along the spans of edges, which are then
    /// tabulated.
    const ALONG_SPANS: bool = false;

    /// True if the observer also reads the spans of the edges of sensor subpaths.
    const KEEPS_SPANS: bool = false;

    /// True if the observer reads the geometry terms of edges, which are 0 otherwise.
    const NEEDS_GEOMETRY: bool = false;

    /// Receives an edge and the event at its end. Breaks if the walk can end.
    fn arrive(&mut self, event: &WalkEvent, ws: &mut Workspace) -> ControlFlow<()>;

    /// Returns true if the observer accepts [`Observer::fly_freely`] in place of
    /// [`Observer::arrive`] for free flights.
    fn sees_free_flights(&self) -> bool {
        false
    }

    /// Receives a flight from one collision to the next, of a walk with one channel.
    fn fly_freely(&mut self, _event: &FreeFlightEvent) {}

    /// Returns the flights that the observer needs to see while a walk with one channel is in a
    /// volume of cells. Except for [`CellDetail::Edges`], [`Observer::fly_in_cells`] and
    /// [`Observer::collide_in_cell`] replace all other calls except [`Observer::continue_walk`].
    fn detail_in(&self, _volume: &CellVolume) -> CellDetail {
        CellDetail::Edges
    }

    /// Receives a straight run through cells.
    fn fly_in_cells(&mut self, _run: &CellRun) {}

    /// Receives a collision in a cell.
    fn collide_in_cell(&mut self, _collision: &CellCollision) {}

    /// Receives the number of copies with which the walk continues from the last edge. The copies
    /// are followed one after the other, the last one first.
    fn continue_walk(&mut self, _copies: usize) {}

    /// Receives an edge that exceeds the largest depth. The walk ends on it, after its
    /// [spans](WalkEvent::spans).
    fn cut(&mut self, _event: &WalkEvent, _ws: &mut Workspace) {}

    /// Receives a ray that is not followed because the walk has spent its budget.
    fn lose(&mut self, _ray: &WalkRay) {}
}

/// An edge of a random walk, and the event at its end.
#[derive(Clone, Debug)]
pub struct WalkEvent<'e> {
    /// Scene of the walk.
    pub scene: &'e Scene,
    /// Channel probabilities.
    pub channel_pdf: Spectrum,
    /// Ray with which the edge starts.
    pub ray: &'e WalkRay,
    /// Edge of the event.
    pub edge: &'e Edge<'e>,
    /// Number of spans of the edge within the largest depth: all, unless the walk is cut. Sensor
    /// subpaths keep spans only if they are [requested](Observer::KEEPS_SPANS).
    pub spans: usize,
    /// Throughput up to the end of the edge.
    pub throughput: Spectrum,
    /// Number of edges and specular events up to the end of the edge.
    pub depth: u32,
    /// Optical path length up to the end of the edge.
    pub optical_length: f64,
    /// Vertex at the end of the edge; `None` if the edge left the scene, or is lost.
    pub vertex: Option<&'e Vertex>,
    /// Next ray of the walk, before Russian roulette; `None` if the walk is absorbed.
    pub onward: Option<&'e WalkRay>,
    /// Cached value of [`WalkEvent::path`].
    pub(super) path: OnceCell<Spectrum>,
}

/// Flight of a random walk that ends at a collision and crosses no surface. It needs no
/// [edge](WalkEvent::edge).
#[derive(Clone, Copy, Debug)]
pub struct FreeFlightEvent<'e, 's> {
    /// Scene of the walk.
    pub scene: &'e Scene,
    /// Ray with which the flight starts.
    pub ray: &'e WalkRay,
    /// Path of the flight.
    pub flight: &'e FreeFlight<'s>,
    /// Optical path length up to the end of the flight.
    pub optical_length: f64,
    /// Unit direction after the scattering at the end.
    pub direction: DVec3,
}

impl<'e> WalkEvent<'e> {
    /// Returns the spans within the largest depth.
    pub fn spans(&self) -> &'e [Span<'e>] {
        &self.edge.spans[..self.spans]
    }

    /// Returns the power of a particle that collides at the end of its edge, over the density per
    /// unit length of the collision.
    pub fn path(&self, collision: &Point) -> Spectrum {
        let path = || self.ray.throughput * collided(self.channel_pdf, collision);
        *self.path.get_or_init(path)
    }
}

/// Pair of observers of one walk; the walk ends as soon as either observer breaks.
impl<A: Observer, B: Observer> Observer for (A, B) {
    const ALONG_SPANS: bool = A::ALONG_SPANS || B::ALONG_SPANS;
    const KEEPS_SPANS: bool = A::KEEPS_SPANS || B::KEEPS_SPANS;
    const NEEDS_GEOMETRY: bool = A::NEEDS_GEOMETRY || B::NEEDS_GEOMETRY;

    fn arrive(&mut self, event: &WalkEvent, ws: &mut Workspace) -> ControlFlow<()> {
        let first = self.0.arrive(event, ws);
        let second = self.1.arrive(event, ws);
        if first.is_break() { first } else { second }
    }

    fn sees_free_flights(&self) -> bool {
        self.0.sees_free_flights() && self.1.sees_free_flights()
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        self.0.fly_freely(event);
        self.1.fly_freely(event);
    }

    fn detail_in(&self, volume: &CellVolume) -> CellDetail {
        self.0.detail_in(volume).min(self.1.detail_in(volume))
    }

    #[inline]
    fn fly_in_cells(&mut self, run: &CellRun) {
        self.0.fly_in_cells(run);
        self.1.fly_in_cells(run);
    }

    #[inline]
    fn collide_in_cell(&mut self, collision: &CellCollision) {
        self.0.collide_in_cell(collision);
        self.1.collide_in_cell(collision);
    }

    fn continue_walk(&mut self, copies: usize) {
        self.0.continue_walk(copies);
        self.1.continue_walk(copies);
    }

    fn cut(&mut self, event: &WalkEvent, ws: &mut Workspace) {
        self.0.cut(event, ws);
        self.1.cut(event, ws);
    }

    fn lose(&mut self, ray: &WalkRay) {
        self.0.lose(ray);
        self.1.lose(ray);
    }
}

impl<O: Observer> Observer for &mut O {
    const ALONG_SPANS: bool = O::ALONG_SPANS;
    const KEEPS_SPANS: bool = O::KEEPS_SPANS;
    const NEEDS_GEOMETRY: bool = O::NEEDS_GEOMETRY;

    fn arrive(&mut self, event: &WalkEvent, ws: &mut Workspace) -> ControlFlow<()> {
        (**self).arrive(event, ws)
    }

    fn sees_free_flights(&self) -> bool {
        (**self).sees_free_flights()
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        (**self).fly_freely(event);
    }

    fn detail_in(&self, volume: &CellVolume) -> CellDetail {
        (**self).detail_in(volume)
    }

    #[inline]
    fn fly_in_cells(&mut self, run: &CellRun) {
        (**self).fly_in_cells(run);
    }

    #[inline]
    fn collide_in_cell(&mut self, collision: &CellCollision) {
        (**self).collide_in_cell(collision);
    }

    fn continue_walk(&mut self, copies: usize) {
        (**self).continue_walk(copies);
    }

    fn cut(&mut self, event: &WalkEvent, ws: &mut Workspace) {
        (**self).cut(event, ws);
    }

    fn lose(&mut self, ray: &WalkRay) {
        (**self).lose(ray);
    }
}
