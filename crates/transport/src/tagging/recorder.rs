//! Follows the modulation of a path from the sensor as it is sampled (docs/theory.md#tagged-light).

use super::path::{SoundInMedia, TaggedPath};
use crate::derivative::FactorRecorder;
use crate::emitter::EmittedRay;
use crate::path::{ConnectionArcs, Edge, End, Vertex};
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// The amplitude of the optical length of each contribution of a path.
#[derive(Debug)]
pub(crate) struct TaggedRecorder {
    sound: SoundInMedia,
    /// Up to where the path has come.
    trunk: TaggedPath,
    /// Of the next contribution alone: up to a point of the last edge.
    aside: Option<TaggedPath>,
    /// And with its connection.
    connected: Option<TaggedPath>,
    found: Vec<DVec2>,
}

impl TaggedRecorder {
    pub(crate) fn new(scene: &Scene) -> Self {
        TaggedRecorder {
            sound: SoundInMedia::of(scene),
            trunk: TaggedPath::default(),
            aside: None,
            connected: None,
            found: Vec::new(),
        }
    }

    /// Begins a path.
    pub(crate) fn begin(&mut self) {
        self.trunk = TaggedPath::default();
        (self.aside, self.connected) = (None, None);
        self.found.clear();
    }

    /// The amplitudes of all contributions, in order.
    pub(crate) fn found(&self) -> &[DVec2] {
        &self.found
    }
}

impl FactorRecorder for TaggedRecorder {
    /// By the index along the connection.
    type Way = DVec2;
    const RECORDS: bool = true;

    fn way(&self, _vertex: &Vertex, arcs: ConnectionArcs) -> DVec2 {
        let mut sum = DVec2::ZERO;
        arcs.each(|medium, arc, theta| {
            sum += self.trunk.along(&self.sound, medium, arc, theta);
        });
        sum
    }

    fn follow(&mut self, edge: &Edge) {
        let length = match &edge.end {
            End::Collision(point) => point.length,
            _ => f64::INFINITY,
        };
        along(&self.sound, edge, length, &mut self.trunk);
    }

    fn turn(&mut self, vertex: &Vertex, direction: DVec3) {
        at_vertex(&self.sound, vertex, direction, &mut self.trunk);
    }

    fn aside_follow(&mut self, edge: &Edge, length: f64) {
        let mut aside = self.trunk;
        along(&self.sound, edge, length, &mut aside);
        self.aside = Some(aside);
    }

    fn aside_connect(&mut self, vertex: &Vertex, direction: DVec3, way: &DVec2) {
        let mut all = self.aside.take().unwrap_or(self.trunk);
        at_vertex(&self.sound, vertex, direction, &mut all);
        all.connect(*way);
        self.connected = Some(all);
    }

    fn aside_reach(&mut self, edge: &Edge, length: f64) {
        let mut aside = self.trunk;
        along(&self.sound, edge, length, &mut aside);
        self.connected = Some(aside);
    }

    fn contribute(&mut self, _ray: &EmittedRay) {
        let path = self.connected.take().unwrap_or(self.trunk);
        self.found.push(path.modulation().total());
    }
}

/// On along an edge as far as a length from its start.
fn along(sound: &SoundInMedia, edge: &Edge, length: f64, path: &mut TaggedPath) {
    for span in &edge.spans {
        let ends = span.length_after() >= length;
        let theta = if ends {
            span.theta_at_length(length - span.length_before)
        } else {
            span.theta_end
        };
        path.fly(sound, span.medium, &span.arc, theta);
        if ends {
            return;
        }
    }
}

/// On from a vertex in a direction: surfaces rest.
fn at_vertex(sound: &SoundInMedia, vertex: &Vertex, direction: DVec3, path: &mut TaggedPath) {
    if let Vertex::Volume { .. } = vertex {
        path.scatter(sound, direction);
    }
}
