//! How far a ray may go in one step: a length scale that varies over the grid (docs/theory.md#sampled-fields).

use super::lattice::{Lattice, PAD};
use crate::field::lengths::Lengths;
use fearless_simd::{Simd, SimdBase, SimdCombine, dispatch, f32x4, f64x4};
use glam::DVec3;

/// Cells between nodes along each axis.
const EDGE: usize = 8;

/// A coefficient below this share of its sample does not stand for it.
const STEEP: f64 = 0.8;

/// The length scale at nodes every few cells, interpolated linearly between them.
///
/// At a sample it is L = (2n²/|∂⁴n²|)^¼, which makes the fifth derivative of a ray by σ n⁵L⁻⁴, but no more than
/// (2n²/|∂²n²|)^½, the distance over which the field turns a ray. Fourth derivatives are fourth differences of
/// the coefficients, the jumps of the third derivative of the spline. Around a sample the scale is at
/// most its own plus the distance: a step of that length cannot jump over what makes it small.
#[derive(Clone, Debug)]
pub(super) struct Scales(Lengths);

impl Scales {
    pub(super) fn new(lattice: &Lattice, coefficients: &[f32], n2_ref: f64) -> Self {
        let [x, y, z] = lattice.dims();
        let nodes = [x, y, z].map(|n| (n - 1).div_ceil(EDGE).max(1) + 1);
        let mut rough: Vec<f64> = vec![0.0; nodes.iter().product()];
        let (mut row, mut near) = (vec![0.0; x], vec![0.0; nodes[0]]);
        for k in 0..z {
            for j in 0..y {
                dispatch!(crate::lanes::level(), simd => {
                    roughness(simd, lattice, coefficients, n2_ref, [j, k], &mut row);
                    largest_near(&row, &mut near);
                });
                for start in rows_of_nodes(nodes, [j, k]) {
                    for (rough, v) in rough[start..start + nodes[0]].iter_mut().zip(&near) {
                        *rough = rough.max(*v);
                    }
                }
            }
        }
        // The size of the grid is as good as infinity, and can be interpolated.
        let largest = lattice.size();
        let length = |rough: f64| (1.0 / rough.sqrt().sqrt()).min(largest);
        let lengths = rough.into_iter().map(length).collect();
        let spacing = lattice.spacing() * EDGE as f64;
        Scales(Lengths::new(nodes, spacing, lengths))
    }

    /// At a position in units of the spacing from sample 0.
    pub(super) fn at(&self, t: DVec3) -> f64 {
        self.0.at(t * (1.0 / EDGE as f64))
    }

    /// Memory in bytes.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }
}

/// The largest of a row within a block to either side of each node.
#[inline(always)]
fn largest_near(row: &[f64], near: &mut [f64]) {
    for (node, largest) in near.iter_mut().enumerate() {
        let (from, to) = (node.saturating_sub(1) * EDGE, (node + 1) * EDGE + 1);
        let around = &row[from.min(row.len())..to.min(row.len())];
        *largest = around.iter().fold(0.0, |m, v| if *v > m { *v } else { m });
    }
}

/// Where the rows of nodes begin that lie around row (j, k) of samples.
fn rows_of_nodes([x, y, _]: [usize; 3], [j, k]: [usize; 2]) -> impl Iterator<Item = usize> {
    let around = |i: usize| i / EDGE..=i.div_ceil(EDGE);
    around(k).flat_map(move |k| around(j).map(move |j| (k * y + j) * x))
}

/// L⁻⁴ at the samples of row (j, k), less what rounding of the coefficients may have to do with it.
#[inline(always)]
fn roughness<S: Simd>(
    simd: S,
    lattice: &Lattice,
    coefficients: &[f32],
    n2_ref: f64,
    [j, k]: [usize; 2],
    row: &mut [f64],
) {
    let (strides, per_spacing) = (lattice.strides(), lattice.per_spacing());
    let start = lattice.offset([PAD, j + PAD, k + PAD]);
    let at = |from: usize| &coefficients[from..from + row.len()];
    let middle = at(start);
    // Two and one before and after along each axis.
    let around = [0, 1, 2].map(|axis| {
        let s = strides[axis];
        [start - 2 * s, start - s, start + s, start + 2 * s].map(at)
    });
    let constant = |v: f64| f64x4::splat(simd, v);
    let (zero, rounding) = (constant(0.0), constant(0.5 * f64::from(f32::EPSILON)));
    let (n2_ref, least) = (constant(n2_ref), constant(0.01 * n2_ref));
    for i in (0..row.len()).step_by(LANES) {
        let m = load(simd, middle, i);
        let (mut second, mut fourth, mut above) = ([zero; 2], [zero; 2], [zero; 2]);
        for axis in 0..3 {
            let per = per_spacing[axis] * per_spacing[axis];
            let [a, b, d, e] = around[axis];
            let (a, b) = (load(simd, a, i), load(simd, b, i));
            let (d, e) = (load(simd, d, i), load(simd, e, i));
            for h in 0..2 {
                let (a, b, m, d, e) = (a[h], b[h], m[h], d[h], e[h]);
                let (ends, near) = (b.abs() + d.abs(), m.abs());
                let bend = b - m * 2.0 + d;
                let two = bend.abs() - rounding * (ends + near * 2.0);
                let sum = a.abs() + ends * 4.0 + near * 6.0 + e.abs();
                let four = (a - b * 4.0 + m * 6.0 - d * 4.0 + e).abs() - rounding * sum;
                above[h] += bend;
                second[h] += two.max(zero) * per;
                fourth[h] += four.max(zero) * (per * per);
            }
        }
        for h in 0..2 {
            // n² of a sample is close to its coefficient, but at a steep step, where coefficients swing more widely than samples;
            // where both are hardly positive no ray goes.
            let coefficient = n2_ref + m[h];
            let sample = coefficient + above[h] * (1.0 / 6.0);
            let n2 = coefficient.max(sample * STEEP).max(least);
            let found = (fourth[h] * (n2 * 2.0)).max(second[h] * second[h]) / (n2 * n2 * 4.0);
            let found: [f64; 4] = *found;
            let start = row.len().min(i + 4 * h);
            let row = &mut row[start..];
            let count = row.len().min(4);
            row[..count].copy_from_slice(&found[..count]);
        }
    }
}

/// Values loaded at once.
const LANES: usize = 8;

/// Those from `i` on; zero beyond the end.
#[inline(always)]
fn load<S: Simd>(simd: S, from: &[f32], i: usize) -> [f64x4<S>; 2] {
    let mut last = [0.0; LANES];
    let values = from[i..].first_chunk().unwrap_or_else(|| {
        last[..from.len() - i].copy_from_slice(&from[i..]);
        &last
    });
    let half = |at: usize| f32x4::from_slice(simd, &values[at..at + 4]);
    let (a, b) = simd.widen_f32x8(half(0).combine(half(4)));
    [a, b]
}
