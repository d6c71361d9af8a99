//! Intersections of rays with a scene.

use super::Scene;
use super::clearance::Clearance;
use super::index::Index;
use super::matter::Matters;
use super::parts::MediumId;
use super::parts::Partition;
use crate::bsdf::{Bsdf, PartialTransmission};
use crate::shape::{Except, Hit, Intersection};
use eikonal::Aabb;
use eikonal::Field;
use eikonal::connect::{Crossing, World};
use eikonal::interface::Rule;
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;

/// Largest length of an extended edge, in radii of the ball around the scene. Rays that do not
/// circle are shorter than three radii in most scenes.
const MAX_EDGE_LENGTH: f64 = 32.0;

impl World for Scene {
    type Region = MediumId;

    fn field(&self, medium: MediumId) -> &Field {
        &self.medium(medium).index
    }

    fn crossing(&self, medium: MediumId, arc: &Arc) -> Option<Crossing<MediumId>> {
        let (object, intersection) = self.first_boundary(arc, None)?;
        let hit = self.hit(object, &intersection);
        let surface = &self.objects()[object];
        Some(Crossing {
            theta: hit.theta,
            position: hit.position,
            normal: hit.normal,
            shape: surface.shape.shape_operator(hit.position, hit.primitive),
            rule: match surface.bsdf {
                Bsdf::Dielectric(_) => Rule::Refract,
                _ => Rule::Pass,
            },
            beyond: self.medium_beside(
                object,
                medium,
                hit.position,
                hit.normal,
                arc.velocity(hit.theta),
            ),
            surface: object,
        })
    }

    /// Returns a distance far above the round-off of positions and far below any tolerance.
    fn ray_epsilon(&self) -> f64 {
        self.ray_epsilon
    }
}

impl Scene {
    /// Returns the first surface that an arc meets.
    pub fn first_hit(&self, arc: &Arc) -> Option<(usize, Hit)> {
        let (object, intersection) = self.first_beyond(arc, None)?;
        Some((object, self.hit(object, &intersection)))
    }

    /// Returns the point of an intersection with an object.
    pub(crate) fn hit(&self, object: usize, intersection: &Intersection) -> Hit {
        self.objects()[object].shape.hit(intersection)
    }

    /// Returns the first surface that an arc meets, except the object `start_object`.
    pub(crate) fn first_beyond(
        &self,
        arc: &Arc,
        start_object: Option<usize>,
    ) -> Option<(usize, Intersection)> {
        self.first_before(arc, 1.0, start_object)
    }

    /// Returns the first surface that an arc meets up to θ = `end`, except the object
    /// `start_object`.
    pub(crate) fn first_before(
        &self,
        arc: &Arc,
        end: f64,
        start_object: Option<usize>,
    ) -> Option<(usize, Intersection)> {
        let all = &*self.geometry.all;
        first_of(all, arc, [0.0, end], [all.place(start_object), None])
    }

    /// Returns true if a straight line from `x`, in a medium, in a unit direction is known to meet
    /// no surface over a length. `within` is a divided volume whose voxel faces the line is known
    /// not to meet.
    #[inline]
    pub(crate) fn is_free(
        &self,
        medium: MediumId,
        within: Option<usize>,
        [x, direction]: [DVec3; 2],
        length: f64,
    ) -> bool {
        let has_others = self.parts.partitions.len() > usize::from(within.is_some());
        (!has_others || self.is_clear_of_voxels(medium, within, [x, direction], length))
            && self.is_clear_of_others(x, direction, length)
    }

    /// Like [`is_free`](Self::is_free), but searches for surfaces in scenes in which this takes no
    /// longer than bounds of distances.
    #[inline]
    pub(crate) fn is_free_line(
        &self,
        medium: MediumId,
        within: Option<usize>,
        [x, direction]: [DVec3; 2],
        length: f64,
    ) -> bool {
        if matches!(self.clearance(), Clearance::Unknown) {
            let arc = Arc::straight(x, direction, length, 1.0);
            return self.first_beyond(&arc, None).is_none();
        }
        self.is_free(medium, within, [x, direction], length)
    }

    /// Returns true if an arc meets no surface up to θ = `end`.
    #[inline]
    pub(crate) fn is_free_curve(&self, arc: &Arc, end: f64, length: f64) -> bool {
        let is_clear = || self.clearance().is_free_around(arc.start(), length);
        (self.parts.partitions.is_empty() && is_clear())
            || self.first_before(arc, end, None).is_none()
    }

    /// Returns true if the line is known to meet no face between voxels.
    fn is_clear_of_voxels(
        &self,
        medium: MediumId,
        within: Option<usize>,
        line: [DVec3; 2],
        length: f64,
    ) -> bool {
        let meets_none = |p: &Partition| p.is_free(medium, line, length) != Some(false);
        let mut partitions = self.parts.partitions.iter().enumerate();
        partitions.all(|(i, p)| Some(i) == within || meets_none(p))
    }

    /// Returns the uniform matter of the scene.
    #[inline]
    pub(super) fn matters(&self) -> &Matters {
        self.matters
            .get_or_init(|| Matters::of(&self.parts, &self.geometry.matter_grids))
    }

    /// Returns true if the line is known to meet no surface other than faces between voxels.
    #[inline]
    fn is_clear_of_others(&self, x: DVec3, direction: DVec3, length: f64) -> bool {
        self.clearance().is_free(x, direction, length)
    }

    /// Returns bounds of the distance to surfaces other than faces between voxels.
    #[inline]
    fn clearance(&self) -> &Clearance {
        self.clearance.get_or_init(|| {
            // Cover the media in which light can collide.
            let regions = self.media().iter().zip(self.regions());
            let turbid = regions.filter(|(medium, _)| !medium.is_transparent());
            let within = turbid.fold(Aabb::EMPTY, |all, (_, region)| all.union(region.aabb));
            self.geometry.clearance(&self.parts, &within)
        })
    }

    /// Returns the first boundary between media that an arc crosses deterministically, except the
    /// object `start_object`.
    pub(crate) fn first_boundary(
        &self,
        arc: &Arc,
        start_object: Option<usize>,
    ) -> Option<(usize, Intersection)> {
        let interfaces = &*self.geometry.interfaces;
        first_of(
            interfaces,
            arc,
            [0.0, 1.0],
            [interfaces.place(start_object), None],
        )
    }

    /// Returns the object if a straight line that leaves it in `direction`, from a point with
    /// `normal`, never meets it again.
    pub(crate) fn start_object(
        &self,
        object: usize,
        normal: DVec3,
        direction: DVec3,
    ) -> Option<usize> {
        let shape = &self.objects()[object].shape;
        shape.never_hit_again(normal, direction).then_some(object)
    }

    /// Returns the transmission of all surfaces within media across a connection; `None` if an
    /// opaque or rough surface blocks it. `arcs` are the arcs of the connection, each with the θ at
    /// which it ends. The ray ends on the object `target`, and meets its end only within the
    /// solver's tolerance. It may therefore touch `target` over a length of `slack` before the end.
    /// `start_object` is an object that the first arc does not meet if it is straight.
    pub fn visibility<'a>(
        &self,
        arcs: impl ExactSizeIterator<Item = (&'a Arc, f64)>,
        [start_object, target]: [Option<usize>; 2],
        slack: f64,
    ) -> Option<PartialTransmission> {
        let mut all = PartialTransmission::ALL;
        // Planted error "visibility along the chord", found by morgana-transport/transport::edges::occlusion_follows_the_arc:
        // let arcs: Vec<_> = arcs.collect();
        // let ends = (arcs[0].0.start(), arcs[arcs.len() - 1].0.end());
        // let chord = Arc::line(ends.0, ends.1 - ends.0, 1.0);
        // if target.is_some() || first_of(&self.geometry.blockers, &chord, [0.0, 1.0], [None; 2]).is_none() {
        //     return Some(all);
        // }
        // let (last, arcs) = (arcs.len().saturating_sub(1), arcs.into_iter());
        // if last < usize::MAX {
        //     return None;
        // }
        let last = arcs.len().saturating_sub(1);
        for (i, (arc, end)) in arcs.enumerate() {
            let target = target.filter(|_| i == last);
            let start_object = start_object.filter(|_| i == 0 && arc.is_straight());
            if self.blocked(arc, end, [start_object, target], slack) {
                return None;
            }
            self.pass_partial(arc, end, target, slack, &mut all);
        }
        (all.probability > 0.0).then_some(all)
    }

    /// Returns true if an opaque or rough surface blocks an arc before its end.
    fn blocked(
        &self,
        arc: &Arc,
        end: f64,
        [start_object, target]: [Option<usize>; 2],
        slack: f64,
    ) -> bool {
        let blockers = &*self.geometry.blockers;
        // A straight line meets a flat surface only where it ends on the surface.
        let flat = |object: &usize| arc.is_straight() && self.objects()[*object].shape.is_flat();
        let except = [start_object, target.filter(flat)].map(|object| blockers.place(object));
        let blocks = |i: usize, theta| !is_end(arc, end, blockers.objects[i], theta, target, slack);
        let shapes = &blockers.shapes;
        let accel = &blockers.accel;
        !shapes.is_empty() && accel.any_hit(shapes, arc, end, except, blocks)
    }

    /// Multiplies by the transmission of the surfaces that an arc crosses.
    fn pass_partial(
        &self,
        arc: &Arc,
        end: f64,
        target: Option<usize>,
        slack: f64,
        all: &mut PartialTransmission,
    ) {
        let mut from = 0.0;
        while let Some((object, intersection)) =
            first_of(&self.geometry.partial, arc, [from, end], [None; 2])
        {
            from = intersection.theta;
            if is_end(arc, end, object, intersection.theta, target, slack) {
                continue;
            }
            if let Some(through) = self.through(object, &intersection, arc) {
                all.times(&through);
            }
        }
    }

    /// Returns the filters of polarised light within media that an arc crosses up to θ = `end`, in
    /// order.
    pub(crate) fn filters_along(
        &self,
        arc: &Arc,
        end: f64,
    ) -> SmallVec<[(usize, Intersection); 2]> {
        let mut filters = SmallVec::new();
        let mut from = 0.0;
        while let Some((object, intersection)) =
            first_of(&self.geometry.partial, arc, [from, end], [None; 2])
        {
            from = intersection.theta;
            if self.objects()[object].bsdf.changes_what_passes() {
                filters.push((object, intersection));
            }
        }
        filters
    }

    /// Returns the straight transmission of an object where an arc meets it. Returns `None` for
    /// objects without [partial transmission](Bsdf::is_partial).
    pub(crate) fn through(
        &self,
        object: usize,
        intersection: &Intersection,
        arc: &Arc,
    ) -> Option<PartialTransmission> {
        let surface = &self.objects()[object];
        if !surface.bsdf.is_partial() {
            return None;
        }
        let hit = self.hit(object, intersection);
        let cos = hit.normal.dot(arc.velocity(hit.theta).normalize());
        surface.bsdf.through(&surface.shape.site(&hit), cos)
    }

    /// Returns a length beyond which a straight ray from a point inside the scene meets no more
    /// surfaces.
    pub(crate) fn reach(&self, x: DVec3) -> f64 {
        1.01 * (x.distance(self.around.center) + self.around.radius)
    }

    /// Returns true if an edge has the length at which its extension ends. Otherwise rays that
    /// circle in a medium would never end.
    pub(crate) fn is_long(&self, length: f64) -> bool {
        length > MAX_EDGE_LENGTH * self.around.radius
    }

    /// Returns true if a point lies outside the ball around the scene, enlarged by one per cent.
    pub(crate) fn is_outside(&self, x: DVec3) -> bool {
        x.distance(self.around.center) > 1.01 * self.around.radius
    }
}

fn first_of(
    index: &Index,
    arc: &Arc,
    range: [f64; 2],
    except: Except,
) -> Option<(usize, Intersection)> {
    if index.objects.is_empty() {
        return None;
    }
    let (i, intersection) = index.accel.first(&index.shapes, arc, range, except)?;
    Some((index.objects[i], intersection))
}

/// Returns true if an intersection with the object on which a connection ends is this end.
fn is_end(
    arc: &Arc,
    end: f64,
    object: usize,
    theta: f64,
    target: Option<usize>,
    slack: f64,
) -> bool {
    let left = || arc.arc_length(end) - arc.arc_length(theta);
    Some(object) == target && left() <= slack
}
