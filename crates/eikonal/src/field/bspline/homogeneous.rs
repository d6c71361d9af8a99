//! Parts of grids where the field does not change, so that rays are straight lines.

use super::lattice::{Lattice, first_coefficient};
use super::values::Values;
use fearless_simd::dispatch;
use glam::DVec3;
use std::ops::Range;

/// Number of cells of a block along each axis.
const BLOCK_CELLS: usize = 8;
/// Difference of coefficients, relative to the largest coefficient, below which they count as
/// equal. Rounding of samples is five orders of magnitude larger. The value determines how soon the
/// ripples around a change have decayed.
const COEFFICIENT_TOLERANCE: f64 = 1.0 / (1u64 << 40) as f64;

/// Largest weight of a sample in a coefficient that acts in a block, by the number of blocks
/// between them. Each weight is relative to the previous weight. A sample at a distance of n
/// samples has the weight (2 − √3)ⁿ. n is 6 for samples beyond a neighbouring block. The factor 10
/// is for the sums along three axes.
const MAX_SAMPLE_WEIGHTS: [f64; 3] = [10.0 * 3.7e-4, 2.7e-5, 2.7e-5];

/// Blocks of cells with equal coefficients.
#[derive(Clone, Debug)]
pub(super) struct HomogeneousBlocks {
    lattice: Lattice,
    /// Number of blocks along each axis.
    dims: [usize; 3],
    /// Number of cells along each axis.
    cells: DVec3,
    /// For each block, x fastest, the number of layers of blocks around its middle that have equal
    /// coefficients; 0 if its own coefficients differ.
    layers: Vec<u8>,
}

impl HomogeneousBlocks {
    /// Finds the blocks from coefficients in rows; `None` if there is no such block.
    pub(super) fn new(lattice: &Lattice, coefficients: &[f32]) -> Option<Self> {
        let dims = blocks(lattice);
        let ranges = dispatch!(crate::lanes::level(), _simd => ranges(lattice, coefficients, dims));
        let largest = |m: f32, [low, high]: &[f32; 2]| m.max(low.abs()).max(high.abs());
        let limit = COEFFICIENT_TOLERANCE * f64::from(ranges.iter().fold(0.0, largest));
        let is_still = |[low, high]: &[f32; 2]| f64::from(*high) - f64::from(*low) <= limit;
        Self::of_still(lattice, ranges.iter().map(is_still))
    }

    /// Finds the blocks of the spline through samples from the samples alone. Blocks with
    /// coefficients that may differ do not count as homogeneous.
    pub(super) fn of_samples(lattice: &Lattice, values: &impl Values) -> Option<Self> {
        let dims = blocks(lattice);
        let mut ranges = ranges_of_samples(values, dims);
        let largest = |m: f64, [low, high]: &[f64; 2]| m.max(low.abs()).max(high.abs());
        let mut limit = COEFFICIENT_TOLERANCE * ranges.iter().fold(0.0, largest);
        let mut still = vec![true; ranges.len()];
        let mut shares = MAX_SAMPLE_WEIGHTS.into_iter();
        loop {
            // Extend the range to samples one block further away.
            (0..3).for_each(|axis| widen(&mut ranges, dims, axis));
            for (still, [low, high]) in still.iter_mut().zip(&ranges) {
                // Planted error "condensed grids still up to the bump in them", found by morgana-eikonal/eikonal::condensed::samples_themselves_say_which_are_needed:
                // *still &= high - low <= 1e12 * limit;
                *still &= high - low <= limit;
            }
            let Some(share) = shares.next() else { break };
            limit /= share;
        }
        Self::of_still(lattice, still.into_iter())
    }

    /// Creates the blocks from flags of still blocks, x fastest; `None` if none is still.
    fn of_still(lattice: &Lattice, still: impl Iterator<Item = bool>) -> Option<Self> {
        let dims = blocks(lattice);
        let mut layers: Vec<u8> = still.map(|still| if still { u8::MAX } else { 0 }).collect();
        if !layers.contains(&u8::MAX) {
            return None;
        }
        for axis in 0..3 {
            spread(&mut layers, dims, axis);
        }
        let cells = DVec3::from_array(cells(lattice).map(|n| n as f64));
        Some(HomogeneousBlocks {
            lattice: lattice.clone(),
            dims,
            cells,
            layers,
        })
    }

    /// Returns the span of a line from `x`, in units of `v`, within the equal blocks around it;
    /// zero if there are none.
    pub(super) fn span(&self, x: DVec3, v: DVec3) -> f64 {
        let t = self.lattice.coordinates(x);
        let v = v * self.lattice.per_spacing();
        let inside = t.cmpge(DVec3::ZERO) & t.cmple(self.cells);
        if !inside.all() {
            return 0.0;
        }
        let [x, y, _] = self.dims;
        let block = [0, 1, 2].map(|a| (t[a] as usize / BLOCK_CELLS).min(self.dims[a] - 1));
        let layers = self.layers[(block[2] * y + block[1]) * x + block[0]];
        if layers == 0 {
            return 0.0;
        }
        let (edge, layers) = (BLOCK_CELLS as f64, f64::from(layers));
        let middle = DVec3::from_array(block.map(|b| b as f64));
        // Planted error "parts of a grid taken for unchanging one block too far", found by morgana-eikonal/eikonal::homogeneous::nothing_changes_where_nothing_is_said_to_change:
        // let low = ((middle - layers) * edge).max(DVec3::ZERO);
        let low = ((middle + 1.0 - layers) * edge).max(DVec3::ZERO);
        let high = ((middle + layers) * edge).min(self.cells);
        let exit = |a: usize| match v[a] {
            v if v > 0.0 => (high[a] - t[a]) / v,
            v if v < 0.0 => (low[a] - t[a]) / v,
            _ => f64::INFINITY,
        };
        exit(0).min(exit(1)).min(exit(2))
    }

    /// Returns the memory in bytes.
    pub(super) fn memory(&self) -> usize {
        self.layers.len()
    }
}

/// Returns the number of cells along each axis.
fn cells(lattice: &Lattice) -> [usize; 3] {
    lattice.dims().map(|n| (n - 1).max(1))
}

/// Returns the number of blocks along each axis.
fn blocks(lattice: &Lattice) -> [usize; 3] {
    cells(lattice).map(|n| n.div_ceil(BLOCK_CELLS))
}

/// Returns the smallest and the largest sample in each block, x fastest.
fn ranges_of_samples(values: &impl Values, [x, y, z]: [usize; 3]) -> Vec<[f64; 2]> {
    let [width, height, planes] = values.dims();
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; x * y * z];
    let mut plane = vec![0.0; width * height];
    for k in 0..planes {
        values.plane(k, &mut plane);
        for (j, row) in plane.chunks_exact(width).enumerate() {
            let first = ((k / BLOCK_CELLS).min(z - 1) * y + (j / BLOCK_CELLS).min(y - 1)) * x;
            for (a, some) in row.chunks(BLOCK_CELLS).enumerate() {
                let [low, high] = &mut ranges[first + a.min(x - 1)];
                *low = some.iter().copied().fold(*low, f64::min);
                *high = some.iter().copied().fold(*high, f64::max);
            }
        }
    }
    ranges
}

/// Extends the range of each block by the ranges of its neighbours along an axis.
fn widen(ranges: &mut [[f64; 2]], dims: [usize; 3], axis: usize) {
    let stride = [1, dims[0], dims[0] * dims[1]][axis];
    let before = ranges.to_vec();
    for (at, [low, high]) in ranges.iter_mut().enumerate() {
        let place = at / stride % dims[axis];
        let lower = (place > 0).then(|| before[at - stride]);
        let upper = (place + 1 < dims[axis]).then(|| before[at + stride]);
        for [other_low, other_high] in lower.into_iter().chain(upper) {
            *low = low.min(other_low);
            *high = high.max(other_high);
        }
    }
}

/// Returns the smallest and the largest coefficient that acts in each block, x fastest.
#[inline(always)]
fn ranges(lattice: &Lattice, coefficients: &[f32], [x, y, z]: [usize; 3]) -> Vec<[f32; 2]> {
    let size = lattice.stored_dims();
    let mut ranges = Vec::with_capacity(x * y * z);
    // Compute the range of each coefficient over the rows that act in blocks (b, c).
    let (mut low, mut high) = (vec![0.0_f32; size[0]], vec![0.0_f32; size[0]]);
    for c in 0..z {
        for b in 0..y {
            low.fill(f32::INFINITY);
            high.fill(f32::NEG_INFINITY);
            for k in acting(c, size[2]) {
                for j in acting(b, size[1]) {
                    let start = lattice.offset([0, j, k]);
                    let row = &coefficients[start..start + size[0]];
                    for ((low, high), v) in low.iter_mut().zip(&mut high).zip(row) {
                        *low = if *v < *low { *v } else { *low };
                        *high = if *v > *high { *v } else { *high };
                    }
                }
            }
            ranges.extend((0..x).map(|a| {
                let acting = acting(a, size[0]);
                let least = low[acting.clone()].iter().copied();
                let greatest = high[acting].iter().copied();
                [
                    least.fold(f32::INFINITY, f32::min),
                    greatest.fold(f32::NEG_INFINITY, f32::max),
                ]
            }));
        }
    }
    ranges
}

/// Returns the stored coefficients, out of `stored`, that act in a block.
fn acting(block: usize, stored: usize) -> Range<usize> {
    let first = first_coefficient((block * BLOCK_CELLS) as isize) as usize;
    first.min(stored)..(first + BLOCK_CELLS + 3).min(stored)
}

/// Computes the distance of each block to the nearest block with value zero, given the distances
/// along the earlier axes. The distance is the largest of the three coordinate differences.
fn spread(layers: &mut [u8], dims: [usize; 3], axis: usize) {
    let stride = [1, dims[0], dims[0] * dims[1]][axis];
    let mut line = vec![0; dims[axis]];
    for first in (0..layers.len()).filter(|at| (at / stride).is_multiple_of(dims[axis])) {
        let place = |i: usize| first + i * stride;
        (0..line.len()).for_each(|i| line[i] = layers[place(i)]);
        for i in 0..line.len() {
            let mut nearest = line[i];
            for away in 1..u8::MAX {
                if away >= nearest {
                    break;
                }
                let (before, after) = (i.checked_sub(away.into()), i + usize::from(away));
                let there = before.and_then(|j| line.get(j)).into_iter();
                let least = there.chain(line.get(after)).min();
                nearest = least.map_or(nearest, |&d| nearest.min(d.max(away)));
            }
            layers[place(i)] = nearest;
        }
    }
}
