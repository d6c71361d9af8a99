//! Traversal of the cells of a grid along a line, in order (J. Amanatides and A. Woo, "A Fast Voxel
//! Traversal Algorithm for Ray Tracing", Eurographics 1987).

use super::grid::{Cell, VolumeGrid};
use glam::DVec3;

/// Iterator over the cells that a line crosses, each with its range of θ.
pub(super) struct Cells {
    cell: Cell,
    /// Parameter θ at which the line leaves the cell across each axis.
    leaves: [f64; 3],
    start: [f64; 3],
    inverse: [f64; 3],
    /// First and last plane between cells across each axis.
    planes: [[i32; 2]; 3],
    from: f64,
    end: f64,
}

impl Cells {
    /// Creates the traversal of a grid over a range of θ, along the line from `start` by `step` in
    /// units of cells.
    pub(super) fn new(grid: &VolumeGrid, [start, step]: [DVec3; 2], [from, end]: [f64; 2]) -> Self {
        let (planes, first) = (grid.planes(), start + step * from);
        let mut cells = Cells {
            cell: std::array::from_fn(|axis| {
                let [lowest, last] = planes[axis];
                (first[axis].floor() as i32).clamp(lowest - 1, last)
            }),
            leaves: [0.0; 3],
            start: start.to_array(),
            inverse: step.recip().to_array(),
            planes,
            from,
            end,
        };
        cells.leaves = std::array::from_fn(|axis| cells.leave(axis));
        cells
    }

    /// Returns the θ at which the line leaves the current cell across an axis.
    #[inline]
    fn leave(&self, axis: usize) -> f64 {
        let up = self.inverse[axis] > 0.0;
        let plane = self.cell[axis] + i32::from(up);
        let [first, last] = self.planes[axis];
        if plane >= first && plane <= last && self.inverse[axis].is_finite() {
            (f64::from(plane) - self.start[axis]) * self.inverse[axis]
        } else {
            f64::INFINITY
        }
    }
}

impl Iterator for Cells {
    type Item = (Cell, [f64; 2]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        if self.from >= self.end {
            return None;
        }
        let [x, y, z] = self.leaves;
        let axis = match (x <= y, x <= z, y <= z) {
            (true, true, _) => 0,
            (false, _, true) => 1,
            _ => 2,
        };
        let range = [self.from, self.leaves[axis].clamp(self.from, self.end)];
        let cell = self.cell;
        self.cell[axis] += if self.inverse[axis] > 0.0 { 1 } else { -1 };
        self.leaves[axis] = self.leave(axis);
        self.from = range[1];
        Some((cell, range))
    }
}
