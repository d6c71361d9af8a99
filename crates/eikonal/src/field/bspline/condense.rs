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
/// A change that exceeds the tolerance by this factor at one sample does so, too, with rounded coefficients.
const CERTAIN: f64 = 1.25;
/// Coefficients further from a value than so many of the fewer samples have shares below 1e-9 in it.
const REACH: f64 = 16.0;
/// Most samples along an axis for which shares are found: all of them times those within reach are held.
const LONGEST: usize = 4096;
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
        let mut suspects = Vec::new();
        for (axis, lines) in lines.iter().enumerate() {
            suspects.extend(
                FACTORS
                    .get(chosen[axis])
                    .map(|f| self.worst(axis, lines, *f)),
            );
        }
        for _ in 0..TRIES {
            let factors = chosen.map(|i| FACTORS.get(i).copied().unwrap_or(1));
            if factors == [1; 3] {
                return None;
            }
            let is_off = |sample: &[usize; 3]| self.change(factors, *sample) > CERTAIN * tolerance;
            let is_long = self.dims().iter().any(|count| *count > LONGEST);
            if is_long || !suspects.iter().any(is_off) {
                let found = self.thinned(factors);
                let Some(sample) = self.difference(&found, tolerance) else {
                    return Some(found);
                };
                if !self.allows_fewer(sample, tolerance) {
                    return None;
                }
                suspects.push(sample);
            }
            let error = |axis: &usize| errors[*axis].get(chosen[*axis]).copied().unwrap_or(0.0);
            let worst = (0..3).max_by(|a, b| error(a).total_cmp(&error(b)))?;
            chosen[worst] += 1;
        }
        None
    }

    /// The sample that changes most of all on some lines along an axis if samples are left out along it by a factor.
    fn worst(&self, axis: usize, lines: &[Vec<f64>], factor: usize) -> [usize; 3] {
        let fewer = Thinned::new(self.dims()[axis], factor);
        let (mut most, mut worst) = (f64::NEG_INFINITY, [0; 3]);
        for (line, mut sample) in lines.iter().zip(self.starts(axis)) {
            for (i, change) in fewer.changes(line).enumerate() {
                if change > most {
                    sample[axis] = i;
                    (most, worst) = (change, sample);
                }
            }
        }
        worst
    }

    /// Returns the change of n² at a sample if samples are left out by these factors, up to the rounding of coefficients.
    fn change(&self, factors: [usize; 3], sample: [usize; 3]) -> f64 {
        let shares = [0, 1, 2].map(|axis| {
            let thinned = Thinned::new(self.dims()[axis], factors[axis]);
            let shares = thinned.shares(sample[axis]).into_iter();
            let placed = shares.map(|(i, share)| (self.lattice.place(axis, i), share));
            placed.collect::<Vec<_>>()
        });
        let mut there = 0.0;
        for (k, share_k) in &shares[2] {
            for (j, share_j) in &shares[1] {
                let along = shares[0].iter();
                let row = along.map(|(i, share)| share * f64::from(self.coefficients[i + j + k]));
                there += share_k * share_j * row.sum::<f64>();
            }
        }
        let here = Taps::at(sample[0] as f64).of(&self.line(0, sample));
        (there - here).abs()
    }

    /// Some lines of samples along an axis.
    fn lines(&self, axis: usize) -> Vec<Vec<f64>> {
        let lines = self.starts(axis).map(|sample| self.line(axis, sample));
        lines.collect()
    }

    /// The first samples of these lines.
    fn starts(&self, axis: usize) -> impl Iterator<Item = [usize; 3]> {
        let [across, other] = [(axis + 1) % 3, (axis + 2) % 3];
        let dims = self.dims();
        let some = move |axis: usize| (0..LINES).map(move |i| i * dims[axis] / LINES);
        some(across).flat_map(move |i| {
            some(other).map(move |j| {
                let mut sample = [0; 3];
                (sample[across], sample[other]) = (i, j);
                sample
            })
        })
    }

    /// The line along an axis through a sample: of what are coefficients along it, but values across it.
    fn line(&self, axis: usize, sample: [usize; 3]) -> Vec<f64> {
        let [across, other] = [(axis + 1) % 3, (axis + 2) % 3];
        let place = |axis: usize, i: usize| self.lattice.place(axis, i);
        let value = |k: usize| {
            let around = (0..9).map(|c| {
                let (b, c) = (c % 3, c / 3);
                let line = place(across, PAD + sample[across] + b - 1)
                    + place(other, PAD + sample[other] + c - 1);
                AT_SAMPLE[b] * AT_SAMPLE[c] * f64::from(self.coefficients[line + place(axis, k)])
            });
            around.sum()
        };
        (0..self.lattice.stored_dims()[axis]).map(value).collect()
    }

    /// Returns whether fewer samples hold the line through a sample along at least one axis.
    fn allows_fewer(&self, sample: [usize; 3], tolerance: f64) -> bool {
        (0..3).any(|axis| {
            let errors = errors(self.dims()[axis], &[self.line(axis, sample)]);
            errors.iter().any(|e| *e <= tolerance)
        })
    }

    /// The spline through what this one is at fewer places, with its slopes at the ends.
    fn thinned(&self, factors: [usize; 3]) -> Bspline {
        let [along_x, along_y, along_z] =
            [0, 1, 2].map(|axis| Thinned::new(self.dims()[axis], factors[axis]));
        let lattice = self.thinned_lattice([along_x.count, along_y.count, along_z.count]);
        let [x, y, z] = self.lattice.stored_dims();
        let [fewer_x, fewer_y, _] = lattice.stored_dims();
        let place = |axis: usize, i: usize| self.lattice.place(axis, i);
        // Planes of coefficients that are few along x and y.
        let mut planes = Vec::with_capacity(fewer_x * fewer_y * z);
        let places = |axis: usize, count: usize| -> Vec<usize> {
            (0..count).map(|i| place(axis, i)).collect()
        };
        let (at_x, at_y) = (places(0, x), places(1, y));
        for k in 0..z {
            // Lines along x lie beside each other, then those along y.
            let plane = &self.coefficients[place(2, k)..];
            let lines = at_x
                .iter()
                .flat_map(|i| at_y.iter().map(move |j| f64::from(plane[i + j])));
            let lines = along_x.fewer(&lines.collect::<Vec<_>>(), y);
            let turned = (0..y).flat_map(|j| (0..fewer_x).map(move |i| (i, j)));
            let lines: Vec<f64> = turned.map(|(i, j)| lines[i * y + j]).collect();
            planes.extend(along_y.fewer(&lines, fewer_x));
        }
        let mut data = vec![0.0_f32; lattice.stored()];
        for j in 0..fewer_y {
            let rows = (0..z).flat_map(|k| &planes[(k * fewer_y + j) * fewer_x..][..fewer_x]);
            let lines: Vec<f64> = rows.copied().collect();
            for (at, value) in along_z.fewer(&lines, fewer_x).into_iter().enumerate() {
                data[lattice.offset([at % fewer_x, j, at / fewer_x])] = value as f32;
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

    /// A sample of this field where the other one differs by more than a tolerance.
    fn difference(&self, other: &Bspline, tolerance: f64) -> Option<[usize; 3]> {
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
            .find_map(|k| {
                let (mine, theirs) = (self.plane(&here, k), other.plane(&there, k));
                let apart = |(a, b): (&f64, &f64)| (b - a).abs() > tolerance;
                let at = mine.iter().zip(&theirs).position(apart)?;
                Some([at % here[0].len(), at / here[0].len(), k])
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
    /// Number of samples that there were.
    samples: usize,
    count: usize,
    /// Distance of neighbours, in units of what it was.
    spacing: f64,
    /// The former coefficients around each sample.
    taps: Vec<Taps>,
    /// Pivots of the elimination.
    factors: Vec<f64>,
}

impl Thinned {
    fn new(samples: usize, factor: usize) -> Self {
        let intervals = samples - 1;
        let count = intervals.div_ceil(factor) + 1;
        let spacing = intervals.max(1) as f64 / (count - 1).max(1) as f64;
        let mut factors = vec![0.25];
        for i in 1..count {
            let product = below(i, count) * above(i - 1) * factors[i - 1];
            factors.push(1.0 / (4.0 - product));
        }
        Thinned {
            samples,
            count,
            spacing,
            taps: (0..count).map(|i| Taps::at(i as f64 * spacing)).collect(),
            factors,
        }
    }

    /// Coefficients of fewer samples along lines, from those of all: of the cubic spline that has the same values at their
    /// places, and the same slopes at the first and the last. The lines lie beside each other: `width` numbers are their first ones.
    ///
    /// (c₍i₋₁₎ + 4cᵢ + c₍i₊₁₎)/6 = fᵢ, of which (c₁ − c₋₁)/2 = f′₀ and its like at the other end eliminate what lies outside.
    fn fewer(&self, lines: &[f64], width: usize) -> Vec<f64> {
        let count = self.count;
        if count < 2 {
            return lines.to_vec();
        }
        let all = |i: usize| &lines[i * width..][..width];
        let mut fewer = vec![0.0; (count + 2 * PAD) * width];
        for (taps, out) in self
            .taps
            .iter()
            .zip(fewer[PAD * width..].chunks_exact_mut(width))
        {
            let around: [&[f64]; 4] = std::array::from_fn(|c| all(taps.first + c));
            for (k, out) in out.iter_mut().enumerate() {
                *out = taps.sum(|c| around[c][k]);
            }
        }
        let last = lines.len() / width - 1 - PAD;
        let slopes: Vec<[f64; 2]> = (0..width)
            .map(|k| [PAD, last].map(|i| 0.5 * self.spacing * (all(i + 1)[k] - all(i - 1)[k])))
            .collect();
        let row = |i: usize| (i + PAD) * width;
        for (k, slopes) in slopes.iter().enumerate() {
            fewer[row(0) + k] += slopes[0] / 3.0;
            fewer[row(count - 1) + k] -= slopes[1] / 3.0;
            fewer[row(0) + k] *= 6.0 * self.factors[0];
        }
        for i in 1..count {
            let (below, factor) = (below(i, count), self.factors[i]);
            let (before, own) = fewer.split_at_mut(row(i));
            let before = &before[row(i - 1)..];
            for (own, before) in own.iter_mut().zip(before) {
                *own = (6.0 * *own - below * before) * factor;
            }
        }
        for i in (0..count - 1).rev() {
            let share = above(i) * self.factors[i];
            let (own, after) = fewer.split_at_mut(row(i + 1));
            for (own, after) in own[row(i)..].iter_mut().zip(after) {
                *own -= share * *after;
            }
        }
        for (k, slopes) in slopes.iter().enumerate() {
            let at = |i: usize| fewer[row(i) + k];
            let before = at(1) - 2.0 * slopes[0];
            let after = at(count - 2) + 2.0 * slopes[1];
            let [beyond_first, beyond_last] = [
                3.0 * before - 3.0 * at(0) + at(1),
                3.0 * after - 3.0 * at(count - 1) + at(count - 2),
            ];
            fewer[k] = beyond_first;
            fewer[width + k] = before;
            fewer[row(count) + k] = after;
            fewer[row(count + 1) + k] = beyond_last;
        }
        fewer
    }

    /// Returns the differences at all samples between a line of coefficients and the spline through fewer of its samples.
    fn changes(&self, line: &[f64]) -> impl Iterator<Item = f64> {
        let fewer = self.fewer(line, 1);
        (0..self.samples).map(move |i| {
            let there = Taps::at(i as f64 / self.spacing).of(&fewer);
            (Taps::at(i as f64).of(line) - there).abs()
        })
    }

    /// The largest of them.
    fn error(&self, line: &[f64]) -> f64 {
        self.changes(line).fold(0.0, f64::max)
    }

    /// Shares of the coefficients of a line in the value at a sample of the spline through fewer samples, of those within reach.
    fn shares(&self, sample: usize) -> Vec<(usize, f64)> {
        let (stored, reach) = (self.samples + 2 * PAD, (REACH * self.spacing) as usize);
        let near = sample.saturating_sub(reach)..(sample + reach + 2 * PAD).min(stored);
        let width = near.len();
        let mut units = vec![0.0; stored * width];
        for (k, i) in near.clone().enumerate() {
            units[i * width + k] = 1.0;
        }
        let fewer = self.fewer(&units, width);
        let taps = Taps::at(sample as f64 / self.spacing);
        let share = |(k, i)| (i, taps.sum(|c| fewer[(taps.first + c) * width + k]));
        near.enumerate().map(share).collect()
    }
}

/// Factor of coefficient i + 1 in the equation of coefficient i, once the coefficient before the first is eliminated.
fn above(i: usize) -> f64 {
    if i == 0 { 2.0 } else { 1.0 }
}

/// Factor of coefficient i − 1 of `count` in the equation of coefficient i.
fn below(i: usize, count: usize) -> f64 {
    if i + 1 == count { 2.0 } else { 1.0 }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The change that is foretold at a sample is that of the field from fewer samples, to the rounding of coefficients.
    #[test]
    fn changes_at_samples_are_foretold() {
        let rough =
            |x: DVec3| 1.3 + 1e-2 * (9.0 * x.x).sin() * (7.0 * x.y).cos() + 1e-2 * x.z.powi(3);
        let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        for dims in [[61, 50, 43], [80, 70, 1]] {
            let fine = Bspline::from_fn(dims, bounds, Placement::Nodes, rough).unwrap();
            let factors = [4, 3, if dims[2] > 1 { 2 } else { 1 }];
            let fewer = fine.thinned(factors);
            let scale = |axis: usize| {
                let intervals = |field: &Bspline| (field.dims()[axis] - 1).max(1) as f64;
                intervals(&fewer) / intervals(&fine)
            };
            let value = |field: &Bspline, place: [f64; 3]| {
                let taps = place.map(Taps::at);
                let at = |axis: usize, c: usize| field.lattice.place(axis, taps[axis].first + c);
                let along_x = |j: usize, k: usize| {
                    taps[0].sum(|c| f64::from(field.coefficients[at(0, c) + j + k]))
                };
                taps[2].sum(|c| taps[1].sum(|b| along_x(at(1, b), at(2, c))))
            };
            let mut most = 0.0;
            for sample in [
                [0, 0, 0],
                [7, 11, 5],
                [30, 49, 21],
                [60, 25, 42],
                [41, 2, 33],
            ] {
                let sample: [usize; 3] =
                    std::array::from_fn(|axis| sample[axis].min(dims[axis] - 1));
                let here = sample.map(|i| i as f64);
                let there = std::array::from_fn(|axis| here[axis] * scale(axis));
                let change = (value(&fewer, there) - value(&fine, here)).abs();
                let foretold = fine.change(factors, sample);
                assert!(
                    (change - foretold).abs() < 1e-8,
                    "{sample:?}: {change} {foretold}"
                );
                most = f64::max(most, change);
            }
            assert!(most > 1e-6, "{most}");
        }
    }
}
