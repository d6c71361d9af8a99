//! Values of grids, sample by sample.

use super::Bspline;
use super::lattice::{cell, first_coefficient};
use super::prefilter::{LANES, Lanes};

/// Number of samples tested together.
const SAMPLES_PER_TEST: usize = 1 << 12;

/// Contrasts δ = n² − n_ref² at the samples of a grid.
pub(super) trait Values {
    /// Returns the number of samples along each axis.
    fn dims(&self) -> [usize; 3];

    /// Returns the contrast at one sample.
    fn at(&self, sample: [usize; 3]) -> f64;

    /// Computes the contrasts at all samples of a plane across z, x fastest.
    fn plane(&self, k: usize, values: &mut [f64]);
}

/// Samples from which the index is computed, x fastest, then y, then z.
pub(super) struct Samples<'a, T, F> {
    dims: [usize; 3],
    data: &'a [T],
    /// Function from a sample to the index.
    index: F,
    n2_ref: f64,
}

impl<'a, T: Copy + Into<f64>, F: Fn(f64) -> f64> Samples<'a, T, F> {
    /// Creates the samples, with n² of the middle sample as reference. `None` if all samples are
    /// equal, or if an index is not positive and finite.
    pub(super) fn new(dims: [usize; 3], data: &'a [T], index: F) -> Option<Self> {
        let is_index = |v: T| {
            let n = index(v.into());
            (n > 0.0) & (n < f64::INFINITY)
        };
        let first: f64 = (*data.first()?).into();
        let is_first = |v: T| v.into() == first;
        if data.len() != dims.iter().product() || all(data, is_first) || !all(data, is_index) {
            return None;
        }
        let mut samples = Samples {
            dims,
            data,
            index,
            n2_ref: 0.0,
        };
        samples.n2_ref = samples.at(dims.map(|n| n / 2));
        Some(samples)
    }

    pub(super) fn n2_ref(&self) -> f64 {
        self.n2_ref
    }

    fn delta(&self, sample: T) -> f64 {
        let n = (self.index)(sample.into());
        n * n - self.n2_ref
    }
}

impl<T: Copy + Into<f64>, F: Fn(f64) -> f64> Values for Samples<'_, T, F> {
    fn dims(&self) -> [usize; 3] {
        self.dims
    }

    fn at(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [x, y, _] = self.dims;
        self.delta(self.data[(k * y + j) * x + i])
    }

    fn plane(&self, k: usize, values: &mut [f64]) {
        let size = values.len();
        let samples = &self.data[k * size..][..size];
        for (value, sample) in values.iter_mut().zip(samples) {
            *value = self.delta(*sample);
        }
    }
}

impl Values for Bspline {
    fn dims(&self) -> [usize; 3] {
        self.lattice.dims()
    }

    fn at(&self, sample: [usize; 3]) -> f64 {
        let taps = sample.map(|i| Taps::at(i as f64));
        let place = |axis: usize, c: usize| self.lattice.place(axis, taps[axis].first + c);
        taps[2].sum(|c| {
            taps[1].sum(|b| {
                let row = place(1, b) + place(2, c);
                taps[0].sum(|a| f64::from(self.coefficients[row + place(0, a)]))
            })
        })
    }

    fn plane(&self, k: usize, values: &mut [f64]) {
        let places = |axis: usize| (0..self.dims()[axis]).map(|i| i as f64);
        let taps = [0, 1, 2].map(|axis| places(axis).map(Taps::at).collect::<Vec<_>>());
        let columns: Vec<usize> = (0..self.lattice.stored_dims()[0])
            .map(|i| self.lattice.place(0, i))
            .collect();
        let add = |[j, k]: [usize; 2], weight: f64, sums: &mut [f64]| {
            let row = &self.coefficients[self.lattice.place(1, j) + self.lattice.place(2, k)..];
            let terms = sums.iter_mut().zip(&columns);
            terms.for_each(|(sum, at)| *sum += weight * f64::from(row[*at]));
        };
        plane(self.lattice.stored_dims(), &taps, k, &add, values);
    }
}

/// Returns true if `is` holds for all samples; tests several samples together with vector
/// instructions.
fn all<T: Copy>(samples: &[T], is: impl Fn(T) -> bool) -> bool {
    let all = |some: &[T]| some.iter().fold(true, |all, v| all & is(*v));
    samples.chunks(SAMPLES_PER_TEST).all(all)
}

/// The four coefficients that act at a place along an axis, and their weights.
pub(super) struct Taps {
    /// Index of the first coefficient, counted from the first stored coefficient.
    first: usize,
    weights: [f64; 4],
}

impl Taps {
    /// Computes the taps at a coordinate counted from the first sample.
    pub(super) fn at(t: f64) -> Self {
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

    #[inline(always)]
    fn sum(&self, coefficient: impl Fn(usize) -> f64) -> f64 {
        (0..4).map(|c| self.weights[c] * coefficient(c)).sum()
    }

    /// Returns the coefficients with non-zero weights.
    fn acting(&self) -> impl Iterator<Item = (usize, f64)> {
        let all = (self.first..).zip(self.weights);
        all.filter(|(_, weight)| *weight != 0.0)
    }

    /// Evaluates the spline on parallel lines.
    #[inline(always)]
    pub(super) fn of(&self, lines: &[Lanes]) -> Lanes {
        let mut sums = [0.0; LANES];
        for (weight, line) in self.weights.iter().zip(&lines[self.first..]) {
            for (sum, v) in sums.iter_mut().zip(line) {
                *sum += weight * v;
            }
        }
        sums
    }
}

/// Evaluates a spline at all x and y of some places, x fastest, at the z with index `k`. `add` adds
/// the row of coefficients at a y and a z, times a weight, to sums.
pub(super) fn plane(
    [x, y, _]: [usize; 3],
    [along_x, along_y, along_z]: &[Vec<Taps>; 3],
    k: usize,
    add: &impl Fn([usize; 2], f64, &mut [f64]),
    values: &mut [f64],
) {
    let mut rows = vec![0.0; x * y];
    let at_z = &along_z[k];
    for (j, row) in rows.chunks_exact_mut(x).enumerate() {
        for (c, weight) in at_z.acting() {
            add([j, c], weight, row);
        }
    }
    let mut line = vec![0.0; x];
    for (at_y, values) in along_y.iter().zip(values.chunks_exact_mut(along_x.len())) {
        line.fill(0.0);
        for (j, weight) in at_y.acting() {
            let terms = line.iter_mut().zip(&rows[j * x..]);
            terms.for_each(|(sum, v)| *sum += weight * v);
        }
        for (value, at_x) in values.iter_mut().zip(along_x) {
            let near = &line[at_x.first..at_x.first + 4];
            *value = at_x.sum(|c| near[c]);
        }
    }
}
