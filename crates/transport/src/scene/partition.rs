//! Partitions: volumes that are divided into several media.

use super::parts::{MediumId, Object, Partition};
use crate::shape::{DIRECTIONS, FirstCrossing, Shape};
use eikonal::Aabb;
use glam::DVec3;

impl Partition {
    /// Returns true if a straight line in a medium is known to meet none of the partition's
    /// surfaces over a length. `line` is a point and a unit direction. Returns `None` if only a
    /// search for surfaces can decide.
    #[inline]
    pub(super) fn is_free(&self, medium: MediumId, line: [DVec3; 2], length: f64) -> Option<bool> {
        let voxels = self.voxels()?;
        Some(voxels.holds(medium, line, length))
    }

    /// Returns true if both partitions consist of the same objects and cells.
    pub(super) fn is_same(&self, other: &Partition) -> bool {
        let cells = match (&self.cells, &other.cells) {
            (None, None) => true,
            (Some(a), Some(b)) => a.is_same(b),
            _ => false,
        };
        cells && (&self.objects, self.exterior) == (&other.objects, other.exterior)
    }

    /// Returns a box around the partition.
    pub(super) fn aabb(&self, objects: &[Object]) -> Aabb {
        let surfaces = objects[self.objects.clone()].iter();
        surfaces.fold(Aabb::EMPTY, |b, o| b.union(o.shape.aabb()))
    }

    /// Returns the volume of a medium within the partition, or of all media except the exterior
    /// one. Volumes are counted in voxels, or computed from the surfaces by the divergence theorem.
    /// Returns `None` if a surface is not a mesh.
    pub(super) fn volume(&self, objects: &[Object], of: Option<MediumId>) -> Option<f64> {
        let counts = |medium: MediumId| medium != self.exterior && of.is_none_or(|of| of == medium);
        if let Some(voxels) = self.voxels() {
            let grid = voxels.parts();
            let numbers = 0..grid.labels().len();
            let media = numbers.filter_map(|v| voxels.of_voxel(v));
            let share = media.filter(|m| counts(*m)).count() as f64 / grid.labels().len() as f64;
            return Some(share * grid.to_world().matrix3.determinant().abs());
        }
        let apex = self.aabb(objects).center();
        let mut volume = 0.0;
        for object in &objects[self.objects.clone()] {
            let (Shape::Mesh(mesh), Some(sides)) = (&object.shape, object.sides) else {
                return None;
            };
            let side = f64::from(u8::from(counts(sides.interior)))
                - f64::from(u8::from(counts(sides.exterior)));
            volume += side * mesh.cone_volume(apex);
        }
        Some(volume)
    }

    /// Returns the medium at a point of the volume; `None` outside. The medium follows from the
    /// cells, or from the first surface in some direction.
    pub(super) fn medium_at(&self, objects: &[Object], x: DVec3) -> Option<MediumId> {
        if let Some(voxels) = self.voxels() {
            return voxels.at(x).filter(|medium| *medium != self.exterior);
        }
        if !self.aabb(objects).contains(x) {
            return None;
        }
        // Rounding may put a point on a face into no tetrahedron.
        let tetrahedra = self.tetrahedra();
        let tetrahedron = tetrahedra.and_then(|tetrahedra| tetrahedra.at(x));
        if tetrahedron.is_some() {
            return tetrahedron.filter(|medium| *medium != self.exterior);
        }
        let turned = |d: DVec3, turn: usize| match turn {
            0 => d,
            1 => DVec3::new(d.y, d.z, d.x),
            _ => DVec3::new(d.z, d.x, d.y),
        };
        let directions = (0..3).flat_map(|turn| DIRECTIONS.map(|d| turned(d, turn)));
        let mut seen = directions.map(|d| self.seen(&objects[self.objects.clone()], x, d));
        let medium = seen.find_map(Result::ok).flatten();
        medium.filter(|medium| *medium != self.exterior)
    }

    /// Returns the medium on the near side of the first surface in a direction, if there is a
    /// surface.
    fn seen(&self, objects: &[Object], x: DVec3, d: DVec3) -> Result<Option<MediumId>, Unclear> {
        let mut first = (f64::INFINITY, None);
        for object in objects {
            let (Shape::Mesh(mesh), Some(sides)) = (&object.shape, object.sides) else {
                continue;
            };
            match mesh.first_crossing(x, d) {
                FirstCrossing::Unclear => return Err(Unclear),
                FirstCrossing::Nothing => {}
                FirstCrossing::Triangle {
                    distance,
                    from_front,
                } => {
                    let medium = if from_front {
                        sides.exterior
                    } else {
                        sides.interior
                    };
                    if distance < first.0 {
                        first = (distance, Some(medium));
                    }
                }
            }
        }
        Ok(first.1)
    }
}

/// Error of a direction that passes too close to an edge to decide.
struct Unclear;
