//! Frames of Stokes vectors.
//!
//! Theory: docs/theory.md#stokes-vectors.

use crate::mueller::Rotation;
use eikonal::ray::Arc;
use glam::DVec3;

/// First axis of a frame at a point of a path: a unit vector perpendicular to the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis(pub DVec3);

impl Axis {
    /// Projects a vector perpendicular to a unit direction. Returns any perpendicular axis if the
    /// projection is zero.
    pub(super) fn across(direction: DVec3, along: DVec3) -> Self {
        let across = along.reject_from_normalized(direction).try_normalize();
        Axis(across.unwrap_or_else(|| direction.any_orthonormal_vector()))
    }

    /// Returns the axis perpendicular to the plane of two unit directions. If they are parallel,
    /// returns any axis perpendicular to the first.
    pub(super) fn of_plane(from: DVec3, to: DVec3) -> Self {
        let across = from.cross(to).try_normalize();
        Axis(across.unwrap_or_else(|| from.any_orthonormal_vector()))
    }

    /// Returns the rotation from this axis's frame to another axis's frame, both for light in the
    /// direction `k`.
    pub(super) fn to(self, other: Axis, k: DVec3) -> Rotation {
        Rotation::to_axis(self.0.dot(other.0), k.cross(self.0).dot(other.0))
    }

    /// Transports the axis along an arc from one θ to another.
    pub(super) fn carried(self, arc: &Arc, from: f64, to: f64) -> Axis {
        Axis(arc.carried(self.0, from, to))
    }
}
