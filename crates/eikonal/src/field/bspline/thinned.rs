//! Splines through fewer samples of a grid.

use super::lattice::{Lattice, PAD};
use super::prefilter::{LANES, Lanes, Solver, Stored, gather, lanes, scatter};
use super::values::{Taps, Values};
use fearless_simd::dispatch;

/// Fewer samples along an axis; the first and the last sample keep their places.
pub(super) struct Thinned {
    /// Solver for the coefficients of all samples.
    solver: Solver,
    /// Number of all samples.
    samples: usize,
    count: usize,
    /// Distance between neighbouring kept samples, in units of the original distance.
    spacing: f64,
    /// Original coefficients around each kept sample.
    taps: Vec<Taps>,
    /// Pivots of the elimination.
    factors: Vec<f64>,
}

impl Thinned {
    /// Thins samples by a factor: about every `factor`-th is kept.
    pub(super) fn new(samples: usize, factor: usize) -> Self {
        let intervals = samples - 1;
        let count = intervals.div_ceil(factor) + 1;
        let spacing = intervals.max(1) as f64 / (count - 1).max(1) as f64;
        let mut factors = vec![0.25];
        for i in 1..count {
            let product = below(i, count) * above(i - 1) * factors[i - 1];
            factors.push(1.0 / (4.0 - product));
        }
        Thinned {
            solver: Solver::interpolating(samples),
            samples,
            count,
            spacing,
            taps: (0..count).map(|i| Taps::at(i as f64 * spacing)).collect(),
            factors,
        }
    }

    /// Returns the number of samples that are kept.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    fn stored(&self) -> usize {
        self.count + 2 * PAD
    }

    /// Allocates lines of all samples, with their padding.
    fn room(&self) -> Vec<Lanes> {
        vec![[0.0; LANES]; self.samples + 2 * PAD]
    }

    fn room_for_fewer(&self) -> Vec<Lanes> {
        vec![[0.0; LANES]; self.stored()]
    }

    /// Returns the largest change of a sample, and this sample, if samples are thinned along one
    /// axis alone. Only lines along this axis through the samples `through` are examined.
    pub(super) fn worst(
        &self,
        axis: usize,
        through: &[[usize; 3]],
        values: &impl Values,
    ) -> (f64, [usize; 3]) {
        let places: Vec<Taps> = (0..self.samples).map(|i| self.place(i)).collect();
        let mut worst = (0.0, [0; 3]);
        for some in through.chunks(LANES) {
            let (samples, fewer) = self.lines(axis, some, values);
            for (i, (here, place)) in samples.iter().zip(&places).enumerate() {
                let there = place.of(&fewer);
                for (l, start) in some.iter().enumerate() {
                    let change = (there[l] - here[l]).abs();
                    if change > worst.0 {
                        let mut sample = *start;
                        sample[axis] = i;
                        worst = (change, sample);
                    }
                }
            }
        }
        worst
    }

    /// Returns the changes at some samples if samples are thinned along an axis alone.
    pub(super) fn changes(
        &self,
        axis: usize,
        samples: &[[usize; 3]],
        values: &impl Values,
    ) -> Vec<f64> {
        let together = samples.chunks(LANES).flat_map(|some| {
            let (held, fewer) = self.lines(axis, some, values);
            let change = |(l, sample): (usize, &[usize; 3])| {
                let i = sample[axis];
                self.place(i).of(&fewer)[l] - held[i][l]
            };
            some.iter().enumerate().map(change).collect::<Vec<_>>()
        });
        together.collect()
    }

    /// Returns the position of a sample among the kept samples.
    fn place(&self, i: usize) -> Taps {
        Taps::at(i as f64 / self.spacing)
    }

    /// Returns the samples of the lines along an axis through some samples of a grid, at most
    /// [`LANES`], and the coefficients of the kept samples.
    fn lines(
        &self,
        axis: usize,
        through: &[[usize; 3]],
        values: &impl Values,
    ) -> (Vec<Lanes>, Vec<Lanes>) {
        let (mut lines, mut fewer) = (self.room(), self.room_for_fewer());
        let samples = PAD..PAD + self.samples;
        for (l, start) in through.iter().enumerate() {
            let mut sample = *start;
            for (i, line) in lines[samples.clone()].iter_mut().enumerate() {
                sample[axis] = i;
                line[l] = values.at(sample);
            }
        }
        let held = lines[samples].to_vec();
        dispatch!(crate::lanes::level(), _simd => self.fewer(&mut lines, &mut fewer));
        (held, fewer)
    }

    /// Computes the coefficients of fewer samples along parallel lines; also converts the samples
    /// in `lines[PAD..]` to coefficients. The new cubic spline has equal values at the kept places,
    /// and equal slopes at the first and the last.
    ///
    /// The equations are (c₍i₋₁₎ + 4cᵢ + c₍i₊₁₎)/6 = fᵢ. The condition (c₁ − c₋₁)/2 = f′₀, and the
    /// corresponding condition at the other end, eliminate the outer coefficients.
    #[inline(always)]
    fn fewer(&self, lines: &mut [Lanes], fewer: &mut [Lanes]) {
        self.solver.solve(lines);
        let count = self.count;
        if count < 2 {
            return fewer.copy_from_slice(lines);
        }
        for (taps, own) in self.taps.iter().zip(&mut fewer[PAD..]) {
            *own = taps.of(lines);
        }
        let slope = |i: usize| lanes(|l| 0.5 * self.spacing * (lines[i + 1][l] - lines[i - 1][l]));
        let slopes = [slope(PAD), slope(PAD + self.samples - 1)];
        let c = &mut fewer[PAD..];
        // Planted error "condensed grids without their slopes at a face", found by morgana-eikonal/eikonal::condensed::slopes_at_faces_are_kept:
        // c[0] = lanes(|l| (c[0][l] + 0.0 * slopes[0][l]) * 6.0 * self.factors[0]);
        c[0] = lanes(|l| (c[0][l] + slopes[0][l] / 3.0) * 6.0 * self.factors[0]);
        c[count - 1] = lanes(|l| c[count - 1][l] - slopes[1][l] / 3.0);
        for i in 1..count {
            let (below, factor) = (below(i, count), self.factors[i]);
            c[i] = lanes(|l| (6.0 * c[i][l] - below * c[i - 1][l]) * factor);
        }
        for i in (0..count - 1).rev() {
            let share = above(i) * self.factors[i];
            c[i] = lanes(|l| c[i][l] - share * c[i + 1][l]);
        }
        let before = lanes(|l| c[1][l] - 2.0 * slopes[0][l]);
        let after = lanes(|l| c[count - 2][l] + 2.0 * slopes[1][l]);
        let beyond = |a: &Lanes, b: &Lanes, c: &Lanes| lanes(|l| 3.0 * a[l] - 3.0 * b[l] + c[l]);
        let ends = [
            beyond(&before, &c[0], &c[1]),
            beyond(&after, &c[count - 1], &c[count - 2]),
        ];
        (fewer[0], fewer[1]) = (ends[0], before);
        (fewer[PAD + count], fewer[PAD + count + 1]) = (after, ends[1]);
    }
}

/// Returns the factor of coefficient i + 1 in the equation of coefficient i, after elimination of
/// the coefficient before the first.
fn above(i: usize) -> f64 {
    if i == 0 { 2.0 } else { 1.0 }
}

/// Returns the factor of coefficient i − 1 of `count` in the equation of coefficient i.
fn below(i: usize, count: usize) -> f64 {
    if i + 1 == count { 2.0 } else { 1.0 }
}

/// Computes the coefficients, in rows, of the spline through the values of a grid at fewer places,
/// with the grid's slopes at the ends.
pub(super) fn coefficients(
    values: &impl Values,
    [along_x, along_y, along_z]: &[Thinned; 3],
    lattice: &Lattice,
) -> Vec<f32> {
    let [x, y, z] = values.dims();
    let [fewer_x, fewer_y] = [along_x.stored(), along_y.stored()];
    let (mut all, mut columns) = (vec![0.0; x * y], vec![0.0; x * fewer_y]);
    // Allocate planes of coefficients that are thinned along x and y.
    let mut planes = vec![0.0; fewer_x * fewer_y * z];
    for (k, plane) in planes.chunks_exact_mut(fewer_x * fewer_y).enumerate() {
        values.plane(k, &mut all);
        // Thin along y first, where neighbouring lines are adjacent in memory.
        let along_columns = Lines {
            number: x,
            first: |i| [i, i],
            steps: [[x, 1], [x, 1]],
        };
        thin(along_y, &along_columns, &all, &mut columns);
        let along_rows = Lines {
            number: fewer_y,
            first: |j| [j * x, j * fewer_x],
            steps: [[1, x], [1, fewer_x]],
        };
        thin(along_x, &along_rows, &columns, plane);
    }
    let mut data = vec![0.0_f32; lattice.stored()];
    let [_, _, up] = lattice.strides();
    for j in 0..fewer_y {
        let across_planes = Lines {
            number: fewer_x,
            first: |i| [j * fewer_x + i, lattice.offset([i, j, 0])],
            steps: [[fewer_x * fewer_y, 1], [up, 1]],
        };
        thin(along_z, &across_planes, &planes, &mut data);
    }
    data
}

/// Arrangement of lines in memory, before and after thinning.
struct Lines<F> {
    number: usize,
    /// Start of a line, before and after thinning.
    first: F,
    /// Distances between neighbours on a line, and between neighbouring lines.
    steps: [[usize; 2]; 2],
}

/// Thins samples along lines.
fn thin<T: Stored>(
    along: &Thinned,
    lines: &Lines<impl Fn(usize) -> [usize; 2]>,
    from: &[f64],
    to: &mut [T],
) {
    let mut all = along.room();
    let mut fewer = along.room_for_fewer();
    dispatch!(crate::lanes::level(), _simd => thin_in(along, lines, from, to, [&mut all, &mut fewer]));
}

#[inline(always)]
fn thin_in<T: Stored>(
    along: &Thinned,
    lines: &Lines<impl Fn(usize) -> [usize; 2]>,
    from: &[f64],
    to: &mut [T],
    [all, fewer]: [&mut [Lanes]; 2],
) {
    for line in (0..lines.number).step_by(LANES) {
        let count = LANES.min(lines.number - line);
        let [start, end] = (lines.first)(line);
        gather(
            &from[start..],
            lines.steps[0],
            count,
            &mut all[PAD..PAD + along.samples],
        );
        along.fewer(all, fewer);
        scatter(fewer, lines.steps[1], count, &mut to[end..]);
    }
}
