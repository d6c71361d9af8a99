//! Ray bending in a scene: its causes, and the reach of connections.

use super::parts::{MediumId, Object, Parts};
use super::{BendingBall, Scene};
use crate::bsdf::Bsdf;
use crate::connection_end::ConnectionEnd;
use crate::emitter::Emitter;
use eikonal::connect::{Guide, InitialGuess, Pattern, RayFamily};
use glam::DVec3;

/// Causes of ray bending in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bending {
    /// No ray bends.
    None,
    /// Only the index of one medium bends rays.
    One(MediumId),
    /// Smooth interfaces, or several media, bend rays.
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

/// Optical path length, in radii of the scene, over which beams are followed and branches searched
/// for. It allows several bounces inside a tank.
pub(super) const REACH: f64 = 20.0;
/// Largest number of total reflections of the branches that are searched for. Inside a glass ball,
/// infinitely many branches run along the surface between two points. Each additional reflection
/// makes them harder to find.
pub const MAX_TOTAL_REFLECTIONS: u32 = 3;

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
    /// Returns true if two points, each given with its medium, are known to have at most one
    /// connecting ray. Either all rays are straight, or both points are in the only medium that
    /// bends rays. This medium must be [certified](eikonal::Uniqueness) and convex, so that no ray
    /// that leaves it returns.
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

    /// Returns true if two points are known to have at most one connecting ray without reflections
    /// where refraction is possible. Only one ball may bend rays, and the points must lie in it.
    pub(crate) fn is_unique_in_ball(&self, ends: [DVec3; 2]) -> bool {
        let known = |ball: &BendingBall| ball.is_unique(ends, |x| self.n(ball.interior, x));
        self.bending_ball().is_some_and(known)
    }

    /// Returns the medium at an end that is a point, if [`Scene::is_unique`] can use it.
    pub(crate) fn medium_of_end(&self, end: &ConnectionEnd) -> Option<MediumId> {
        match (self.bending, end) {
            (Bending::One(_), ConnectionEnd::Point { position, .. }) => {
                Some(self.medium_at(*position))
            }
            _ => None,
        }
    }
}
