//! Conservative bounds of the spline over a box, from the convex hull of coefficients.
//!
//! A spline lies within the range of the coefficients that act at a point. Its derivatives are
//! splines of lower degree, whose coefficients are differences, or double differences for mixed
//! derivatives.
//!
//! Theory: docs/theory.md#sampled-fields.

use super::Bspline;
use super::blocks::{Blocks, Cells, count};
use super::lattice::{cell, first_coefficient};
use crate::bounds::{Aabb, FieldBounds, interval_eigenvalues};
use fearless_simd::dispatch;
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::sync::{MutexGuard, PoisonError};

/// Minimum number of cells of a box whose bounds a field stores. Bounds of fewer cells take more
/// memory than the coefficients, and hardly any time.
const MIN_STORED_CELLS: usize = 200;
/// Maximum number of boxes whose bounds a field stores: four shapes, covered by at most 16³ boxes
/// each. They take at most 1.5 MB.
const MAX_STORED_BOXES: usize = 4 * 4096;

impl Bspline {
    pub(in crate::field) fn bounds(&self, region: &Aabb) -> FieldBounds {
        if self.is_constant() {
            return FieldBounds::constant(self.n2_ref);
        }
        let cells = self.cells(region);
        if !Blocks::pay(&cells) {
            return self.bounds_in(&cells);
        }
        let blocks = || Blocks::new(self, self.lattice.dims());
        let bounds = self.blocks.get_or_init(blocks).bounds(&cells);
        bounds.unwrap_or_else(|| self.bounds_in(&cells))
    }

    pub(in crate::field) fn stored_bounds(&self, region: &Aabb) -> FieldBounds {
        let cells = self.cells(region);
        if count(&cells) < MIN_STORED_CELLS {
            return self.bounds(region);
        }
        if let Some(bounds) = self.stored().get(&cells) {
            return *bounds;
        }
        let bounds = self.bounds(region);
        let mut stored = self.stored();
        if stored.len() < MAX_STORED_BOXES {
            stored.insert(cells, bounds);
        }
        bounds
    }

    /// Returns the stored bounds.
    pub(super) fn stored(&self) -> MutexGuard<'_, BTreeMap<Cells, FieldBounds>> {
        self.bounds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns bounds over a range of cells.
    pub(super) fn bounds_in(&self, cells: &Cells) -> FieldBounds {
        let s = self.lattice.per_spacing();
        let c = self.coefficients_in(cells);
        let ranges = dispatch!(self.level, _simd => c.ranges());
        let range = |which: usize, per: f64| ranges[which].ends().map(|v| v * per);
        let [n2_min, n2_max] = range(N2, 1.0);
        let first = [range(X, s.x), range(Y, s.y), range(Z, s.z)];
        let steepest = first.map(|[low, high]| high.abs().max(low.abs()));
        let [xx, yy, zz] = [
            range(XX, s.x * s.x),
            range(YY, s.y * s.y),
            range(ZZ, s.z * s.z),
        ];
        let [xy, xz, yz] = [
            range(XY, s.x * s.y),
            range(XZ, s.x * s.z),
            range(YZ, s.y * s.z),
        ];
        let matrix = |i: usize| {
            DMat3::from_cols(
                DVec3::new(xx[i], xy[i], xz[i]),
                DVec3::new(xy[i], yy[i], yz[i]),
                DVec3::new(xz[i], yz[i], zz[i]),
            )
        };
        let [hess_min, hess_max] = interval_eigenvalues(matrix(0), matrix(1));
        FieldBounds {
            n2_min: self.n2_ref + n2_min,
            n2_max: self.n2_ref + n2_max,
            grad_max: DVec3::from_array(steepest).length(),
            hess_min,
            hess_max,
        }
    }

    /// Returns the cells that intersect a box.
    fn cells(&self, region: &Aabb) -> Cells {
        let low = self.lattice.coordinates(region.min);
        let high = self.lattice.coordinates(region.max);
        std::array::from_fn(|a| {
            let start = cell(low[a]);
            // Skip the next cell if the box ends on a knot.
            [start, start.max(high[a].ceil() as isize - 1)]
        })
    }

    /// Returns the coefficients that act in a range of cells.
    fn coefficients_in(&self, cells: &Cells) -> Array {
        let [xs, ys, zs]: [Vec<usize>; 3] = std::array::from_fn(|a| {
            let [start, end] = cells[a];
            let indices = first_coefficient(start)..=first_coefficient(end) + 3;
            let stored = indices.map(|i| self.lattice.clamp(a, i));
            stored.map(|i| self.lattice.place(a, i)).collect()
        });
        let mut array = Array::new([xs.len(), ys.len(), zs.len()]);
        let mut rows = array.values.chunks_exact_mut(array.stride);
        for z in zs {
            for (y, row) in ys.iter().zip(&mut rows) {
                for (value, x) in row.iter_mut().zip(&xs) {
                    *value = f64::from(self.coefficients[z + y + x]);
                }
            }
        }
        array
    }
}

/// Number of values in a vector.
const LANES: usize = 4;
type Lanes = [f64; LANES];

/// Indices into [`Array::ranges`]: the value and its differences.
const N2: usize = 0;
const X: usize = 1;
const Y: usize = 2;
const Z: usize = 3;
const XX: usize = 4;
const YY: usize = 5;
const ZZ: usize = 6;
const XY: usize = 7;
const XZ: usize = 8;
const YZ: usize = 9;

/// Numbers on a grid, x fastest. Rows are padded with NaN, which ranges ignore; differences with
/// NaN are NaN.
struct Array {
    dims: [usize; 3],
    stride: usize,
    values: Vec<f64>,
}

impl Array {
    fn new(dims: [usize; 3]) -> Self {
        let stride = dims[0].next_multiple_of(LANES) + LANES;
        Array {
            dims,
            stride,
            values: vec![f64::NAN; stride * dims[1] * dims[2]],
        }
    }

    fn row(&self, j: usize, k: usize) -> &[f64] {
        let start = (k * self.dims[1] + j) * self.stride;
        &self.values[start..start + self.stride]
    }

    /// Returns ranges of the values and of their first and second differences.
    #[inline(always)]
    fn ranges(&self) -> [Range; 10] {
        let [_, y, z] = self.dims;
        let mut ranges = [Range::EMPTY; 10];
        for k in 0..z {
            for j in 0..y {
                self.row_ranges(j, k, &mut ranges);
            }
        }
        ranges
    }

    /// Adds the ranges of differences that begin in one row.
    #[inline(always)]
    fn row_ranges(&self, j: usize, k: usize, ranges: &mut [Range; 10]) {
        let [x, y, z] = self.dims;
        let row = |j, k| (j < y && k < z).then(|| self.row(j, k));
        let this = self.row(j, k);
        let [next, after] = [row(j + 1, k), row(j + 2, k)];
        let [above, higher, beside] = [row(j, k + 1), row(j, k + 2), row(j + 1, k + 1)];
        let mut put = |which: usize, values: Lanes| ranges[which].put(values);
        for i in (0..x).step_by(LANES) {
            let (c, right) = (lanes(this, i), lanes(this, i + 1));
            let dx = minus(right, c);
            put(N2, c);
            put(X, dx);
            put(XX, minus(minus(lanes(this, i + 2), right), dx));
            if let Some(next) = next {
                let n = lanes(next, i);
                let dy = minus(n, c);
                put(Y, dy);
                put(XY, minus(minus(lanes(next, i + 1), n), dx));
                if let Some(after) = after {
                    put(YY, minus(minus(lanes(after, i), n), dy));
                }
                if let (Some(above), Some(beside)) = (above, beside) {
                    put(YZ, minus(minus(lanes(beside, i), lanes(above, i)), dy));
                }
            }
            if let Some(above) = above {
                let n = lanes(above, i);
                let dz = minus(n, c);
                put(Z, dz);
                put(XZ, minus(minus(lanes(above, i + 1), n), dx));
                if let Some(higher) = higher {
                    put(ZZ, minus(minus(lanes(higher, i), n), dz));
                }
            }
        }
    }
}

#[inline(always)]
fn lanes(row: &[f64], at: usize) -> Lanes {
    std::array::from_fn(|l| row[at + l])
}

#[inline(always)]
fn minus(a: Lanes, b: Lanes) -> Lanes {
    std::array::from_fn(|l| a[l] - b[l])
}

/// Smallest and largest numbers, lane by lane.
#[derive(Clone, Copy)]
struct Range {
    low: Lanes,
    high: Lanes,
}

impl Range {
    const EMPTY: Range = Range {
        low: [f64::INFINITY; LANES],
        high: [f64::NEG_INFINITY; LANES],
    };

    /// Includes numbers; NaN is ignored.
    #[inline(always)]
    fn put(&mut self, values: Lanes) {
        for (l, v) in values.into_iter().enumerate() {
            self.low[l] = if v < self.low[l] { v } else { self.low[l] };
            self.high[l] = if v > self.high[l] { v } else { self.high[l] };
        }
    }

    fn ends(&self) -> [f64; 2] {
        let low = self.low.into_iter().fold(f64::INFINITY, f64::min);
        [low, self.high.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    }
}
