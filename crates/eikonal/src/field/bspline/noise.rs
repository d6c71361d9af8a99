//! Effect of noise in samples on derivatives (docs/theory.md#sampled-fields).

use super::Bspline;
use super::lattice::PAD;

/// Responses of the interpolating spline to white noise at the samples, per standard deviation and
/// in units of the spacing. They are the responses of first and second derivatives and of fourth
/// differences.
const RESPONSES: [f64; 3] = [1.18, 6.0, 21.9];
/// Standard deviation of fourth differences of white noise, √70, relative to the noise.
const FOURTH_DIFFERENCE_DEVIATION: f64 = 8.366_600_265_340_756;
/// Smallest number of samples along an axis for which noise is estimated.
const MIN_SAMPLES: usize = 8;
/// Number of lines along an axis that are examined, along each of the two other axes.
const LINES: usize = 24;

/// Fractions of the derivatives of n² that are noise, 0 to 1: root mean square of the noise over
/// root mean square of the derivative, over the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoiseShares {
    /// Fraction of the first derivatives, which bend rays, that is noise.
    pub first: f64,
    /// Fraction of the second derivatives, which determine focusing and brightness, that is noise.
    pub second: f64,
    /// Fraction of the fourth derivatives, which determine steps, that is noise.
    pub fourth: f64,
}

/// Sums over the places examined along one axis.
#[derive(Default)]
struct Sums {
    /// Squares of the derivatives, in units of the spacing.
    squares: [f64; 3],
    /// Squares of fourth differences of the samples.
    rough: f64,
    count: f64,
}

impl Bspline {
    /// Returns the fractions of the field's derivatives caused by noise in the samples of n, if the
    /// samples are interpolated. `sigma` is the standard deviation of the noise. Along an axis with
    /// samples smoother than this noise, the roughness of the samples is used instead.
    pub fn noise_shares(&self, sigma: f64) -> NoiseShares {
        let (mut noise, mut total) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let sums = self.sums(axis);
            if sums.count == 0.0 {
                continue;
            }
            let shown = (sums.rough / sums.count).sqrt() / FOURTH_DIFFERENCE_DEVIATION;
            let sigma = shown.min(2.0 * self.n2_ref.sqrt() * sigma);
            let per = self.lattice.per_spacing()[axis];
            for (k, order) in [1, 2, 4].into_iter().enumerate() {
                let unit = per.powi(2 * order);
                noise[k] += (sigma * RESPONSES[k]).powi(2) * unit;
                total[k] += sums.squares[k] / sums.count * unit;
            }
        }
        let share = |k: usize| {
            if total[k] > 0.0 {
                (noise[k] / total[k]).sqrt().min(1.0)
            } else {
                0.0
            }
        };
        NoiseShares {
            first: share(0),
            second: share(1),
            fourth: share(2),
        }
    }

    fn sums(&self, axis: usize) -> Sums {
        let dims = self.lattice.dims();
        let mut sums = Sums::default();
        if dims[axis] < MIN_SAMPLES {
            return sums;
        }
        let [across, other] = [(axis + 1) % 3, (axis + 2) % 3];
        let some = |n: usize| (0..n.min(LINES)).map(move |i| i * n / n.min(LINES));
        for j in some(dims[across]) {
            for k in some(dims[other]) {
                let line = self.lattice.place(across, PAD + j) + self.lattice.place(other, PAD + k);
                let at = |i: usize| {
                    f64::from(self.coefficients[line + self.lattice.place(axis, PAD + i)])
                };
                let line: Vec<f64> = (0..dims[axis]).map(at).collect();
                line.windows(7).for_each(|c| sums.add(c));
            }
        }
        sums
    }
}

impl Sums {
    /// Adds seven consecutive coefficients.
    fn add(&mut self, c: &[f64]) {
        let fourth = |c: &[f64]| c[0] - 4.0 * c[1] + 6.0 * c[2] - 4.0 * c[3] + c[4];
        let derivatives = [
            0.5 * (c[4] - c[2]),
            c[2] - 2.0 * c[3] + c[4],
            fourth(&c[1..]),
        ];
        for (sum, d) in self.squares.iter_mut().zip(derivatives) {
            *sum += d * d;
        }
        let rough = (fourth(c) + 4.0 * fourth(&c[1..]) + fourth(&c[2..])) / 6.0;
        self.rough += rough * rough;
        self.count += 1.0;
    }
}
