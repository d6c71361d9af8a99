//! Smoothing splines, which deviate from noisy samples as far as the noise allows.
//!
//! Along a line of samples f, the coefficients c minimise |f − Bc|² + λ|D⁴c|², with B the spline's
//! values at the samples and D⁴ fourth differences (Eilers and Marx 1996). Cubic profiles do not
//! change. Waves of ω per sample are multiplied by about 1/(1 + λω⁸): waves longer than 2πλ^⅛
//! samples remain. λ is as large as possible while the noise explains the differences between the
//! samples and the spline (Reinsch 1967).
//!
//! Theory: docs/theory.md#sampled-fields.

use super::lattice::{Lattice, PAD};
use super::prefilter::{LANES, Lanes, lanes};
use std::f64::consts::PI;

/// Order of the differences that are minimised, and number of off-diagonals of the system.
const ORDER: usize = 4;
/// Weights of fourth differences D⁴.
// Planted error "third differences for fourth in smoothing splines", found by morgana-eikonal/eikonal::field_noise::smoothing_keeps_what_is_no_noise:
// const DIFFERENCE: [f64; ORDER + 1] = [0.0, -1.0, 3.0, -3.0, 1.0];
const DIFFERENCE: [f64; ORDER + 1] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Values of three neighbouring basis functions at a sample.
const VALUES: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
/// Smallest number of samples of a line that is smoothed; shorter lines are interpolated.
const MIN_SAMPLES: usize = 16;
/// Maximum number of groups of [`LANES`] lines from which λ is found.
const MAX_GROUPS: usize = 64;
/// Growth of λ^⅛ from one try to the next, and its largest value as a fraction of the line.
const GROWTH: f64 = 1.189_207_115_002_721;
const MAX_SMOOTHING_LENGTH: f64 = 1.0 / 16.0;
/// First λ^⅛; it changes only the very shortest waves.
const FIRST_SMOOTHING_LENGTH: f64 = 0.5;
/// Number of standard deviations by which residuals may exceed the value expected from noise.
const MAX_DEVIATIONS: f64 = 3.0;

/// Solver for lines of one length.
pub(super) struct Smoother {
    /// Factors of LDLᵀ: 1/D, and the entries of L before the diagonal, nearest first.
    inverse: Vec<f64>,
    lower: Vec<[f64; ORDER]>,
}

impl Smoother {
    /// Chooses the smoother for samples along an axis with noise of the given standard deviation.
    /// `None` if the samples should be interpolated.
    pub(super) fn of_noise(
        lattice: &Lattice,
        data: &[f32],
        axis: usize,
        noise: f64,
    ) -> Option<Self> {
        let samples = lattice.dims()[axis];
        if noise <= 0.0 || samples < MIN_SAMPLES {
            return None;
        }
        let lines = Lines::new(lattice, data, axis);
        // Increase λ until the residuals exceed the noise.
        let mut best = None;
        let mut length = FIRST_SMOOTHING_LENGTH;
        while length <= samples as f64 * MAX_SMOOTHING_LENGTH {
            let lambda = length.powi(2 * ORDER as i32);
            let smoother = Smoother::new(samples, lambda);
            let expected = noise * noise * rejected(lambda);
            let spread = 1.0 + MAX_DEVIATIONS * (2.0 / lines.values as f64).sqrt();
            if lines.residual(&smoother) > expected * spread {
                break;
            }
            best = Some(smoother);
            length *= GROWTH;
        }
        best
    }

    fn new(samples: usize, lambda: f64) -> Self {
        let count = samples + 2;
        // Assemble the upper half of BᵀB + λD⁴ᵀD⁴, from the diagonal on.
        let mut band = vec![[0.0; ORDER + 1]; count];
        let mut add = |from: usize, row: &[f64], factor: f64| {
            for i in 0..row.len() {
                for j in i..row.len() {
                    band[from + i][j - i] += factor * row[i] * row[j];
                }
            }
        };
        (0..samples).for_each(|i| add(i, &VALUES, 1.0));
        (0..count - ORDER).for_each(|i| add(i, &DIFFERENCE, lambda));
        // Factorise it as LDLᵀ.
        let (mut diagonal, mut lower) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for i in 0..count {
            let mut row = [0.0; ORDER];
            for back in (1..=ORDER.min(i)).rev() {
                let k = i - back;
                let before: f64 = (back + 1..=ORDER.min(i))
                    .filter(|p| p - back <= ORDER)
                    .map(|p| row[p - 1] * entry(&lower, k, p - back) * diagonal[i - p])
                    .sum();
                row[back - 1] = (band[k][back] - before) / diagonal[k];
            }
            let sum = (1..=ORDER.min(i)).map(|p| row[p - 1] * row[p - 1] * diagonal[i - p]);
            let d: f64 = band[i][0] - sum.sum::<f64>();
            diagonal.push(d);
            lower.push(row);
        }
        Smoother {
            inverse: diagonal.into_iter().map(f64::recip).collect(),
            lower,
        }
    }

    /// Converts samples in `line[1..=n]` to coefficients in `line[..n + 2]`.
    #[inline(always)]
    pub(super) fn solve(&self, lines: &mut [Lanes]) {
        let count = self.inverse.len();
        // Multiply by Bᵀ, and solve for L from the left.
        let mut before = [0.0; LANES];
        lines[0] = before;
        lines[count - 1] = before;
        for i in 0..count {
            let this = lines[i];
            let after = if i + 1 < count {
                lines[i + 1]
            } else {
                [0.0; LANES]
            };
            let [a, b, c] = VALUES;
            let mut value = lanes(|l| a * before[l] + b * this[l] + c * after[l]);
            before = this;
            for back in 1..=ORDER.min(i) {
                let factor = self.lower[i][back - 1];
                value = lanes(|l| value[l] - factor * lines[i - back][l]);
            }
            lines[i] = value;
        }
        for i in (0..count).rev() {
            let mut value = lanes(|l| lines[i][l] * self.inverse[i]);
            for ahead in 1..=ORDER.min(count - 1 - i) {
                let factor = self.lower[i + ahead][ahead - 1];
                value = lanes(|l| value[l] - factor * lines[i + ahead][l]);
            }
            lines[i] = value;
        }
    }
}

/// Returns the entry of L in row `i`, `back` places before the diagonal.
fn entry(lower: &[[f64; ORDER]], i: usize, back: usize) -> f64 {
    lower[i][back - 1]
}

/// Returns the fraction of white noise's variance that the spline does not follow: the mean of the
/// square of λd/(b² + λd) over all ω, with b and d the squares of the responses of B and D⁴.
fn rejected(lambda: f64) -> f64 {
    const STEPS: i32 = 4000;
    let part = |i: i32| {
        let cos = (PI * (f64::from(i) + 0.5) / f64::from(STEPS)).cos();
        let value = ((2.0 + cos) / 3.0).powi(2);
        let penalty = lambda * (2.0 - 2.0 * cos).powi(ORDER as i32);
        (penalty / (value + penalty)).powi(2)
    };
    (0..STEPS).map(part).sum::<f64>() / f64::from(STEPS)
}

/// Some lines along an axis, evenly distributed over the grid.
struct Lines {
    groups: Vec<Vec<Lanes>>,
    /// Number of samples on the lines.
    values: usize,
}

impl Lines {
    fn new(lattice: &Lattice, data: &[f32], axis: usize) -> Self {
        let (dims, strides) = (lattice.dims(), lattice.strides());
        let [across, other] = [(axis + 1) % 3, (axis + 2) % 3];
        let count = dims[across] * dims[other];
        let wanted = count.min(MAX_GROUPS * LANES);
        let start = |line: usize| {
            let at = line * count / wanted;
            let mut index = [PAD; 3];
            index[across] += at % dims[across];
            index[other] += at / dims[across];
            lattice.offset(index)
        };
        let value = |start: usize, k: usize| f64::from(data[start + k * strides[axis]]);
        let group = |first: usize| {
            // Repeat the last line to fill the last group.
            let starts: [usize; LANES] =
                std::array::from_fn(|l| start((first + l).min(wanted - 1)));
            (0..dims[axis])
                .map(|k| starts.map(|s| value(s, k)))
                .collect()
        };
        let groups: Vec<Vec<Lanes>> = (0..wanted).step_by(LANES).map(group).collect();
        Lines {
            values: wanted * dims[axis],
            groups,
        }
    }

    /// Returns the mean square of the residuals of a spline.
    fn residual(&self, smoother: &Smoother) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for samples in &self.groups {
            let mut lines = vec![[0.0; LANES]; samples.len() + 2];
            lines[1..=samples.len()].copy_from_slice(samples);
            smoother.solve(&mut lines);
            for (sample, c) in samples.iter().zip(lines.windows(3)) {
                let [a, b, d] = VALUES;
                let left = lanes(|l| sample[l] - a * c[0][l] - b * c[1][l] - d * c[2][l]);
                sum += left.iter().map(|v| v * v).sum::<f64>();
                count += LANES as f64;
            }
        }
        sum / count
    }
}
