//! Length scales at nodes of a grid, interpolated linearly between them.

use super::cells;
use glam::DVec3;

/// Length scales at nodes, with limited slopes, so that the interpolant is 1-Lipschitz.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lengths {
    /// Number of nodes along each axis, at least two.
    nodes: [usize; 3],
    /// Last place, in units of the spacing from node 0, just within the last cell.
    last: DVec3,
    /// Length scales of the nodes, x fastest.
    lengths: Vec<f64>,
}

impl Lengths {
    /// Stores lengths at nodes with the given spacing along each axis. Lengths that exceed the
    /// slopes allowed by their neighbours are shortened.
    pub(super) fn new(nodes: [usize; 3], spacing: DVec3, lengths: Vec<f64>) -> Self {
        let last = DVec3::from_array(nodes.map(|n| (n - 1) as f64));
        let mut lengths = Lengths {
            nodes,
            last: last * (1.0 - f64::EPSILON),
            lengths,
        };
        for axis in 0..3 {
            lengths.limit(axis, spacing[axis]);
        }
        lengths
    }

    /// Limits the slope along an axis to 1/√3, with nodes at distance `apart`. The slope along the
    /// diagonal is then at most 1.
    fn limit(&mut self, axis: usize, apart: f64) {
        let [x, y, _] = self.nodes;
        let stride = [1, x, x * y][axis];
        let rise = apart / 3f64.sqrt();
        let along = |at: usize| at / stride % self.nodes[axis];
        for at in 0..self.lengths.len() {
            if along(at) > 0 {
                self.lengths[at] = self.lengths[at].min(self.lengths[at - stride] + rise);
            }
        }
        for at in (0..self.lengths.len()).rev() {
            if along(at) + 1 < self.nodes[axis] {
                self.lengths[at] = self.lengths[at].min(self.lengths[at + stride] + rise);
            }
        }
    }

    /// Interpolates at a position in units of the spacing from node 0; beyond the nodes, at the
    /// nearest place among them.
    #[inline(always)]
    pub(super) fn at(&self, t: DVec3) -> f64 {
        let [x, y, _] = self.nodes;
        let (cell, DVec3 { x: u, y: v, z: w }) = cells::located(t.max(DVec3::ZERO).min(self.last));
        let [i, j, k] = cell.map(|i| i as usize);
        let row = |j: usize, k: usize| {
            let at = (k * y + j) * x + i;
            let pair = &self.lengths[at..at + 2];
            pair[0] + (pair[1] - pair[0]) * u
        };
        let plane = |k: usize| {
            let a = row(j, k);
            a + (row(j + 1, k) - a) * v
        };
        let a = plane(k);
        a + (plane(k + 1) - a) * w
    }

    /// Returns the memory in bytes.
    pub(super) fn memory(&self) -> usize {
        self.lengths.len() * size_of::<f64>()
    }
}
