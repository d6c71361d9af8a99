//! Arcs along a connection.

use crate::path::workspace::RayPart;
use crate::scene::MediumId;
use eikonal::connect::Piece;
use eikonal::ray::Arc;
use glam::DVec3;

/// Arcs of a connection, in the order in which its ray was followed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ConnectionArcs<'a> {
    /// Arcs along a straight line.
    Line(&'a [RayPart]),
    /// Arcs along a ray that the solver found.
    Ray(&'a [Piece<MediumId>]),
}

impl<'a> ConnectionArcs<'a> {
    /// Calls `see` with the medium of each arc, the arc, and the θ at which the arc ends.
    pub(crate) fn each(&self, mut see: impl FnMut(MediumId, &'a Arc, f64)) {
        match self {
            ConnectionArcs::Line(parts) => {
                parts
                    .iter()
                    .for_each(|p| see(p.medium, &p.arc, p.theta_end));
            }
            ConnectionArcs::Ray(pieces) => {
                pieces
                    .iter()
                    .for_each(|p| see(p.region, &p.arc, p.theta_end));
            }
        }
    }

    /// Returns position and velocity at the start and at the end; `None` without arcs.
    pub(crate) fn ends(&self) -> Option<[(DVec3, DVec3); 2]> {
        let [(first, _), (last, theta)] = match self {
            ConnectionArcs::Line(parts) => {
                [parts.first()?, parts.last()?].map(|p| (&p.arc, p.theta_end))
            }
            ConnectionArcs::Ray(pieces) => {
                [pieces.first()?, pieces.last()?].map(|p| (&p.arc, p.theta_end))
            }
        };
        Some([
            (first.start(), first.velocity(0.0)),
            (last.position(theta), last.velocity(theta)),
        ])
    }
}
