//! Conservative bounds of the spline over a box, from the convex hull of coefficients.
//!
//! A spline lies within the range of the coefficients that reach a point. Its derivatives are splines
//! of lower degree whose coefficients are differences, double differences for mixed ones.

use super::Bspline;
use super::lattice::{cell, first_coefficient};
use crate::bounds::{Aabb, FieldBounds, interval_eigenvalues};
use glam::{DMat3, DVec3};

/// Weights of the differences of order 0, 1 and 2.
const DIFFERENCE: [&[f64]; 3] = [&[1.0], &[-1.0, 1.0], &[1.0, -2.0, 1.0]];

impl Bspline {
    pub(in crate::field) fn bounds(&self, region: &Aabb) -> FieldBounds {
        if self.is_constant() {
            return FieldBounds::constant(self.n2_ref);
        }
        let places = self.places(region);
        let range = |order| self.derivative_range(&places, order);
        let [n2_min, n2_max] = range([0, 0, 0]);
        let steepest = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
            .map(range)
            .map(|[low, high]| high.abs().max(low.abs()));
        let [xx, yy, zz] = [[2, 0, 0], [0, 2, 0], [0, 0, 2]].map(range);
        let [yz, xz, xy] = [[0, 1, 1], [1, 0, 1], [1, 1, 0]].map(range);
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

    /// Per axis the places in memory, relative to the first, of the coefficients that points of the
    /// box depend on.
    fn places(&self, region: &Aabb) -> [Vec<usize>; 3] {
        let low = self.lattice.coordinates(region.min);
        let high = self.lattice.coordinates(region.max);
        let strides = self.lattice.strides();
        std::array::from_fn(|a| {
            let start = cell(low[a]);
            // A box that ends on a knot needs nothing of the cell beyond it.
            let end = start.max(high[a].ceil() as isize - 1);
            let indices = first_coefficient(start)..=first_coefficient(end) + 3;
            let stored = indices.map(|i| self.lattice.clamp(a, i));
            stored.map(|i| i * strides[a]).collect()
        })
    }

    /// Range of the coefficients of the derivative of `order` along x, y, z.
    fn derivative_range(&self, [xs, ys, zs]: &[Vec<usize>; 3], order: [usize; 3]) -> [f64; 2] {
        let [dx, dy, dz] = order.map(|d| DIFFERENCE[d]);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for z in zs.windows(dz.len()) {
            for y in ys.windows(dy.len()) {
                for x in xs.windows(dx.len()) {
                    let mut sum = 0.0;
                    for (k, wz) in z.iter().zip(dz) {
                        for (j, wy) in y.iter().zip(dy) {
                            for (i, wx) in x.iter().zip(dx) {
                                let c = f64::from(self.coefficients[i + j + k]);
                                sum += wx * wy * wz * c;
                            }
                        }
                    }
                    (low, high) = (low.min(sum), high.max(sum));
                }
            }
        }
        let s = self.lattice.per_spacing();
        let scale: f64 = (0..3).map(|a| s[a].powi(order[a] as i32)).product();
        [low * scale, high * scale]
    }
}
