//! Length scales that vary over the grid and limit the steps of rays
//! (docs/theory.md#sampled-fields).

use super::lattice::{Lattice, PAD};
use super::prefilter::extend_all;
use crate::field::lengths::Lengths;
use fearless_simd::{Simd, SimdBase, SimdCombine, dispatch, f32x4, f64x4};
use glam::DVec3;

/// Number of cells between nodes along each axis.
const CELLS_PER_NODE: usize = 8;

/// Smallest ratio of hidden to visible roughness at which the hidden roughness is taken into
/// account.
const MIN_HIDDEN_ROUGHNESS: f64 = 0.5;

/// Ratio of a coefficient to its sample below which the sample replaces it.
const MIN_COEFFICIENT_RATIO: f64 = 0.8;

/// Length scale at nodes every few cells, interpolated linearly between them.
///
/// At a sample it is L = (2n²/|∂⁴n²|)^¼. The fifth derivative of a ray with respect to σ is then
/// n⁵L⁻⁴. It is at most (2n²/|∂²n²|)^½, the distance over which the field turns a ray. Fourth
/// derivatives are fourth differences of the coefficients, which are the jumps of the third
/// derivative of the spline. Around a sample the scale is at most the sample's scale plus the
/// distance. A step of this length cannot jump over the feature that makes the scale small.
#[derive(Clone, Debug)]
pub(super) struct Scales(Lengths);

impl Scales {
    /// Computes the scales from coefficients in rows, with rounding errors of `roundings` halves of
    /// their last bit.
    pub(super) fn new(
        lattice: &Lattice,
        coefficients: &[f32],
        n2_ref: f64,
        roundings: f64,
    ) -> Self {
        Scales(lengths(lattice, coefficients, n2_ref, roundings))
    }

    /// Returns the scale at a position in units of the spacing from sample 0.
    pub(super) fn at(&self, t: DVec3) -> f64 {
        self.0.at(t * (1.0 / CELLS_PER_NODE as f64))
    }

    /// Returns the memory in bytes.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }
}

/// Computes the lengths. Where rounding hides the fourth differences of the coefficients, the next
/// coarser lattice supplies them, up to the amount that may be hidden.
fn lengths(lattice: &Lattice, coefficients: &[f32], n2_ref: f64, roundings: f64) -> Lengths {
    let nodes = lattice
        .dims()
        .map(|n| (n - 1).div_ceil(CELLS_PER_NODE).max(1) + 1);
    let mut around = Around::new(nodes);
    around.see(lattice, coefficients, n2_ref, roundings);
    let Around {
        mut seen, hidden, ..
    } = around;
    // Take the size of the grid instead of infinity: it can be interpolated.
    let largest = lattice.size();
    let least = largest.powi(-4);
    let much = |seen: f64, hidden: f64| hidden > MIN_HIDDEN_ROUGHNESS * seen.max(least);
    let hides = seen.iter().zip(&hidden).any(|(s, h)| much(*s, *h));
    if let Some(coarse) = lattice.coarser().filter(|_| hides) {
        let data = coarsened(lattice, &coarse, coefficients);
        let below = lengths(&coarse, &data, n2_ref, roundings);
        let per = lattice.spacing() / coarse.spacing();
        let [x, y, _] = nodes;
        for (at, (seen, hidden)) in seen.iter_mut().zip(&hidden).enumerate() {
            if much(*seen, *hidden) {
                let node = [at % x, at / x % y, at / (x * y)].map(|i| i as f64);
                let there = below.at(DVec3::from_array(node) * per);
                // Planted error "steps through fine grids blind to what rounding hides", found by morgana-eikonal/eikonal::field_grid::the_length_scale_does_not_depend_on_the_spacing:
                // *seen = seen.max(0.0 * there.powi(-4).min(*seen + hidden));
                *seen = seen.max(there.powi(-4).min(*seen + hidden));
            }
        }
    }
    let length = |rough: f64| (1.0 / rough.sqrt().sqrt()).min(largest);
    let lengths = seen.into_iter().map(length).collect();
    Lengths::new(nodes, lattice.spacing() * CELLS_PER_NODE as f64, lengths)
}

/// Largest L⁻⁴ around nodes: the visible part, and the part that rounding may hide.
struct Around {
    nodes: [usize; 3],
    seen: Vec<f64>,
    hidden: Vec<f64>,
}

impl Around {
    fn new(nodes: [usize; 3]) -> Self {
        let zero = vec![0.0; nodes.iter().product()];
        Around {
            nodes,
            seen: zero.clone(),
            hidden: zero,
        }
    }

    fn see(&mut self, lattice: &Lattice, coefficients: &[f32], n2_ref: f64, roundings: f64) {
        let [x, y, z] = lattice.dims();
        let mut row = [vec![0.0; x], vec![0.0; x]];
        let mut near = vec![0.0; self.nodes[0]];
        for k in 0..z {
            for j in 0..y {
                dispatch!(crate::lanes::level(), simd => {
                    roughness(simd, lattice, coefficients, [n2_ref, roundings], [j, k], &mut row)
                });
                for (row, all) in row.iter().zip([&mut self.seen, &mut self.hidden]) {
                    dispatch!(crate::lanes::level(), _simd => largest_near(row, &mut near));
                    for start in rows_of_nodes(self.nodes, [j, k]) {
                        for (most, v) in all[start..start + self.nodes[0]].iter_mut().zip(&near) {
                            *most = most.max(*v);
                        }
                    }
                }
            }
        }
    }
}

/// Smooths coefficients by binomial weights along the axes along which a coarser lattice has every
/// second coefficient.
fn coarsened(fine: &Lattice, coarse: &Lattice, from: &[f32]) -> Vec<f32> {
    let step = [0, 1, 2].map(|a| {
        if fine.dims()[a] == coarse.dims()[a] {
            1
        } else {
            2
        }
    });
    let [_, stride_y, stride_z] = fine.strides();
    let [x, y, z] = coarse.dims();
    let mut to = vec![0.0; coarse.stored()];
    let (mut plane, mut row) = (vec![0.0; stride_z], vec![0.0; stride_y]);
    for k in 0..z {
        smoothed(step[2], &mut plane, |d| {
            &from[((k * step[2] + PAD) as isize + d) as usize * stride_z..]
        });
        for j in 0..y {
            smoothed(step[1], &mut row, |d| {
                &plane[((j * step[1] + PAD) as isize + d) as usize * stride_y..]
            });
            let start = coarse.offset([PAD, j + PAD, k + PAD]);
            for (i, slot) in to[start..start + x].iter_mut().enumerate() {
                let mut one = [0.0];
                smoothed(step[0], &mut one, |d| {
                    &row[((i * step[0] + PAD) as isize + d) as usize..]
                });
                *slot = one[0] as f32;
            }
        }
    }
    extend_all(coarse, &mut to);
    to
}

/// Applies the weights 1, 4, 6, 4, 1 (sixteenths) to values at consecutive offsets; copies the
/// values along an axis where every place is kept.
fn smoothed<'a, T: Copy + Into<f64> + 'a>(
    step: usize,
    to: &mut [f64],
    from: impl Fn(isize) -> &'a [T],
) {
    let middle = from(0);
    if step == 1 {
        to.iter_mut()
            .zip(middle)
            .for_each(|(slot, v)| *slot = (*v).into());
        return;
    }
    let [a, b, d, e] = [-2, -1, 1, 2].map(from);
    for (i, slot) in to.iter_mut().enumerate() {
        let ends: f64 = a[i].into() + e[i].into();
        let near: f64 = b[i].into() + d[i].into();
        *slot = (ends + near * 4.0 + middle[i].into() * 6.0) * (1.0 / 16.0);
    }
}

/// Returns the largest value of a row within a block to either side of each node.
#[inline(always)]
fn largest_near(row: &[f64], near: &mut [f64]) {
    for (node, largest) in near.iter_mut().enumerate() {
        let (from, to) = (
            node.saturating_sub(1) * CELLS_PER_NODE,
            (node + 1) * CELLS_PER_NODE + 1,
        );
        let around = &row[from.min(row.len())..to.min(row.len())];
        *largest = around.iter().fold(0.0, |m, v| if *v > m { *v } else { m });
    }
}

/// Returns the starts of the rows of nodes around row (j, k) of samples.
fn rows_of_nodes([x, y, _]: [usize; 3], [j, k]: [usize; 2]) -> impl Iterator<Item = usize> {
    let around = |i: usize| i / CELLS_PER_NODE..=i.div_ceil(CELLS_PER_NODE);
    around(k).flat_map(move |k| around(j).map(move |j| (k * y + j) * x))
}

/// Computes L⁻⁴ at the samples of row (j, k), less the possible contribution of rounding, and the
/// amount that rounding may hide.
#[inline(always)]
fn roughness<S: Simd>(
    simd: S,
    lattice: &Lattice,
    coefficients: &[f32],
    [n2_ref, roundings]: [f64; 2],
    [j, k]: [usize; 2],
    [seen, hidden]: &mut [Vec<f64>; 2],
) {
    let (strides, per_spacing) = (lattice.strides(), lattice.per_spacing());
    let start = lattice.offset([PAD, j + PAD, k + PAD]);
    let at = |from: usize| &coefficients[from..from + seen.len()];
    let middle = at(start);
    // Take two coefficients before and two after, along each axis.
    let around = [0, 1, 2].map(|axis| {
        let s = strides[axis];
        [start - 2 * s, start - s, start + s, start + 2 * s].map(at)
    });
    let constant = |v: f64| f64x4::splat(simd, v);
    let (zero, rounding) = (
        constant(0.0),
        constant(0.5 * roundings * f64::from(f32::EPSILON)),
    );
    let (n2_ref, least) = (constant(n2_ref), constant(0.01 * n2_ref));
    for i in (0..seen.len()).step_by(LANES) {
        let m = load(simd, middle, i);
        let (mut second, mut fourth, mut above) = ([zero; 2], [zero; 2], [zero; 2]);
        let mut unknown = [zero; 2];
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
                let doubt = rounding * sum;
                let four = (a - b * 4.0 + m * 6.0 - d * 4.0 + e).abs() - doubt;
                unknown[h] += doubt * (per * per);
                above[h] += bend;
                second[h] += two.max(zero) * per;
                fourth[h] += four.max(zero) * (per * per);
            }
        }
        for h in 0..2 {
            // Take n² of the coefficient, which is close to the sample, except at a steep step,
            // where coefficients swing more widely than samples. Where both are hardly positive, no
            // ray goes.
            let coefficient = n2_ref + m[h];
            let sample = coefficient + above[h] * (1.0 / 6.0);
            let n2 = coefficient.max(sample * MIN_COEFFICIENT_RATIO).max(least);
            let found = (fourth[h] * (n2 * 2.0)).max(second[h] * second[h]) / (n2 * n2 * 4.0);
            let unknown: [f64; 4] = *(unknown[h] / n2);
            let found: [f64; 4] = *found;
            let (start, end) = (seen.len().min(i + 4 * h), seen.len().min(i + 4 * h + 4));
            seen[start..end].copy_from_slice(&found[..end - start]);
            hidden[start..end].copy_from_slice(&unknown[..end - start]);
        }
    }
}

/// Number of values loaded together.
const LANES: usize = 8;

/// Loads the values from `i` on; zero beyond the end.
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
