//! Frames of Stokes vectors.
//!
//! Theory: docs/theory.md#stokes-vectors.

use crate::mueller::Rotation;
use eikonal::ray::Arc;
use glam::DVec3;

/// The first axis of a frame at a point of a path: a unit vector across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis(pub DVec3);

impl Axis {
    /// Along a vector as far as that is across a unit direction; any axis if nothing is left.
    pub(super) fn across(direction: DVec3, along: DVec3) -> Self {
        let across = along.reject_from_normalized(direction).try_normalize();
        Axis(across.unwrap_or_else(|| direction.any_orthonormal_vector()))
    }

    /// Perpendicular to the plane of two unit directions; any axis across the first if they are parallel.
    pub(super) fn of_plane(from: DVec3, to: DVec3) -> Self {
        let across = from.cross(to).try_normalize();
        Axis(across.unwrap_or_else(|| from.any_orthonormal_vector()))
    }

    /// The rotation from the frame of this axis to that of another, both of light in the direction `k`.
    pub(super) fn to(self, other: Axis, k: DVec3) -> Rotation {
        Rotation::to_axis(self.0.dot(other.0), k.cross(self.0).dot(other.0))
    }

    /// Carried along an arc from one θ to another.
    pub(super) fn carried(self, arc: &Arc, from: f64, to: f64) -> Axis {
        Axis(arc.carried(self.0, from, to))
    }
}
