//! χ² tests of distributions of directions.

use crate::chi_square::{ChiSquareFailure, Mass, Report, Table, uniform_edges};
use crate::quadrature::Effort;
use crate::rng::Rng;
use std::f64::consts::PI;

/// Bins of the unit sphere in (cosθ, φ) about an axis. The area of a bin is its solid angle, so
/// densities are per steradian. The false-alarm rate equals the rate of [`Table::test`].
#[derive(Clone, Debug)]
pub struct DirectionTable {
    frame: [[f64; 3]; 3],
    table: Table,
}

impl DirectionTable {
    /// Makes equal bins in cosθ over [−1, 1] and in φ. With an even number of cosθ bins, an edge
    /// lies on the horizon, where many densities jump.
    pub fn uniform(axis: [f64; 3], cos_bins: usize, phi_bins: usize) -> Self {
        Self::new(axis, uniform_edges(-1.0, 1.0, cos_bins), phi_bins)
    }

    /// Makes bins with arbitrary increasing edges in cosθ; `axis` is a unit vector.
    pub fn new(axis: [f64; 3], cos_edges: Vec<f64>, phi_bins: usize) -> Self {
        let table = Table::new(cos_edges, uniform_edges(-PI, PI, phi_bins));
        DirectionTable {
            frame: frame(axis),
            table,
        }
    }

    /// Makes bins for a distribution that peaks around the axis within an angle of about `width`
    /// radians. Bins are fine there, and coarser outwards over the whole sphere. The quadrature
    /// misses a lobe much narrower than its bins; the test then fails.
    pub fn peaked(axis: [f64; 3], width: f64, cos_bins: usize, phi_bins: usize) -> Self {
        // 1 − cosθ grows geometrically from (width/4)²/2 to 2.
        let smallest = (width * width / 32.0).min(0.1);
        let ratio = (2.0 / smallest).powf(1.0 / (cos_bins - 1) as f64);
        let mut edges: Vec<f64> = (1..cos_bins)
            .rev()
            .map(|i| 1.0 - smallest * ratio.powi(i as i32 - 1))
            .collect();
        edges.insert(0, -1.0);
        edges.push(1.0);
        Self::new(axis, edges, phi_bins)
    }

    /// Sets the quadrature effort.
    pub fn with_effort(self, effort: Effort) -> Self {
        DirectionTable {
            table: self.table.with_effort(effort),
            ..self
        }
    }

    /// Sets the allowed error of ∫pdf (1e-4 by default).
    pub fn with_mass_tolerance(self, tolerance: f64) -> Self {
        DirectionTable {
            table: self.table.with_mass_tolerance(tolerance),
            ..self
        }
    }

    /// Compares unit vectors drawn by `sample` with `pdf` (per steradian); see [`Table::test`].
    ///
    /// # Errors
    /// Returns a [`ChiSquareFailure`] if the test could not be carried out.
    pub fn test(
        &self,
        seed: u64,
        samples: u64,
        mass: Mass,
        mut sample: impl FnMut(&mut Rng) -> Option<[f64; 3]>,
        pdf: impl Fn([f64; 3]) -> f64,
    ) -> Result<Report, ChiSquareFailure> {
        let to_table = |rng: &mut Rng| sample(rng).map(|d| self.coordinates(d));
        self.table
            .test(seed, samples, mass, to_table, |c| pdf(self.direction(c)))
    }

    /// Returns (cosθ, φ) of a unit vector.
    fn coordinates(&self, d: [f64; 3]) -> [f64; 2] {
        let [s, t, n] = self.frame.map(|axis| dot(axis, d));
        // Assign a cosine above 1 by rounding to the last bin; keep NaN.
        [
            if n.abs() < 1.0 + 1e-12 {
                n.clamp(-1.0, 1.0)
            } else {
                f64::NAN
            },
            t.atan2(s),
        ]
    }

    fn direction(&self, [cos, phi]: [f64; 2]) -> [f64; 3] {
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let local = [sin * phi.cos(), sin * phi.sin(), cos];
        std::array::from_fn(|i| (0..3).map(|k| local[k] * self.frame[k][i]).sum())
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns a right-handed orthonormal frame whose third vector is `n`.
fn frame(n: [f64; 3]) -> [[f64; 3]; 3] {
    assert!(
        (dot(n, n) - 1.0).abs() < 1e-9,
        "the axis must have length 1"
    );
    let helper = if n[0].abs() < 0.6 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let t = cross(n, helper);
    let t = t.map(|c| c / dot(t, t).sqrt());
    [cross(t, n), t, n]
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXIS: [f64; 3] = [0.48, -0.6, 0.64];

    #[test]
    fn accepts_uniform_directions_and_rejects_a_tilt() {
        let table = DirectionTable::uniform(AXIS, 10, 16);
        let draw = |rng: &mut Rng| Some(rng.direction());
        let right = table
            .test(1, 100_000, Mass::Exactly(1.0), draw, |_| 0.25 / PI)
            .unwrap();
        assert!(right.p_value > 1e-3, "{right:?}");
        let tilted = |d: [f64; 3]| 0.25 / PI * (1.0 + 0.04 * d[0]);
        let wrong = table
            .test(1, 200_000, Mass::Exactly(1.0), draw, tilted)
            .unwrap();
        assert!(wrong.p_value < 1e-6, "{wrong:?}");
    }

    #[test]
    fn coordinates_round_trip() {
        let table = DirectionTable::peaked(AXIS, 0.01, 12, 4);
        let mut rng = Rng::new(3);
        for _ in 0..100 {
            let d = rng.direction();
            let back = table.direction(table.coordinates(d));
            assert!((0..3).all(|i| (d[i] - back[i]).abs() < 1e-12));
        }
    }
}
