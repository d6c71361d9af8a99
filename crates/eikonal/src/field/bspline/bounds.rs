//! Conservative bounds of the spline over a box, from the convex hull of coefficients.
//!
//! A spline lies within the range of the coefficients that reach a point. Its derivatives are splines
//! of lower degree whose coefficients are differences, double differences for mixed ones.

use super::Bspline;
use super::blocks::{Blocks, Cells};
use super::lattice::{cell, first_coefficient};
use crate::bounds::{Aabb, FieldBounds, interval_eigenvalues};
use glam::{DMat3, DVec3};

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

    /// Bounds over a range of cells.
    pub(super) fn bounds_in(&self, cells: &Cells) -> FieldBounds {
        let s = self.lattice.per_spacing();
        let c = self.coefficients_in(cells);
        let [dx, dy, dz] = [0, 1, 2].map(|axis| c.difference(axis));
        let range = |of: &Array, per: f64| of.range().map(|v| v * per);
        let [n2_min, n2_max] = range(&c, 1.0);
        let first = [range(&dx, s.x), range(&dy, s.y), range(&dz, s.z)];
        let steepest = first.map(|[low, high]| high.abs().max(low.abs()));
        let xx = range(&dx.difference(0), s.x * s.x);
        let yy = range(&dy.difference(1), s.y * s.y);
        let zz = range(&dz.difference(2), s.z * s.z);
        let xy = range(&dx.difference(1), s.x * s.y);
        let xz = range(&dx.difference(2), s.x * s.z);
        let yz = range(&dy.difference(2), s.y * s.z);
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

    /// The cells that a box meets.
    fn cells(&self, region: &Aabb) -> Cells {
        let low = self.lattice.coordinates(region.min);
        let high = self.lattice.coordinates(region.max);
        std::array::from_fn(|a| {
            let start = cell(low[a]);
            // A box that ends on a knot needs nothing of the cell beyond it.
            [start, start.max(high[a].ceil() as isize - 1)]
        })
    }

    /// The coefficients that act in a range of cells.
    fn coefficients_in(&self, cells: &Cells) -> Array {
        let strides = self.lattice.strides();
        let [xs, ys, zs]: [Vec<usize>; 3] = std::array::from_fn(|a| {
            let [start, end] = cells[a];
            let indices = first_coefficient(start)..=first_coefficient(end) + 3;
            let stored = indices.map(|i| self.lattice.clamp(a, i));
            stored.map(|i| i * strides[a]).collect()
        });
        let rows = zs.iter().flat_map(|z| ys.iter().map(move |y| z + y));
        let values = rows.flat_map(|row| xs.iter().map(move |x| row + x));
        Array {
            dims: [xs.len(), ys.len(), zs.len()],
            values: values.map(|i| f64::from(self.coefficients[i])).collect(),
        }
    }
}

/// Numbers on a grid, x fastest.
struct Array {
    dims: [usize; 3],
    values: Vec<f64>,
}

impl Array {
    /// Differences of neighbours along an axis: one fewer.
    fn difference(&self, axis: usize) -> Array {
        let [x, y, _] = self.dims;
        let mut dims = self.dims;
        dims[axis] -= 1;
        let mut values = Vec::with_capacity(self.values.len());
        let mut push = |low: &[f64], high: &[f64]| {
            values.extend(low.iter().zip(high).map(|(a, b)| b - a));
        };
        match axis {
            0 => self.values.chunks(x).for_each(|row| push(row, &row[1..])),
            1 => self
                .values
                .chunks(x * y)
                .for_each(|slab| push(slab, &slab[x..])),
            _ => push(&self.values, &self.values[x * y..]),
        }
        Array { dims, values }
    }

    /// The least and the greatest.
    fn range(&self) -> [f64; 2] {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &v in &self.values {
            low = if v < low { v } else { low };
            high = if v > high { v } else { high };
        }
        [low, high]
    }
}
