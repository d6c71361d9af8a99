//! Bounds over blocks of cells, stored so that bounds over large boxes need not visit every
//! coefficient.

use super::Bspline;
use super::lattice::PAD;
use crate::bounds::FieldBounds;

/// Smallest number of cells of a block along each axis. Blocks of larger grids have more cells, so
/// that [`MAX_BLOCKS`] blocks cover an axis.
const MIN_BLOCK_CELLS: usize = 8;
/// Maximum number of the smallest blocks along an axis, except blocks outside the samples.
const MAX_BLOCKS: usize = 32;
/// Number of blocks of cells outside the samples, at either end of each axis.
const OUTSIDE_BLOCKS: usize = 2;
/// Largest number of cells that are bounded exactly.
const MAX_EXACT_CELLS: usize = 1000;
/// Maximum number of blocks along each axis whose bounds are merged; blocks of the smallest size
/// that suffices are used.
const MAX_MERGED_BLOCKS: usize = 16;

/// A range of cells along each axis, both ends included.
pub(super) type Cells = [[isize; 2]; 3];

/// Blocks of several sizes, each twice as large as the previous.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Number of samples of the grid.
    samples: [usize; 3],
    levels: Vec<Level>,
}

/// Equal blocks of the cells between samples, x fastest. At both ends of each axis there are two
/// more: the first cell beyond, where the spline is continued, and the cells where the field bends
/// to a constant.
#[derive(Clone, Debug)]
struct Level {
    edge: usize,
    dims: [usize; 3],
    bounds: Vec<FieldBounds>,
}

/// Returns the number of cells in a range.
pub(super) fn count(cells: &Cells) -> usize {
    cells.iter().map(|[a, b]| (b - a + 1) as usize).product()
}

impl Blocks {
    /// Returns true if a range of cells is so large that blocks pay off.
    pub(super) fn pay(cells: &Cells) -> bool {
        count(cells) > MAX_EXACT_CELLS
    }

    /// Computes the blocks of a grid.
    pub(super) fn new(grid: &Bspline, samples: [usize; 3]) -> Self {
        let longest = samples.into_iter().max().unwrap_or(1);
        let edge = MIN_BLOCK_CELLS.max(longest.div_ceil(MAX_BLOCKS).next_power_of_two());
        let dims = samples.map(|n| (n - 1).div_ceil(edge) + 2 * OUTSIDE_BLOCKS);
        let block = |place: [usize; 3]| {
            grid.bounds_in(&std::array::from_fn(|axis| {
                let (end, beyond) = (samples[axis] as isize - 1, 2 + PAD as isize);
                match (place[axis], dims[axis] - place[axis]) {
                    (0, _) => [-beyond, -2],
                    (1, _) => [-1, -1],
                    (_, 1) => [end + 1, end + beyond],
                    (_, 2) => [end, end],
                    (i, _) => {
                        let start = ((i - OUTSIDE_BLOCKS) * edge) as isize;
                        [start, (start + edge as isize).min(end) - 1]
                    }
                }
            }))
        };
        let mut levels = vec![Level::from_fn(edge, dims, block)];
        while let Some(level) = levels
            .last()
            .filter(|l| l.dims.iter().any(|n| *n > MAX_MERGED_BLOCKS))
        {
            levels.push(level.coarser());
        }
        Blocks { samples, levels }
    }

    /// Returns bounds over a range of cells, and over the rest of the blocks that contain them.
    pub(super) fn bounds(&self, cells: &Cells) -> Option<FieldBounds> {
        let span = |level: &Level| level.span(cells, self.samples);
        let fits = |level: &&Level| span(level).iter().all(|[a, b]| b - a < MAX_MERGED_BLOCKS);
        let level = self.levels.iter().find(fits)?;
        level.union(span(level))
    }

    /// Returns the memory in bytes.
    pub(super) fn memory(&self) -> usize {
        let count: usize = self.levels.iter().map(|l| l.bounds.len()).sum();
        count * size_of::<FieldBounds>()
    }
}

impl Level {
    fn from_fn(edge: usize, dims: [usize; 3], bounds: impl Fn([usize; 3]) -> FieldBounds) -> Self {
        let [x, y, z] = dims;
        let places = (0..x * y * z).map(|i| [i % x, i / x % y, i / x / y]);
        Level {
            edge,
            dims,
            bounds: places.map(bounds).collect(),
        }
    }

    /// Merges blocks to twice the size; blocks beyond the samples stay.
    fn coarser(&self) -> Level {
        let dims = self
            .dims
            .map(|n| (n - 2 * OUTSIDE_BLOCKS).div_ceil(2) + 2 * OUTSIDE_BLOCKS);
        Level::from_fn(2 * self.edge, dims, |place| {
            let parts = std::array::from_fn(|axis| {
                let (i, from_end) = (place[axis], dims[axis] - place[axis]);
                let end = self.dims[axis];
                if i < OUTSIDE_BLOCKS {
                    [i, i]
                } else if from_end <= OUTSIDE_BLOCKS {
                    [end - from_end, end - from_end]
                } else {
                    let first = 2 * i - OUTSIDE_BLOCKS;
                    [first, (first + 1).min(end - OUTSIDE_BLOCKS - 1)]
                }
            });
            self.union(parts).unwrap_or(self.bounds[0])
        })
    }

    /// Returns the blocks that contain a range of cells, along each axis.
    fn span(&self, cells: &Cells, samples: [usize; 3]) -> [[usize; 2]; 3] {
        std::array::from_fn(|axis| {
            let (end, blocks) = (samples[axis] as isize - 1, self.dims[axis]);
            cells[axis].map(|c| match c {
                ..-1 => 0,
                -1 => 1,
                c if c < end => OUTSIDE_BLOCKS + c as usize / self.edge,
                c if c == end => blocks - 2,
                _ => blocks - 1,
            })
        })
    }

    fn union(&self, [xs, ys, zs]: [[usize; 2]; 3]) -> Option<FieldBounds> {
        let [x, y, _] = self.dims;
        let rows = (zs[0]..=zs[1]).flat_map(|k| (ys[0]..=ys[1]).map(move |j| (k * y + j) * x));
        let blocks = rows.flat_map(|row| &self.bounds[row + xs[0]..=row + xs[1]]);
        blocks.copied().reduce(FieldBounds::union)
    }
}
