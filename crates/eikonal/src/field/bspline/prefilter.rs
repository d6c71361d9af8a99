//! From samples to the coefficients of the spline that interpolates them.

use super::lattice::{Lattice, PAD};
use fearless_simd::dispatch;

/// Lines handled at once.
const LANES: usize = 8;
type Lanes = [f64; LANES];

/// Turns samples into coefficients in place, axis by axis; line by line in f64.
pub(super) fn prefilter(lattice: &Lattice, data: &mut [f32]) {
    for axis in 0..3 {
        dispatch!(crate::lanes::level(), _simd => along(lattice, data, axis));
    }
}

/// The same along one axis, for several lines side by side: x is contiguous in memory.
#[inline(always)]
fn along(lattice: &Lattice, data: &mut [f32], axis: usize) {
    let (size, stride) = (lattice.stored_dims(), lattice.strides());
    let (across, other) = if axis == 0 { (1, 2) } else { (0, 3 - axis) };
    let solver = Solver::new(size[axis] - 2 * PAD);
    let mut lines = vec![[0.0; LANES]; size[axis]];
    for i in 0..size[other] {
        for j in (0..size[across]).step_by(LANES) {
            let count = LANES.min(size[across] - j);
            let first = i * stride[other] + j * stride[across];
            let place = |k: usize, l: usize| first + k * stride[axis] + l * stride[across];
            for (k, line) in lines.iter_mut().enumerate() {
                (0..count).for_each(|l| line[l] = f64::from(data[place(k, l)]));
            }
            solver.solve(&mut lines);
            for (k, line) in lines.iter().enumerate() {
                (0..count).for_each(|l| data[place(k, l)] = line[l] as f32);
            }
        }
    }
}

/// Solves for lines of equal length.
struct Solver {
    samples: usize,
    /// Of the elimination in each row.
    factors: Vec<f64>,
}

impl Solver {
    fn new(samples: usize) -> Self {
        let mut factors = vec![-1.0];
        for i in 1..samples.saturating_sub(1) {
            factors.push(1.0 / (4.0 - factors[i - 1]));
        }
        Solver { samples, factors }
    }

    /// Samples f in `line[PAD..len − PAD]` become coefficients c with
    /// c₍i₋₁₎ + 4cᵢ + c₍i₊₁₎ = 6fᵢ; those in the padding continue them quadratically.
    #[inline(always)]
    fn solve(&self, lines: &mut [Lanes]) {
        let n = self.samples;
        // One or two samples are their own coefficients.
        if n > 2 {
            self.solve_tridiagonal(&mut lines[PAD..PAD + n]);
        }
        extend(lines, n);
    }

    /// The interpolation conditions with c₋₁ = 3c₀ − 3c₁ + c₂ put into the first, 7c₀ − 2c₁ + c₂ =
    /// 6f₀; less the second (c₀ + 4c₁ + c₂ = 6f₁) it reads 6c₀ − 6c₁ = 6(f₀ − f₁). Likewise at the end.
    #[inline(always)]
    fn solve_tridiagonal(&self, c: &mut [Lanes]) {
        let (last, factors) = (c.len() - 1, &self.factors);
        // Rows: c₀ − c₁ = f₀ − f₁, then (1, 4, 1), then c₍last₎ − c₍last₋₁₎ = f₍last₎ − f₍last₋₁₎.
        let end = lanes(|l| c[last][l] - c[last - 1][l]);
        c[0] = lanes(|l| c[0][l] - c[1][l]);
        for i in 1..last {
            c[i] = lanes(|l| (6.0 * c[i][l] - c[i - 1][l]) * factors[i]);
        }
        c[last] = lanes(|l| (end[l] + c[last - 1][l]) / (1.0 + factors[last - 1]));
        for i in (0..last).rev() {
            c[i] = lanes(|l| c[i][l] - factors[i] * c[i + 1][l]);
        }
    }
}

/// Fills the padding with the polynomial of degree two (less for fewer than three samples)
/// through the outermost coefficients.
#[inline(always)]
fn extend(line: &mut [Lanes], n: usize) {
    let next = |a: Lanes, b: Lanes, c: Lanes| match n {
        1 => a,
        2 => lanes(|l| 2.0 * a[l] - b[l]),
        _ => lanes(|l| 3.0 * a[l] - 3.0 * b[l] + c[l]),
    };
    // With fewer than three samples the farther arguments are not used.
    for i in (0..PAD).rev() {
        line[i] = next(line[i + 1], line[i + 2], line[i + 3]);
    }
    for i in PAD + n..line.len() {
        line[i] = next(line[i - 1], line[i - 2], line[i - 3]);
    }
}

#[inline(always)]
fn lanes(f: impl Fn(usize) -> f64) -> Lanes {
    std::array::from_fn(f)
}
