//! Factors of one path, as a tree. The factors of a contribution lead from one or two nodes back to
//! the root.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use crate::bsdf::{BsdfEvent, Surface};
use crate::emitter::EmittedRay;
use crate::observe::fold::{Fold, FoldedEnd, FoldedPath};
use crate::path::{ConnectionArcs, Edge, EdgePart, End, RayPart, Span, TransportMode, Vertex};
use crate::scene::MediumId;
use crate::shape::Intersection;
use eikonal::connect::Event;
use eikonal::interface::Rule;
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;

/// Factor of a path's contribution.
#[derive(Clone, Debug)]
pub(crate) enum Factor {
    /// Attenuation e^−∫σ_t ds along a segment.
    Attenuation(Segment),
    /// Scattering coefficient σ_s at a collision.
    Scattering { medium: MediumId, x: DVec3 },
    /// Phase function at a position, at the cosine of the scattering angle.
    Phase {
        medium: MediumId,
        x: DVec3,
        cos: f64,
    },
    /// Bsdf of an object's surface, at a vertex, or where a connection is refracted or reflected.
    Surface {
        object: usize,
        surface: Surface,
        event: BsdfEvent,
    },
    /// Factor of a surface that transmits or reflects light on an edge.
    EdgeEvent(EdgeEvent),
    /// Arc of a connection: attenuation, and the factors of panes and filters that light passes.
    Connection {
        segment: Segment,
        /// True if the arc ends at a boundary between media.
        bounded: bool,
    },
    /// Emission along a ray.
    Emission(EmittedRay),
}

/// Segment within one medium: an arc up to θ.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    pub medium: MediumId,
    pub arc: Arc,
    pub theta: f64,
}

/// Transmission or reflection at a surface without a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeEvent {
    pub object: usize,
    pub intersection: Intersection,
    /// Medium through which light arrives.
    pub medium: MediumId,
    /// Unit direction before the surface; `to` is the direction after it.
    pub from: DVec3,
    pub to: DVec3,
}

impl EdgeEvent {
    /// Returns the event between one arc of an edge and the next, if they meet at a surface.
    fn between(span: &Span, next: &Span) -> Option<Self> {
        let (object, intersection) = span.surface?;
        Some(EdgeEvent {
            object,
            intersection,
            medium: span.medium,
            from: span.arc.velocity(span.theta_end).normalize(),
            to: next.arc.velocity(0.0).normalize(),
        })
    }
}

/// Node of a tape: after one of its factors, or at its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Place(usize);

impl Place {
    /// Node before all factors.
    const START: Self = Place(0);

    /// Returns the node after the factor with this index.
    pub(super) fn after(factor: usize) -> Self {
        Place(factor + 1)
    }

    /// Returns the index of the node; the start has index 0.
    pub(super) fn number(self) -> usize {
        self.0
    }
}

/// Factor with the node that precedes it.
#[derive(Clone, Debug)]
pub(super) struct PlacedFactor {
    pub factor: Factor,
    pub before: Place,
}

/// Factors of one path, and the nodes of its contributions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    /// Factors. Each follows an earlier one, or the start.
    pub(super) factors: Vec<PlacedFactor>,
    /// Nodes of each contribution: one node, or one of each of two subpaths.
    pub(super) kept: Vec<[Place; 2]>,
    /// Current node of a particle's path.
    trunk: Place,
    /// Node after the factors that only the next contribution has.
    branch: Option<Place>,
}

impl Tape {
    /// Starts the path with a ray of an emitter.
    pub(crate) fn begin(&mut self, ray: &EmittedRay) {
        self.trunk = self.push(self.trunk, Factor::Emission(*ray));
    }

    /// Extends the path along an arc up to θ.
    pub(crate) fn fly(&mut self, medium: MediumId, arc: &Arc, theta: f64) {
        self.trunk = self.segment(self.trunk, medium, arc, theta);
    }

    /// Adds an arc up to θ to the next contribution only.
    pub(crate) fn branch_fly(&mut self, medium: MediumId, arc: &Arc, theta: f64) {
        let from = self.branch.unwrap_or(self.trunk);
        self.branch = Some(self.segment(from, medium, arc, theta));
    }

    /// Passes or reflects the path at a surface between two arcs of an edge.
    pub(crate) fn pass_surface(&mut self, span: &Span, next: &Span) {
        self.trunk = self.edge_event(self.trunk, span, next);
    }

    /// Turns a path of light at a vertex, perhaps along a specular lobe.
    pub(crate) fn turn_light(&mut self, vertex: &Vertex, direction: DVec3, specular: bool) {
        let factor = turned(TransportMode::Importance, vertex, direction, specular);
        self.trunk = self.push(self.trunk, factor);
    }

    /// Scatters the path at a position.
    pub(crate) fn collide(&mut self, medium: MediumId, x: DVec3) {
        self.trunk = self.push(self.trunk, Factor::Scattering { medium, x });
    }

    /// Records a contribution of the path.
    pub(crate) fn keep(&mut self) {
        let place = self.branch.take().unwrap_or(self.trunk);
        self.kept.push([place, Place::START]);
    }

    /// Clears the tape.
    pub(crate) fn clear(&mut self) {
        self.factors.clear();
        self.kept.clear();
        (self.trunk, self.branch) = (Place::START, None);
    }

    /// Adds a factor after a node. Returns the node after the factor.
    fn push(&mut self, before: Place, factor: Factor) -> Place {
        self.factors.push(PlacedFactor { factor, before });
        Place::after(self.factors.len() - 1)
    }

    fn segment(&mut self, from: Place, medium: MediumId, arc: &Arc, theta: f64) -> Place {
        let arc = *arc;
        self.push(from, Factor::Attenuation(Segment { medium, arc, theta }))
    }

    fn edge_event(&mut self, from: Place, span: &Span, next: &Span) -> Place {
        match EdgeEvent::between(span, next) {
            // Planted error "mirrors on the way left out of derivatives", found by morgana-transport/transport::derivatives::colours::light_that_met_a_colour_once_is_in_proportion_to_it:
            // Some(_) => from,
            Some(edge_event) => self.push(from, Factor::EdgeEvent(edge_event)),
            None => from,
        }
    }

    fn connected(&mut self, from: Place, connection_log: &[Factor]) -> Place {
        connection_log
            .iter()
            .cloned()
            // Planted error "connections that do not attenuate in derivatives", found by morgana-transport/transport::derivatives::media::derivatives_are_differences_where_rays_are_straight:
            // .take(0).fold(from, |place, factor| self.push(place, factor))
            .fold(from, |place, factor| self.push(place, factor))
    }

    /// Adds a whole edge, and a scattering if it ends at a collision.
    fn edge(&mut self, from: Place, edge: &Edge) -> Place {
        if let End::Collision(point) = &edge.end {
            return self.scattered(from, edge, point.length);
        }
        self.spans(from, &edge.spans)
    }

    /// Adds whole arcs, and the events between them.
    fn spans(&mut self, from: Place, spans: &[Span]) -> Place {
        let mut place = from;
        for (i, span) in spans.iter().enumerate() {
            place = self.segment(place, span.medium, &span.arc, span.theta_end);
            if let Some(next) = spans.get(i + 1) {
                place = self.edge_event(place, span, next);
            }
        }
        place
    }

    /// Adds the part of an edge up to an arc length, and a scattering there.
    fn scattered(&mut self, from: Place, edge: &Edge, length: f64) -> Place {
        let place = self.up_to(from, edge, length);
        match edge.spans.get(last_span(edge, length)) {
            Some(span) => {
                let (medium, x) = (
                    span.medium,
                    span.arc
                        .position(span.theta_at_length(length - span.length_before)),
                );
                self.push(place, Factor::Scattering { medium, x })
            }
            None => place,
        }
    }

    /// Adds the part of an edge up to an arc length.
    fn up_to(&mut self, from: Place, edge: &Edge, length: f64) -> Place {
        let last = last_span(edge, length);
        let Some(span) = edge.spans.get(last) else {
            return from;
        };
        let mut place = self.spans(from, &edge.spans[..last]);
        if let Some(before) = last.checked_sub(1) {
            place = self.edge_event(place, &edge.spans[before], span);
        }
        let theta = span.theta_at_length(length - span.length_before);
        self.segment(place, span.medium, &span.arc, theta)
    }
}

impl Fold for Tape {
    type State = Place;
    type ConnectionLog = SmallVec<[Factor; 1]>;
    const NEEDS_SPANS: bool = true;
    const NEEDS_PARTS: bool = false;

    fn start(&mut self) -> Place {
        Place::START
    }

    fn emit(&mut self, ray: &EmittedRay) -> Place {
        self.push(Place::START, Factor::Emission(*ray))
    }

    fn follow(&mut self, place: &mut Place, _mode: TransportMode, edge: &Edge, _parts: &[RayPart]) {
        *place = self.edge(*place, edge);
    }

    fn follow_part(&mut self, place: &mut Place, part: &EdgePart) {
        *place = if part.scatters {
            self.scattered(*place, part.edge, part.length)
        } else {
            self.up_to(*place, part.edge, part.length)
        };
    }

    fn pass(&mut self, place: &mut Place, span: &Span, next: &Span) {
        *place = self.edge_event(*place, span, next);
    }

    fn turn(
        &mut self,
        place: &mut Place,
        mode: TransportMode,
        vertex: &Vertex,
        direction: DVec3,
        specular: bool,
    ) {
        *place = self.push(*place, turned(mode, vertex, direction, specular));
    }

    fn log_connection(
        &mut self,
        _mode: TransportMode,
        _vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> Self::ConnectionLog {
        connection_log(arcs)
    }

    fn contribute(&mut self, path: FoldedPath<Place, Self::ConnectionLog>) {
        let end = |end: Option<FoldedEnd<Place>>| end.map_or(Place::START, |end| end.state);
        let mut place = end(path.sensor);
        if let Some(connection_log) = path.connection_log {
            place = self.connected(place, connection_log);
        }
        if let Some(ray) = path.ray {
            place = self.push(place, Factor::Emission(*ray));
        }
        // Planted error "joined paths without the factors of the light's subpath", found by morgana-transport/transport::derivatives::integrators::derivatives_by_bidirectional_path_tracing_are_those_by_path_tracing:
        // let light = end(path.light); self.kept.push([place, if place != Place::START { Place::START } else { light }]);
        self.kept.push([place, end(path.light)]);
    }
}

/// Returns the factors of a connection.
fn connection_log(arcs: ConnectionArcs) -> SmallVec<[Factor; 1]> {
    let arc_of = |medium, arc: &Arc, theta, bounded| Factor::Connection {
        segment: Segment {
            medium,
            arc: *arc,
            theta,
        },
        bounded,
    };
    match arcs {
        ConnectionArcs::Line(parts) => {
            let each = parts.iter().enumerate();
            each.map(|(i, p)| arc_of(p.medium, &p.arc, p.theta_end, i + 1 < parts.len()))
                .collect()
        }
        ConnectionArcs::Ray(pieces) => {
            let mut connection_log = SmallVec::new();
            for piece in pieces {
                let passes = |event: &Event| event.rule == Rule::Pass;
                let bounded = piece.event.as_ref().is_some_and(passes);
                connection_log.push(arc_of(piece.region, &piece.arc, piece.theta_end, bounded));
                // Planted error "glass that connections pass left out of derivatives", found by morgana-transport/transport::derivatives::colours::light_through_glass_is_in_proportion_to_its_colour:
                // connection_log.extend(piece.event.as_ref().filter(|_| false).map(interface));
                connection_log.extend(piece.event.as_ref().filter(|e| !passes(e)).map(interface));
            }
            connection_log
        }
    }
}

/// Returns the factor of a smooth interface at which a connection is refracted or reflected.
fn interface(event: &Event) -> Factor {
    Factor::Surface {
        object: event.surface,
        surface: Surface::plain(event.normal, 1.0, 1.0),
        event: BsdfEvent {
            toward: -event.before.normalize(),
            direction: event.after.normalize(),
            delta: true,
        },
    }
}

/// Returns the index of the span of an edge that contains an arc length.
fn last_span(edge: &Edge, length: f64) -> usize {
    let last = edge
        .spans
        .partition_point(|span| span.length_after() < length);
    last.min(edge.spans.len().saturating_sub(1))
}

/// Returns the factor of a vertex at which a subpath turns, perhaps along a specular lobe.
fn turned(mode: TransportMode, vertex: &Vertex, direction: DVec3, specular: bool) -> Factor {
    match *vertex {
        Vertex::Volume {
            x,
            direction: arrival,
            medium,
        } => Factor::Phase {
            medium,
            x,
            cos: arrival.dot(direction),
        },
        Vertex::Surface {
            direction: arrival,
            object,
            surface,
            ..
        } => {
            let (toward, direction) = match mode {
                TransportMode::Radiance => (-arrival, direction),
                TransportMode::Importance => (direction, -arrival),
            };
            let delta = specular;
            Factor::Surface {
                object,
                surface,
                event: BsdfEvent {
                    toward,
                    direction,
                    delta,
                },
            }
        }
    }
}
