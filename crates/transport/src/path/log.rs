//! Events of paths, in the order in which estimators sample them.

use super::connection::ConnectionArcs;
use super::random_walk::{Observer, WalkEvent};
use super::segment::{Edge, TransportMode, Vertex};
use super::workspace::{RayPart, Workspace};
use crate::emitter::EmittedRay;
use glam::DVec3;
use std::ops::ControlFlow;

/// Receives the events of the subpaths of a sample, and the contributions that they make. Logs are
/// static types, so that a log that ignores events costs nothing.
///
/// Events of the sensor subpath have [`TransportMode::Radiance`], events of the light subpath
/// [`TransportMode::Importance`].
pub(crate) trait PathLog {
    /// Arcs of a connection, as the log keeps them.
    type ConnectionLog;

    /// True if [`follow`](Self::follow) reads the spans of its edge. Edges that contributions leave
    /// before their end always keep their spans.
    const NEEDS_SPANS: bool;

    /// True if `follow` reads the parts of its edge, or its spans if no parts are kept.
    const NEEDS_PARTS: bool;

    /// Starts the light subpath with a ray.
    fn emit(&mut self, ray: &EmittedRay);

    /// Follows an edge to its end, with a scattering event if it collides there. `parts` are the
    /// arcs of the edge up to its end; estimators may omit them.
    fn follow(&mut self, mode: TransportMode, edge: &Edge, parts: &[RayPart]);

    /// Numbers the end of the last edge of a subpath, from 0, so that later contributions may leave
    /// the subpath there.
    fn number_vertex(&mut self, mode: TransportMode);

    /// Turns at the last vertex of a subpath, possibly along a specular lobe.
    fn turn(&mut self, mode: TransportMode, vertex: &Vertex, direction: DVec3, specular: bool);

    /// Stores the arcs of a connection from a vertex of a subpath. The arcs may start at either
    /// end.
    fn log_connection(
        &mut self,
        mode: TransportMode,
        vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> Self::ConnectionLog;

    /// Receives the path of a contribution.
    fn contribute(&mut self, path: &FoundPath<Self::ConnectionLog>);
}

/// Path of a contribution: parts of one or two subpaths, and the connection between them.
#[derive(Debug)]
pub(crate) struct FoundPath<'a, W> {
    /// Part of the sensor subpath; `None` if a connection ends at the sensor.
    pub sensor: Option<SubpathEnd<'a>>,
    /// Part of the light subpath; `None` if the light is emitted along `ray`.
    pub light: Option<SubpathEnd<'a>>,
    /// Arcs of the connection.
    pub connection_log: Option<&'a W>,
    /// Ray of the emitter, if it differs from the first ray of the light subpath.
    pub ray: Option<&'a EmittedRay>,
}

/// End of the part of a subpath that belongs to a contribution.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubpathEnd<'a> {
    /// Place at which the contribution leaves the subpath.
    pub branch_point: BranchPoint,
    /// Edges of the path after it has left the subpath. Only this contribution has them.
    pub passed: &'a [Edge<'a>],
    /// Part of an edge after `passed`.
    pub part: Option<EdgePart<'a>>,
    /// Vertex that is connected, and the direction of the connection.
    pub turn: Option<(&'a Vertex, DVec3)>,
}

/// Place at which a contribution leaves a subpath.
#[derive(Clone, Copy, Debug)]
pub(crate) enum BranchPoint {
    /// The start of the subpath.
    Start,
    /// A vertex with a [number](PathLog::number_vertex).
    Vertex(usize),
    /// The current end of the subpath.
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
    /// Makes the end of a path that leaves a subpath without another edge.
    pub(crate) fn at(branch_point: BranchPoint) -> Self {
        SubpathEnd {
            branch_point,
            passed: &[],
            part: None,
            turn: None,
        }
    }
}

/// Ignores all events.
impl PathLog for () {
    type ConnectionLog = ();
    const NEEDS_SPANS: bool = false;
    const NEEDS_PARTS: bool = false;

    fn emit(&mut self, _ray: &EmittedRay) {}
    fn follow(&mut self, _mode: TransportMode, _edge: &Edge, _parts: &[RayPart]) {}
    fn number_vertex(&mut self, _mode: TransportMode) {}
    fn turn(&mut self, _mode: TransportMode, _vertex: &Vertex, _direction: DVec3, _specular: bool) {
    }
    fn log_connection(&mut self, _mode: TransportMode, _vertex: &Vertex, _arcs: ConnectionArcs) {}
    fn contribute(&mut self, _path: &FoundPath<()>) {}
}

/// Observer that forwards the events of a walk to a log.
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
