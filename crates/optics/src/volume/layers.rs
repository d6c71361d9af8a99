//! Distances from each cell to the nearest full or different cell, and traversal of lines that
//! skips these distances.

use glam::DVec3;

/// Computes distances to the nearest full cell, measured by the largest coordinate difference, at
/// most 254. On input, `layers` is 0 in full cells and `u8::MAX` elsewhere, x fastest; on output it
/// holds the distances. Cells outside the grid count as full. Two scans suffice, one forwards and
/// one backwards (A. Rosenfeld and J. L. Pfaltz, "Distance functions on digital pictures", Pattern
/// Recognition 1968).
pub fn spread(size: [usize; 3], layers: &mut [u8]) {
    let [nx, ny, nz] = size;
    let is_edge = |i: usize, n: usize| i == 0 || i + 1 == n;
    let mut near = vec![0; nx];
    let mut visit = |layers: &mut [u8], j: usize, k: usize, forwards: bool| {
        let first = nx * (j + ny * k);
        if is_edge(j, ny) || is_edge(k, nz) {
            layers[first..first + nx]
                .iter_mut()
                .for_each(|l| *l = (*l).min(1));
            return;
        }
        // Collect the rows that the scan has passed: three in the previous plane, and the previous
        // row.
        let steps = [nx * ny - nx, nx * ny, nx * ny + nx, nx];
        let rows = steps.map(|step| if forwards { first - step } else { first + step });
        for (i, near) in near.iter_mut().enumerate() {
            *near = rows
                .iter()
                .fold(u8::MAX, |least, row| least.min(layers[row + i]));
        }
        // Scan the row.
        let row = &mut layers[first..first + nx];
        let mut one = |i: usize, before: u8| {
            let least = if is_edge(i, nx) {
                0
            } else {
                before.min(near[i - 1]).min(near[i]).min(near[i + 1])
            };
            row[i] = row[i].min(least.saturating_add(1)).min(u8::MAX - 1);
            row[i]
        };
        if forwards {
            (0..nx).fold(0, |before, i| one(i, before));
        } else {
            (0..nx).rev().fold(0, |before, i| one(i, before));
        }
    };
    for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
        visit(layers, j, k, true);
    }
    for (k, j) in (0..nz)
        .rev()
        .flat_map(|k| (0..ny).rev().map(move |j| (k, j)))
    {
        visit(layers, j, k, false);
    }
}

/// Constant 1.5 · 2⁵². Adding it rounds a number below 2⁵¹ to an integer, which is then in the bits
/// of [`MANTISSA`].
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// Mask of the bits that hold the integer after adding [`ROUNDER`].
const MANTISSA: u64 = (1 << 51) - 1;

/// Returns the lowest corner of the cell that contains a point, in units of cells. A point of a
/// face may be assigned to either cell.
#[inline]
pub fn cell_of(p: DVec3) -> DVec3 {
    // Conversion to integers would take several times as long.
    p - 0.5 + ROUNDER - ROUNDER
}

/// Returns the index of a cell in a lattice of `size` cells, x fastest; `None` outside.
#[inline]
pub fn number_of(cell: DVec3, size: DVec3) -> Option<usize> {
    let inside = cell.x >= 0.0
        && cell.y >= 0.0
        && cell.z >= 0.0
        && cell.x < size.x
        && cell.y < size.y
        && cell.z < size.z;
    let number = cell.x + size.x * (cell.y + size.y * cell.z);
    inside.then(|| ((number + ROUNDER).to_bits() & MANTISSA) as usize)
}

/// Line through a lattice of cells, traversed from one cube of equal cells to the next.
#[derive(Clone, Debug)]
pub struct Leaps<'l> {
    size: DVec3,
    /// For each cell, the number of layers of equal cells around it, x fastest. The layers never extend
    /// beyond the lattice.
    layers: &'l [u8],
    /// Start of the line, in cells from the corner of the lattice.
    start: DVec3,
    /// Direction, in cells per unit of length.
    direction: DVec3,
    /// Lowest corner of the cell at the centre of the current cube.
    cell: DVec3,
}

impl<'l> Leaps<'l> {
    /// Creates the line from its start, in cells from the corner of the lattice, and its direction
    /// per unit of length.
    #[inline]
    pub fn new(size: DVec3, layers: &'l [u8], [start, direction]: [DVec3; 2]) -> Self {
        Leaps {
            size,
            layers,
            start,
            direction,
            cell: cell_of(start),
        }
    }

    /// Returns the cell at the centre of the current cube; `None` outside the lattice.
    #[inline]
    pub fn cell(&self) -> Option<usize> {
        number_of(self.cell, self.size)
    }

    /// Returns true if the line is still in the cube around `cell`, the result of [`Leaps::cell`],
    /// after a length.
    #[inline]
    pub fn stays(&self, cell: usize, length: f64) -> bool {
        let layers = f64::from(self.layers[cell]);
        let within = self.start + self.direction * length - self.cell;
        let stays = |p: f64| p >= -layers && p <= layers + 1.0;
        stays(within.x) && stays(within.y) && stays(within.z)
    }

    /// Moves on to the cube behind the cube around `cell`, the result of [`Leaps::cell`]. Returns
    /// the length at which the line enters the new cube. By rounding, this length may be less than
    /// the length of the previous leap.
    #[inline]
    pub fn leap(&mut self, cell: usize) -> f64 {
        let layers = f64::from(self.layers[cell]);
        let (low, high) = (self.cell - layers, self.cell + layers);
        let length = |axis: usize| match self.direction[axis] {
            0.0 => f64::INFINITY,
            speed if speed > 0.0 => (high[axis] + 1.0 - self.start[axis]) / speed,
            speed => (low[axis] - self.start[axis]) / speed,
        };
        let (mut exit, mut through) = (f64::INFINITY, 0);
        for axis in 0..3 {
            if length(axis) < exit {
                (exit, through) = (length(axis), axis);
            }
        }
        // Enter the cell beyond the exit face. Never move backwards, whatever rounding does.
        let to = cell_of(self.start + self.direction * exit);
        for axis in 0..3 {
            let (ahead, from) = (self.direction[axis] > 0.0, self.cell[axis]);
            self.cell[axis] = match (axis == through, ahead) {
                (true, true) => high[axis] + 1.0,
                (true, false) => low[axis] - 1.0,
                (false, true) => to[axis].clamp(from, high[axis]),
                (false, false) => to[axis].clamp(low[axis], from),
            };
        }
        exit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_distances_to_full_cells_and_what_is_beyond() {
        let size = [9, 7, 8];
        let full = |at: [i32; 3]| [[2, 2, 3], [7, 5, 1]].contains(&at);
        let place = |cell: i32| [cell % 9, cell / 9 % 7, cell / 63];
        let mut layers: Vec<u8> = (0..504)
            .map(|c| if full(place(c)) { 0 } else { u8::MAX })
            .collect();
        spread(size, &mut layers);
        for cell in 0..504 {
            let at = place(cell);
            let mut least = i32::MAX;
            for other in [[2, 2, 3], [7, 5, 1]] {
                let distance = (0..3).map(|a| (at[a] - other[a]).abs()).max().unwrap();
                least = least.min(distance);
            }
            for axis in 0..3 {
                least = least.min(at[axis] + 1).min(size[axis] as i32 - at[axis]);
            }
            assert_eq!(i32::from(layers[cell as usize]), least, "{at:?}");
        }
    }
}
