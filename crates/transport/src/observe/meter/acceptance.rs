//! Which of the light at a surface a meter accepts: fibres and other detectors see a part of the surface, and a cone
//! (docs/theory.md#records).

use super::flight::Passing;
use glam::DVec3;

/// What is accepted of the light that passes; by default all of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Acceptance {
    /// Light within a distance of a point.
    pub patch: Option<Patch>,
    /// Light with n sin θ up to this, positive, where θ is its angle with the surface's normal and n the index, both where it goes.
    pub numerical_aperture: Option<f64>,
}

/// The points of a surface within a distance of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The point.
    pub center: DVec3,
    /// The distance, positive.
    pub radius: f64,
}

impl Acceptance {
    /// Whether it takes light from the whole surface.
    pub(super) fn is_everywhere(&self) -> bool {
        self.patch.is_none()
    }

    /// Whether light is accepted.
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
