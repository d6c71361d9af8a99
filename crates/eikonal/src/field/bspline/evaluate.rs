//! Value and derivatives of the spline.
//!
//! The sum over 4³ coefficients is separable. It is taken over z and y first, with four lanes along
//! x, which is contiguous and lets the compiler use vector instructions; x is contracted last.

use super::Bspline;
use super::lattice::{cell, first_coefficient};
use crate::field::Jet;
use glam::{DMat3, DVec3};

type Lanes = [f64; 4];

/// Multiplying by it is much cheaper than dividing by 6.
const SIXTH: f64 = 1.0 / 6.0;

/// The four basis functions of one axis at a point, and their derivatives by position.
struct Weights {
    value: Lanes,
    first: Lanes,
    second: Lanes,
}

impl Weights {
    /// At a fraction `t` of a cell; `s` = 1/spacing.
    fn new(t: f64, s: f64) -> Self {
        let u = 1.0 - t;
        let (t2, u2) = (t * t, u * u);
        let value = [
            u2 * u * SIXTH,
            (t2 * (3.0 * t - 6.0) + 4.0) * SIXTH,
            (u2 * (3.0 * u - 6.0) + 4.0) * SIXTH,
            t2 * t * SIXTH,
        ];
        let half = 0.5 * s;
        let first = [
            -half * u2,
            half * t * (3.0 * t - 4.0),
            -half * u * (3.0 * u - 4.0),
            half * t2,
        ];
        let s2 = s * s;
        let second = [s2 * u, s2 * (3.0 * t - 2.0), s2 * (3.0 * u - 2.0), s2 * t];
        Weights {
            value,
            first,
            second,
        }
    }
}

#[inline(always)]
fn add(sum: &mut Lanes, weight: f64, row: &Lanes) {
    for (s, r) in sum.iter_mut().zip(row) {
        *s += weight * r;
    }
}

#[inline(always)]
fn dot(a: &Lanes, b: &Lanes) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

impl Bspline {
    pub(in crate::field) fn n2(&self, x: DVec3) -> f64 {
        let ([wx, wy, wz], rows) = self.stencil(x);
        let mut sum = [0.0; 4];
        for (k, plane) in rows.iter().enumerate() {
            for (j, row) in plane.iter().enumerate() {
                add(&mut sum, wz.value[k] * wy.value[j], &row.map(f64::from));
            }
        }
        self.n2_ref + dot(&sum, &wx.value)
    }

    pub(in crate::field) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let ([wx, wy, wz], rows) = self.stencil(x);
        let [mut sum, mut sum_y, mut sum_z] = [[0.0; 4]; 3];
        for (k, plane) in rows.iter().enumerate() {
            let [mut p, mut py] = [[0.0; 4]; 2];
            for (j, row) in plane.iter().enumerate() {
                let row = row.map(f64::from);
                add(&mut p, wy.value[j], &row);
                add(&mut py, wy.first[j], &row);
            }
            add(&mut sum, wz.value[k], &p);
            add(&mut sum_y, wz.value[k], &py);
            add(&mut sum_z, wz.first[k], &p);
        }
        let grad = DVec3::new(
            dot(&sum, &wx.first),
            dot(&sum_y, &wx.value),
            dot(&sum_z, &wx.value),
        );
        (self.n2_ref + dot(&sum, &wx.value), grad)
    }

    pub(in crate::field) fn jet(&self, x: DVec3) -> Jet {
        let ([wx, wy, wz], rows) = self.stencil(x);
        let [mut sum, mut sum_y, mut sum_z] = [[0.0; 4]; 3];
        let [mut sum_yy, mut sum_yz, mut sum_zz] = [[0.0; 4]; 3];
        for (k, plane) in rows.iter().enumerate() {
            let [mut p, mut py, mut pyy] = [[0.0; 4]; 3];
            for (j, row) in plane.iter().enumerate() {
                let row = row.map(f64::from);
                add(&mut p, wy.value[j], &row);
                add(&mut py, wy.first[j], &row);
                add(&mut pyy, wy.second[j], &row);
            }
            add(&mut sum, wz.value[k], &p);
            add(&mut sum_y, wz.value[k], &py);
            add(&mut sum_yy, wz.value[k], &pyy);
            add(&mut sum_z, wz.first[k], &p);
            add(&mut sum_yz, wz.first[k], &py);
            add(&mut sum_zz, wz.second[k], &p);
        }
        let grad = DVec3::new(
            dot(&sum, &wx.first),
            dot(&sum_y, &wx.value),
            dot(&sum_z, &wx.value),
        );
        let (xy, xz) = (dot(&sum_y, &wx.first), dot(&sum_z, &wx.first));
        let yz = dot(&sum_yz, &wx.value);
        let hess = DMat3::from_cols(
            DVec3::new(dot(&sum, &wx.second), xy, xz),
            DVec3::new(xy, dot(&sum_yy, &wx.value), yz),
            DVec3::new(xz, yz, dot(&sum_zz, &wx.value)),
        );
        Jet {
            n2: self.n2_ref + dot(&sum, &wx.value),
            grad,
            hess,
        }
    }

    /// The weights along x, y, z, and the coefficients as planes (z) of rows (y).
    #[inline(always)]
    fn stencil(&self, x: DVec3) -> ([Weights; 3], [[[f32; 4]; 4]; 4]) {
        let t = self.lattice.coordinates(x);
        let cell = t.to_array().map(cell);
        let s = self.lattice.per_spacing();
        let weights = std::array::from_fn(|a| Weights::new(t[a] - cell[a] as f64, s[a]));
        (weights, self.gather(cell.map(first_coefficient)))
    }

    #[inline(always)]
    fn gather(&self, first: [isize; 3]) -> [[[f32; 4]; 4]; 4] {
        let size = self.lattice.stored_dims();
        let inside = (0..3).all(|a| first[a] >= 0 && first[a] + 4 <= size[a] as isize);
        let mut rows = [[[0.0; 4]; 4]; 4];
        if inside {
            let [_, sy, sz] = self.lattice.strides();
            let start = self.lattice.offset(first.map(|i| i as usize));
            for (k, plane) in rows.iter_mut().enumerate() {
                for (j, row) in plane.iter_mut().enumerate() {
                    let at = start + k * sz + j * sy;
                    row.copy_from_slice(&self.coefficients[at..at + 4]);
                }
            }
        } else {
            self.gather_clamped(first, &mut rows);
        }
        rows
    }

    /// As inside, with the outermost coefficients standing for all beyond them.
    #[cold]
    fn gather_clamped(&self, first: [isize; 3], rows: &mut [[[f32; 4]; 4]; 4]) {
        let index: [[usize; 4]; 3] = std::array::from_fn(|a| {
            std::array::from_fn(|i| self.lattice.clamp(a, first[a] + i as isize))
        });
        for (plane, &k) in rows.iter_mut().zip(&index[2]) {
            for (row, &j) in plane.iter_mut().zip(&index[1]) {
                for (c, &i) in row.iter_mut().zip(&index[0]) {
                    *c = self.coefficients[self.lattice.offset([i, j, k])];
                }
            }
        }
    }
}
