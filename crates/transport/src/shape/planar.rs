//! What rectangles, disks, cube faces and caps share: flat parts of local coordinate planes.

use super::curve::Curve;
use super::placement::Placement;
use super::{AreaSample, Hit};
use glam::DVec3;

/// A flat part of a shape: where coordinate `axis` has the value `at`, facing `normal`.
pub(super) struct Flat {
    pub axis: usize,
    pub at: f64,
    pub normal: DVec3,
    pub primitive: u32,
}

impl Flat {
    /// The first u in (0, until] where the curve crosses the part of the plane that `inside` accepts.
    pub fn first(&self, curve: &Curve, until: f64, inside: impl Fn(DVec3) -> bool) -> Option<f64> {
        let plane = curve.plane(self.axis, self.at);
        curve.first(&plane, until, inside)
    }

    /// The local point, put onto the plane.
    pub fn project(&self, mut local: DVec3) -> DVec3 {
        local[self.axis] = self.at;
        local
    }

    /// The hit at a local point of the part.
    pub fn hit(&self, placement: &Placement, theta: f64, local: DVec3, uv: [f64; 2]) -> Hit {
        Hit {
            theta,
            position: placement.point(local),
            normal: placement.normal(self.normal),
            uv,
            primitive: self.primitive,
        }
    }

    /// The sample at a local point of the part.
    pub fn sample(
        &self,
        placement: &Placement,
        local: DVec3,
        uv: [f64; 2],
        pdf: f64,
    ) -> AreaSample {
        AreaSample {
            position: placement.point(local),
            normal: placement.normal(self.normal),
            uv,
            primitive: self.primitive,
            pdf,
        }
    }
}
