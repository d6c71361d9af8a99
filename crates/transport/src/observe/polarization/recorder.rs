//! Follows the Mueller matrices of a path as it is sampled.
//!
//! Theory: docs/theory.md#stokes-vectors.

use super::frame::Axis;
use super::transported::{StokesInFrame, Transported};
use crate::Spectrum;
use crate::bsdf::FilterMueller;
use crate::derivative::FactorRecorder;
use crate::emitter::EmittedRay;
use crate::path::{ConnectionArcs, Edge, End, RayPart, Span, Vertex, surface_at};
use crate::scene::{MediumId, Scene};
use crate::sensor::SensorRay;
use crate::shape::Meeting;
use eikonal::connect::Event;
use eikonal::interface::Rule;
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;

/// What paths bring, as Stokes vectors at the sensor per what they bring of unpolarised light.
pub(crate) struct StokesRecorder<'a> {
    scene: &'a Scene,
    /// Whether it holds filters of polarised light, or panes.
    has_filters: bool,
    /// Number of channels whose matrices differ.
    count: usize,
    /// Up to where the path has come.
    trunk: Transported,
    /// Of the next contribution alone: up to a point of the last edge.
    aside: Option<Transported>,
    /// And what a connection brings.
    connected: Option<[Spectrum; 4]>,
    /// For each contribution, its Stokes parameters by channel.
    found: Vec<[Spectrum; 4]>,
}

impl<'a> StokesRecorder<'a> {
    /// For paths of so many channels.
    pub(crate) fn new(scene: &'a Scene, channels: usize) -> Self {
        let mut bsdfs = scene.objects().iter().map(|object| &object.bsdf);
        let differ = bsdfs.any(|bsdf| bsdf.polarizes_by_channel());
        let count = if differ { channels } else { 1 };
        let mut bsdfs = scene.objects().iter().map(|object| &object.bsdf);
        StokesRecorder {
            scene,
            has_filters: bsdfs.any(|bsdf| bsdf.changes_what_passes()),
            count,
            trunk: Transported::new(Axis(DVec3::X), count),
            aside: None,
            connected: None,
            found: Vec::new(),
        }
    }

    /// Begins a path: the first axis of the sensor's frame is horizontal, across the ray and `up`.
    pub(crate) fn begin(&mut self, scene: &'a Scene, ray: &SensorRay, up: DVec3) {
        self.scene = scene;
        self.found.clear();
        (self.aside, self.connected) = (None, None);
        let horizontal = ray.direction.cross(up);
        let axis = Axis::across(ray.direction, horizontal);
        self.trunk = Transported::new(axis, self.count);
    }

    /// The Stokes parameters of all contributions, in order.
    pub(crate) fn found(&self) -> &[[Spectrum; 4]] {
        &self.found
    }

    /// What does something to light along the arcs of a connection.
    fn parts<'p>(&self, arcs: ConnectionArcs<'p>) -> SmallVec<[Part<'p>; 2]> {
        let mut parts = SmallVec::new();
        let mut push = |medium, arc, theta_end, interface| {
            let filters = if self.has_filters {
                self.scene.filters_along(arc, theta_end)
            } else {
                SmallVec::new()
            };
            parts.push(Part {
                medium,
                arc,
                theta_end,
                filters,
                interface,
            });
        };
        match arcs {
            ConnectionArcs::Line(lines) if self.has_filters => {
                for line in lines {
                    push(line.medium, &line.arc, line.theta_end, None);
                }
            }
            ConnectionArcs::Line(_) => {}
            ConnectionArcs::Ray(pieces) => {
                for piece in pieces {
                    let event = piece.event.as_ref();
                    let interface = event.filter(|event| event.rule != Rule::Pass);
                    push(piece.region, &piece.arc, piece.theta_end, interface);
                }
            }
        }
        parts
    }

    /// Light along a part, through its filters.
    fn carry_on(&self, light: &mut StokesInFrame, part: &Part) {
        let mut from = 0.0;
        for (object, meeting) in &part.filters {
            light.carry(part.arc, from, meeting.theta);
            from = meeting.theta;
            let k = part.arc.velocity(from).normalize();
            let filter = filter(self.scene, *object, meeting, part.medium, k);
            filter.inspect(|f| light.pass(f, k));
        }
        light.carry(part.arc, from, part.theta_end);
    }

    /// Light against a part, through its filters.
    fn carry_back(&self, light: &mut StokesInFrame, part: &Part) {
        let mut from = part.theta_end;
        for (object, meeting) in part.filters.iter().rev() {
            light.carry(part.arc, from, meeting.theta);
            from = meeting.theta;
            let k = -part.arc.velocity(from).normalize();
            let filter = filter(self.scene, *object, meeting, part.medium, k);
            filter.inspect(|f| light.pass(f, k));
        }
        light.carry(part.arc, from, 0.0);
    }
}

/// A part of a connection.
struct Part<'p> {
    medium: MediumId,
    arc: &'p Arc,
    /// Where on the arc it ends.
    theta_end: f64,
    /// Filters on the way.
    filters: SmallVec<[(usize, Meeting); 2]>,
    /// Its end, if light is refracted or reflected there.
    interface: Option<&'p Event>,
}

impl Part<'_> {
    /// Whether unpolarised light stays so.
    fn does_nothing(&self) -> bool {
        self.filters.is_empty() && self.interface.is_none()
    }
}

/// What a filter or a pane does to light in the unit direction `k`; `None` if the object is none.
fn filter(
    scene: &Scene,
    object: usize,
    meeting: &Meeting,
    medium: MediumId,
    k: DVec3,
) -> Option<FilterMueller> {
    let bsdf = &scene.objects()[object].bsdf;
    if !bsdf.changes_what_passes() {
        return None;
    }
    let surface = surface_at(scene, object, &scene.hit(object, meeting), medium);
    bsdf.passing_mueller(&surface, k)
}

impl FactorRecorder for StokesRecorder<'_> {
    /// Light that arrives at the vertex; `None` if it is unpolarised.
    type Way = Option<StokesInFrame>;
    const NEEDS_SPANS: bool = true;
    const NEEDS_PARTS: bool = false;

    fn way(&mut self, vertex: &Vertex, arcs: ConnectionArcs) -> Self::Way {
        let parts = self.parts(arcs);
        // Lines are not turned.
        if parts.iter().all(|part| part.does_nothing()) {
            return None;
        }
        let (first, last) = (parts.first()?, parts.last()?);
        let x = vertex.position();
        let [start, end] = [first.arc.start(), last.arc.position(last.theta_end)];
        let leaves = x.distance_squared(start) <= x.distance_squared(end);
        Some(if leaves {
            let mut light = StokesInFrame::unpolarized(last.arc.velocity(last.theta_end));
            for part in parts.iter().rev() {
                if let Some(event) = part.interface {
                    light.meet(event, [-event.after, -event.before]);
                }
                self.carry_back(&mut light, part);
            }
            light
        } else {
            let mut light = StokesInFrame::unpolarized(first.arc.velocity(0.0));
            for part in &parts {
                self.carry_on(&mut light, part);
                if let Some(event) = part.interface {
                    light.meet(event, [event.before, event.after]);
                }
            }
            light
        })
    }

    fn follow(&mut self, edge: &Edge, _parts: &[RayPart]) {
        let length = match &edge.end {
            End::Collision(point) => point.length,
            _ => f64::INFINITY,
        };
        along(self.scene, edge, length, &mut self.trunk);
    }

    fn turn(&mut self, vertex: &Vertex, direction: DVec3, _specular: bool) {
        at_vertex(self.scene, vertex, direction, &mut self.trunk);
    }

    fn aside_follow(&mut self, edge: &Edge, length: f64) {
        let mut aside = self.trunk;
        along(self.scene, edge, length, &mut aside);
        self.aside = Some(aside);
    }

    fn aside_connect(&mut self, vertex: &Vertex, direction: DVec3, way: &Self::Way) {
        let mut all = self.aside.take().unwrap_or(self.trunk);
        at_vertex(self.scene, vertex, direction, &mut all);
        self.connected = Some(match way {
            Some(light) => all.of(light, direction),
            None => all.of_unpolarized(),
        });
    }

    fn aside_reach(&mut self, edge: &Edge, length: f64) {
        let mut aside = self.trunk;
        along(self.scene, edge, length, &mut aside);
        self.connected = Some(aside.of_unpolarized());
    }

    fn contribute(&mut self, _ray: &EmittedRay) {
        let found = self.connected.take();
        self.found
            .push(found.unwrap_or_else(|| self.trunk.of_unpolarized()));
    }
}

/// On along an edge as far as a length from its start, through the events on the way.
fn along(scene: &Scene, edge: &Edge, length: f64, path: &mut Transported) {
    let last = edge
        .spans
        .partition_point(|span| span.length_after() < length);
    for (i, span) in edge.spans.iter().enumerate().take(last + 1) {
        if i == last {
            let theta = span.theta_at_length(length - span.length_before);
            return path.carry(&span.arc, theta);
        }
        path.carry(&span.arc, span.theta_end);
        if let Some(next) = edge.spans.get(i + 1) {
            through(scene, span, next, path);
        }
    }
}

/// On through the surface between two spans.
fn through(scene: &Scene, span: &Span, next: &Span, path: &mut Transported) {
    let Some((object, meeting)) = &span.surface else {
        return;
    };
    let bsdf = &scene.objects()[*object].bsdf;
    if bsdf.is_null() {
        return;
    }
    let from = span.arc.velocity(span.theta_end).normalize();
    let to = next.arc.velocity(0.0).normalize();
    let hit = scene.hit(*object, meeting);
    let passes = hit.normal.dot(from) * hit.normal.dot(to) > 0.0;
    if bsdf.is_partial() && passes {
        let filter = filter(scene, *object, meeting, span.medium, -from);
        filter.inspect(|f| path.pass(f, from));
        return;
    }
    let surface = surface_at(scene, *object, &hit, span.medium);
    path.turn(from, to, |channel| {
        bsdf.mueller(&surface, from, to, channel)
    });
}

/// On from a vertex in a direction.
fn at_vertex(scene: &Scene, vertex: &Vertex, to: DVec3, path: &mut Transported) {
    match *vertex {
        Vertex::Volume {
            x,
            direction,
            medium,
        } => {
            let phase = &scene.medium(medium).phase;
            let mueller = phase.mueller(x, direction.dot(to));
            path.turn(direction, to, |_| mueller);
        }
        // Not of smooth interfaces and mirrors, which edges go on from.
        Vertex::Surface {
            direction,
            object,
            ref surface,
            ..
        } => {
            let bsdf = &scene.objects()[object].bsdf;
            path.turn(direction, to, |channel| {
                bsdf.mueller(surface, direction, to, channel)
            });
        }
    }
}
