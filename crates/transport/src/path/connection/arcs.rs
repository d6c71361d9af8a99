//! The way of a connection, arc by arc.

use crate::path::workspace::RayPart;
use crate::scene::MediumId;
use eikonal::connect::Piece;
use eikonal::ray::Arc;

/// The arcs of a connection, in the order in which its ray was followed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ConnectionArcs<'a> {
    /// Along a straight line.
    Line(&'a [RayPart]),
    /// Along a ray that the solver has found.
    Ray(&'a [Piece<MediumId>]),
}

impl<'a> ConnectionArcs<'a> {
    /// Calls `see` with the medium of each arc, the arc, and the θ where it ends.
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
}
