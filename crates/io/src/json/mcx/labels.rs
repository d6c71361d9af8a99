//! Labels of voxels.

use crate::scene::{Numbers, Tensor};
use std::sync::Arc;

/// The most voxels: those of 1290³.
const MOST: usize = 1 << 31;

/// Labels of voxels, x fastest.
pub(super) struct Labels {
    pub size: [usize; 3],
    pub data: Vec<f32>,
}

impl Labels {
    /// As an array `[z, y, x]`.
    pub(super) fn tensor(&self) -> Option<Arc<Tensor>> {
        let [x, y, z] = self.size;
        let numbers = Numbers::Single(self.data.clone());
        Tensor::new(vec![z, y, x], numbers).map(Arc::new).ok()
    }

    /// The label at a position in voxels from the corner; 0 outside.
    pub(super) fn at(&self, position: [f64; 3]) -> f32 {
        let inside = (0..3).all(|a| (0.0..self.size[a] as f64).contains(&position[a]));
        if !inside {
            return 0.0;
        }
        let [i, j, k] = position.map(|x| x as usize);
        self.data[i + self.size[0] * (j + self.size[1] * k)]
    }

    /// Volumes of one label.
    pub(super) fn filled(size: [usize; 3], label: f32) -> Option<Self> {
        let count = size.iter().try_fold(1usize, |n, m| n.checked_mul(*m));
        let count = count.filter(|n| (1..=MOST).contains(n))?;
        let data = vec![label; count];
        Some(Labels { size, data })
    }
}
