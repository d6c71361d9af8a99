//! What rays meet in a scene.

use super::{Index, MediumId, Scene};
use crate::bsdf::Bsdf;
use crate::shape::Hit;
use eikonal::Field;
use eikonal::connect::{Crossing, Piece, World};
use eikonal::interface::Rule;
use eikonal::ray::Arc;

impl World for Scene {
    type Region = MediumId;

    fn field(&self, medium: MediumId) -> &Field {
        &self.medium(medium).index
    }

    fn crossing(&self, medium: MediumId, arc: &Arc) -> Option<Crossing<MediumId>> {
        let (object, hit) = self.first_of(&self.interfaces, arc, 0.0, 1.0)?;
        let surface = &self.objects()[object];
        Some(Crossing {
            theta: hit.theta,
            position: hit.position,
            normal: hit.normal,
            shape: surface.shape.shape_operator(hit.position, hit.primitive),
            rule: match surface.bsdf {
                Bsdf::Null => Rule::Pass,
                _ => Rule::Refract,
            },
            beyond: self.medium_beside(
                object,
                medium,
                (hit.position, hit.normal),
                arc.velocity(hit.theta),
            ),
            surface: object,
        })
    }

    /// Far above the round-off of positions, far below any tolerance.
    fn nudge(&self) -> f64 {
        1e-10 * (self.around.radius + self.around.center.length())
    }
}

impl Scene {
    /// The first surface that an arc meets.
    pub fn first_hit(&self, arc: &Arc) -> Option<(usize, Hit)> {
        self.first_of(&self.all, arc, 0.0, 1.0)
    }

    fn first_of(&self, index: &Index, arc: &Arc, from: f64, to: f64) -> Option<(usize, Hit)> {
        let (i, hit) = index.accel.first_hit(&index.shapes, arc, from, to)?;
        Some((index.objects[i], hit))
    }

    /// Whether an opaque or rough surface stands in the way of a connection. Over a length of `slack`
    /// before its end the ray may touch `target`, the object on which it ends: it comes close to the
    /// point that it was aimed at, but not closer than the solver's tolerance.
    pub fn is_occluded(
        &self,
        pieces: &[Piece<MediumId>],
        target: Option<usize>,
        slack: f64,
    ) -> bool {
        if self.blockers.objects.is_empty() {
            return false;
        }
        let Some((last, before)) = pieces.split_last() else {
            return false;
        };
        let blocked = |p: &Piece<MediumId>| {
            self.first_of(&self.blockers, &p.arc, 0.0, p.theta_end)
                .is_some()
        };
        if before.iter().any(blocked) {
            return true;
        }
        let Some((object, hit)) = self.first_of(&self.blockers, &last.arc, 0.0, last.theta_end)
        else {
            return false;
        };
        let left = last.arc.arc_length(last.theta_end) - last.arc.arc_length(hit.theta);
        !(Some(object) == target && left <= slack)
    }

    /// Length beyond which a straight ray that starts inside the scene meets nothing more.
    pub(crate) fn reach(&self, x: glam::DVec3) -> f64 {
        1.01 * (x.distance(self.around.center) + self.around.radius)
    }

    /// Whether a point lies beyond everything in the scene.
    pub(crate) fn is_outside(&self, x: glam::DVec3) -> bool {
        x.distance(self.around.center) > 1.01 * self.around.radius
    }
}
