//! What takes note of the factors of two subpaths, and of what joins them.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use crate::emitter::EmittedRay;
use crate::path::connection::ConnectionArcs;
use crate::path::random_walk::{Observer, WalkEvent};
use crate::path::segment::{Edge, TransportMode, Vertex};
use crate::path::workspace::Workspace;
use glam::DVec3;
use std::ops::ControlFlow;

/// Takes note of the factors of two subpaths, and of what joins them. A static type: one that takes no notes costs nothing.
pub(crate) trait SubpathRecorder {
    /// The arcs of a connection, as they are kept.
    type Way;

    /// Whether it takes notes, so that edges must keep their spans.
    const RECORDS: bool;

    /// The light's subpath starts with a ray.
    fn emit(&mut self, ray: &EmittedRay);

    /// A subpath follows an edge to its next vertex, and is scattered if it collides there.
    fn reach(&mut self, mode: TransportMode, edge: &Edge);

    /// A subpath turns at its last vertex, perhaps along a specular lobe.
    fn leave(&mut self, mode: TransportMode, vertex: &Vertex, direction: DVec3, specular: bool);

    /// Keeps the arcs of a connection, which may be in either order.
    fn arcs(&self, arcs: ConnectionArcs) -> Self::Way;

    /// The subpaths, or one of them, have made a contribution.
    fn join(&mut self, joint: &Joint<Self::Way>);

    /// Light of a volume was seen from the sensor, at an arc length of the last of the edges that lead there.
    fn see(&mut self, passed: &[Edge], last: &Edge, length: f64, ray: &EmittedRay);
}

/// Up to where a subpath is part of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointEnd<'a> {
    /// Number of its edges before the last vertex.
    pub before: usize,
    /// That vertex, if it is connected, and the direction of the connection.
    pub turn: Option<(&'a Vertex, DVec3)>,
}

/// What makes a path of subpaths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint<'a, W> {
    /// Of the sensor.
    pub sensor: Option<JointEnd<'a>>,
    /// Of the light.
    pub light: Option<JointEnd<'a>>,
    /// The arcs of the connection.
    pub way: Option<&'a W>,
    /// The emitter's ray, if it is not the one with which the light's subpath starts.
    pub ray: Option<EmittedRay>,
}

/// Takes no notes.
impl SubpathRecorder for () {
    type Way = ();
    const RECORDS: bool = false;

    fn emit(&mut self, _ray: &EmittedRay) {}
    fn reach(&mut self, _mode: TransportMode, _edge: &Edge) {}
    fn leave(
        &mut self,
        _mode: TransportMode,
        _vertex: &Vertex,
        _direction: DVec3,
        _specular: bool,
    ) {
    }
    fn arcs(&self, _arcs: ConnectionArcs) {}
    fn join(&mut self, _joint: &Joint<()>) {}
    fn see(&mut self, _passed: &[Edge], _last: &Edge, _length: f64, _ray: &EmittedRay) {}
}

/// Tells a recorder of a walk.
pub(super) struct Recorded<'r, R> {
    pub recorder: &'r mut R,
    pub mode: TransportMode,
}

impl<R: SubpathRecorder> Observer for Recorded<'_, R> {
    const KEEPS_SPANS: bool = R::RECORDS;

    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        self.recorder.reach(self.mode, event.edge);
        if let (Some(vertex), Some(ray)) = (event.vertex, event.onward) {
            let direction = ray.start.direction;
            self.recorder
                .leave(self.mode, vertex, direction, ray.specular);
        }
        ControlFlow::Continue(())
    }
}
