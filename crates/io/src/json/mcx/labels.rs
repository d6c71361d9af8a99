//! Labels of voxels.

use crate::error::Problem;
use crate::input::Limits;
use crate::scene::{Numbers, Tensor};
use std::sync::Arc;

/// Peak memory per voxel in bytes: labels as read (4), as numbers of the scene (4), as whole
/// numbers (4), and as parts with the layers around them (1 + 1).
const BYTES_PER_VOXEL: u64 = 4 + 4 + 4 + 1 + 1;

/// Labels of voxels; x runs fastest.
pub(super) struct Labels {
    pub size: [usize; 3],
    pub data: Vec<f32>,
}

impl Labels {
    /// Converts the labels to an array `[z, y, x]`.
    pub(super) fn into_tensor(self) -> Option<Arc<Tensor>> {
        let [x, y, z] = self.size;
        let numbers = Numbers::Single(self.data);
        Tensor::new(vec![z, y, x], numbers).map(Arc::new).ok()
    }

    /// Returns the label at a position in voxels from the corner; 0 outside the volume.
    pub(super) fn at(&self, position: [f64; 3]) -> f32 {
        let inside = (0..3).all(|a| (0.0..self.size[a] as f64).contains(&position[a]));
        if !inside {
            return 0.0;
        }
        let [i, j, k] = position.map(|x| x as usize);
        self.data[i + self.size[0] * (j + self.size[1] * k)]
    }

    /// Fills a volume with one label.
    ///
    /// # Errors
    /// Returns an error if there are no voxels, or more than the memory limits allow.
    pub(super) fn filled(size: [usize; 3], label: f32, limits: Limits) -> Result<Self, Problem> {
        let count = size.iter().fold(1usize, |n, m| n.saturating_mul(*m));
        if count == 0 {
            return Err(Problem::Empty("a volume needs voxels".into()));
        }
        limits.check(count as u64, BYTES_PER_VOXEL, 0)?;
        let data = vec![label; count];
        Ok(Labels { size, data })
    }
}
