//! Which medium a point is in.

use super::Scene;
use super::parts::{AMBIENT, MediumId, Object, Partition, Parts};
use crate::sensor::Sensor;
use eikonal::connect::World;
use glam::DVec3;

impl Scene {
    /// The innermost medium that surrounds a point.
    pub fn medium_at(&self, x: DVec3) -> MediumId {
        self.parts.containment().medium_at(x)
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
    /// Where closed objects or partitions touch, overlap or hold one another, containment decides, so that a ray
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

/// Where which medium is: closed objects, and partitions, whose surfaces do not count as objects.
#[derive(Clone, Copy, Debug)]
pub struct Containment<'a> {
    /// All objects.
    pub objects: &'a [Object],
    /// What divides volumes into several media.
    pub partitions: &'a [Partition],
}

impl Parts {
    /// Where which medium is.
    pub fn containment(&self) -> Containment<'_> {
        Containment {
            objects: &self.objects,
            partitions: &self.partitions,
        }
    }
}

impl Containment<'_> {
    /// The medium of what is innermost around a point, that with the smallest box.
    pub fn medium_at(&self, x: DVec3) -> MediumId {
        self.innermost(x, |_| true)
            .map_or(AMBIENT, |body| body.medium)
    }

    /// Number of bodies around a point.
    pub(super) fn depth(&self, x: DVec3) -> usize {
        self.around(x, |_| true).count()
    }

    /// The same without an object, or without the partition that it belongs to.
    pub fn medium_around(&self, object: usize, x: DVec3) -> MediumId {
        let own = self.partitions.iter().find(|p| p.objects.contains(&object));
        let own = own.map_or(object..object + 1, |p| p.objects.clone());
        let own = &own;
        let around = self.innermost(x, |i| !own.contains(&i));
        around.map_or(AMBIENT, |body| body.medium)
    }

    /// The smallest body around a point; of equal ones, the one whose name comes first.
    fn innermost(&self, x: DVec3, counts: impl Fn(usize) -> bool + Copy) -> Option<Body<'_>> {
        let order = |a: &Body, b: &Body| {
            let by_size = a.size.total_cmp(&b.size);
            by_size.then_with(|| a.name.cmp(b.name))
        };
        self.around(x, counts).min_by(order)
    }

    /// The bodies around a point.
    fn around(
        &self,
        x: DVec3,
        counts: impl Fn(usize) -> bool + Copy,
    ) -> impl Iterator<Item = Body<'_>> {
        let in_partition = move |i: usize| self.partitions.iter().any(|p| p.objects.contains(&i));
        let bodies = self.objects.iter().enumerate().filter_map(move |(i, o)| {
            let medium = o.interior().filter(|_| counts(i))?;
            let holds = o.shape.is_closed() && !in_partition(i) && o.shape.contains(x);
            holds.then(|| Body {
                medium,
                size: o.shape.aabb().diagonal(),
                name: &o.name,
            })
        });
        let divided = self.partitions.iter().filter_map(move |p| {
            let medium = p
                .medium_at(self.objects, x)
                .filter(|_| counts(p.objects.start))?;
            Some(Body {
                medium,
                size: p.aabb(self.objects).diagonal(),
                name: &self.objects[p.objects.start].name,
            })
        });
        bodies.chain(divided)
    }
}

/// A body around a point.
struct Body<'a> {
    medium: MediumId,
    /// Diameter of the box around it.
    size: f64,
    name: &'a str,
}

/// Whether each object is closed or divides a volume, separates media, and comes near another one that does; the surfaces of a
/// partition are no others to each other.
pub(super) fn overlapping(
    Containment {
        objects,
        partitions,
    }: Containment,
    margin: f64,
) -> Vec<bool> {
    let partition = |i: usize| partitions.iter().position(|p| p.objects.contains(&i));
    let matters = |i: usize| {
        let o = &objects[i];
        o.sides.is_some() && (o.shape.is_closed() || partition(i).is_some())
    };
    let near = |i: usize, k: usize| {
        let (a, b) = (objects[i].shape.aabb(), objects[k].shape.aabb());
        a.grown(margin).overlaps(&b)
    };
    let apart =
        |i: usize, k: usize| i != k && (partition(i).is_none() || partition(i) != partition(k));
    (0..objects.len())
        .map(|i| matters(i) && (0..objects.len()).any(|k| apart(i, k) && matters(k) && near(i, k)))
        .collect()
}
