//! Containment: the medium at a point.

use super::Scene;
use super::parts::{AMBIENT, MediumId, Object, Partition, Parts};
use crate::sensor::Sensor;
use crate::shape::Tree;
use eikonal::Aabb;
use eikonal::connect::World;
use glam::DVec3;
use std::cmp::Ordering;

impl Scene {
    /// Returns the innermost medium that surrounds a point.
    pub fn medium_at(&self, x: DVec3) -> MediumId {
        self.containment().medium_at(x)
    }

    /// Returns true if an opaque body displaces a medium at a point. No ray reaches the point then.
    pub fn is_displaced(&self, id: MediumId, x: DVec3) -> bool {
        self.containment().is_displaced(id, x)
    }

    /// Returns the closed objects and partitions, for queries about points.
    pub(super) fn containment(&self) -> Containment<'_> {
        self.parts.containment(&self.geometry.bodies)
    }

    /// Returns the medium beside an object's surface at `x`, on the side to which `direction`
    /// points, for a ray that arrives through `current`.
    ///
    /// If closed objects or partitions touch, overlap or contain each other, containment decides. A
    /// ray that leaves one layer then enters the next one.
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
            Some(_) if self.geometry.overlapping[object] => {
                self.medium_at(x + normal * (2.0 * self.ray_epsilon()).copysign(side))
            }
            Some(sides) if (side > 0.0) != self.is_inverted(object) => sides.exterior,
            Some(sides) => sides.interior,
        }
    }

    /// Returns true if the normals of a closed object point inwards.
    pub(super) fn is_inverted(&self, object: usize) -> bool {
        let shape = &self.objects()[object].shape;
        shape.is_closed() && shape.has_flipped_normals()
    }

    /// Returns the medium in which a sensor ray starts.
    pub(crate) fn medium_of_sensor_ray(&self, origin: DVec3) -> MediumId {
        match self.sensor() {
            Sensor::Perspective(_) | Sensor::Absent(_) => self.sensor_medium,
            _ => self.medium_at(origin),
        }
    }
}

/// The closed shapes of a list of objects, with look-up by position in logarithmic time.
#[derive(Debug)]
pub struct Bodies {
    /// Indices of the objects that are closed or divide a volume.
    bounding: Vec<usize>,
    /// Hierarchy over the boxes of the objects in `bounding`.
    tree: Tree,
    /// Partition to which each object belongs, if any.
    partition: Vec<Option<usize>>,
}

impl Bodies {
    /// Finds the closed shapes among objects, and the shapes of partitions, which divide volumes
    /// into several media.
    pub fn new(objects: &[Object], partitions: &[Partition]) -> Self {
        let mut partition = vec![None; objects.len()];
        for (i, p) in partitions.iter().enumerate() {
            partition[p.objects.clone()].fill(Some(i));
        }
        let bounds = |i: &usize| objects[*i].shape.is_closed() || partition[*i].is_some();
        let bounding: Vec<usize> = (0..objects.len()).filter(bounds).collect();
        let boxes: Vec<Aabb> = bounding.iter().map(|i| objects[*i].shape.aabb()).collect();
        Bodies {
            tree: Tree::new(boxes.iter().copied()),
            bounding,
            partition,
        }
    }

    /// Calls `holds` with the objects whose boxes share a point with a box, and possibly with
    /// others nearby, until `holds` returns true. Returns true if a call did.
    fn any_near(&self, place: &Aabb, mut holds: impl FnMut(usize) -> bool) -> bool {
        self.tree
            .any_near(place, &mut |leaf| holds(self.bounding[leaf]))
    }
}

/// Closed objects and partitions, which determine the medium at each point. Surfaces of partitions
/// do not count as objects.
#[derive(Clone, Copy, Debug)]
pub struct Containment<'a> {
    /// All objects.
    pub objects: &'a [Object],
    /// Volumes divided into several media.
    pub partitions: &'a [Partition],
    /// Search structure over the closed objects.
    pub bodies: &'a Bodies,
}

impl Parts {
    /// Returns the closed shapes, as [`Parts::containment`] needs them.
    pub(super) fn bodies(&self) -> Bodies {
        Bodies::new(&self.objects, &self.partitions)
    }

    /// Returns the closed objects and partitions, for queries about points.
    pub(super) fn containment<'a>(&'a self, bodies: &'a Bodies) -> Containment<'a> {
        Containment {
            objects: &self.objects,
            partitions: &self.partitions,
            bodies,
        }
    }
}

impl Containment<'_> {
    /// Returns the medium of the innermost body around a point, which is the body with the smallest
    /// box.
    pub fn medium_at(&self, x: DVec3) -> MediumId {
        self.innermost(x, |_| true)
            .map_or(AMBIENT, |body| body.medium)
    }

    /// Returns true if an opaque body displaces a medium at a point.
    pub(super) fn is_displaced(&self, id: MediumId, x: DVec3) -> bool {
        self.bodies.any_near(&Aabb::new(x, x), |i| {
            let object = &self.objects[i];
            object.interior() != Some(id) && object.bsdf.is_opaque() && object.shape.contains(x)
        })
    }

    /// Returns the number of bodies around a point.
    pub(super) fn depth(&self, x: DVec3) -> usize {
        let mut depth = 0;
        self.around(x, |_| true, |_| depth += 1);
        depth
    }

    /// Returns the medium of the innermost body around a point, without an object or the partition
    /// that it belongs to.
    pub fn medium_around(&self, object: usize, x: DVec3) -> MediumId {
        let own = self.bodies.partition[object];
        let own = own.map_or(object..object + 1, |i| self.partitions[i].objects.clone());
        let around = self.innermost(x, |i| !own.contains(&i));
        around.map_or(AMBIENT, |body| body.medium)
    }

    /// Returns the body around a point that comes first [by size](by_size).
    fn innermost(&self, x: DVec3, counts: impl Fn(usize) -> bool) -> Option<Body<'_>> {
        let order = |a: &Body, b: &Body| {
            let by_size = by_size((&a.bounds, a.name), (&b.bounds, b.name));
            by_size.then(a.number.cmp(&b.number))
        };
        let mut innermost: Option<Body> = None;
        self.around(x, counts, |body| {
            if innermost.as_ref().is_none_or(|i| order(&body, i).is_lt()) {
                innermost = Some(body);
            }
        });
        innermost
    }

    /// Calls `visit` with the bodies around a point.
    fn around<'a>(
        &'a self,
        x: DVec3,
        counts: impl Fn(usize) -> bool,
        mut visit: impl FnMut(Body<'a>),
    ) {
        self.bodies.any_near(&Aabb::new(x, x), |i| {
            let object = &self.objects[i];
            let counts = self.bodies.partition[i].is_none() && counts(i);
            if let Some(medium) = object.interior().filter(|_| counts)
                && object.shape.contains(x)
            {
                visit(Body {
                    medium,
                    bounds: object.shape.aabb(),
                    name: &object.name,
                    number: i,
                });
            }
            false
        });
        for (i, p) in self.partitions.iter().enumerate() {
            let medium = p.medium_at(self.objects, x);
            if let Some(medium) = medium.filter(|_| counts(p.objects.start)) {
                visit(Body {
                    medium,
                    bounds: p.aabb(self.objects),
                    name: &self.objects[p.objects.start].name,
                    number: self.objects.len() + i,
                });
            }
        }
    }
}

/// Orders things by their boxes and names: smaller boxes first, then names, then the lowest corners
/// of the boxes. The order does not depend on positions in a list.
pub(super) fn by_size(a: (&Aabb, &str), b: (&Aabb, &str)) -> Ordering {
    let corner = |b: &Aabb| b.min.to_array();
    let by_size = a.0.diagonal().total_cmp(&b.0.diagonal());
    let by_name = by_size.then_with(|| a.1.cmp(b.1));
    let corners = corner(a.0).into_iter().zip(corner(b.0));
    corners.fold(by_name, |order, (a, b)| order.then(a.total_cmp(&b)))
}

/// A body around a point.
struct Body<'a> {
    medium: MediumId,
    bounds: Aabb,
    name: &'a str,
    /// Index of the object; partitions come after all objects.
    number: usize,
}

/// Returns for each object true if it is closed or divides a volume, separates media, and lies near
/// another object with these properties. Surfaces of one partition are not compared with each
/// other.
pub(super) fn overlapping(
    Containment {
        objects, bodies, ..
    }: Containment,
    margin: f64,
) -> Vec<bool> {
    let partition = &bodies.partition;
    let separates = |i: &usize| objects[*i].sides.is_some();
    let mut overlapping = vec![false; objects.len()];
    for &i in bodies.bounding.iter().filter(|i| separates(i)) {
        let own = objects[i].shape.aabb().grown(margin);
        overlapping[i] = bodies.any_near(&own, |other| {
            let apart = partition[i].is_none() || partition[i] != partition[other];
            let counts = other != i && apart && separates(&other);
            counts && own.overlaps(&objects[other].shape.aabb())
        });
    }
    overlapping
}

#[cfg(test)]
mod tests {
    use super::super::parts::Sides;
    use super::*;
    use crate::bsdf::Bsdf;
    use crate::shape::Sphere;
    use testkit::Rng;

    /// Makes balls at random positions. About one in `overlap` meets another. Each ball has a
    /// separate medium, with exceptions.
    fn balls(count: usize, overlap: f64) -> Vec<Object> {
        let mut rng = Rng::new(count as u64);
        let radius = (0.12 / overlap / count as f64).cbrt();
        let ball = |i: usize| {
            let center = DVec3::from(rng.uniform::<3>());
            let sides = Sides {
                interior: i + 1,
                exterior: AMBIENT,
            };
            Object {
                name: format!("{}", i % 7),
                shape: Sphere::around(center, radius).unwrap().into(),
                bsdf: Bsdf::Null,
                sides: (!i.is_multiple_of(5)).then_some(sides),
                emitter: None,
            }
        };
        (0..count).map(ball).collect()
    }

    /// Balls of equal size, with only seven names.
    #[test]
    fn the_search_finds_what_looking_at_all_objects_does() {
        let objects = balls(300, 0.02);
        let bodies = Bodies::new(&objects, &[]);
        let containment = Containment {
            objects: &objects,
            partitions: &[],
            bodies: &bodies,
        };
        let reversed: Vec<Object> = objects.iter().rev().cloned().collect();
        let bodies_reversed = Bodies::new(&reversed, &[]);
        let in_reverse = Containment {
            objects: &reversed,
            bodies: &bodies_reversed,
            ..containment
        };
        let mut rng = Rng::new(1);
        let mut inside = 0;
        for _ in 0..2000 {
            let x = DVec3::from(rng.uniform::<3>());
            let around = objects.iter().filter(|o| o.sides.is_some());
            let around: Vec<&Object> = around.filter(|o| o.shape.contains(x)).collect();
            let key = |o: &Object| (o.shape.aabb(), o.name.clone());
            let first = around.iter().min_by(|a, b| {
                let [a, b] = [key(a), key(b)];
                by_size((&a.0, &a.1), (&b.0, &b.1))
            });
            let expected = first.and_then(|o| o.interior()).unwrap_or(AMBIENT);
            assert_eq!(containment.medium_at(x), expected);
            assert_eq!(in_reverse.medium_at(x), expected);
            assert_eq!(containment.depth(x), around.len());
            inside += usize::from(around.len() > 1);
        }
        assert!(inside > 200, "{inside}");
        let margin = 1e-3;
        let boxes: Vec<Aabb> = objects.iter().map(|o| o.shape.aabb()).collect();
        let near = |i: usize, k: usize| {
            i != k && objects[k].sides.is_some() && boxes[i].grown(margin).overlaps(&boxes[k])
        };
        let expected = (0..objects.len())
            .map(|i| objects[i].sides.is_some() && (0..objects.len()).any(|k| near(i, k)));
        assert_eq!(
            overlapping(containment, margin),
            expected.collect::<Vec<_>>()
        );
    }

    /// The number of objects tested for a point does not grow with the number of all objects.
    #[test]
    fn a_point_finds_its_medium_among_many() {
        for count in [1_000, 100_000] {
            let objects = balls(count, 1.0);
            let bodies = Bodies::new(&objects, &[]);
            let (mut rng, mut looked_at, points) = (Rng::new(2), 0, 1000);
            for _ in 0..points {
                let x = DVec3::from(rng.uniform::<3>());
                bodies.any_near(&Aabb::new(x, x), |_| {
                    looked_at += 1;
                    false
                });
            }
            assert!(looked_at < 40 * points, "{count}: {looked_at}");
        }
    }
}
