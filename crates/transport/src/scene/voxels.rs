//! Divided volumes with faces of voxels as surfaces, prepared for walks from voxel to voxel
//! (docs/theory.md#walks-through-cells).

use super::Scene;
use super::cells::{BeyondFace, CellContents, CellFrame, OTHER, WalkCells};
use super::matter::Matters;
use super::parts::{MediumId, Parts};
use crate::shape::Shape;
use crate::shared::Distinct;
use crate::volume::LabelGrid;
use eikonal::Aabb;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// Largest cosine, by rounding, between edges of voxels that are at right angles.
const MAX_COSINE: f64 = 1e-12;
/// Distance from other surfaces, in voxels, within which walks do not use voxels.
const SURFACE_MARGIN: f64 = 1e-6;

/// A volume of rectangular voxels, each with matter of one index and uniform coefficients.
#[derive(Clone, Debug)]
pub struct VoxelVolume {
    size: [usize; 3],
    to_world: DAffine3,
    frame: CellFrame,
    pub(super) contents: CellContents,
}

/// A voxel: its index, x fastest, and its lowest corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Voxel {
    index: usize,
    low: DVec3,
}

/// Face of a voxel: the axis across which it lies, and true for the upper of both faces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VoxelFace {
    axis: usize,
    is_upper: bool,
}

impl Scene {
    /// Returns the grid of the voxels of a medium: of labels, or of a volume that surfaces along
    /// voxels divide into media.
    pub(crate) fn voxels_of(&self, medium: MediumId) -> Option<Arc<LabelGrid>> {
        let voxels = self.parts.partitions.iter();
        let mut voxels = voxels.filter_map(|partition| partition.voxels());
        let voxels = voxels.find(|voxels| voxels.media().contains(&medium));
        let labels = self.medium(medium).labels.as_ref();
        voxels
            .map(|voxels| voxels.parts().clone())
            .or_else(|| labels.map(|labels| labels.grid().clone()))
    }
}

impl VoxelVolume {
    /// Prepares a divided volume. Returns `None` unless its faces are faces of rectangular voxels
    /// that refract all light or transmit all light straight on.
    pub(super) fn of(
        parts: &Parts,
        matters: &Matters,
        number: usize,
        grids: &Distinct<Vec<u8>>,
    ) -> Option<Self> {
        let partition = &parts.partitions[number];
        let voxels = partition.voxels()?;
        let (contents, own) = CellContents::of(parts, matters, partition, voxels.media())?;
        let grid = matters.voxels_of(number)?;
        let (size, to_world) = (grid.size(), grid.to_world());
        let cells = DVec3::from_array(size.map(|n| n as f64));
        let (axes, per_length) = edges(&to_world, cells)?;
        let mut volume = VoxelVolume {
            size,
            to_world,
            frame: CellFrame {
                to_cells: DAffine3::from_scale(cells) * to_world.inverse(),
                from_cells: to_world * DAffine3::from_scale(1.0 / cells),
                axes,
                per_length,
            },
            contents,
        };
        let matters = grid.labels().iter().map(|m| own[usize::from(*m)]);
        let mut numbers: Vec<u8> = matters.collect();
        for (i, object) in parts.objects.iter().enumerate() {
            if !partition.objects.contains(&i) {
                volume.mark_unsuitable(&object.shape, &mut numbers);
            }
        }
        volume.contents.numbers = grids.intern(numbers);
        Some(volume)
    }

    /// Excludes the voxels through which a surface may pass.
    fn mark_unsuitable(&self, shape: &Shape, numbers: &mut [u8]) {
        shape.each_patch(|points| self.mark_unsuitable_around(points, numbers));
    }

    /// Excludes the voxels near a box around points.
    fn mark_unsuitable_around(&self, points: &[DVec3], numbers: &mut [u8]) {
        let places = points.iter().map(|p| self.frame.in_cells(*p));
        let filled = Aabb::around(places);
        if !(filled.min.is_finite() && filled.max.is_finite()) {
            numbers.fill(OTHER);
            return;
        }
        let (first, end) = (filled.min - SURFACE_MARGIN, filled.max + SURFACE_MARGIN);
        let range = |axis: usize| {
            let n = self.size[axis] as f64;
            let end = (end[axis].floor() + 1.0).clamp(0.0, n) as usize;
            (first[axis].floor().clamp(0.0, n) as usize).min(end)..end
        };
        let [x, y, z] = [range(0), range(1), range(2)];
        for row in z.flat_map(|k| y.clone().map(move |j| (j, k))) {
            let first = self.size[0] * (row.0 + self.size[1] * row.1);
            numbers[first + x.start..first + x.end].fill(OTHER);
        }
    }

    /// Returns the number of voxels along x, y, z.
    pub(crate) fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the map from the unit cube to the world.
    pub(crate) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Returns a length along an axis in voxels, limited to a quarter of a voxel, for scenes that are
    /// very large compared with a voxel.
    fn hair(&self, axis: usize, length: f64) -> f64 {
        (length * self.frame.per_length[axis]).min(0.25)
    }
}

impl WalkCells for VoxelVolume {
    type Cell = Voxel;
    type Face = VoxelFace;

    #[inline]
    fn contents(&self) -> &CellContents {
        &self.contents
    }

    #[inline]
    fn frame(&self) -> &CellFrame {
        &self.frame
    }

    fn cell_at(&self, place: DVec3) -> Option<Voxel> {
        let low = place.floor();
        let index = |axis: usize| {
            let inside = (0.0..self.size[axis] as f64).contains(&low[axis]);
            inside.then_some(low[axis] as usize)
        };
        let index = index(0)? + self.size[0] * (index(1)? + self.size[1] * index(2)?);
        Some(Voxel { index, low })
    }

    #[inline]
    fn number(cell: Voxel) -> usize {
        cell.index
    }

    #[inline]
    fn exit(
        &self,
        cell: Voxel,
        [place, speed]: [DVec3; 2],
        length: f64,
    ) -> Option<(VoxelFace, f64)> {
        let within = place + speed * length - cell.low;
        let inside = |p: f64| (0.0..=1.0).contains(&p);
        if inside(within.x) && inside(within.y) && inside(within.z) {
            return None;
        }
        let length = |axis: usize| match speed[axis] {
            0.0 => f64::INFINITY,
            v if v > 0.0 => (cell.low[axis] + 1.0 - place[axis]) / v,
            v => (cell.low[axis] - place[axis]) / v,
        };
        let [x, y, z] = [length(0), length(1), length(2)];
        let (axis, length) = match (x <= y, x <= z, y <= z) {
            (true, true, _) => (0, x),
            (_, _, true) => (1, y),
            _ => (2, z),
        };
        let is_upper = speed[axis] > 0.0;
        // Rounding may put the position slightly beyond a face.
        Some((VoxelFace { axis, is_upper }, length.max(0.0)))
    }

    #[inline]
    fn on_face(&self, cell: Voxel, face: VoxelFace, mut place: DVec3) -> DVec3 {
        place[face.axis] = cell.low[face.axis] + f64::from(u8::from(face.is_upper));
        place
    }

    #[inline]
    fn normal(&self, _cell: Voxel, face: VoxelFace) -> DVec3 {
        DVec3::AXES[face.axis]
    }

    #[inline]
    fn beyond(&self, cell: Voxel, face: VoxelFace) -> BeyondFace<'_, Voxel> {
        let VoxelFace { axis, is_upper } = face;
        let stride = [1, self.size[0], self.size[0] * self.size[1]][axis];
        let mut low = cell.low;
        let (is_last, index) = if is_upper {
            let is_last = low[axis] + 1.0 >= self.size[axis] as f64;
            (is_last, cell.index.wrapping_add(stride))
        } else {
            (low[axis] <= 0.0, cell.index.wrapping_sub(stride))
        };
        if is_last {
            return self.contents.exterior();
        }
        low[axis] += if is_upper { 1.0 } else { -1.0 };
        match self.contents.matter(index) {
            Some(matter) => BeyondFace::Cell(Voxel { index, low }, matter),
            None => BeyondFace::Unknown,
        }
    }

    fn inside(&self, cell: Voxel, place: DVec3, length: f64) -> DVec3 {
        let inwards = |axis: usize| {
            let (low, hair) = (cell.low[axis], self.hair(axis, length));
            place[axis].clamp(low + hair, low + 1.0 - hair)
        };
        DVec3::new(inwards(0), inwards(1), inwards(2))
    }

    fn outside(&self, _cell: Voxel, face: VoxelFace, mut place: DVec3, length: f64) -> DVec3 {
        let hair = self.hair(face.axis, length);
        place[face.axis] += if face.is_upper { hair } else { -hair };
        place
    }
}

/// Returns unit vectors along the edges of voxels and the reciprocal lengths of the edges, if the
/// edges are at right angles.
fn edges(to_world: &DAffine3, cells: DVec3) -> Option<(DMat3, DVec3)> {
    let sides = to_world.matrix3;
    let lengths = DVec3::new(
        sides.x_axis.length(),
        sides.y_axis.length(),
        sides.z_axis.length(),
    );
    let axes = sides * DMat3::from_diagonal(1.0 / lengths);
    let cosines = [
        axes.x_axis.dot(axes.y_axis),
        axes.y_axis.dot(axes.z_axis),
        axes.z_axis.dot(axes.x_axis),
    ];
    let is_square = cosines.iter().all(|cos| cos.abs() < MAX_COSINE);
    is_square.then(|| (axes, cells / lengths))
}
