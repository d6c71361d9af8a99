//! Derivatives with respect to the coefficients and the samples of a spline: the transposes of
//! evaluation and of the prefilter.
//!
//! Theory: docs/theory.md#derivatives-of-rays.

use super::lattice::PAD;
use super::weights::Weights;
use super::{Bspline, prefilter};
use crate::field::{IndexChange, IndexDerivative};
use fearless_simd::{Simd, SimdBase, dispatch, f64x4};
use glam::DVec3;

impl Bspline {
    /// Returns the number of coefficients, including coefficients beyond the samples.
    pub(in crate::field) fn coefficient_count(&self) -> usize {
        self.lattice.stored_dims().iter().product()
    }

    /// Adds derivatives with respect to the coefficients, in rows along x, then y, then z.
    pub(in crate::field) fn add_coefficient_derivative(
        &self,
        x: DVec3,
        by: IndexDerivative,
        into: &mut [f64],
    ) {
        dispatch!(self.level, simd => self.scatter_by(simd, x, by, into));
    }

    #[inline(always)]
    fn scatter_by<S: Simd>(&self, simd: S, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        let (first, t) = self.lattice.locate(x);
        let [wx, wy, wz] = [t.x, t.y, t.z].map(|t| Weights::new(simd, t));
        let slope = by.gradient * self.lattice.per_spacing();
        let size = self.lattice.stored_dims();
        let inside = (0..3).all(|a| first[a] >= 0 && first[a] + 4 <= size[a] as isize);
        for k in 0..4 {
            for j in 0..4 {
                let value = wy.value[j] * wz.value[k];
                let across =
                    slope.y * wy.first[j] * wz.value[k] + slope.z * wy.value[j] * wz.first[k];
                let row = wx.value * (by.n2 * value + across) + wx.first * (slope.x * value);
                let place = |a: usize, i: usize| self.lattice.clamp(a, first[a] + i as isize);
                let start = (place(2, k) * size[1] + place(1, j)) * size[0];
                if inside {
                    let to = &mut into[start + first[0] as usize..][..4];
                    let sum = f64x4::from_slice(simd, to) + row;
                    to.copy_from_slice(&*sum);
                } else {
                    for i in 0..4 {
                        into[start + place(0, i)] += row[i];
                    }
                }
            }
        }
    }

    /// Returns the changes of n² and ∇n² at `x` for changes of the coefficients: the transpose of
    /// [`Bspline::add_coefficient_derivative`].
    pub(in crate::field) fn coefficient_change(&self, x: DVec3, change: &[f64]) -> IndexChange {
        dispatch!(self.level, simd => self.gather_from(simd, x, change))
    }

    #[inline(always)]
    fn gather_from<S: Simd>(&self, simd: S, x: DVec3, change: &[f64]) -> IndexChange {
        let (first, t) = self.lattice.locate(x);
        let [wx, wy, wz] = [t.x, t.y, t.z].map(|t| Weights::new(simd, t));
        let size = self.lattice.stored_dims();
        let place = |a: usize, i: usize| self.lattice.clamp(a, first[a] + i as isize);
        let (mut value, mut slope) = (0.0, DVec3::ZERO);
        for k in 0..4 {
            for j in 0..4 {
                let start = (place(2, k) * size[1] + place(1, j)) * size[0];
                let (mut along, mut steep) = (0.0, 0.0);
                for i in 0..4 {
                    let c = change[start + place(0, i)];
                    along += wx.value[i] * c;
                    steep += wx.first[i] * c;
                }
                value += along * wy.value[j] * wz.value[k];
                slope.x += steep * wy.value[j] * wz.value[k];
                slope.y += along * wy.first[j] * wz.value[k];
                slope.z += along * wy.value[j] * wz.first[k];
            }
        }
        IndexChange {
            n2: value,
            gradient: slope * self.lattice.per_spacing(),
        }
    }

    /// Converts changes of n² of the samples to changes of the coefficients: the transpose of
    /// [`Bspline::sample_derivative`].
    pub fn sample_change(&self, samples: &[f64]) -> Vec<f64> {
        let (dims, size) = (self.lattice.dims(), self.lattice.stored_dims());
        let mut data = vec![0.0; self.coefficient_count()];
        for (row, samples) in samples.chunks_exact(dims[0]).enumerate() {
            let (j, k) = (row % dims[1] + PAD, row / dims[1] + PAD);
            let start = (k * size[1] + j) * size[0] + PAD;
            data[start..start + dims[0]].copy_from_slice(samples);
        }
        prefilter::rows(&self.lattice, &mut data);
        data
    }

    /// Returns the number of samples along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.lattice.dims()
    }

    /// Returns true if the spline passes through its samples; false if it deviates from them by
    /// their noise.
    pub fn interpolates(&self) -> bool {
        self.interpolates
    }

    /// Returns n at the samples, to the precision of the coefficients; x fastest, then y, then z.
    pub fn samples(&self) -> Vec<f64> {
        let [x, y, z] = self.dims();
        let places = (0..x * y * z).map(|at| [at % x, at / x % y, at / (x * y)]);
        places
            .map(|sample| self.n2(self.lattice.position(sample)).sqrt())
            .collect()
    }

    /// Converts derivatives with respect to the coefficients to derivatives with respect to n² of
    /// the samples, x fastest, then y, then z. Multiply by 2n for derivatives with respect to n.
    /// The result holds for a grid that interpolates its samples, not for one that smooths them.
    pub fn sample_derivative(&self, by_coefficients: Vec<f64>) -> Vec<f64> {
        let mut size = self.lattice.stored_dims();
        let mut data = by_coefficients;
        for axis in 0..3 {
            data = fold_axis(&data, size, axis);
            size[axis] -= 2 * PAD;
        }
        data
    }
}

/// Transposes the prefilter along one axis of an array of `size`, x fastest; this removes `2·PAD`
/// places.
fn fold_axis(data: &[f64], size: [usize; 3], axis: usize) -> Vec<f64> {
    let stride: usize = size[..axis].iter().product();
    let samples = size[axis] - 2 * PAD;
    let mut out = vec![0.0; data.len() / size[axis] * samples];
    let mut line = vec![0.0; size[axis]];
    for block in 0..data.len() / (stride * size[axis]) {
        for i in 0..stride {
            let from = &data[block * stride * size[axis] + i..];
            for (slot, value) in line.iter_mut().zip(from.iter().step_by(stride)) {
                *slot = *value;
            }
            fold_line(&mut line, samples);
            let to = &mut out[block * stride * samples + i..];
            for (slot, value) in to.iter_mut().step_by(stride).zip(&line[PAD..PAD + samples]) {
                *slot = *value;
            }
        }
    }
    out
}

/// Transposes `prefilter::Solver::solve`: derivatives with respect to samples replace derivatives
/// with respect to coefficients in `line[PAD..PAD + n]`.
fn fold_line(line: &mut [f64], n: usize) {
    let weights = match n {
        1 => [1.0, 0.0, 0.0],
        2 => [2.0, -1.0, 0.0],
        _ => [3.0, -3.0, 1.0],
    };
    for i in (PAD + n..line.len()).rev() {
        for (k, w) in weights.iter().enumerate() {
            line[i - 1 - k] += w * line[i];
        }
    }
    for i in 0..PAD {
        for (k, w) in weights.iter().enumerate() {
            line[i + 1 + k] += w * line[i];
        }
    }
    if n > 2 {
        solve_transposed(&mut line[PAD..PAD + n]);
    }
}

/// Computes Rᵀ A⁻ᵀ g, where A c = R f is the system of `prefilter::interpolate`.
fn solve_transposed(g: &mut [f64]) {
    let last = g.len() - 1;
    // Rows of Aᵀ: (1, 1), (−1, 4, 1), (1, 4, 1) …, (1, 4, −1), (1, 1).
    let lower = |i: usize| if i == 1 { -1.0 } else { 1.0 };
    let upper = |i: usize| if i + 1 == last && i > 0 { -1.0 } else { 1.0 };
    let mut factors = vec![0.0; last];
    let mut diagonal = 1.0;
    for i in 0..last {
        factors[i] = upper(i) / diagonal;
        g[i] /= diagonal;
        g[i + 1] -= lower(i + 1) * g[i];
        diagonal = if i + 1 == last { 1.0 } else { 4.0 } - lower(i + 1) * factors[i];
    }
    g[last] /= diagonal;
    for i in (0..last).rev() {
        g[i] -= factors[i] * g[i + 1];
    }
    let (first, end) = (g[0], g[last]);
    g[1..last].iter_mut().for_each(|y| *y *= 6.0);
    // Planted error "derivatives by samples as if they were coefficients at the faces", found by morgana-eikonal/eikonal::adjoint::grids::rays_by_samples_of_a_grid:
    // (no line)
    g[1] -= first;
    g[last - 1] -= end;
}
