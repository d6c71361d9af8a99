//! What watches a random walk (docs/theory.md#random-walks, docs/theory.md#walks-through-voxels).

use super::{VoxelFlight, WalkRay};
use crate::Spectrum;
use crate::path::segment::{Edge, Point, Span, Vertex, collided};
use crate::path::walk::FreeFlight;
use crate::path::workspace::Workspace;
use crate::scene::{Scene, VoxelVolume};
use glam::DVec3;
use std::cell::OnceCell;
use std::ops::ControlFlow;

/// Watches a random walk. It draws none of the walk's random numbers, so that the walk does not depend on who is watching.
pub trait Observer {
    /// Whether it asks for attenuation all along the spans of edges, which are then prepared for many questions.
    const ALONG_SPANS: bool = false;

    /// Whether it looks at the spans of the edges of sensor subpaths, too.
    const KEEPS_SPANS: bool = false;

    /// Whether it asks for the geometry terms of edges, which are 0 otherwise.
    const ASKS_FOR_GEOMETRY: bool = false;

    /// An edge, and what happens at its end. Breaks if the walk need not go on.
    fn arrive(&mut self, event: &WalkEvent, ws: &mut Workspace) -> ControlFlow<()>;

    /// Whether it takes [`Observer::fly_freely`] in place of [`Observer::arrive`] for flights that nothing interrupts.
    fn sees_free_flights(&self) -> bool {
        false
    }

    /// A flight from one collision to the next, of a walk with one channel.
    fn fly_freely(&mut self, _event: &FreeFlightEvent) {}

    /// Whether it takes [`Observer::fly_in_voxel`] and [`Observer::collide_in_voxel`] in place of all other calls but [`Observer::go_on`] as
    /// long as a walk with one channel is in a volume of voxels.
    fn sees_voxels(&self, _volume: &VoxelVolume) -> bool {
        false
    }

    /// A straight flight within a voxel.
    fn fly_in_voxel(&mut self, _flight: &VoxelFlight) {}

    /// A collision in a voxel, which takes power from the particle.
    fn collide_in_voxel(&mut self, _absorbed: f64) {}

    /// The walk goes on in so many copies from the edge that was seen last; they are followed one after the other, the last
    /// first.
    fn go_on(&mut self, _copies: usize) {}

    /// An edge that is longer than paths may be: the walk ends on it, after its [spans](WalkEvent::spans).
    fn cut(&mut self, _event: &WalkEvent, _ws: &mut Workspace) {}

    /// A ray that is not followed because the walk has spent its budget.
    fn lose(&mut self, _ray: &WalkRay) {}
}

/// An edge of a random walk, and what happens at its end.
#[derive(Clone, Debug)]
pub struct WalkEvent<'e> {
    /// The scene.
    pub scene: &'e Scene,
    /// Channel probabilities.
    pub channel_pdf: Spectrum,
    /// The ray with which the edge starts.
    pub ray: &'e WalkRay,
    /// The edge.
    pub edge: &'e Edge<'e>,
    /// Number of its spans within the largest depth: all, unless the walk is cut. Sensor subpaths keep spans only if they are [asked for](Observer::KEEPS_SPANS).
    pub spans: usize,
    /// Throughput up to its end.
    pub throughput: Spectrum,
    /// Edges and specular events up to its end.
    pub depth: u32,
    /// Optical path length up to its end.
    pub optical_length: f64,
    /// The vertex at its end; `None` if it has left the scene, or is lost.
    pub vertex: Option<&'e Vertex>,
    /// The ray with which the walk goes on from there, before Russian roulette; `None` if it is absorbed.
    pub onward: Option<&'e WalkRay>,
    /// See [`WalkEvent::path`], once it is known.
    pub(super) path: OnceCell<Spectrum>,
}

/// A flight of a random walk that ends at a collision and is no [edge](WalkEvent::edge), since nothing happens on it.
#[derive(Clone, Copy, Debug)]
pub struct FreeFlightEvent<'e, 's> {
    /// The ray with which it starts.
    pub ray: &'e WalkRay,
    /// The flight.
    pub flight: &'e FreeFlight<'s>,
    /// Optical path length up to its end.
    pub optical_length: f64,
    /// Unit direction in which it is scattered there.
    pub direction: DVec3,
}

impl<'e> WalkEvent<'e> {
    /// The spans within the largest depth.
    pub fn spans(&self) -> &'e [Span<'e>] {
        &self.edge.spans[..self.spans]
    }

    /// Power of a particle that collides at the end of its edge, over the density per unit length of the collision.
    pub fn path(&self, collision: &Point) -> Spectrum {
        let path = || self.ray.throughput * collided(self.channel_pdf, collision);
        *self.path.get_or_init(path)
    }
}

/// Both watch; the walk ends where either is done.
impl<A: Observer, B: Observer> Observer for (A, B) {
    const ALONG_SPANS: bool = A::ALONG_SPANS || B::ALONG_SPANS;
    const KEEPS_SPANS: bool = A::KEEPS_SPANS || B::KEEPS_SPANS;
    const ASKS_FOR_GEOMETRY: bool = A::ASKS_FOR_GEOMETRY || B::ASKS_FOR_GEOMETRY;

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

    fn sees_voxels(&self, volume: &VoxelVolume) -> bool {
        self.0.sees_voxels(volume) && self.1.sees_voxels(volume)
    }

    #[inline]
    fn fly_in_voxel(&mut self, flight: &VoxelFlight) {
        self.0.fly_in_voxel(flight);
        self.1.fly_in_voxel(flight);
    }

    #[inline]
    fn collide_in_voxel(&mut self, absorbed: f64) {
        self.0.collide_in_voxel(absorbed);
        self.1.collide_in_voxel(absorbed);
    }

    fn go_on(&mut self, copies: usize) {
        self.0.go_on(copies);
        self.1.go_on(copies);
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
    const ASKS_FOR_GEOMETRY: bool = O::ASKS_FOR_GEOMETRY;

    fn arrive(&mut self, event: &WalkEvent, ws: &mut Workspace) -> ControlFlow<()> {
        (**self).arrive(event, ws)
    }

    fn sees_free_flights(&self) -> bool {
        (**self).sees_free_flights()
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        (**self).fly_freely(event);
    }

    fn sees_voxels(&self, volume: &VoxelVolume) -> bool {
        (**self).sees_voxels(volume)
    }

    #[inline]
    fn fly_in_voxel(&mut self, flight: &VoxelFlight) {
        (**self).fly_in_voxel(flight);
    }

    #[inline]
    fn collide_in_voxel(&mut self, absorbed: f64) {
        (**self).collide_in_voxel(absorbed);
    }

    fn go_on(&mut self, copies: usize) {
        (**self).go_on(copies);
    }

    fn cut(&mut self, event: &WalkEvent, ws: &mut Workspace) {
        (**self).cut(event, ws);
    }

    fn lose(&mut self, ray: &WalkRay) {
        (**self).lose(ray);
    }
}
