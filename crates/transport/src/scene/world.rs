//! What rays meet in a scene.

use super::{Index, MediumId, Scene};
use crate::Spectrum;
use crate::bsdf::{Bsdf, Through};
use crate::shape::Hit;
use eikonal::Field;
use eikonal::connect::{Crossing, World};
use eikonal::interface::Rule;
use eikonal::ray::Arc;

impl World for Scene {
    type Region = MediumId;

    fn field(&self, medium: MediumId) -> &Field {
        &self.medium(medium).index
    }

    fn crossing(&self, medium: MediumId, arc: &Arc) -> Option<Crossing<MediumId>> {
        let (object, hit) = self.first_boundary(arc)?;
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
        if index.objects.is_empty() {
            return None;
        }
        let (i, hit) = index.accel.first_hit(&index.shapes, arc, from, to)?;
        Some((index.objects[i], hit))
    }

    /// The first boundary between media that an arc passes on its deterministic way.
    pub(crate) fn first_boundary(&self, arc: &Arc) -> Option<(usize, Hit)> {
        self.first_of(&self.interfaces, arc, 0.0, 1.0)
    }

    /// What of the light passes straight through all surfaces in the way of a connection, whose arcs are given with
    /// the θ where they end; `None` if an opaque or rough one stands there. Over a length of `slack` before its end the ray may touch `target`, the
    /// object on which it ends: it comes close to the point that it was aimed at, but not closer than the
    /// solver's tolerance.
    pub fn visibility<'a>(
        &self,
        arcs: impl ExactSizeIterator<Item = (&'a Arc, f64)>,
        target: Option<usize>,
        slack: f64,
    ) -> Option<Through> {
        let mut all = Through {
            probability: 1.0,
            factor: Spectrum::ONE,
        };
        let last = arcs.len().saturating_sub(1);
        for (i, arc) in arcs.enumerate() {
            let target = target.filter(|_| i == last);
            if self.blocked(arc, target, slack) {
                return None;
            }
            self.unveil(arc, target, slack, &mut all);
        }
        (all.probability > 0.0).then_some(all)
    }

    /// Whether an opaque or rough surface stands in the way along an arc.
    fn blocked(&self, (arc, end): (&Arc, f64), target: Option<usize>, slack: f64) -> bool {
        let blockers = &self.blockers;
        let blocks =
            |i: usize, theta| !is_end((arc, end), (blockers.objects[i], theta), target, slack);
        let shapes = &blockers.shapes;
        let accel = &blockers.accel;
        !shapes.is_empty() && accel.any_hit(shapes, arc, end, blocks)
    }

    /// Multiplies by what the surfaces in the way along an arc let pass.
    fn unveil(
        &self,
        (arc, end): (&Arc, f64),
        target: Option<usize>,
        slack: f64,
        all: &mut Through,
    ) {
        let mut from = 0.0;
        while let Some((object, hit)) = self.first_of(&self.veils, arc, from, end) {
            from = hit.theta;
            if is_end((arc, end), (object, hit.theta), target, slack) {
                continue;
            }
            let surface = &self.objects()[object];
            let cos = hit.normal.dot(arc.velocity(hit.theta).normalize());
            if let Some(through) = surface.bsdf.through(&surface.shape.site(&hit), cos) {
                all.probability *= through.probability;
                all.factor *= through.factor;
            }
        }
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

/// Whether a hit on the object on which a connection ends is that end.
fn is_end(
    (arc, end): (&Arc, f64),
    (object, theta): (usize, f64),
    target: Option<usize>,
    slack: f64,
) -> bool {
    let left = || arc.arc_length(end) - arc.arc_length(theta);
    Some(object) == target && left() <= slack
}
