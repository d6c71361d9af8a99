//! Takes note of a path from the sensor as it is sampled, so that the modulation of what it brings can be found later, where that is asked for
//! (docs/theory.md#tagged-light).

use super::path::{SoundInMedia, TaggedPath};
use super::steps::{Leg, Step};
use crate::derivative::FactorRecorder;
use crate::emitter::EmittedRay;
use crate::path::{ConnectionArcs, Edge, End, Vertex};
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// The ways of the contributions of a path.
#[derive(Debug)]
pub(crate) struct TaggedRecorder {
    sound: SoundInMedia,
    /// From the sensor on.
    trunk: Vec<Step>,
    /// Of contributions alone, one after the other.
    aside: Vec<Step>,
    /// Where the ways of contributions end, in order.
    ends: Vec<WayEnds>,
}

/// The steps of the trunk and aside that a contribution's way is made of: those aside follow those of the contribution before.
#[derive(Clone, Copy, Debug, Default)]
struct WayEnds {
    trunk: usize,
    aside: usize,
}

impl TaggedRecorder {
    pub(crate) fn new(scene: &Scene) -> Self {
        TaggedRecorder {
            sound: SoundInMedia::of(scene),
            trunk: Vec::new(),
            aside: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// Begins a path.
    pub(crate) fn begin(&mut self) {
        self.trunk.clear();
        self.aside.clear();
        self.ends.clear();
    }

    /// The amplitudes of the optical lengths of contributions, which are given in the order in which they were made.
    pub(crate) fn modulations(
        &self,
        contributions: impl Iterator<Item = usize>,
    ) -> impl Iterator<Item = DVec2> {
        let (mut trunk, mut known) = (TaggedPath::default(), 0);
        contributions.map(move |i| {
            let end = self.ends[i];
            trunk.go(&self.sound, &self.trunk[known..end.trunk]);
            known = end.trunk;
            let before = i.checked_sub(1).map_or(0, |before| self.ends[before].aside);
            let mut way = trunk;
            way.go(&self.sound, &self.aside[before..end.aside]);
            way.modulation().total()
        })
    }
}

impl FactorRecorder for TaggedRecorder {
    type Way = SmallVec<[Leg; 1]>;
    const RECORDS: bool = true;

    fn way(&self, _vertex: &Vertex, arcs: ConnectionArcs) -> Self::Way {
        let mut legs = SmallVec::new();
        arcs.each(|medium, arc, theta| {
            let arc = *arc;
            legs.push(Leg { medium, arc, theta });
        });
        legs
    }

    fn follow(&mut self, edge: &Edge) {
        let length = match &edge.end {
            End::Collision(point) => point.length,
            _ => f64::INFINITY,
        };
        along(edge, length, &mut self.trunk);
    }

    fn turn(&mut self, vertex: &Vertex, direction: DVec3, _specular: bool) {
        at_vertex(vertex, direction, &mut self.trunk);
    }

    fn aside_follow(&mut self, edge: &Edge, length: f64) {
        along(edge, length, &mut self.aside);
    }

    fn aside_connect(&mut self, vertex: &Vertex, direction: DVec3, way: &Self::Way) {
        at_vertex(vertex, direction, &mut self.aside);
        self.aside.extend(way.iter().copied().map(Step::Connect));
    }

    fn aside_reach(&mut self, edge: &Edge, length: f64) {
        along(edge, length, &mut self.aside);
    }

    fn contribute(&mut self, _ray: &EmittedRay) {
        self.ends.push(WayEnds {
            trunk: self.trunk.len(),
            aside: self.aside.len(),
        });
    }
}

/// On along an edge as far as a length from its start.
fn along(edge: &Edge, length: f64, to: &mut Vec<Step>) {
    for span in &edge.spans {
        let ends = span.length_after() >= length;
        let theta = if ends {
            span.theta_at_length(length - span.length_before)
        } else {
            span.theta_end
        };
        to.push(Step::Fly(Leg {
            medium: span.medium,
            arc: span.arc,
            theta,
        }));
        if ends {
            return;
        }
    }
}

/// On from a vertex in a direction: surfaces rest.
fn at_vertex(vertex: &Vertex, direction: DVec3, to: &mut Vec<Step>) {
    if let Vertex::Volume { .. } = vertex {
        to.push(Step::Scatter(direction));
    }
}
