//! The divided volumes of a scene, prepared for walks from cell to cell
//! (docs/theory.md#walks-through-cells).

use super::Scene;
use super::cells::{CellContents, WalkCells};
use super::parts::MediumId;
use super::tetrahedra::TetrahedralVolume;
use super::voxels::VoxelVolume;

/// A volume of cells, each with matter of one index and uniform coefficients. At all faces between
/// cells of different indices, light is refracted, or passes straight on.
#[derive(Clone, Debug)]
pub enum CellVolume {
    /// Rectangular voxels.
    Voxels(Box<VoxelVolume>),
    /// Tetrahedra.
    Tetrahedra(TetrahedralVolume),
}

impl CellVolume {
    fn contents(&self) -> &CellContents {
        match self {
            CellVolume::Voxels(voxels) => voxels.contents(),
            CellVolume::Tetrahedra(tetrahedra) => tetrahedra.contents(),
        }
    }

    fn contents_mut(&mut self) -> &mut CellContents {
        match self {
            CellVolume::Voxels(voxels) => &mut voxels.contents,
            CellVolume::Tetrahedra(tetrahedra) => &mut tetrahedra.contents,
        }
    }

    /// Returns true if an object is a face of the volume.
    pub(crate) fn has_face(&self, object: usize) -> bool {
        self.contents().objects.contains(&object)
    }
}

/// The divided volumes of a scene through which walks can go from cell to cell.
#[derive(Clone, Debug)]
pub(super) struct CellVolumes {
    list: Vec<CellVolume>,
    /// For each medium, the volume to whose cells the medium belongs, if any.
    of_medium: Vec<Option<usize>>,
}

impl CellVolumes {
    fn of(scene: &Scene) -> Self {
        let (parts, matters) = (&scene.parts, scene.matters());
        let mut volumes = CellVolumes {
            list: Vec::new(),
            of_medium: vec![None; parts.media.len()],
        };
        let grids = &scene.geometry.walk_grids;
        for number in 0..parts.partitions.len() {
            let voxels = VoxelVolume::of(parts, matters, number, grids)
                .map(|voxels| CellVolume::Voxels(Box::new(voxels)));
            let volume = voxels.or_else(|| {
                let tetrahedra = TetrahedralVolume::of(parts, matters, number, grids);
                tetrahedra.map(CellVolume::Tetrahedra)
            });
            let Some(mut volume) = volume else {
                continue;
            };
            let contents = volume.contents_mut();
            // If other objects lie near the volume, the medium around it varies.
            let mut faces = contents.objects.clone();
            if faces.any(|face| scene.geometry.overlapping[face]) {
                contents.exterior_n = None;
            }
            for held in &contents.matters {
                volumes.of_medium[held.medium] = Some(volumes.list.len());
            }
            volumes.list.push(volume);
        }
        volumes
    }
}

impl Scene {
    /// Returns the volume to whose cells a medium belongs, if walks can go through it from cell to
    /// cell.
    #[inline]
    pub(crate) fn cell_volume(&self, medium: MediumId) -> Option<&CellVolume> {
        let volumes = self.cell_volumes.get_or_init(|| CellVolumes::of(self));
        Some(&volumes.list[volumes.of_medium[medium]?])
    }
}
