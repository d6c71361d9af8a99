//! Labels of voxels.

use super::error::GridError;
use super::lattice::to_samples;
use eikonal::field::Placement;
use glam::{DAffine3, DVec3};

/// A label, 0 to 255, for each voxel of the unit cube under an affine map. Beyond the cube the outermost voxels go on.
#[derive(Clone, Debug)]
pub struct LabelGrid {
    size: [usize; 3],
    /// x fastest.
    labels: Vec<u8>,
    to_world: DAffine3,
    to_voxels: DAffine3,
}

impl LabelGrid {
    /// `labels` of `size` = (nx, ny, nz) voxels, x fastest; `to_world` maps the unit cube to its place.
    ///
    /// # Errors
    ///
    /// A size of zero or another number of labels, a map that cannot be inverted.
    pub fn new(size: [usize; 3], labels: Vec<u8>, to_world: DAffine3) -> Result<Self, GridError> {
        let [x, y, z] = size;
        if size.contains(&0) {
            return Err(GridError::Empty(x, y, z));
        }
        if labels.len() != x * y * z {
            return Err(GridError::Length {
                expected: x * y * z,
                found: labels.len(),
            });
        }
        let det = to_world.matrix3.determinant();
        if !(det.is_finite() && det != 0.0) {
            return Err(GridError::Singular);
        }
        Ok(LabelGrid {
            size,
            labels,
            to_world,
            to_voxels: to_samples(size, Placement::Centers) * to_world.inverse(),
        })
    }

    /// The label at a world position.
    #[inline]
    pub fn at(&self, x: DVec3) -> u8 {
        let place = self.to_voxels.transform_point3(x).to_array();
        let [i, j, k] = std::array::from_fn(|axis| {
            let last = (self.size[axis] - 1) as f64;
            (place[axis] + 0.5).floor().clamp(0.0, last) as usize
        });
        self.labels[i + self.size[0] * (j + self.size[1] * k)]
    }

    /// Number of voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The labels, x fastest.
    pub fn labels(&self) -> &[u8] {
        &self.labels
    }

    /// From the unit cube to the world.
    pub fn to_world(&self) -> DAffine3 {
        self.to_world
    }

    /// Bytes held by the labels.
    pub fn memory(&self) -> usize {
        self.labels.len()
    }
}
