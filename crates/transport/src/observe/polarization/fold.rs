//! Stokes vectors that are followed while paths are sampled.
//!
//! Theory: docs/theory.md#stokes-vectors.

use super::connection::{ConnectionStokes, filter};
use super::transported::{StokesInFrame, Transported};
use crate::Spectrum;
use crate::bsdf::FilterMueller;
use crate::emitter::EmittedRay;
use crate::mueller::PlaneMueller;
use crate::observe::fold::{Fold, FoldedEnd, FoldedPath};
use crate::path::{
    ConnectionArcs, Edge, EdgePart, End, RayPart, Span, TransportMode, Vertex, surface_at,
};
use crate::scene::Scene;
use crate::sensor::SensorRay;
use eikonal::ray::Arc;
use glam::DVec3;

/// Stokes vectors at the sensor of the contributions of paths, per unit of unpolarised light that
/// they contribute.
#[derive(Debug)]
pub(crate) struct StokesFold<'a> {
    scene: &'a Scene,
    /// True if the scene has polarisation filters or panes.
    has_filters: bool,
    /// Number of channels whose matrices differ.
    count: usize,
    /// Direction of the sensor's ray.
    direction: DVec3,
    /// Upward direction of the sensor.
    up: DVec3,
    /// Stokes parameters of each contribution, by channel.
    found: Vec<[Spectrum; 4]>,
}

/// Polarisation at a point of a subpath.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "a path has one, which is not moved"
)]
pub(crate) enum StokesState {
    /// Matrix from the point to the sensor.
    Sensor(Transported),
    /// Stokes vectors from an emitter to the point.
    Light(StokesInFrame),
}

impl<'a> StokesFold<'a> {
    /// Creates a fold for paths with `channels` channels.
    pub(crate) fn new(scene: &'a Scene, channels: usize) -> Self {
        let mut bsdfs = scene.objects().iter().map(|object| &object.bsdf);
        let differ = bsdfs.any(|bsdf| bsdf.polarizes_by_channel());
        let mut bsdfs = scene.objects().iter().map(|object| &object.bsdf);
        StokesFold {
            scene,
            has_filters: bsdfs.any(|bsdf| bsdf.changes_what_passes()),
            count: if differ { channels } else { 1 },
            direction: DVec3::Z,
            up: DVec3::Y,
            found: Vec::new(),
        }
    }

    /// Replaces the scene by another instant with the same surfaces.
    pub(crate) fn enter(&mut self, scene: &'a Scene) {
        self.scene = scene;
    }

    /// Returns the state of unpolarised light in a direction.
    pub(crate) fn unpolarized(&self, direction: DVec3) -> StokesState {
        StokesState::Light(StokesInFrame::unpolarized(direction, self.count))
    }

    /// Begins the paths of a sample with a sensor ray.
    pub(crate) fn begin(&mut self, scene: &'a Scene, ray: &SensorRay) {
        self.enter(scene);
        self.direction = ray.direction;
        self.up = scene.sensor().to_world().matrix3.y_axis;
        self.found.clear();
    }

    /// Returns the Stokes parameters of all contributions, in order.
    pub(crate) fn found(&self) -> &[[Spectrum; 4]] {
        &self.found
    }

    /// Follows an edge up to a length from its start, through the events before it.
    fn along(&self, state: &mut StokesState, edge: &Edge, length: f64) {
        let last = edge
            .spans
            .partition_point(|span| span.length_after() < length);
        for (i, span) in edge.spans.iter().enumerate().take(last + 1) {
            if i == last {
                let theta = span.theta_at_length(length - span.length_before);
                return state.carry(&span.arc, theta);
            }
            state.carry(&span.arc, span.theta_end);
            if let Some(next) = edge.spans.get(i + 1) {
                self.through(state, span, next);
            }
        }
    }

    /// Passes or reflects at the surface between two spans.
    fn through(&self, state: &mut StokesState, span: &Span, next: &Span) {
        let Some((object, intersection)) = &span.surface else {
            return;
        };
        let scene = self.scene;
        let bsdf = &scene.objects()[*object].bsdf;
        if bsdf.is_null() {
            return;
        }
        let from = span.arc.velocity(span.theta_end).normalize();
        let to = next.arc.velocity(0.0).normalize();
        let hit = scene.hit(*object, intersection);
        let passes = hit.normal.dot(from) * hit.normal.dot(to) > 0.0;
        if bsdf.is_partial() && passes {
            let k = state.light_along(from);
            let filter = filter(scene, *object, intersection, span.medium, k);
            filter.inspect(|filter| state.pass(filter, from));
            return;
        }
        let surface = surface_at(scene, *object, &hit, span.medium);
        state.turn([from, to], |[from, to], channel| {
            bsdf.mueller(&surface, from, to, channel)
        });
    }
}

impl StokesState {
    /// Follows an arc up to θ.
    pub(crate) fn carry(&mut self, arc: &Arc, theta: f64) {
        match self {
            StokesState::Sensor(path) => path.carry(arc, theta),
            StokesState::Light(light) => light.carry(arc, 0.0, theta),
        }
    }

    /// Returns the direction of the light on a subpath in this direction.
    fn light_along(&self, direction: DVec3) -> DVec3 {
        match self {
            StokesState::Sensor(_) => -direction,
            StokesState::Light(_) => direction,
        }
    }

    /// Passes a filter that the subpath meets in the unit direction `from`.
    fn pass(&mut self, filter: &FilterMueller, from: DVec3) {
        match self {
            StokesState::Sensor(path) => path.pass(filter, from),
            StokesState::Light(light) => light.pass(filter, from),
        }
    }

    /// Turns from one unit direction to another. `mueller` returns the matrix of a channel for the
    /// directions of a path from the sensor.
    fn turn(
        &mut self,
        [from, to]: [DVec3; 2],
        mueller: impl Fn([DVec3; 2], usize) -> PlaneMueller,
    ) {
        match self {
            StokesState::Sensor(path) => path.turn(from, to, |c| mueller([from, to], c)),
            // Planted error "metals met by light from emitters as by paths from the sensor", found by morgana-transport/transport::polarization::estimators::rough_surfaces_polarise_alike_from_both_ends:
            // StokesState::Light(light) => light.turn(-to, -from, |c| mueller([-to, -from], c)),
            StokesState::Light(light) => light.turn(from, to, |c| mueller([-to, -from], c)),
        }
    }
}

impl Fold for StokesFold<'_> {
    type State = StokesState;
    type ConnectionLog = ConnectionStokes;
    const NEEDS_SPANS: bool = true;
    const NEEDS_PARTS: bool = false;

    fn start(&mut self) -> StokesState {
        let path = Transported::at_sensor(self.direction, self.up, self.count);
        StokesState::Sensor(path)
    }

    fn emit(&mut self, ray: &EmittedRay) -> StokesState {
        self.unpolarized(ray.direction)
    }

    fn follow(
        &mut self,
        state: &mut StokesState,
        _mode: TransportMode,
        edge: &Edge,
        _parts: &[RayPart],
    ) {
        let length = match &edge.end {
            End::Collision(point) => point.length,
            _ => f64::INFINITY,
        };
        self.along(state, edge, length);
    }

    fn follow_part(&mut self, state: &mut StokesState, part: &EdgePart) {
        self.along(state, part.edge, part.length);
    }

    fn pass(&mut self, state: &mut StokesState, span: &Span, next: &Span) {
        self.through(state, span, next);
    }

    fn turn(
        &mut self,
        state: &mut StokesState,
        _mode: TransportMode,
        vertex: &Vertex,
        to: DVec3,
        _specular: bool,
    ) {
        let scene = self.scene;
        match *vertex {
            Vertex::Volume {
                x,
                direction,
                medium,
            } => {
                let phase = &scene.medium(medium).phase;
                let mueller = phase.mueller(x, direction.dot(to));
                state.turn([direction, to], |_, _| mueller);
            }
            // Smooth interfaces and mirrors are events of edges, not vertices.
            Vertex::Surface {
                direction,
                object,
                ref surface,
                ..
            } => {
                let bsdf = &scene.objects()[object].bsdf;
                state.turn([direction, to], |[from, to], channel| {
                    bsdf.mueller(surface, from, to, channel)
                });
            }
        }
    }

    fn log_connection(
        &mut self,
        mode: TransportMode,
        vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> ConnectionStokes {
        ConnectionStokes::new(self.scene, self.has_filters, mode, vertex, arcs)
    }

    fn contribute(&mut self, path: FoldedPath<StokesState, ConnectionStokes>) {
        let light = match light_of(path.light) {
            Some(mut light) => {
                if let Some(connection_log) = path.connection_log {
                    connection_log.follow(self.scene, &mut light);
                }
                Some(light)
            }
            None => path
                .connection_log
                .and_then(|connection_log| connection_log.of_unpolarized(self.scene)),
        };
        let sensor = match path.sensor.map(|end| end.state) {
            Some(StokesState::Sensor(sensor)) => sensor,
            _ => {
                // Planted error "frames of light at the sensor those of the pixel's own ray", found by morgana-transport/transport::polarization::estimators::rough_surfaces_polarise_alike_from_both_ends:
                // let leaving = path.connection_log.map_or(self.direction, |_| self.direction);
                let leaving = path
                    .connection_log
                    .map_or(self.direction, |connection_log| -connection_log.arrival());
                Transported::at_sensor(leaving, self.up, self.count)
            }
        };
        self.found.push(match light {
            Some(light) => sensor.of(&light),
            None => sensor.of_unpolarized(),
        });
    }
}

/// Returns the light at the end of a subpath from an emitter.
fn light_of(end: Option<FoldedEnd<StokesState>>) -> Option<StokesInFrame> {
    match end?.state {
        StokesState::Light(light) => Some(light),
        StokesState::Sensor(_) => None,
    }
}
