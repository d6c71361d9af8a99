//! Flat parts of local coordinate planes: rectangles, disks, cube faces and caps.

use super::curve::{Surface, Track};
use super::placement::Placement;
use super::{AreaSample, Hit, Intersection, Uv};
use glam::DVec3;

/// Flat part of a shape, where coordinate `axis` has the value `at`. It faces to one side (1 or −1)
/// along the axis.
pub(super) struct Flat {
    pub axis: usize,
    pub at: f64,
    pub side: f64,
    pub primitive: u32,
}

impl Flat {
    /// Returns the first u up to `until` where a track crosses the part of the plane that `inside`
    /// accepts.
    #[inline]
    pub(super) fn first(
        &self,
        track: &impl Track,
        until: f64,
        inside: impl Fn(DVec3) -> bool,
    ) -> Option<f64> {
        track.first(Surface::Plane(self.axis, self.at), until, inside)
    }

    /// Returns the intersection with the track at `u`, projected onto the plane.
    #[inline]
    pub(crate) fn intersection(&self, track: &impl Track, u: f64) -> Intersection {
        Intersection {
            theta: track.theta(u),
            local: self.project(track.position(u)),
            primitive: self.primitive,
        }
    }

    /// Projects the local point onto the plane.
    pub(super) fn project(&self, mut local: DVec3) -> DVec3 {
        local[self.axis] = self.at;
        local
    }

    /// Returns the hit at a local point of the part.
    pub(super) fn hit(&self, placement: &Placement, theta: f64, local: DVec3, uv: Uv) -> Hit {
        Hit {
            theta,
            position: placement.point(local),
            normal: self.scene_normal(placement),
            uv,
            primitive: self.primitive,
        }
    }

    fn scene_normal(&self, placement: &Placement) -> DVec3 {
        placement.axis_normal(self.axis) * self.side
    }

    /// Returns the sample at a local point of the part.
    pub(super) fn sample(
        &self,
        placement: &Placement,
        local: DVec3,
        uv: Uv,
        pdf: f64,
    ) -> AreaSample {
        AreaSample {
            position: placement.point(local),
            normal: self.scene_normal(placement),
            uv,
            primitive: self.primitive,
            pdf,
        }
    }
}
