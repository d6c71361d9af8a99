//! Divided volumes of tetrahedra, prepared for walks from face to face
//! (docs/theory.md#walks-through-cells).

use super::cells::{BeyondFace, CellContents, CellFrame, OTHER, WalkCells};
use super::matter::Matters;
use super::parts::Parts;
use crate::shape::Shape;
use crate::shared::Distinct;
use crate::volume::TetrahedralMesh;
use eikonal::Aabb;
use glam::DVec3;
use std::sync::Arc;

/// Distance from other surfaces, relative to the size of the volume, within which walks do not use
/// tetrahedra. It exceeds rounding errors of surfaces that lie on faces.
const SURFACE_MARGIN: f64 = 1e-6;

/// A volume of tetrahedra, each with matter of one index and uniform coefficients.
#[derive(Clone, Debug)]
pub struct TetrahedralVolume {
    mesh: Arc<TetrahedralMesh>,
    pub(super) contents: CellContents,
}

impl TetrahedralVolume {
    /// Prepares a divided volume. Returns `None` unless it consists of tetrahedra with faces that
    /// refract all light or transmit all light straight on.
    pub(super) fn of(
        parts: &Parts,
        matters: &Matters,
        number: usize,
        grids: &Distinct<Vec<u8>>,
    ) -> Option<Self> {
        let partition = &parts.partitions[number];
        let tetrahedra = partition.tetrahedra()?;
        let media = &tetrahedra.media;
        let (mut contents, own) = CellContents::of(parts, matters, partition, media)?;
        // All matter of a medium of tetrahedra is one.
        let of_medium = |medium: usize| match matters.own(medium)[..] {
            [matter] => own.get(matter).copied().unwrap_or(OTHER),
            _ => OTHER,
        };
        let of_part: Vec<u8> = media.iter().map(|medium| of_medium(*medium)).collect();
        let mesh = &tetrahedra.mesh;
        let place = |part: &u8| usize::from(*part).checked_sub(1);
        let number = |part: &u8| place(part).map_or(OTHER, |place| of_part[place]);
        let mut numbers: Vec<u8> = mesh.parts().iter().map(number).collect();
        let margin = SURFACE_MARGIN * partition.aabb(&parts.objects).diagonal();
        for (i, object) in parts.objects.iter().enumerate() {
            if !partition.objects.contains(&i) {
                mark_unsuitable(mesh, &object.shape, margin, &mut numbers);
            }
        }
        contents.numbers = grids.intern(numbers);
        Some(TetrahedralVolume {
            mesh: mesh.clone(),
            contents,
        })
    }
}

/// Excludes the tetrahedra within a margin of which a surface may pass.
fn mark_unsuitable(mesh: &TetrahedralMesh, shape: &Shape, margin: f64, numbers: &mut [u8]) {
    shape.each_patch(|points| {
        let around = Aabb::around(points.iter().copied());
        if !(around.min.is_finite() && around.max.is_finite()) {
            numbers.fill(OTHER);
            return;
        }
        for number in mesh.near(&around.grown(margin)) {
            numbers[number] = OTHER;
        }
    });
}

impl WalkCells for TetrahedralVolume {
    type Cell = usize;
    type Face = usize;

    #[inline]
    fn contents(&self) -> &CellContents {
        &self.contents
    }

    #[inline]
    fn frame(&self) -> &CellFrame {
        &CellFrame::WORLD
    }

    fn cell_at(&self, place: DVec3) -> Option<usize> {
        self.mesh.at(place)
    }

    #[inline]
    fn number(cell: usize) -> usize {
        cell
    }

    #[inline]
    fn exit(&self, cell: usize, line: [DVec3; 2], length: f64) -> Option<(usize, f64)> {
        self.mesh.exit(cell, line, length)
    }

    #[inline]
    fn on_face(&self, _cell: usize, _face: usize, place: DVec3) -> DVec3 {
        place
    }

    #[inline]
    fn normal(&self, cell: usize, face: usize) -> DVec3 {
        self.mesh.normal(cell, face)
    }

    #[inline]
    fn beyond(&self, cell: usize, face: usize) -> BeyondFace<'_, usize> {
        let Some(next) = self.mesh.beyond(cell, face) else {
            return self.contents.exterior();
        };
        match self.contents.matter(next) {
            Some(matter) => BeyondFace::Cell(next, matter),
            None => BeyondFace::Unknown,
        }
    }

    fn inside(&self, cell: usize, place: DVec3, length: f64) -> DVec3 {
        self.mesh.inside(cell, place, length)
    }

    fn outside(&self, cell: usize, face: usize, place: DVec3, length: f64) -> DVec3 {
        // Normals point into the cell.
        place - self.mesh.normal(cell, face) * length
    }
}
