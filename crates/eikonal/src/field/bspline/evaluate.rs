//! Value and derivatives of the spline.
//!
//! The sum over 4³ coefficients is separable. It is computed over y first, then z, then x; the
//! lanes of vectors run along x, which is contiguous. The order of the operations does not depend
//! on the processor's instructions: results are bit-identical on all processors that fuse products
//! and sums.

use super::Bspline;
use super::lattice::{Layout, SECTION};
use super::weights::Weights;
use crate::field::Jet;
use crate::lanes::Summand;
use fearless_simd::{Simd, SimdBase, SimdCombine, dispatch, f32x4, f64x4};
use glam::{DMat3, DVec3};

/// Planes (z) of rows (y) of four coefficients.
type Rows<S> = [[f64x4<S>; 4]; 4];

impl Bspline {
    pub(in crate::field) fn n2(&self, x: DVec3) -> f64 {
        dispatch!(self.level, simd => self.n2_by(simd, x))
    }

    pub(in crate::field) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        dispatch!(self.level, simd => self.gradient_by(simd, x))
    }

    pub(in crate::field) fn jet(&self, x: DVec3) -> Jet {
        dispatch!(self.level, simd => self.jet_by(simd, x))
    }

    #[inline(always)]
    fn n2_by<S: Simd>(&self, simd: S, x: DVec3) -> f64 {
        let ([wx, wy, wz], rows) = self.stencil(simd, x);
        let sum = along_z(&along_y(&rows, wy.value), wz.value) * wx.value;
        self.n2_ref + across([sum; 4])[0]
    }

    #[inline(always)]
    fn gradient_by<S: Simd>(&self, simd: S, x: DVec3) -> (f64, DVec3) {
        let ([wx, wy, wz], rows) = self.stencil(simd, x);
        let (value, first) = (along_y(&rows, wy.value), along_y(&rows, wy.first));
        let sum = along_z(&value, wz.value);
        let sum_y = along_z(&first, wz.value);
        let sum_z = along_z(&value, wz.first);
        let sums = [
            sum * wx.value,
            sum * wx.first,
            sum_y * wx.value,
            sum_z * wx.value,
        ];
        let [n2, x, y, z] = across(sums);
        let grad = DVec3::new(x, y, z) * self.lattice.per_spacing();
        (self.n2_ref + n2, grad)
    }

    #[inline(always)]
    fn jet_by<S: Simd>(&self, simd: S, x: DVec3) -> Jet {
        let ([wx, wy, wz], rows) = self.stencil(simd, x);
        let (value, first) = (along_y(&rows, wy.value), along_y(&rows, wy.first));
        let second = along_y(&rows, wy.second);
        let sum = along_z(&value, wz.value);
        let sum_y = along_z(&first, wz.value);
        let sum_z = along_z(&value, wz.first);
        let sum_yy = along_z(&second, wz.value);
        let sum_yz = along_z(&first, wz.first);
        let sum_zz = along_z(&value, wz.second);
        let [n2, x, y, z] = across([
            sum * wx.value,
            sum * wx.first,
            sum_y * wx.value,
            sum_z * wx.value,
        ]);
        let [xx, xy, xz, yz] = across([
            sum * wx.second,
            sum_y * wx.first,
            sum_z * wx.first,
            sum_yz * wx.value,
        ]);
        let [yy, zz, ..] = across([sum_yy * wx.value, sum_zz * wx.value, sum, sum]);
        let s = self.lattice.per_spacing();
        let (xy, xz, yz) = (xy * (s.x * s.y), xz * (s.x * s.z), yz * (s.y * s.z));
        Jet {
            n2: self.n2_ref + n2,
            grad: DVec3::new(x, y, z) * s,
            hess: DMat3::from_cols(
                DVec3::new(xx * (s.x * s.x), xy, xz),
                DVec3::new(xy, yy * (s.y * s.y), yz),
                DVec3::new(xz, yz, zz * (s.z * s.z)),
            ),
        }
    }

    /// Returns the weights along x, y, z, and the coefficients.
    #[inline(always)]
    fn stencil<S: Simd>(&self, simd: S, x: DVec3) -> ([Weights<S>; 3], Rows<S>) {
        let (first, t) = self.lattice.locate(x);
        let weights = [
            Weights::new(simd, t.x),
            Weights::new(simd, t.y),
            Weights::new(simd, t.z),
        ];
        let inside = self.lattice.inside(first);
        let gathered;
        let (from, [_, row, plane]) = if inside && self.lattice.layout() == Layout::Rows {
            let start = self.lattice.offset(first.map(|i| i as usize));
            (&self.coefficients[start..], self.lattice.strides())
        } else {
            gathered = if inside {
                self.gather_columns(first.map(|i| i as usize))
            } else {
                self.gather_clamped(first)
            };
            (&gathered[..], [1, 4, 16])
        };
        (weights, load(simd, from, [row as u32, plane as u32]))
    }

    /// Gathers rows from columns: four coefficients from four sections make a row.
    #[inline(always)]
    fn gather_columns(&self, first: [usize; 3]) -> [f32; 64] {
        let mut to = [0.0; 64];
        let places = |a: usize| [0, 1, 2, 3].map(|i| self.lattice.place(a, first[a] + i));
        let [x, y, z] = [places(0), places(1), places(2)];
        for (at, row) in to.chunks_exact_mut(4).enumerate() {
            let start = x[0] + y[at % 4] + z[at / 4];
            let from = &self.coefficients[start..][..3 * SECTION + 1];
            let [a, b, c, d] = [0, SECTION, 2 * SECTION, 3 * SECTION];
            row.copy_from_slice(&[from[a], from[b], from[c], from[d]]);
        }
        to
    }

    /// Gathers rows; the outermost coefficients replace all coefficients beyond.
    #[cold]
    fn gather_clamped(&self, first: [isize; 3]) -> [f32; 64] {
        let mut to = [0.0; 64];
        let [x, y, z]: [[usize; 4]; 3] = std::array::from_fn(|a| {
            let stored = |i: usize| self.lattice.clamp(a, first[a] + i as isize);
            std::array::from_fn(|i| self.lattice.place(a, stored(i)))
        });
        for (plane, z) in to.as_chunks_mut::<16>().0.iter_mut().zip(z) {
            for (row, y) in plane.as_chunks_mut::<4>().0.iter_mut().zip(y) {
                *row = x.map(|x| self.coefficients[x + y + z]);
            }
        }
        to
    }
}

/// Loads the rows of all planes. With strides of 32 bits, sums of strides cannot overflow, and all
/// rows lie within the slice that the last row needs. One check of bounds is therefore enough.
#[inline(always)]
fn load<S: Simd>(simd: S, from: &[f32], strides: [u32; 2]) -> Rows<S> {
    let [row, plane] = strides.map(|stride| stride as usize);
    let of_plane = 3 * row + 4;
    let from = &from[..3 * plane + of_plane];
    [
        load_plane(simd, &from[..of_plane], row),
        load_plane(simd, &from[plane..plane + of_plane], row),
        load_plane(simd, &from[2 * plane..2 * plane + of_plane], row),
        load_plane(simd, &from[3 * plane..], row),
    ]
}

/// Loads the rows of a plane.
#[inline(always)]
fn load_plane<S: Simd>(simd: S, from: &[f32], row: usize) -> [f64x4<S>; 4] {
    let at = |start: usize| f32x4::from_slice(simd, &from[start..start + 4]);
    let (a, b) = simd.widen_f32x8(at(0).combine(at(row)));
    let (c, d) = simd.widen_f32x8(at(2 * row).combine(at(3 * row)));
    [a, b, c, d]
}

/// Sums the rows of each plane.
#[inline(always)]
fn along_y<S: Simd>(rows: &Rows<S>, weights: f64x4<S>) -> [f64x4<S>; 4] {
    let [a, b, c, d] = rows;
    let w = &weights;
    [
        combined(a, w),
        combined(b, w),
        combined(c, w),
        combined(d, w),
    ]
}

/// Sums all planes.
#[inline(always)]
fn along_z<S: Simd>(planes: &[f64x4<S>; 4], weights: f64x4<S>) -> f64x4<S> {
    combined(planes, &weights)
}

#[inline(always)]
fn combined<S: Simd>([a, b, c, d]: &[f64x4<S>; 4], weights: &f64x4<S>) -> f64x4<S> {
    let [s, t, u, v] = **weights;
    (*b * t).plus(s, *a) + (*d * v).plus(u, *c)
}

/// Sums the four lanes of each vector.
#[inline(always)]
fn across<S: Simd>([a, b, c, d]: [f64x4<S>; 4]) -> [f64; 4] {
    let halves = neighbours(neighbours(a, b), neighbours(c, d));
    *halves
}

/// Sums neighbouring lanes: first of `a`, then of `b`.
#[inline(always)]
fn neighbours<S: Simd>(a: f64x4<S>, b: f64x4<S>) -> f64x4<S> {
    a.unzip_low(b) + a.unzip_high(b)
}

#[cfg(all(test, any(target_arch = "x86", target_arch = "x86_64")))]
mod tests {
    use super::*;
    use crate::Aabb;
    use crate::field::Placement;
    use crate::field::bspline::Sampling;
    use crate::field::bspline::lattice::Lattice;

    /// Values and derivatives at places inside and outside a grid.
    fn values(grid: &Bspline) -> Vec<f64> {
        let place = |i: usize| [0.754_877, 0.569_840, 0.438_579].map(|s| s * i as f64 % 1.0);
        let jet = |i: usize| {
            let x = DVec3::from_array(place(i)) * 3.0 - 1.5;
            let (n2, jet) = (grid.n2(x), grid.jet(x));
            let (also_n2, grad) = grid.gradient(x);
            let mut values = vec![n2, jet.n2, also_n2];
            values.extend(jet.grad.to_array().into_iter().chain(grad.to_array()));
            values.extend(jet.hess.to_cols_array());
            values
        };
        (0..2000).flat_map(jet).collect()
    }

    /// Returns a grid with sizes that are no multiples of columns.
    fn grid(layout: Layout) -> Bspline {
        let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let lattice = Lattice::new([9, 8, 7], cube, Placement::Nodes).unwrap();
        let positions = lattice.clone();
        let index = |x: DVec3| 1.3 + 0.1 * (3.0 * x.x).sin() * (5.0 * x.y).cos() * x.z;
        let sample = |at| index(positions.position(at));
        let sampling = Sampling {
            noise: 0.0,
            double: true,
        };
        Bspline::build(lattice.laid_out(layout), sampling, sample).unwrap()
    }

    #[test]
    fn instructions_make_no_difference() {
        let grid = grid(Layout::Rows);
        crate::lanes::assert_agree(1e-13, |level| {
            let mut grid = grid.clone();
            grid.level = level;
            values(&grid)
        });
    }

    #[test]
    fn the_order_in_memory_makes_no_difference() {
        let [rows, columns] = [Layout::Rows, Layout::Columns].map(grid);
        assert_eq!(values(&rows), values(&columns));
        for size in [0.1, 0.5, 3.0] {
            let region = Aabb::new(DVec3::splat(0.2 - size), DVec3::splat(0.2 + size));
            assert_eq!(rows.bounds(&region), columns.bounds(&region));
        }
    }
}
