//! Events of paths, in the order in which estimators sample them.

use super::connection::ConnectionArcs;
use super::random_walk::{Observer, WalkEvent};
use super::segment::{Edge, TransportMode, Vertex};
use super::workspace::{RayPart, Workspace};
use crate::emitter::EmittedRay;
use glam::DVec3;
use std::ops::ControlFlow;

/// Receives the events of the subpaths of a sample, and the contributions that they make. A static type: a log that ignores
/// events costs nothing.
///
/// The subpath of the sensor has [`TransportMode::Radiance`], that of the light [`TransportMode::Importance`].
pub(crate) trait PathLog {
    /// Arcs of a connection, as the log keeps them.
    type Way;

    /// True if [`follow`](Self::follow) looks at the spans of its edge. Edges that contributions leave before their end always
    /// keep their spans.
    const NEEDS_SPANS: bool;

    /// True if `follow` looks at the parts of its edge, or at its spans where no parts are kept.
    const NEEDS_PARTS: bool;

    /// Starts the subpath of the light with a ray.
    fn emit(&mut self, ray: &EmittedRay);

    /// Follows an edge to its end, with a scattering if it collides there. `parts` are the arcs of the edge up to its end; estimators
    /// may leave them out.
    fn follow(&mut self, mode: TransportMode, edge: &Edge, parts: &[RayPart]);

    /// Gives the end of the last edge of a subpath a number, from 0, so that contributions may leave the subpath there later.
    fn number_vertex(&mut self, mode: TransportMode);

    /// Turns at the last vertex of a subpath, perhaps along a specular lobe.
    fn turn(&mut self, mode: TransportMode, vertex: &Vertex, direction: DVec3, specular: bool);

    /// Keeps the arcs of a connection from a vertex of a subpath. They may start at either end.
    fn way(&mut self, mode: TransportMode, vertex: &Vertex, arcs: ConnectionArcs) -> Self::Way;

    /// Receives the path of a contribution.
    fn contribute(&mut self, path: &FoundPath<Self::Way>);
}

/// Path of a contribution: parts of one or two subpaths, and what joins them.
#[derive(Debug)]
pub(crate) struct FoundPath<'a, W> {
    /// Part of the sensor's subpath; `None` if a connection ends at the sensor.
    pub sensor: Option<SubpathEnd<'a>>,
    /// Part of the light's subpath; `None` if the path has the light of `ray`.
    pub light: Option<SubpathEnd<'a>>,
    /// Arcs of the connection.
    pub way: Option<&'a W>,
    /// Ray of the emitter, if it is not the one with which the light's subpath starts.
    pub ray: Option<&'a EmittedRay>,
}

/// End of the part of a subpath that belongs to a contribution.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubpathEnd<'a> {
    /// Where the contribution leaves the subpath.
    pub leaves: Leaves,
    /// Edges of the contribution alone, from there on.
    pub passed: &'a [Edge<'a>],
    /// Part of an edge after them.
    pub part: Option<EdgePart<'a>>,
    /// Vertex that is connected, and the direction of the connection.
    pub turn: Option<(&'a Vertex, DVec3)>,
}

/// Where a contribution leaves a subpath.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Leaves {
    /// At its start.
    Start,
    /// At a vertex with a [number](PathLog::number_vertex).
    Vertex(usize),
    /// Where the subpath has come to.
    Last,
}

/// Part of an edge, from its start up to an arc length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgePart<'a> {
    pub edge: &'a Edge<'a>,
    pub length: f64,
    /// True if the path is scattered at the end.
    pub scatters: bool,
}

impl SubpathEnd<'_> {
    /// End of a path that leaves a subpath without another edge.
    pub(crate) fn at(leaves: Leaves) -> Self {
        SubpathEnd {
            leaves,
            passed: &[],
            part: None,
            turn: None,
        }
    }
}

/// Ignores all events.
impl PathLog for () {
    type Way = ();
    const NEEDS_SPANS: bool = false;
    const NEEDS_PARTS: bool = false;

    fn emit(&mut self, _ray: &EmittedRay) {}
    fn follow(&mut self, _mode: TransportMode, _edge: &Edge, _parts: &[RayPart]) {}
    fn number_vertex(&mut self, _mode: TransportMode) {}
    fn turn(&mut self, _mode: TransportMode, _vertex: &Vertex, _direction: DVec3, _specular: bool) {
    }
    fn way(&mut self, _mode: TransportMode, _vertex: &Vertex, _arcs: ConnectionArcs) {}
    fn contribute(&mut self, _path: &FoundPath<()>) {}
}

/// Hands the events of a walk to a log.
pub(super) struct Logged<'l, L> {
    pub log: &'l mut L,
    pub mode: TransportMode,
}

impl<L: PathLog> Observer for Logged<'_, L> {
    const KEEPS_SPANS: bool = L::NEEDS_SPANS || L::NEEDS_PARTS;

    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        self.log.follow(self.mode, event.edge, &[]);
        self.log.number_vertex(self.mode);
        if let (Some(vertex), Some(ray)) = (event.vertex, event.onward) {
            let direction = ray.start.direction;
            self.log.turn(self.mode, vertex, direction, ray.specular);
        }
        ControlFlow::Continue(())
    }
}
