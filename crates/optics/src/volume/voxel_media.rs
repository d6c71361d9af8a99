//! Media of voxels.

use super::labels::LabelGrid;
use eikonal::Aabb;
use glam::DVec3;
use std::sync::Arc;

/// The medium of each voxel of a volume, by its number in the scene.
#[derive(Clone, Debug)]
pub struct VoxelMedia {
    parts: Arc<LabelGrid>,
    media: Vec<usize>,
    aabb: Aabb,
}

/// Cubes of voxels of one medium through which a line is followed.
const MOST_STEPS: usize = 16;

impl VoxelMedia {
    /// `parts` has for each voxel 1 + the place of its medium in `media`, or 0 where the medium is that around the volume.
    pub fn new(parts: impl Into<Arc<LabelGrid>>, media: Vec<usize>) -> Self {
        let parts = parts.into();
        let unit = Aabb::new(DVec3::ZERO, DVec3::ONE).corners();
        let to_world = parts.to_world();
        VoxelMedia {
            aabb: Aabb::around(unit.map(|p| to_world.transform_point3(p))),
            parts,
            media,
        }
    }

    /// For each voxel 1 + the place of its medium in [`VoxelMedia::media`], or 0.
    pub fn parts(&self) -> &LabelGrid {
        &self.parts
    }

    /// The media of its voxels.
    pub fn media(&self) -> &[usize] {
        &self.media
    }

    /// Returns whether voxels have the same media, the grid of their parts being one in memory.
    pub fn is_same(&self, other: &VoxelMedia) -> bool {
        Arc::ptr_eq(&self.parts, &other.parts) && self.media == other.media
    }

    /// The medium of a voxel; `None` if it is that around the volume.
    pub fn of_voxel(&self, voxel: usize) -> Option<usize> {
        self.medium(self.parts.labels()[voxel])
    }

    /// The medium at a point; `None` if it is that around the volume, or outside.
    pub fn at(&self, x: DVec3) -> Option<usize> {
        self.medium(self.parts.within(x)?)
    }

    fn medium(&self, part: u8) -> Option<usize> {
        let place = usize::from(part).checked_sub(1)?;
        self.media.get(place).copied()
    }

    /// Whether a straight line from `x`, which is in a medium, in a unit direction is known to stay in the voxels of that medium over a
    /// length, or outside of the volume.
    pub fn holds(&self, medium: usize, [x, direction]: [DVec3; 2], length: f64) -> bool {
        if !Aabb::around([x, x + direction * length]).overlaps(&self.aabb) {
            return true;
        }
        let mut line = self.parts.along(x, direction);
        for _ in 0..MOST_STEPS {
            match line.cell() {
                // By rounding a point of a face may lie in the voxel beyond.
                Some(voxel) if self.medium(self.parts.labels()[voxel]) == Some(medium) => {
                    if line.stays(voxel, length) {
                        return true;
                    }
                    line.leap(voxel);
                }
                _ => return false,
            }
        }
        false
    }
}
