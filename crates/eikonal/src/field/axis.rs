//! Cylindrical coordinates around an axis, for fields that do not change along an axis.

use super::error::{FieldError, direction, finite_vector};
use super::outer;
use crate::bounds::Aabb;
use glam::{DMat3, DVec2, DVec3};

/// An axis in space with a transverse orthonormal basis (e₁, e₂). The vectors e₁, e₂ and the
/// direction of the axis are right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    origin: DVec3,
    e1: DVec3,
    e2: DVec3,
}

impl Axis {
    /// Creates an axis through `origin`, with any transverse basis.
    pub(super) fn new(origin: DVec3, along: DVec3) -> Result<Self, FieldError> {
        let (e1, e2) = direction("direction of the axis", along)?.any_orthonormal_pair();
        Ok(Axis {
            origin: finite_vector("origin of the axis", origin)?,
            e1,
            e2,
        })
    }

    /// Creates an axis through `origin` with e₁ along the transverse part of `reference`.
    pub(super) fn with_reference(
        origin: DVec3,
        along: DVec3,
        reference: DVec3,
    ) -> Result<Self, FieldError> {
        let axis = direction("direction of the axis", along)?;
        let unit = direction("reference direction", reference)?;
        let across = unit.reject_from_normalized(axis);
        // Reject smaller angles: rounding errors would determine φ = 0.
        if across.length() < 1e-9 {
            return Err(FieldError::ParallelReference {
                reference,
                axis: along,
            });
        }
        let e1 = across.normalize();
        Ok(Axis {
            origin: finite_vector("origin of the axis", origin)?,
            e1,
            e2: axis.cross(e1),
        })
    }

    /// Returns the origin, a point of the axis.
    pub(super) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the unit direction of the axis.
    pub(super) fn direction(&self) -> DVec3 {
        self.e1.cross(self.e2)
    }

    /// Returns e₁ and e₂.
    pub(super) fn basis(&self) -> [DVec3; 2] {
        [self.e1, self.e2]
    }

    /// Returns the transverse coordinates of `x`.
    pub(super) fn transverse(&self, x: DVec3) -> DVec2 {
        self.across(x - self.origin)
    }

    /// Returns the transverse part of a vector.
    pub(super) fn across(&self, v: DVec3) -> DVec2 {
        DVec2::new(self.e1.dot(v), self.e2.dot(v))
    }

    /// Returns the ranges of the two transverse coordinates over a box, as smallest and largest
    /// corner.
    pub(super) fn transverse_range(&self, region: &Aabb) -> [DVec2; 2] {
        let [u0, u1] = region.project(self.e1);
        let [v0, v1] = region.project(self.e2);
        let origin = DVec2::new(self.e1.dot(self.origin), self.e2.dot(self.origin));
        [DVec2::new(u0, v0) - origin, DVec2::new(u1, v1) - origin]
    }

    /// Returns the range of the distance to the axis over a box: exact for an axis along an edge of
    /// the box, conservative otherwise.
    pub(super) fn radius_range(&self, region: &Aabb) -> [f64; 2] {
        let [min, max] = self.transverse_range(region);
        let near = DVec2::ZERO.clamp(min, max).length();
        [near, min.abs().max(max.abs()).length()]
    }

    /// Returns a transverse vector as a vector in space.
    pub(super) fn vector(&self, g: DVec2) -> DVec3 {
        self.e1 * g.x + self.e2 * g.y
    }

    /// Returns the symmetric transverse matrix ((xx, xy), (xy, yy)) as a matrix in space.
    pub(super) fn matrix(&self, xx: f64, xy: f64, yy: f64) -> DMat3 {
        let (a, b) = (self.e1 * xx + self.e2 * xy, self.e1 * xy + self.e2 * yy);
        let [e1, e2] = [self.e1, self.e2];
        DMat3::from_cols(
            a * e1.x + b * e2.x,
            a * e1.y + b * e2.y,
            a * e1.z + b * e2.z,
        )
    }

    /// Returns the projection on the transverse plane.
    pub(super) fn projection(&self) -> DMat3 {
        outer(self.e1) + outer(self.e2)
    }
}
