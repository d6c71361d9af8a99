//! A smooth field from fewer samples (docs/theory.md#sampled-fields).

use super::lattice::{Lattice, PAD, Placement, cell, first_coefficient};
use super::{Bspline, ROUNDINGS};
use crate::bounds::Aabb;
use glam::{BVec3, DVec3};

/// Grids with fewer coefficients lie in the processor's cache as they are.
const FEW: usize = 1 << 20;
/// Samples are left out by these factors along an axis, if it keeps `FEWEST` of them.
const FACTORS: [usize; 5] = [8, 6, 4, 3, 2];
const FEWEST: usize = 16;
/// Lines along an axis that are looked at before any grid is made: so many along each of the two others.
const LINES: usize = 16;
/// The place of no factor in that list.
const NONE: usize = FACTORS.len();
/// So many grids are tried, the next with more samples along the axis that adds most to the error.
const TRIES: usize = 6;
/// Basis functions at a sample: of the coefficient before it, its own, and the next.
const AT_SAMPLE: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
/// Planes are compared in steps of so many, so that a difference is met early.
const STRIDE: usize = 7;

/// The four coefficients that act at a place along an axis, and their weights.
struct Taps {
    /// Counted from the first stored one.
    first: usize,
    weights: [f64; 4],
}

/// By how much lines of so many samples differ at most if samples are left out by each factor; infinite if too few are left.
fn errors(count: usize, lines: &[Vec<f64>]) -> [f64; FACTORS.len()] {
    FACTORS.map(|factor| {
        let fewer = Thinned::new(count, factor);
        let error = |line: &Vec<f64>| fewer.error(line);
        match fewer.count {
            0..FEWEST => f64::INFINITY,
            _ => lines.iter().map(error).fold(0.0, f64::max),
        }
    })
}

impl Bspline {
    /// The field from fewer samples, if that changes n² at no sample by more than `tolerance`: with as few as an eighth of them along each axis that allows it.
    /// `None` for grids that are small, or as fine as they have to be, and for a tolerance that is not finite.
    ///
    /// Where the samples do not change, rays are still straight lines.
    pub fn condensed(&self, tolerance: f64) -> Option<Bspline> {
        if self.is_constant() || self.coefficients.len() < FEW || !tolerance.is_finite() {
            return None;
        }
        let lines = [0, 1, 2].map(|axis| self.lines(axis));
        let errors = [0, 1, 2].map(|axis| errors(self.dims()[axis], &lines[axis]));
        // Places in the list of factors.
        let mut chosen = errors.map(|e| e.iter().position(|e| *e <= tolerance).unwrap_or(NONE));
        for _ in 0..TRIES {
            let factors = chosen.map(|i| FACTORS.get(i).copied().unwrap_or(1));
            if factors == [1; 3] {
                return None;
            }
            let found = self.thinned(factors);
            if self.is_close(&found, tolerance) {
                return Some(found);
            }
            let error = |axis: &usize| errors[*axis].get(chosen[*axis]).copied().unwrap_or(0.0);
            let worst = (0..3).max_by(|a, b| error(a).total_cmp(&error(b)))?;
            chosen[worst] += 1;
        }
        None
    }

    /// Some lines of samples along an axis: of what are coefficients along it, but values across it.
    fn lines(&self, axis: usize) -> Vec<Vec<f64>> {
        let [across, other] = [(axis + 1) % 3, (axis + 2) % 3];
        let some = |axis: usize| (0..LINES).map(move |i| PAD + i * self.dims()[axis] / LINES);
        let place = |axis: usize, i: usize| self.lattice.place(axis, i);
        let value = |i: usize, j: usize, k: usize| {
            let around = (0..9).map(|c| {
                let (b, c) = (c % 3, c / 3);
                let line = place(across, i + b - 1) + place(other, j + c - 1);
                AT_SAMPLE[b] * AT_SAMPLE[c] * f64::from(self.coefficients[line + place(axis, k)])
            });
            around.sum()
        };
        let stored = self.lattice.stored_dims()[axis];
        let line = |(i, j)| (0..stored).map(|k| value(i, j, k)).collect();
        let starts = some(across).flat_map(|i| some(other).map(move |j| (i, j)));
        starts.map(line).collect()
    }

    /// The spline through what this one is at fewer places, with its slopes at the ends.
    fn thinned(&self, factors: [usize; 3]) -> Bspline {
        let [along_x, along_y, along_z] =
            [0, 1, 2].map(|axis| Thinned::new(self.dims()[axis], factors[axis]));
        let lattice = self.thinned_lattice([along_x.count, along_y.count, along_z.count]);
        let [x, y, z] = self.lattice.stored_dims();
        let [fewer_x, fewer_y, _] = lattice.stored_dims();
        let place = |axis: usize, i: usize| self.lattice.place(axis, i);
        // Coefficients that are few along x and y, column by column along z.
        let mut columns = vec![0.0; fewer_x * fewer_y * z];
        for k in 0..z {
            let rows: Vec<Vec<f64>> = (0..y)
                .map(|j| {
                    let row = (0..x).map(|i| place(0, i) + place(1, j) + place(2, k));
                    let row: Vec<f64> = row.map(|at| f64::from(self.coefficients[at])).collect();
                    along_x.fewer(&row)
                })
                .collect();
            for i in 0..fewer_x {
                let column: Vec<f64> = rows.iter().map(|row| row[i]).collect();
                for (j, value) in along_y.fewer(&column).into_iter().enumerate() {
                    columns[(j * fewer_x + i) * z + k] = value;
                }
            }
        }
        let mut data = vec![0.0_f32; lattice.stored()];
        for (at, column) in columns.chunks_exact(z).enumerate() {
            let (i, j) = (at % fewer_x, at / fewer_x);
            for (k, value) in along_z.fewer(column).into_iter().enumerate() {
                data[lattice.offset([i, j, k])] = value as f32;
            }
        }
        let homogeneous = self.homogeneous.clone();
        Bspline {
            homogeneous,
            interpolates: false,
            // Rounding of those that these were made of, and their own.
            ..Self::of_coefficients(lattice, self.n2_ref, data, Some(ROUNDINGS))
        }
    }

    /// From the first sample of each axis to the last.
    fn thinned_lattice(&self, dims: [usize; 3]) -> Lattice {
        let (first, last) = ([0; 3], self.dims().map(|n| n - 1));
        let (start, end) = (self.lattice.position(first), self.lattice.position(last));
        // Along an axis with one sample the box may have any thickness.
        let flat = BVec3::from_array(last.map(|i| i == 0));
        let end = DVec3::select(flat, end + self.lattice.spacing(), end);
        let bounds = Aabb::new(start, end);
        Lattice::new(dims, bounds, Placement::Nodes).expect("smaller than a valid grid")
    }

    /// Whether the fields are the same within a tolerance, at the samples of this one.
    fn is_close(&self, other: &Bspline, tolerance: f64) -> bool {
        let places = |axis: usize| (0..self.dims()[axis]).map(|i| i as f64);
        let here = [0, 1, 2].map(|axis| places(axis).map(Taps::at).collect::<Vec<_>>());
        let there = [0, 1, 2].map(|axis| {
            let intervals = |count: usize| (count - 1).max(1) as f64;
            let scale = intervals(other.dims()[axis]) / intervals(self.dims()[axis]);
            places(axis)
                .map(|t| Taps::at(t * scale))
                .collect::<Vec<_>>()
        });
        let planes = here[2].len();
        (0..STRIDE)
            .flat_map(|first| (first..planes).step_by(STRIDE))
            .all(|k| {
                let (mine, theirs) = (self.plane(&here, k), other.plane(&there, k));
                mine.iter()
                    .zip(&theirs)
                    .all(|(a, b)| (b - a).abs() <= tolerance)
            })
    }

    /// n² − n_ref² at all x and y of the places, x fastest, at the z of one.
    fn plane(&self, [along_x, along_y, along_z]: &[Vec<Taps>; 3], k: usize) -> Vec<f64> {
        let [x, y, _] = self.lattice.stored_dims();
        let place = |axis, i| self.lattice.place(axis, i);
        let columns: Vec<usize> = (0..x).map(|i| place(0, i)).collect();
        let mut rows = vec![0.0; x * y];
        let z = &along_z[k];
        for (j, row) in rows.chunks_exact_mut(x).enumerate() {
            for (c, weight) in z.weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let start = place(1, j) + place(2, z.first + c);
                for (sum, at) in row.iter_mut().zip(&columns) {
                    *sum += weight * f64::from(self.coefficients[start + at]);
                }
            }
        }
        let mut values = Vec::with_capacity(along_x.len() * along_y.len());
        let mut line = vec![0.0; x];
        for taps in along_y {
            line.fill(0.0);
            for (c, weight) in taps.weights.iter().enumerate() {
                let row = &rows[(taps.first + c) * x..][..x];
                line.iter_mut()
                    .zip(row)
                    .for_each(|(sum, v)| *sum += weight * v);
            }
            values.extend(
                along_x
                    .iter()
                    .map(|taps| taps.sum(|c| line[taps.first + c])),
            );
        }
        values
    }
}

/// Fewer samples along an axis, the first and the last where they were.
struct Thinned {
    count: usize,
    /// Distance of neighbours, in units of what it was.
    spacing: f64,
}

impl Thinned {
    fn new(samples: usize, factor: usize) -> Self {
        let intervals = samples - 1;
        let count = intervals.div_ceil(factor) + 1;
        Thinned {
            count,
            spacing: intervals as f64 / (count - 1).max(1) as f64,
        }
    }

    /// Where they lie, in units of the former spacing.
    fn places(&self) -> impl Iterator<Item = f64> {
        let spacing = self.spacing;
        (0..self.count).map(move |i| i as f64 * spacing)
    }

    /// Coefficients of fewer samples along a line, from those of all: of the cubic spline that has the same values at their
    /// places, and the same slopes at the first and the last.
    ///
    /// (c₍i₋₁₎ + 4cᵢ + c₍i₊₁₎)/6 = fᵢ, of which (c₁ − c₋₁)/2 = f′₀ and its like at the other end eliminate what lies outside.
    fn fewer(&self, line: &[f64]) -> Vec<f64> {
        let count = self.count;
        if count < 2 {
            return line.to_vec();
        }
        let places = self.places().map(|t| Taps::at(t).of(line));
        let mut c: Vec<f64> = places.collect();
        let slope = |i: usize| 0.5 * self.spacing * (line[i + 1] - line[i - 1]);
        let slopes = [slope(PAD), slope(line.len() - 1 - PAD)];
        c[0] += slopes[0] / 3.0;
        c[count - 1] -= slopes[1] / 3.0;
        let above = |i: usize| if i == 0 { 2.0 } else { 1.0 };
        let below = |i: usize| if i + 1 == count { 2.0 } else { 1.0 };
        let mut factors = vec![0.25];
        c[0] *= 6.0 * factors[0];
        for i in 1..count {
            let factor = 1.0 / (4.0 - below(i) * above(i - 1) * factors[i - 1]);
            c[i] = (6.0 * c[i] - below(i) * c[i - 1]) * factor;
            factors.push(factor);
        }
        for i in (0..count - 1).rev() {
            c[i] -= above(i) * factors[i] * c[i + 1];
        }
        let before = c[1] - 2.0 * slopes[0];
        let after = c[count - 2] + 2.0 * slopes[1];
        let [beyond_first, beyond_last] = [
            3.0 * before - 3.0 * c[0] + c[1],
            3.0 * after - 3.0 * c[count - 1] + c[count - 2],
        ];
        let inner = c.iter().copied();
        let start = [beyond_first, before].into_iter();
        start.chain(inner).chain([after, beyond_last]).collect()
    }

    /// By how much splines through fewer samples of a line of coefficients differ from it at most, at its samples.
    fn error(&self, line: &[f64]) -> f64 {
        let fewer = self.fewer(line);
        let difference = |i: usize| {
            let there = Taps::at(i as f64 / self.spacing).of(&fewer);
            (Taps::at(i as f64).of(line) - there).abs()
        };
        (0..line.len() - 2 * PAD)
            .map(difference)
            .fold(0.0, f64::max)
    }
}

impl Taps {
    /// At a coordinate counted from the first sample.
    fn at(t: f64) -> Self {
        let cell = cell(t);
        let t = t - cell as f64;
        let s = 1.0 - t;
        Taps {
            first: first_coefficient(cell) as usize,
            weights: [
                s * s * s / 6.0,
                (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
                t * t * t / 6.0,
            ],
        }
    }

    fn sum(&self, coefficient: impl Fn(usize) -> f64) -> f64 {
        (0..4).map(|c| self.weights[c] * coefficient(c)).sum()
    }

    /// Along a line.
    fn of(&self, line: &[f64]) -> f64 {
        self.sum(|c| line[self.first + c])
    }
}
