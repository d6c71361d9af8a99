//! Where a grid does not change, so that rays are straight lines.

use super::lattice::{Lattice, first_coefficient};
use glam::DVec3;

/// Cells of a block along each axis.
const EDGE: usize = 8;
/// Coefficients that differ by less than this part of the largest are taken as equal: rounding of samples is
/// five orders of magnitude larger. It decides how soon the ripples around a change have died away.
const EQUAL: f64 = 1.0 / (1u64 << 40) as f64;

/// Blocks of cells with equal coefficients.
#[derive(Clone, Debug)]
pub(super) struct Calm {
    /// Blocks along each axis.
    dims: [usize; 3],
    /// Cells along each axis.
    cells: DVec3,
    /// For each block, x fastest, how many layers of blocks around its middle have equal coefficients; 0 if
    /// its own differ.
    layers: Vec<u8>,
}

impl Calm {
    /// Of coefficients in rows; `None` if there is no such block.
    pub(super) fn new(lattice: &Lattice, coefficients: &[f32]) -> Option<Self> {
        let cells = lattice.dims().map(|n| (n - 1).max(1));
        let dims = cells.map(|n| n.div_ceil(EDGE));
        let largest = coefficients.iter().fold(0.0, |m: f32, c| m.max(c.abs()));
        let limit = EQUAL * f64::from(largest);
        let calm = ranges(lattice, coefficients, dims);
        let calm = calm.map(|[low, high]| f64::from(high) - f64::from(low) <= limit);
        let mut layers: Vec<u8> = calm.map(|calm| if calm { u8::MAX } else { 0 }).collect();
        if !layers.contains(&u8::MAX) {
            return None;
        }
        for axis in 0..3 {
            spread(&mut layers, dims, axis);
        }
        let cells = DVec3::from_array(cells.map(|n| n as f64));
        Some(Calm {
            dims,
            cells,
            layers,
        })
    }

    /// How far a line can be followed from a position without leaving the blocks around it that are equal, both in units of
    /// the spacing; in units of `v`. Zero where there are none.
    pub(super) fn span(&self, t: DVec3, v: DVec3) -> f64 {
        let inside = t.cmpge(DVec3::ZERO) & t.cmple(self.cells);
        if !inside.all() {
            return 0.0;
        }
        let [x, y, _] = self.dims;
        let block = [0, 1, 2].map(|a| (t[a] as usize / EDGE).min(self.dims[a] - 1));
        let layers = self.layers[(block[2] * y + block[1]) * x + block[0]];
        if layers == 0 {
            return 0.0;
        }
        let (edge, layers) = (EDGE as f64, f64::from(layers));
        let middle = DVec3::from_array(block.map(|b| b as f64));
        let low = ((middle + 1.0 - layers) * edge).max(DVec3::ZERO);
        let high = ((middle + layers) * edge).min(self.cells);
        let exit = |a: usize| match v[a] {
            v if v > 0.0 => (high[a] - t[a]) / v,
            v if v < 0.0 => (low[a] - t[a]) / v,
            _ => f64::INFINITY,
        };
        exit(0).min(exit(1)).min(exit(2))
    }

    /// Memory in bytes.
    pub(super) fn memory(&self) -> usize {
        self.layers.len()
    }
}

/// The least and the greatest coefficient that act in each block.
fn ranges(
    lattice: &Lattice,
    coefficients: &[f32],
    dims: [usize; 3],
) -> impl Iterator<Item = [f32; 2]> {
    let [x, y, _] = dims;
    let size = lattice.stored_dims();
    let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; dims.iter().product()];
    for k in 0..size[2] {
        for j in 0..size[1] {
            let start = lattice.offset([0, j, k]);
            let row = &coefficients[start..start + size[0]];
            for block in 0..x {
                let [from, to] = acting(block);
                let row = &row[from.min(size[0])..to.min(size[0])];
                let low = row.iter().fold(f32::INFINITY, |m, c| m.min(*c));
                let high = row.iter().fold(f32::NEG_INFINITY, |m, c| m.max(*c));
                for c in blocks_of(k, dims[2]) {
                    for b in blocks_of(j, y) {
                        let range = &mut ranges[(c * y + b) * x + block];
                        *range = [range[0].min(low), range[1].max(high)];
                    }
                }
            }
        }
    }
    ranges.into_iter()
}

/// The stored coefficients that act in a block: the first, and the one after the last.
fn acting(block: usize) -> [usize; 2] {
    let first = first_coefficient((block * EDGE) as isize) as usize;
    [first, first + EDGE + 3]
}

/// The blocks, of so many, in which a stored coefficient acts.
fn blocks_of(stored: usize, blocks: usize) -> impl Iterator<Item = usize> {
    let near = (stored / EDGE).saturating_sub(2)..(stored / EDGE + 1).min(blocks);
    near.filter(move |&b| {
        let [from, to] = acting(b);
        (from..to).contains(&stored)
    })
}

/// Distances, by the largest of the three coordinates, to the nearest block where they are zero, of which those along
/// earlier axes are known.
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
