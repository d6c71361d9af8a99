//! Conversion of samples to the coefficients of the spline through them, or of a smoothing spline
//! where they are noisy.
//!
//! Theory: docs/theory.md#sampled-fields.

use super::lattice::{Lattice, PAD};
use super::smooth::Smoother;
use fearless_simd::dispatch;

/// Number of lines processed together.
pub(super) const LANES: usize = 16;
/// Numbers at one place of [`LANES`] lines.
pub(super) type Lanes = [f64; LANES];

/// Converts samples to coefficients in place, axis by axis and line by line in f64. With `noise`,
/// the standard deviation of the samples' noise, the spline is the smoothest that agrees with the
/// samples within this noise. Zero interpolates.
pub(super) fn prefilter(lattice: &Lattice, data: &mut [f32], noise: f64) {
    // Choose all solvers before any line is changed.
    let solvers = [0, 1, 2].map(|axis| Solver::new(lattice, data, axis, noise));
    let grid = Grid::of(lattice);
    for (axis, solver) in solvers.iter().enumerate() {
        dispatch!(crate::lanes::level(), _simd => along(&grid, data, axis, solver));
    }
}

/// Converts samples of one plane across z to coefficients along x and y, interpolating. The filter
/// amplifies the rounding of the shortest waves three times along each axis. In double precision
/// along x and y, only the amplification along z remains ([`planes`]).
pub(super) fn plane(lattice: &Lattice, data: &mut [f64]) {
    let mut grid = Grid::of(lattice);
    grid.size[2] = 1;
    for axis in 0..2 {
        let solver = Solver::interpolating(lattice.dims()[axis]);
        dispatch!(crate::lanes::level(), _simd => along(&grid, data, axis, &solver));
    }
}

/// Converts the result of [`plane`] for each plane to coefficients, along z.
pub(super) fn planes(lattice: &Lattice, data: &mut [f32]) {
    let solver = Solver::interpolating(lattice.dims()[2]);
    let grid = Grid::of(lattice);
    dispatch!(crate::lanes::level(), _simd => along(&grid, data, 2, &solver));
}

/// Converts samples to coefficients in double precision, interpolating; rows along x, then y, then
/// z, with room for the padding.
pub(super) fn rows(lattice: &Lattice, data: &mut [f64]) {
    let size = lattice.stored_dims();
    let grid = Grid {
        size,
        stride: [1, size[0], size[0] * size[1]],
    };
    for axis in 0..3 {
        let solver = Solver::interpolating(lattice.dims()[axis]);
        dispatch!(crate::lanes::level(), _simd => along(&grid, data, axis, &solver));
    }
}

/// Continues coefficients into the padding.
pub(super) fn extend_all(lattice: &Lattice, data: &mut [f32]) {
    let grid = Grid::of(lattice);
    for axis in 0..3 {
        dispatch!(crate::lanes::level(), _simd => along(&grid, data, axis, &Solver::Extending));
    }
}

/// Arrangement of lines in memory.
struct Grid {
    size: [usize; 3],
    stride: [usize; 3],
}

impl Grid {
    fn of(lattice: &Lattice) -> Self {
        Grid {
            size: lattice.stored_dims(),
            stride: lattice.strides(),
        }
    }
}

/// A number type in which coefficients are stored.
pub(super) trait Stored: Copy + Into<f64> {
    fn of(value: f64) -> Self;
}

impl Stored for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
}

impl Stored for f64 {
    fn of(value: f64) -> Self {
        value
    }
}

/// Solves along one axis, for several lines together.
#[inline(always)]
fn along<T: Stored>(grid: &Grid, data: &mut [T], axis: usize, solver: &Solver) {
    let Grid { size, stride } = grid;
    let (across, other) = if axis == 0 { (1, 2) } else { (0, 3 - axis) };
    let mut lines = vec![[0.0; LANES]; size[axis]];
    for i in 0..size[other] {
        for j in (0..size[across]).step_by(LANES) {
            let count = LANES.min(size[across] - j);
            let first = i * stride[other] + j * stride[across];
            let steps = [stride[axis], stride[across]];
            gather(&data[first..], steps, count, &mut lines);
            solver.solve(&mut lines);
            scatter(&lines, steps, count, &mut data[first..]);
        }
    }
}

/// Reads `count` lines. `steps` are the distances between neighbours on a line, and between
/// neighbouring lines.
#[inline(always)]
pub(super) fn gather<T: Stored>(
    data: &[T],
    [along, across]: [usize; 2],
    count: usize,
    lines: &mut [Lanes],
) {
    for (k, line) in lines.iter_mut().enumerate() {
        let data = &data[k * along..];
        if across == 1 && count == LANES {
            let neighbours = data[..LANES].iter();
            line.iter_mut()
                .zip(neighbours)
                .for_each(|(slot, v)| *slot = (*v).into());
        } else {
            for (l, slot) in line[..count].iter_mut().enumerate() {
                *slot = data[l * across].into();
            }
        }
    }
}

/// Writes `count` lines; see [`gather`].
#[inline(always)]
pub(super) fn scatter<T: Stored>(
    lines: &[Lanes],
    [along, across]: [usize; 2],
    count: usize,
    data: &mut [T],
) {
    for (k, line) in lines.iter().enumerate() {
        let data = &mut data[k * along..];
        if across == 1 && count == LANES {
            data[..LANES].copy_from_slice(&line.map(T::of));
        } else {
            for (l, value) in line[..count].iter().enumerate() {
                data[l * across] = T::of(*value);
            }
        }
    }
}

/// Solver for lines of equal length.
pub(super) enum Solver {
    Interpolating {
        samples: usize,
        /// Elimination factors of each row.
        factors: Vec<f64>,
    },
    Smoothing(Smoother),
    /// Only continues coefficients into the padding.
    Extending,
}

impl Solver {
    fn new(lattice: &Lattice, data: &[f32], axis: usize, noise: f64) -> Self {
        let samples = lattice.dims()[axis];
        if let Some(smoother) = Smoother::of_noise(lattice, data, axis, noise) {
            return Solver::Smoothing(smoother);
        }
        Self::interpolating(samples)
    }

    pub(super) fn interpolating(samples: usize) -> Self {
        let mut factors = vec![-1.0];
        for i in 1..samples.saturating_sub(1) {
            factors.push(1.0 / (4.0 - factors[i - 1]));
        }
        Solver::Interpolating { samples, factors }
    }

    /// Converts samples f in `line[PAD..len − PAD]` to coefficients c; coefficients in the padding
    /// continue them quadratically.
    #[inline(always)]
    pub(super) fn solve(&self, lines: &mut [Lanes]) {
        match self {
            Solver::Interpolating { samples, factors } => {
                // Skip one or two samples: they are their own coefficients.
                if *samples > 2 {
                    interpolate(&mut lines[PAD..PAD + samples], factors);
                }
            }
            Solver::Smoothing(smoother) => smoother.solve(&mut lines[PAD - 1..]),
            Solver::Extending => {}
        }
        let samples = lines.len() - 2 * PAD;
        extend(lines, samples);
    }
}

/// Solves for coefficients with c₍i₋₁₎ + 4cᵢ + c₍i₊₁₎ = 6fᵢ.
///
/// Inserting c₋₁ = 3c₀ − 3c₁ + c₂ into the first condition gives 7c₀ − 2c₁ + c₂ = 6f₀. Subtracting
/// the second (c₀ + 4c₁ + c₂ = 6f₁) gives 6c₀ − 6c₁ = 6(f₀ − f₁). The other end is analogous.
#[inline(always)]
fn interpolate(c: &mut [Lanes], factors: &[f64]) {
    let last = c.len() - 1;
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

/// Fills the padding with the polynomial of degree two (less for fewer than three samples) through
/// the outermost coefficients.
#[inline(always)]
fn extend(line: &mut [Lanes], n: usize) {
    let next = |a: Lanes, b: Lanes, c: Lanes| match n {
        1 => a,
        2 => lanes(|l| 2.0 * a[l] - b[l]),
        _ => lanes(|l| 3.0 * a[l] - 3.0 * b[l] + c[l]),
    };
    // With fewer than three samples the last arguments are not used.
    for i in (0..PAD).rev() {
        line[i] = next(line[i + 1], line[i + 2], line[i + 3]);
    }
    for i in PAD + n..line.len() {
        line[i] = next(line[i - 1], line[i - 2], line[i - 3]);
    }
}

#[inline(always)]
pub(super) fn lanes(f: impl Fn(usize) -> f64) -> Lanes {
    let mut lanes = [0.0; LANES];
    for (l, lane) in lanes.iter_mut().enumerate() {
        *lane = f(l);
    }
    lanes
}
