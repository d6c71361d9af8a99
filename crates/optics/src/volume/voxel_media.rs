//! Media of voxels.

use super::labels::LabelGrid;
use eikonal::Aabb;
use glam::DVec3;
use std::sync::Arc;

/// Medium of each voxel of a volume, as an index into the media of the scene.
#[derive(Clone, Debug)]
pub struct VoxelMedia {
    parts: Arc<LabelGrid>,
    media: Vec<usize>,
    aabb: Aabb,
}

/// Maximum number of cubes of voxels through which a line is followed.
const MAX_STEPS: usize = 16;

impl VoxelMedia {
    /// Creates the media of voxels. `parts` holds for each voxel 1 + the index of its medium in
    /// `media`, or 0 for the medium around the volume.
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

    /// Returns, for each voxel, 1 + the index of its medium in [`VoxelMedia::media`], or 0 for the
    /// medium around the volume.
    pub fn parts(&self) -> &Arc<LabelGrid> {
        &self.parts
    }

    /// Returns the media of the voxels.
    pub fn media(&self) -> &[usize] {
        &self.media
    }

    /// Returns true if the media are equal and the grids of parts are one in memory.
    pub fn is_same(&self, other: &VoxelMedia) -> bool {
        Arc::ptr_eq(&self.parts, &other.parts) && self.media == other.media
    }

    /// Returns the medium of a voxel; `None` for the medium around the volume.
    pub fn of_voxel(&self, voxel: usize) -> Option<usize> {
        self.medium(self.parts.labels()[voxel])
    }

    /// Returns the medium at a point; `None` outside the volume or for the medium around it.
    pub fn at(&self, x: DVec3) -> Option<usize> {
        self.medium(self.parts.within(x)?)
    }

    fn medium(&self, part: u8) -> Option<usize> {
        let place = usize::from(part).checked_sub(1)?;
        self.media.get(place).copied()
    }

    /// Returns true if a straight line is known to stay in voxels of `medium` or outside the volume
    /// over a length. The line starts at `x`, a point in `medium`, along a unit direction.
    pub fn holds(&self, medium: usize, [x, direction]: [DVec3; 2], length: f64) -> bool {
        if !Aabb::around([x, x + direction * length]).overlaps(&self.aabb) {
            return true;
        }
        let mut line = self.parts.along(x, direction);
        for _ in 0..MAX_STEPS {
            match line.cell() {
                // Rounding may place a point on a face in the voxel beyond.
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
