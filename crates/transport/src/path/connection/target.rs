//! Targets of connections.

use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::Emitter;
use crate::path::segment::{TransportMode, Vertex};
use crate::scene::{MediumId, Scene};
use eikonal::connect::Guide;
use glam::DVec3;

/// Target of a connection from a vertex.
#[derive(Clone, Copy, Debug)]
pub struct ConnectionTarget<'a> {
    /// End of the connection.
    pub end: ConnectionEnd,
    /// True if the connection may arrive on either side of the end's surface, false if only on the
    /// side of the end's normal.
    pub two_sided: bool,
    /// Medium at the end, if the end is a point.
    pub medium: Option<MediumId>,
    /// Centre and radius of the disc through which light can come, if the end is a plane.
    pub disc: (DVec3, f64),
    /// Ray along the centre of a beam.
    pub guide: Option<&'a Guide<MediumId>>,
    /// Quantity that the subpath of the vertex carries. The end is at the opposite end of the path.
    pub mode: TransportMode,
}

impl<'a> ConnectionTarget<'a> {
    /// Makes a target at an emitter.
    pub fn emitter(scene: &'a Scene, emitter: usize, end: ConnectionEnd) -> Self {
        let around = scene.around();
        let disc = match &scene.emitters()[emitter] {
            // The disc is wide enough for all noticeable power of the beam.
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

    /// Makes a target at the sensor.
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

    /// Returns the normal of the side on which light must leave the end's surface, for a ray that
    /// arrives in `direction`.
    pub(super) fn facing(&self, on: &OnSurface, direction: DVec3) -> DVec3 {
        if self.two_sided && on.normal.dot(direction) > 0.0 {
            -on.normal
        } else {
            on.normal
        }
    }

    /// Makes a target at a vertex of an emitter's subpath.
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

/// Returns the end that a connection to an environment has for the direction `toward`.
pub(crate) fn environment_end(scene: &Scene, toward: DVec3) -> ConnectionEnd {
    let around = scene.around();
    ConnectionEnd::Plane {
        through: around.center + toward * (2.0 * around.radius),
        direction: -toward,
        beam: false,
    }
}
