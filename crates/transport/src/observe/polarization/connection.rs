//! Polarisation along connections.
//!
//! Theory: docs/theory.md#stokes-vectors.

use super::transported::StokesInFrame;
use crate::bsdf::FilterMueller;
use crate::path::{ConnectionArcs, TransportMode, Vertex, surface_at};
use crate::scene::{MediumId, Scene};
use crate::shape::Intersection;
use eikonal::connect::Event;
use eikonal::interface::Rule;
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;

/// Parts of a connection that change the frame or the polarisation of light.
#[derive(Clone, Debug)]
pub(crate) struct ConnectionStokes {
    /// Parts of the connection; none along straight lines without filters.
    parts: SmallVec<[ConnectionPart; 1]>,
    /// True if light travels against the arcs, from the last part to the first one.
    is_reversed: bool,
    /// Unit direction in which the light arrives.
    arrival: DVec3,
}

/// Part of a connection within one medium.
#[derive(Clone, Debug)]
struct ConnectionPart {
    medium: MediumId,
    arc: Arc,
    /// End of the part on its arc.
    theta_end: f64,
    /// Filters along the part.
    filters: SmallVec<[(usize, Intersection); 2]>,
    /// Interface at the end of the part, if light is refracted or reflected there.
    interface: Option<Event>,
}

impl ConnectionPart {
    fn new(
        scene: &Scene,
        has_filters: bool,
        medium: MediumId,
        (arc, theta_end): (&Arc, f64),
        interface: Option<Event>,
    ) -> Self {
        let filters = if has_filters {
            // Planted error "connections that pass filters unpolarised", found by morgana-transport/transport::polarization::filters::connections_pass_filters:
            // scene.filters_along(arc, 0.0 * theta_end)
            scene.filters_along(arc, theta_end)
        } else {
            SmallVec::new()
        };
        ConnectionPart {
            medium,
            arc: *arc,
            theta_end,
            filters,
            interface,
        }
    }

    /// Returns true if unpolarised light stays unpolarised.
    fn does_nothing(&self) -> bool {
        self.filters.is_empty() && self.interface.is_none()
    }

    /// Follows light along the part, and through the interface at its end.
    fn follow(&self, scene: &Scene, light: &mut StokesInFrame) {
        let mut from = 0.0;
        for (object, intersection) in &self.filters {
            light.carry(&self.arc, from, intersection.theta);
            from = intersection.theta;
            let k = self.arc.velocity(from).normalize();
            let filter = filter(scene, *object, intersection, self.medium, k);
            filter.inspect(|f| light.pass(f, k));
        }
        light.carry(&self.arc, from, self.theta_end);
        if let Some(event) = &self.interface {
            light.meet(event, [event.before, event.after]);
        }
    }

    /// Follows light against the part's direction, after the interface at its end.
    fn follow_back(&self, scene: &Scene, light: &mut StokesInFrame) {
        if let Some(event) = &self.interface {
            light.meet(event, [-event.after, -event.before]);
        }
        let mut from = self.theta_end;
        for (object, intersection) in self.filters.iter().rev() {
            light.carry(&self.arc, from, intersection.theta);
            from = intersection.theta;
            let k = -self.arc.velocity(from).normalize();
            let filter = filter(scene, *object, intersection, self.medium, k);
            filter.inspect(|f| light.pass(f, k));
        }
        light.carry(&self.arc, from, 0.0);
    }
}

impl ConnectionStokes {
    /// Creates the parts of a connection from a vertex of a subpath.
    pub(super) fn new(
        scene: &Scene,
        has_filters: bool,
        mode: TransportMode,
        vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> Self {
        let Some([start, end]) = arcs.ends() else {
            return ConnectionStokes {
                parts: SmallVec::new(),
                is_reversed: false,
                arrival: DVec3::Z,
            };
        };
        let x = vertex.position();
        let starts_here = x.distance_squared(start.0) <= x.distance_squared(end.0);
        // Light arrives at the vertex of a sensor subpath, and leaves the vertex of a light
        // subpath.
        // Planted error "connections followed by polarised light in the order of their arcs", found by morgana-transport/transport::polarization::estimators::spheres_in_graded_glass_polarise_alike_from_both_ends:
        // let is_reversed = starts_here == matches!(mode, TransportMode::Radiance | TransportMode::Importance);
        let is_reversed = starts_here == (mode == TransportMode::Radiance);
        let mut parts = SmallVec::new();
        let mut add = |medium, arc, interface| {
            parts.push(ConnectionPart::new(
                scene,
                has_filters,
                medium,
                arc,
                interface,
            ));
        };
        match arcs {
            // Straight lines do not turn frames.
            ConnectionArcs::Line(lines) => {
                for line in lines.iter().filter(|_| has_filters) {
                    add(line.medium, (&line.arc, line.theta_end), None);
                }
            }
            ConnectionArcs::Ray(pieces) => {
                for piece in pieces {
                    let interface = piece.event.filter(|event| event.rule != Rule::Pass);
                    add(piece.region, (&piece.arc, piece.theta_end), interface);
                }
            }
        }
        let arrival = if is_reversed { -start.1 } else { end.1 };
        ConnectionStokes {
            parts,
            is_reversed,
            arrival: arrival.normalize(),
        }
    }

    /// Returns the unit direction in which the light arrives.
    pub(super) fn arrival(&self) -> DVec3 {
        self.arrival
    }

    /// Follows light along the connection.
    pub(super) fn follow(&self, scene: &Scene, light: &mut StokesInFrame) {
        if self.is_reversed {
            let parts = self.parts.iter().rev();
            parts.for_each(|part| part.follow_back(scene, light));
        } else {
            let parts = self.parts.iter();
            parts.for_each(|part| part.follow(scene, light));
        }
    }

    /// Returns the light at the end, for unpolarised light at the start; `None` if it is still
    /// unpolarised.
    pub(super) fn of_unpolarized(&self, scene: &Scene) -> Option<StokesInFrame> {
        if self.parts.iter().all(ConnectionPart::does_nothing) {
            return None;
        }
        let start = if self.is_reversed {
            let last = self.parts.last()?;
            last.arc.velocity(last.theta_end)
        } else {
            self.parts.first()?.arc.velocity(0.0)
        };
        let mut light = StokesInFrame::unpolarized(start, 1);
        self.follow(scene, &mut light);
        Some(light)
    }
}

/// Returns the matrix of a filter or a pane for light in the unit direction `k`; `None` if the
/// object is neither.
pub(super) fn filter(
    scene: &Scene,
    object: usize,
    intersection: &Intersection,
    medium: MediumId,
    k: DVec3,
) -> Option<FilterMueller> {
    let bsdf = &scene.objects()[object].bsdf;
    if !bsdf.changes_what_passes() {
        return None;
    }
    let surface = surface_at(scene, object, &scene.hit(object, intersection), medium);
    bsdf.passing_mueller(&surface, k)
}
