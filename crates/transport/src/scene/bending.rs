//! What bends rays, and how far connections follow them.

use super::parts::{MediumId, Object, Parts};
use super::{BendingBall, Scene};
use crate::bsdf::Bsdf;
use crate::connection_end::ConnectionEnd;
use crate::emitter::Emitter;
use eikonal::connect::{Guide, InitialGuess, Pattern, RayFamily};
use glam::DVec3;

/// What bends rays in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bending {
    /// Nothing.
    None,
    /// The index of one medium only.
    One(MediumId),
    /// Smooth interfaces, or several media.
    Several,
}

impl Bending {
    pub(super) fn of(parts: &Parts) -> Self {
        let bends = |o: &Object| matches!(o.bsdf, Bsdf::Dielectric(_));
        let curved = |id: &MediumId| !parts.media[*id].index.is_constant();
        let mut curved = (0..parts.media.len()).filter(curved);
        match (curved.next(), curved.next()) {
            _ if parts.objects.iter().any(bends) => Bending::Several,
            (None, _) => Bending::None,
            (Some(id), None) => Bending::One(id),
            _ => Bending::Several,
        }
    }
}

/// Beams are followed, and branches looked for, over this many radii of the scene in optical path
/// length: enough for several bounces inside a tank.
pub(super) const REACH: f64 = 20.0;
/// Branches are looked for through this many total reflections. Inside a glass ball there is no end
/// of branches that run along its surface from one to the next; each is ever harder to find.
pub const TOTAL_REFLECTIONS: u32 = 3;

pub(super) fn guides(scene: &Scene) -> Vec<Option<Guide<MediumId>>> {
    let guide = |emitter: &Emitter| match emitter {
        Emitter::Collimated(beam) => {
            let start = InitialGuess {
                family: RayFamily::Plane {
                    x: beam.origin(),
                    direction: beam.direction(),
                },
                region: scene.medium_at(beam.origin()),
                optical_length: scene.reach.optical_length,
                pattern: Pattern::REFRACT,
            };
            Guide::new(scene, start, scene.tolerance()).ok()
        }
        _ => None,
    };
    scene.emitters().iter().map(guide).collect()
}

impl Scene {
    /// Whether it is known that no two rays connect two points, each given with its medium: all rays are
    /// straight, or both points are in the only medium that bends rays, which is convex, so that no ray that
    /// leaves it returns, and [certified](eikonal::Uniqueness).
    pub fn is_unique(&self, x: DVec3, medium: MediumId, y: DVec3, other: MediumId) -> bool {
        match self.bending {
            Bending::None => true,
            Bending::One(id) if id == medium && id == other => {
                let certificate = self.regions[id].uniqueness.as_ref();
                certificate
                    .is_some_and(|u| u.whole_medium() || u.pair(&self.medium(id).index, x, y))
            }
            _ => false,
        }
    }

    /// Whether it is known that no two rays connect two points that take no reflections where refraction is possible, because nothing
    /// but one ball bends rays, and the points lie in it.
    pub(crate) fn is_unique_in_ball(&self, ends: [DVec3; 2]) -> bool {
        let known = |ball: &BendingBall| ball.is_unique(ends, |x| self.n(ball.interior, x));
        self.bending_ball().is_some_and(known)
    }

    /// The medium at an end that is a point, if [`Scene::is_unique`] could make use of it.
    pub(crate) fn medium_of_end(&self, end: &ConnectionEnd) -> Option<MediumId> {
        match (self.bending, end) {
            (Bending::One(_), ConnectionEnd::Point { position, .. }) => {
                Some(self.medium_at(*position))
            }
            _ => None,
        }
    }
}
