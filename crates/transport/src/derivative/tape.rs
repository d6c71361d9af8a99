//! The factors of one path, in order.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use super::FactorRecorder;
use crate::path::{ConnectionArcs, Edge, End, Vertex};
use crate::scene::MediumId;
use crate::shape::Site;
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;

/// A factor of what a path brings.
#[derive(Clone, Debug)]
pub(super) enum Factor {
    /// e^−∫σ_t ds along a part of a way.
    Attenuation(Stretch),
    /// σ_s at a collision.
    Scattering { medium: MediumId, x: DVec3 },
    /// A phase function, at the cosine of the angle of scattering.
    Phase { medium: MediumId, cos: f64 },
    /// The scattering of an object's surface.
    Surface { object: usize, site: Site },
}

/// A part of a way within one medium: an arc up to θ.
#[derive(Clone, Debug)]
pub(crate) struct Stretch {
    pub medium: MediumId,
    pub arc: Arc,
    pub theta: f64,
}

/// A contribution of a path.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    /// Number of factors of the path up to where it was made.
    pub trunk: usize,
    /// Number of factors put aside for this and all contributions before it.
    pub aside: usize,
    /// The emitter whose light it is.
    pub emitter: usize,
}

/// The factors of one path, in order, and where it has made contributions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    /// Of the path itself.
    pub(super) trunk: Vec<Factor>,
    /// Of single contributions, one after the other.
    pub(super) aside: Vec<Factor>,
    pub(super) kept: Vec<Kept>,
}

impl Tape {
    /// The path flies along an arc up to θ.
    pub(crate) fn fly(&mut self, medium: MediumId, arc: &Arc, theta: f64) {
        let arc = *arc;
        self.trunk
            .push(Factor::Attenuation(Stretch { medium, arc, theta }));
    }

    /// Puts the part of a way along an arc up to θ aside.
    pub(crate) fn aside_fly(&mut self, medium: MediumId, arc: &Arc, theta: f64) {
        let arc = *arc;
        self.aside
            .push(Factor::Attenuation(Stretch { medium, arc, theta }));
    }

    /// The path is scattered at a place.
    pub(crate) fn collide(&mut self, medium: MediumId, x: DVec3) {
        self.trunk.push(Factor::Scattering { medium, x });
    }

    /// Forgets the path.
    pub(crate) fn clear(&mut self) {
        self.trunk.clear();
        self.aside.clear();
        self.kept.clear();
    }
}

impl FactorRecorder for Tape {
    type Way = SmallVec<[Stretch; 1]>;
    const RECORDS: bool = true;

    fn way(&self, _vertex: &Vertex, arcs: ConnectionArcs) -> Self::Way {
        let mut way = Self::Way::new();
        arcs.each(|medium, arc, theta| {
            way.push(Stretch {
                medium,
                arc: *arc,
                theta,
            });
        });
        way
    }

    fn follow(&mut self, edge: &Edge) {
        match &edge.end {
            End::Collision(point) => up_to(edge, point.length, &mut self.trunk),
            _ => self.trunk.extend(edge.spans.iter().map(|span| {
                Factor::Attenuation(Stretch {
                    medium: span.medium,
                    arc: span.arc,
                    theta: span.theta_end,
                })
            })),
        }
    }

    fn turn(&mut self, vertex: &Vertex, direction: DVec3) {
        self.trunk.push(turned(vertex, direction));
    }

    fn aside_follow(&mut self, edge: &Edge, length: f64) {
        up_to(edge, length, &mut self.aside);
    }

    fn aside_connect(&mut self, vertex: &Vertex, direction: DVec3, way: &Self::Way) {
        self.aside.push(turned(vertex, direction));
        self.aside
            .extend(way.iter().cloned().map(Factor::Attenuation));
    }

    fn contribute(&mut self, emitter: usize) {
        self.kept.push(Kept {
            trunk: self.trunk.len(),
            aside: self.aside.len(),
            emitter,
        });
    }
}

/// The factors of an edge up to a collision at an arc length.
fn up_to(edge: &Edge, length: f64, out: &mut Vec<Factor>) {
    let last = edge
        .spans
        .partition_point(|span| span.length_after() < length);
    let last = last.min(edge.spans.len().saturating_sub(1));
    for (i, span) in edge.spans.iter().enumerate().take(last + 1) {
        let theta = if i == last {
            span.theta_at_length(length - span.length_before)
        } else {
            span.theta_end
        };
        let (medium, arc) = (span.medium, span.arc);
        out.push(Factor::Attenuation(Stretch { medium, arc, theta }));
        if i == last {
            let x = arc.position(theta);
            out.push(Factor::Scattering { medium, x });
        }
    }
}

/// The factor of a vertex at which a path turns.
fn turned(vertex: &Vertex, direction: DVec3) -> Factor {
    match *vertex {
        Vertex::Volume {
            direction: arrival,
            medium,
            ..
        } => Factor::Phase {
            medium,
            cos: arrival.dot(direction),
        },
        Vertex::Surface {
            object, surface, ..
        } => Factor::Surface {
            object,
            site: surface.site,
        },
    }
}
