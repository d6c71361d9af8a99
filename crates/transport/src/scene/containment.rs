//! Which medium a point is in.

use super::Scene;
use super::parts::{AMBIENT, MediumId, Object};
use crate::sensor::Sensor;
use eikonal::connect::World;
use glam::DVec3;

impl Scene {
    /// The innermost medium that surrounds a point.
    pub fn medium_at(&self, x: DVec3) -> MediumId {
        medium_at(&self.parts.objects, x)
    }

    /// Whether something opaque fills the place of a medium at a point, so that no ray is there, whatever the index.
    pub fn is_displaced(&self, id: MediumId, x: DVec3) -> bool {
        let fills = |o: &Object| {
            let other = o.interior() != Some(id);
            other && o.shape.is_closed() && o.bsdf.is_opaque() && o.shape.contains(x)
        };
        self.objects().iter().any(fills)
    }

    /// The medium beside an object's surface at `x`, on the side to which `direction` points, for a ray
    /// that arrives through `current`.
    ///
    /// Where closed objects touch, overlap or hold one another, containment decides, so that a ray
    /// that leaves one layer enters the next one.
    pub(crate) fn medium_beside(
        &self,
        object: usize,
        current: MediumId,
        x: DVec3,
        normal: DVec3,
        direction: DVec3,
    ) -> MediumId {
        let side = normal.dot(direction);
        match self.objects()[object].sides {
            None => current,
            Some(_) if self.overlapping[object] => {
                self.medium_at(x + normal * (2.0 * self.ray_epsilon()).copysign(side))
            }
            Some(sides) if (side > 0.0) != self.is_inverted(object) => sides.exterior,
            Some(sides) => sides.interior,
        }
    }

    /// Whether the normals of a closed object point inwards.
    pub(super) fn is_inverted(&self, object: usize) -> bool {
        let shape = &self.objects()[object].shape;
        shape.is_closed() && shape.has_flipped_normals()
    }

    /// The medium in which a sensor ray starts.
    pub(crate) fn medium_of_sensor_ray(&self, origin: DVec3) -> MediumId {
        match self.sensor() {
            Sensor::Perspective(_) | Sensor::Absent(_) => self.sensor_medium,
            _ => self.medium_at(origin),
        }
    }
}

/// The innermost closed object around a point decides: the one with the smallest box.
pub fn medium_at<'a>(objects: impl IntoIterator<Item = &'a Object>, x: DVec3) -> MediumId {
    objects
        .into_iter()
        .filter_map(|o| Some((o.interior()?, &o.shape)))
        .filter(|(_, shape)| shape.is_closed() && shape.contains(x))
        .min_by(|(_, a), (_, b)| a.aabb().diagonal().total_cmp(&b.aabb().diagonal()))
        .map_or(AMBIENT, |(medium, _)| medium)
}

/// Whether each object is closed, separates media, and comes near another one that does.
pub(super) fn overlapping(objects: &[Object], margin: f64) -> Vec<bool> {
    let matters = |o: &Object| o.sides.is_some() && o.shape.is_closed();
    let near = |a: &Object, b: &Object| a.shape.aabb().grown(margin).overlaps(&b.shape.aabb());
    let others = |i: usize| objects.iter().enumerate().filter(move |(k, _)| *k != i);
    objects
        .iter()
        .enumerate()
        .map(|(i, o)| matters(o) && others(i).any(|(_, b)| matters(b) && near(o, b)))
        .collect()
}
