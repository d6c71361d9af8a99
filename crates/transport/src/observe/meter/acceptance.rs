//! Light that a meter on a surface accepts. Fibres and other detectors accept light from a part of
//! the surface, within a cone (docs/theory.md#records).

use super::flight::Passing;
use glam::DVec3;

/// Criteria for light that passes a surface; the default accepts all light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Acceptance {
    /// Accepted points of the surface.
    pub patch: Option<Patch>,
    /// Numerical aperture, positive: the largest accepted n sin θ. θ is the angle between the light
    /// and the surface's normal, n the index, both on the side to which the light travels.
    pub numerical_aperture: Option<f64>,
}

/// Points of a surface within a distance of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Centre.
    pub center: DVec3,
    /// Radius, positive.
    pub radius: f64,
}

impl Acceptance {
    /// Returns true if light from the whole surface is accepted.
    pub(super) fn is_everywhere(&self) -> bool {
        self.patch.is_none()
    }

    /// Returns true if light is accepted.
    pub(super) fn accepts(&self, passing: &Passing) -> bool {
        self.patch
            .is_none_or(|patch| patch.holds(passing.hit.position))
            && self.numerical_aperture.is_none_or(|na| {
                let n2 = passing
                    .scene
                    .medium(passing.medium)
                    .index
                    .n2(passing.hit.position);
                let cosine = passing.hit.normal.dot(passing.direction);
                n2 * (1.0 - cosine * cosine) <= na * na
            })
    }
}

impl Patch {
    fn holds(&self, x: DVec3) -> bool {
        (x - self.center).length() <= self.radius
    }
}
