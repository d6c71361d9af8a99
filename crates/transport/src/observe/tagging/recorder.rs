//! Takes note of a path from the sensor as it is sampled, so that the modulation of what it brings can be found later, where that is asked for
//! (docs/theory.md#tagged-light).

use super::path::{SoundInMedia, TaggedPath};
use super::sound_along::SoundAlong;
use super::steps::Step;
use crate::derivative::FactorRecorder;
use crate::emitter::EmittedRay;
use crate::path::{ConnectionArcs, Edge, RayPart, Vertex};
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// The ways of the contributions of a path.
#[derive(Debug)]
pub(crate) struct TaggedRecorder {
    sound: SoundInMedia,
    /// Along which the steps go.
    parts: Vec<RayPart>,
    /// From the sensor on.
    trunk: Vec<Step>,
    /// Of contributions alone, one after the other.
    aside: Vec<Step>,
    /// Where the ways of contributions end, in order.
    ends: Vec<WayEnds>,
    /// Of a way, one after the other.
    way: Vec<Step>,
    along: SoundAlong,
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
            parts: Vec::new(),
            trunk: Vec::new(),
            aside: Vec::new(),
            ends: Vec::new(),
            way: Vec::new(),
            along: SoundAlong::default(),
        }
    }

    /// Begins a path.
    pub(crate) fn begin(&mut self) {
        self.parts.clear();
        self.trunk.clear();
        self.aside.clear();
        self.ends.clear();
    }

    /// The amplitudes of the optical lengths of contributions, which are given in the order in which they were made.
    pub(crate) fn modulations(
        &mut self,
        contributions: impl Iterator<Item = usize>,
    ) -> impl Iterator<Item = DVec2> {
        let (mut trunk, mut known) = (TaggedPath::default(), 0);
        let mut contributions = contributions.peekable();
        std::iter::from_fn(move || {
            let i = contributions.next()?;
            let end = self.ends[i];
            let (sound, parts, along) = (&self.sound, &self.parts, &mut self.along);
            let on = &self.trunk[known..end.trunk];
            let before = i.checked_sub(1).map_or(0, |before| self.ends[before].aside);
            let aside = &self.aside[before..end.aside];
            known = end.trunk;
            if contributions.peek().is_none() {
                // Nothing leaves the trunk beyond: the rest is followed at once.
                self.way.clear();
                self.way.extend(on.iter().chain(aside));
                trunk.go(sound, parts, &self.way, along);
                return Some(trunk.modulation().total());
            }
            trunk.go(sound, parts, on, along);
            let mut way = trunk;
            way.go(sound, parts, aside, along);
            Some(way.modulation().total())
        })
    }
}

impl FactorRecorder for TaggedRecorder {
    /// Numbers of parts.
    type Way = Range<usize>;
    const NEEDS_SPANS: bool = false;
    const NEEDS_PARTS: bool = true;

    fn way(&mut self, _vertex: &Vertex, arcs: ConnectionArcs) -> Self::Way {
        let first = self.parts.len();
        arcs.each(|medium, arc, theta_end| {
            if self.sound.is_in(medium) {
                let arc = *arc;
                self.parts.push(RayPart {
                    arc,
                    theta_end,
                    medium,
                });
            }
        });
        first..self.parts.len()
    }

    fn follow(&mut self, _edge: &Edge, parts: &[RayPart]) {
        let first = self.parts.len();
        let audible = parts.iter().filter(|part| self.sound.is_in(part.medium));
        self.parts.extend(audible);
        self.trunk.extend((first..self.parts.len()).map(Step::Fly));
    }

    fn turn(&mut self, vertex: &Vertex, direction: DVec3, _specular: bool) {
        self.trunk.extend(at_vertex(&self.sound, vertex, direction));
    }

    fn aside_follow(&mut self, edge: &Edge, length: f64) {
        self.aside
            .extend(along(&self.sound, edge, length, &mut self.parts));
    }

    fn aside_connect(&mut self, vertex: &Vertex, direction: DVec3, way: &Self::Way) {
        self.aside.extend(at_vertex(&self.sound, vertex, direction));
        self.aside.extend(way.clone().map(Step::Connect));
    }

    fn aside_reach(&mut self, edge: &Edge, length: f64) {
        self.aside_follow(edge, length);
    }

    fn contribute(&mut self, _ray: &EmittedRay) {
        self.ends.push(WayEnds {
            trunk: self.trunk.len(),
            aside: self.aside.len(),
        });
    }
}

/// On along an edge as far as a length from its start, where there is sound.
fn along(
    sound: &SoundInMedia,
    edge: &Edge,
    length: f64,
    parts: &mut Vec<RayPart>,
) -> impl Iterator<Item = Step> {
    let first = parts.len();
    let flown = edge
        .spans
        .iter()
        .take_while(|span| span.length_before < length);
    let audible = flown.filter(|span| sound.is_in(span.medium));
    parts.extend(audible.map(|span| RayPart {
        medium: span.medium,
        arc: span.arc,
        theta_end: if span.length_after() < length {
            span.theta_end
        } else {
            span.theta_at_length(length - span.length_before)
        },
    }));
    (first..parts.len()).map(Step::Fly)
}

/// On from a vertex in a direction, if sound moves it: surfaces rest.
fn at_vertex(sound: &SoundInMedia, vertex: &Vertex, direction: DVec3) -> Option<Step> {
    match vertex {
        Vertex::Volume { medium, .. } if sound.is_in(*medium) => Some(Step::Scatter(direction)),
        _ => None,
    }
}
