//! What rays meet in a scene.

use super::{Index, MediumId, Scene};
use crate::Spectrum;
use crate::bsdf::{Bsdf, Through};
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
        if index.objects.is_empty() {
            return None;
        }
        let (i, hit) = index.accel.first_hit(&index.shapes, arc, from, to)?;
        Some((index.objects[i], hit))
    }

    /// What of the light passes straight through all surfaces in the way of a connection; `None` if an opaque
    /// or rough one stands there. Over a length of `slack` before its end the ray may touch `target`, the
    /// object on which it ends: it comes close to the point that it was aimed at, but not closer than the
    /// solver's tolerance.
    pub fn visibility(
        &self,
        pieces: &[Piece<MediumId>],
        target: Option<usize>,
        slack: f64,
    ) -> Option<Through> {
        let mut all = Through {
            probability: 1.0,
            factor: Spectrum::ONE,
        };
        let last = pieces.len().saturating_sub(1);
        for (i, piece) in pieces.iter().enumerate() {
            let target = target.filter(|_| i == last);
            if self.blocked(piece, target, slack) {
                return None;
            }
            self.unveil(piece, target, slack, &mut all);
        }
        (all.probability > 0.0).then_some(all)
    }

    /// Whether an opaque or rough surface stands in the way of a piece of a connection.
    fn blocked(&self, piece: &Piece<MediumId>, target: Option<usize>, slack: f64) -> bool {
        let first = self.first_of(&self.blockers, &piece.arc, 0.0, piece.theta_end);
        first.is_some_and(|(object, hit)| !is_end(piece, (object, &hit), target, slack))
    }

    /// Multiplies by what the surfaces in the way of a piece let pass.
    fn unveil(
        &self,
        piece: &Piece<MediumId>,
        target: Option<usize>,
        slack: f64,
        all: &mut Through,
    ) {
        let (mut from, end) = (0.0, piece.theta_end);
        while let Some((object, hit)) = self.first_of(&self.veils, &piece.arc, from, end) {
            from = hit.theta;
            if is_end(piece, (object, &hit), target, slack) {
                continue;
            }
            let surface = &self.objects()[object];
            let cos = hit.normal.dot(piece.arc.velocity(hit.theta).normalize());
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
    piece: &Piece<MediumId>,
    (object, hit): (usize, &Hit),
    target: Option<usize>,
    slack: f64,
) -> bool {
    let left = || piece.arc.arc_length(piece.theta_end) - piece.arc.arc_length(hit.theta);
    Some(object) == target && left() <= slack
}
