//! Diffraction images of apertures of square cells (docs/theory.md#diffraction-at-the-aperture).

use super::sharpen::sharpened;
use crate::sampling::{Grid2, PickedCell};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::PI;

/// Minimum number of nodes per cell along each axis of a period of the pattern.
const MIN_NODES_PER_CELL: usize = 8;
/// Minimum number of nodes along each axis.
const MIN_NODES: usize = 2048;
/// Number of orders on each side of the centre that are treated one by one. The power beyond falls
/// like a continuum.
const ORDERS: i32 = 16;

/// Squared modulus of the Fourier transform of square cells, as a density of spatial frequencies.
///
/// For N × N cells of width h, it is sinc²(f_x) sinc²(f_y) P(f). The power P of the discrete
/// transform has period one in f = h × frequency. The sinc² factors add up to one over the periods.
/// Hence P is the density within a period, and the sinc² factors are the probabilities of the
/// periods. The transmitted power in excess of the square of the mean amplitude comes from detail
/// finer than the cells. It spreads as from single cells, with P constant in f.
#[derive(Debug)]
pub(super) struct MaskPattern {
    /// Density P at f = (i, j)/M for 0 ≤ j ≤ M/2, halved in the first and last rows: P(−f) = P(f).
    nodes: Grid2,
    /// Fraction of the light that follows P.
    coherent: f64,
    /// Period M, in nodes.
    period: usize,
    /// Reduced radius of f = 1.
    scale: f64,
}

impl MaskPattern {
    /// Computes the pattern of `side`² cells with the given mean amplitudes, not all zero and at
    /// most one each, that transmit the given `power`.
    pub(super) fn new(side: usize, amplitudes: &[f64], power: f64) -> Self {
        let period = (MIN_NODES_PER_CELL * side).max(MIN_NODES);
        let nodes = Grid2::new(period, period / 2 + 1, &powers(period, side, amplitudes));
        let Ok(nodes) = nodes else {
            unreachable!("an aperture that is open lets light pass");
        };
        let coherent = amplitudes.iter().map(|a| a * a).sum::<f64>() / power;
        // Sharpening may increase the power of edges along the sides of cells by more than they
        // lose.
        let coherent = coherent.min(1.0);
        MaskPattern {
            nodes,
            coherent,
            period,
            // f = 1 is one period per cell, which is 2/side of the radius, and v = 2π × periods per
            // radius.
            scale: PI * side as f64,
        }
    }

    /// Samples the direction of the light, in reduced radii along x and y, from two pairs of
    /// uniform numbers in [0, 1).
    pub(super) fn sample(&self, u: [f64; 2], jitter: [f64; 2]) -> [f64; 2] {
        let (f, within) = if u[0] < self.coherent {
            self.in_period([u[0] / self.coherent, u[1]], jitter)
        } else {
            let rest = (u[0] - self.coherent) / (1.0 - self.coherent);
            (jitter.map(|f| f - 0.5), [rest, u[1]])
        };
        [0, 1].map(|axis| self.scale * (f[axis] + order(f[axis], within[axis])))
    }

    /// Samples a position within a period with density P. Also returns the remainder of the first
    /// pair of numbers.
    fn in_period(&self, u: [f64; 2], jitter: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let PickedCell {
            cell: [i, j],
            within: [a, b],
        } = self.nodes.pick(u);
        let (sign, a) = if a < 0.5 {
            (1.0, 2.0 * a)
        } else {
            (-1.0, 2.0 * a - 1.0)
        };
        let column = if 2 * i < self.period {
            i as f64
        } else {
            i as f64 - self.period as f64
        };
        let at = |node: f64, jitter: f64| sign * (node + tent(jitter)) / self.period as f64;
        ([at(column, jitter[0]), at(j as f64, jitter[1])], [a, b])
    }
}

/// Computes P on half of the nodes, sharpened, row by row.
fn powers(period: usize, side: usize, amplitudes: &[f64]) -> Vec<f64> {
    // Transform the rows, then the columns.
    let fft = FftPlanner::new().plan_fft_forward(period);
    let rows: Vec<_> = amplitudes
        .chunks_exact(side)
        .map(|row| transform(&*fft, row.iter().map(|a| Complex::from(*a))))
        .collect();
    let half = period / 2 + 1;
    let mut powers = vec![0.0; period * half];
    for i in 0..period {
        let column = transform(&*fft, rows.iter().map(|row| row[i]));
        let power: Vec<f64> = column.iter().map(Complex::norm_sqr).collect();
        for (j, power) in sharpened(&power).take(half).enumerate() {
            powers[j * period + i] = power;
        }
    }
    // Sharpen the rows, and halve the first and last one.
    for (j, row) in powers.chunks_exact_mut(period).enumerate() {
        let weight = if j == 0 || j + 1 == half { 0.5 } else { 1.0 };
        let sharp: Vec<f64> = sharpened(row).map(|p| weight * p.max(0.0)).collect();
        row.copy_from_slice(&sharp);
    }
    powers
}

/// Returns the discrete transform of some values, padded with zeros.
fn transform(fft: &dyn Fft<f64>, values: impl Iterator<Item = Complex<f64>>) -> Vec<Complex<f64>> {
    let mut buffer: Vec<_> = values.collect();
    buffer.resize(fft.len(), Complex::ZERO);
    fft.process(&mut buffer);
    buffer
}

/// Samples a number in (−1, 1) with density 1 − |t|.
fn tent(u: f64) -> f64 {
    if u < 0.5 {
        (2.0 * u).sqrt() - 1.0
    } else {
        1.0 - (2.0 * (1.0 - u)).sqrt()
    }
}

/// Samples an integer m with probability sinc²(f + m).
fn order(f: f64, u: f64) -> f64 {
    let sine = (PI * f).sin() / PI;
    let (mut u, mut left) = (u, 1.0);
    for m in std::iter::once(0).chain((1..=ORDERS).flat_map(|m| [m, -m])) {
        let x = f + f64::from(m);
        let probability = if x == 0.0 { 1.0 } else { (sine / x).powi(2) };
        if u < probability {
            return f64::from(m);
        }
        u -= probability;
        left -= probability;
    }
    // On either side, the power beyond an order is inversely proportional to the order.
    let share = u / left;
    let (side, beyond) = if share < 0.5 {
        (1.0, 1.0 - 2.0 * share)
    } else {
        (-1.0, 2.0 - 2.0 * share)
    };
    side * ((f64::from(ORDERS) + 0.5) / beyond.max(f64::EPSILON)).round()
}
