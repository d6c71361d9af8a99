//! What vertices are connected to.

use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::Emitter;
use crate::path::segment::{TransportMode, Vertex};
use crate::scene::{MediumId, Scene};
use eikonal::connect::Guide;
use glam::DVec3;

/// What a vertex is to be connected to.
#[derive(Clone, Copy, Debug)]
pub struct ConnectionTarget<'a> {
    /// Where the connection should end.
    pub end: ConnectionEnd,
    /// Whether the connection may arrive on either side of the end's surface, rather than on that of
    /// the end's normal only.
    pub two_sided: bool,
    /// Medium at the end, if it is a point.
    pub medium: Option<MediumId>,
    /// Centre and radius of the part of a plane from which light may come.
    pub disc: (DVec3, f64),
    /// Where a beam goes.
    pub guide: Option<&'a Guide<MediumId>>,
    /// What the vertex's own subpath carries: the end is then at the other end of the path.
    pub mode: TransportMode,
}

impl<'a> ConnectionTarget<'a> {
    /// An end at an emitter.
    pub fn emitter(scene: &'a Scene, emitter: usize, end: ConnectionEnd) -> Self {
        let around = scene.around();
        let disc = match &scene.emitters()[emitter] {
            // Where nothing to speak of is left of a beam.
            Emitter::Collimated(beam) => (beam.origin(), beam.aperture().reach()),
            _ => (around.center, around.radius),
        };
        ConnectionTarget {
            end,
            two_sided: false,
            medium: scene.medium_of_end(&end),
            disc,
            guide: scene.guide(emitter),
            mode: TransportMode::Radiance,
        }
    }

    /// An end at the sensor.
    pub fn sensor(scene: &'a Scene, end: ConnectionEnd) -> Self {
        let around = scene.around();
        ConnectionTarget {
            end,
            two_sided: false,
            medium: scene.medium_of_end(&end),
            disc: (around.center, around.radius),
            guide: None,
            mode: TransportMode::Importance,
        }
    }

    /// The side of the end's surface that light must leave it on, for a ray that arrives in `direction`.
    pub(super) fn facing(&self, on: &OnSurface, direction: DVec3) -> DVec3 {
        if self.two_sided && on.normal.dot(direction) > 0.0 {
            -on.normal
        } else {
            on.normal
        }
    }

    /// A vertex of an emitter's subpath.
    pub fn vertex(vertex: &Vertex) -> Self {
        ConnectionTarget {
            end: vertex.as_end(),
            two_sided: true,
            medium: Some(vertex.medium()),
            disc: (DVec3::ZERO, 0.0),
            guide: None,
            mode: TransportMode::Radiance,
        }
    }
}

/// The end with which a connection to an environment would look in the direction `toward`.
pub(crate) fn environment_end(scene: &Scene, toward: DVec3) -> ConnectionEnd {
    let around = scene.around();
    ConnectionEnd::Plane {
        through: around.center + toward * (2.0 * around.radius),
        direction: -toward,
        beam: false,
    }
}
