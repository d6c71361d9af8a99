//! χ² goodness-of-fit tests of samplers against their densities on a binned 2-D domain.

use crate::quadrature::{Effort, integrate_cell};
use crate::rng::Rng;
use crate::z_test::upper_tail;

/// Declared integral of a density over the table.
#[derive(Clone, Copy, Debug)]
pub enum Mass {
    /// This exact mass: 1, or 1 − (probability of absorption or of a delta event) in closed form.
    Exactly(f64),
    /// A mass that is unknown in closed form, but at most 1. The test compares the number of `None`
    /// samples with 1 − ∫pdf, so that a wrong normalisation fails.
    AtMostOne,
}

/// Result of a χ² test that could be carried out.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Σ (observed − expected)² / expected over the pooled cells.
    pub statistic: f64,
    /// Degrees of freedom: the number of pooled cells minus 1.
    pub dof: usize,
    /// P(χ² > statistic), uniform in [0, 1] for a correct sampler. At level α, the false-alarm rate
    /// is α.
    pub p_value: f64,
    /// ∫ pdf over the table.
    pub integral: f64,
}

/// Reason why a test fails before any statistics. These failures have no false alarms.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChiSquareFailure {
    /// ∫pdf differs from the declared mass.
    #[error("the density integrates to {integral}, expected {expected} within {tolerance:.1e}")]
    Mass {
        /// ∫ pdf over the table.
        integral: f64,
        /// Declared mass.
        expected: f64,
        /// Allowed difference.
        tolerance: f64,
    },
    /// The density is zero at a sample.
    #[error("the density is zero at the sample {point:?}")]
    ZeroDensity {
        /// Sample.
        point: [f64; 2],
    },
    /// A sample lies outside the table, or is NaN.
    #[error("sample {point:?} lies outside the table")]
    Outside {
        /// Sample.
        point: [f64; 2],
    },
    /// All cells were pooled into one: the test needs more samples or coarser bins.
    #[error("only one cell has enough expected samples")]
    TooCoarse,
}

/// Bins of a rectangle, with edges in both coordinates.
#[derive(Clone, Debug)]
pub struct Table {
    u: Vec<f64>,
    v: Vec<f64>,
    effort: Effort,
    mass_tolerance: f64,
}

/// Returns the edges of `n` equal bins over [lo, hi].
pub fn uniform_edges(lo: f64, hi: f64, n: usize) -> Vec<f64> {
    (0..=n)
        .map(|i| lo + (hi - lo) * i as f64 / n as f64)
        .collect()
}

/// Smallest expected count of a cell before pooling; 5 is customary.
const MIN_EXPECTED: f64 = 5.0;

impl Table {
    /// Makes a table with increasing bin edges in both coordinates.
    ///
    /// Place edges at the known discontinuities of the density.
    pub fn new(u: Vec<f64>, v: Vec<f64>) -> Self {
        for edges in [&u, &v] {
            assert!(
                edges.len() >= 2 && edges.is_sorted_by(|a, b| a < b),
                "edges must increase"
            );
        }
        Table {
            u,
            v,
            effort: Effort::default(),
            mass_tolerance: 1e-4,
        }
    }

    /// Sets the quadrature effort.
    pub fn with_effort(self, effort: Effort) -> Self {
        Table { effort, ..self }
    }

    /// Sets the allowed error of ∫pdf (1e-4 by default).
    pub fn with_mass_tolerance(self, mass_tolerance: f64) -> Self {
        Table {
            mass_tolerance,
            ..self
        }
    }

    /// Draws `samples` samples with `sample` (`None`: absorbed, or a delta event), and compares the
    /// count in each bin with the integral of `pdf`. The density `pdf` is per unit area of the
    /// table.
    ///
    /// # Errors
    /// Returns a [`ChiSquareFailure`] if the test could not be carried out.
    pub fn test(
        &self,
        seed: u64,
        samples: u64,
        mass: Mass,
        sample: impl FnMut(&mut Rng) -> Option<[f64; 2]>,
        pdf: impl Fn([f64; 2]) -> f64,
    ) -> Result<Report, ChiSquareFailure> {
        let expected: Vec<f64> = self.integrate(&pdf);
        let integral: f64 = expected.iter().sum();
        let remainder = self.check_mass(integral, mass)?;
        let (observed, none) = self.count(seed, samples, sample, &pdf)?;
        let n = samples as f64;
        let mut cells: Vec<(f64, f64)> = expected
            .iter()
            .zip(observed)
            .map(|(p, count)| (n * p, count as f64))
            .collect();
        let slack = remainder < self.mass_tolerance && none == 0;
        if !slack {
            cells.push((n * remainder, none as f64));
        }
        let (statistic, dof) = pooled_statistic(cells).ok_or(ChiSquareFailure::TooCoarse)?;
        Ok(Report {
            statistic,
            dof,
            p_value: upper_tail(statistic, dof),
            integral,
        })
    }

    fn columns(&self) -> usize {
        self.v.len() - 1
    }

    /// Returns the probability of each bin, in row-major order (u slow, v fast).
    fn integrate(&self, pdf: &impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        let mut expected = Vec::new();
        for u in self.u.windows(2) {
            for v in self.v.windows(2) {
                expected.push(integrate_cell(pdf, [u[0], v[0]], [u[1], v[1]], self.effort));
            }
        }
        expected
    }

    /// Returns 1 − mass, the probability of `None`.
    fn check_mass(&self, integral: f64, mass: Mass) -> Result<f64, ChiSquareFailure> {
        let tolerance = self.mass_tolerance;
        let (expected, right) = match mass {
            Mass::Exactly(m) => (m, (integral - m).abs() <= tolerance),
            Mass::AtMostOne => (integral.min(1.0), integral <= 1.0 + tolerance),
        };
        if right {
            Ok((1.0 - expected).max(0.0))
        } else {
            Err(ChiSquareFailure::Mass {
                integral,
                expected,
                tolerance,
            })
        }
    }

    fn count(
        &self,
        seed: u64,
        samples: u64,
        mut sample: impl FnMut(&mut Rng) -> Option<[f64; 2]>,
        pdf: &impl Fn([f64; 2]) -> f64,
    ) -> Result<(Vec<u64>, u64), ChiSquareFailure> {
        let mut rng = Rng::new(seed);
        let mut counts = vec![0; (self.u.len() - 1) * self.columns()];
        let mut none = 0;
        for _ in 0..samples {
            let Some(point) = sample(&mut rng) else {
                none += 1;
                continue;
            };
            let bin = bin_of(&self.u, point[0]).zip(bin_of(&self.v, point[1]));
            let (i, j) = bin.ok_or(ChiSquareFailure::Outside { point })?;
            // Check at the sample: the quadrature of a bin can miss a narrow support.
            if pdf(point) <= 0.0 {
                return Err(ChiSquareFailure::ZeroDensity { point });
            }
            counts[i * self.columns() + j] += 1;
        }
        Ok((counts, none))
    }
}

/// Returns the index of the bin that contains `x`. The last bin includes its upper edge.
fn bin_of(edges: &[f64], x: f64) -> Option<usize> {
    let last = edges.len() - 1;
    if !(edges[0]..=edges[last]).contains(&x) {
        return None;
    }
    Some((edges.partition_point(|&e| e <= x) - 1).min(last - 1))
}

/// Returns χ² and the degrees of freedom of (expected, observed) cells. Small cells are pooled into
/// one. The pool then absorbs the next larger cells until it is large enough.
fn pooled_statistic(mut cells: Vec<(f64, f64)>) -> Option<(f64, usize)> {
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pool = (0.0, 0.0);
    let mut rest = cells.as_slice();
    while let Some((&cell, tail)) = rest.split_first() {
        if cell.0 >= MIN_EXPECTED && (pool == (0.0, 0.0) || pool.0 >= MIN_EXPECTED) {
            break;
        }
        pool = (pool.0 + cell.0, pool.1 + cell.1);
        rest = tail;
    }
    let pool = (pool != (0.0, 0.0)).then_some(pool);
    let kept: Vec<(f64, f64)> = rest.iter().copied().chain(pool).collect();
    let statistic = kept.iter().map(|(e, o)| (o - e) * (o - e) / e).sum();
    (kept.len() >= 2).then(|| (statistic, kept.len() - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples x with density 2x and y uniformly; a fraction `lost` of the samples is absorbed.
    fn ramp(rng: &mut Rng, lost: f64) -> Option<[f64; 2]> {
        let u: [f64; 3] = rng.uniform();
        (u[2] >= lost).then_some([u[0].sqrt(), u[1]])
    }

    fn table() -> Table {
        Table::new(uniform_edges(0.0, 1.0, 12), uniform_edges(0.0, 1.0, 8))
    }

    #[test]
    fn accepts_a_right_sampler() {
        let report = table()
            .test(
                1,
                100_000,
                Mass::Exactly(1.0),
                |r| ramp(r, 0.0),
                |[x, _]| 2.0 * x,
            )
            .unwrap();
        assert!(report.p_value > 1e-3, "{report:?}");
        assert_eq!(report.dof, 95);
        let lossy = table()
            .test(
                2,
                100_000,
                Mass::Exactly(0.8),
                |r| ramp(r, 0.2),
                |[x, _]| 1.6 * x,
            )
            .unwrap();
        assert!(lossy.p_value > 1e-3, "{lossy:?}");
    }

    /// Checks that absorbed samples have a cell of their own, so that the test detects a wrong
    /// fraction.
    #[test]
    fn finds_a_wrong_share_of_absorbed_samples() {
        let test = |lost| {
            let pdf = |[x, _]: [f64; 2]| 1.6 * x;
            let report = table().test(7, 100_000, Mass::Exactly(0.8), |r| ramp(r, lost), pdf);
            report.unwrap()
        };
        assert_eq!(test(0.2).dof, 96);
        assert!(test(0.22).p_value < 1e-6);
    }

    #[test]
    fn masses_keep_to_their_tolerance() {
        let test = |table: Table, mass: f64, declared: Mass| {
            table.test(8, 1000, declared, |r| ramp(r, 0.0), |[x, _]| 2.0 * mass * x)
        };
        assert!(test(table(), 1.000_05, Mass::AtMostOne).is_ok());
        assert!(test(table(), 1.000_2, Mass::AtMostOne).is_err());
        assert!(test(table(), 0.999, Mass::Exactly(1.0)).is_err());
        let loose = table().with_mass_tolerance(0.01);
        assert!(test(loose, 0.999, Mass::Exactly(1.0)).is_ok());
    }

    #[test]
    fn bins_hold_their_lower_edges_and_the_last_one_both() {
        let edges = [0.0, 1.0, 2.0];
        let bins = [0.0, 0.5, 1.0, 2.0].map(|x| bin_of(&edges, x));
        assert_eq!(bins, [Some(0), Some(0), Some(1), Some(1)]);
        assert_eq!(bin_of(&edges, 2.1).or(bin_of(&edges, -0.1)), None);
    }

    /// Checks against a calculation by hand that cells that expect fewer than five samples are
    /// pooled. The pool absorbs larger cells until it expects five samples.
    #[test]
    fn small_cells_are_pooled() {
        let three = vec![
            (20.0, 18.0),
            (1.0, 2.0),
            (3.0, 4.0),
            (2.0, 1.0),
            (10.0, 12.0),
        ];
        let (statistic, dof) = pooled_statistic(three).unwrap();
        assert!((statistic - (4.0 / 20.0 + 4.0 / 10.0 + 1.0 / 6.0)).abs() < 1e-12);
        assert_eq!(dof, 2);
        let taken = vec![
            (1.0, 1.0),
            (2.0, 2.0),
            (10.0, 12.0),
            (20.0, 18.0),
            (30.0, 31.0),
        ];
        let (statistic, dof) = pooled_statistic(taken).unwrap();
        assert!((statistic - (4.0 / 20.0 + 1.0 / 30.0 + 4.0 / 13.0)).abs() < 1e-12);
        assert_eq!(dof, 2);
        assert_eq!(pooled_statistic(vec![(4.0, 1.0), (9.0, 1.0)]), None);
    }

    #[test]
    fn p_values_are_uniform_under_the_null() {
        let mut p: Vec<f64> = (0..200)
            .map(|seed| {
                let pdf = |[x, _]: [f64; 2]| 2.0 * x;
                table()
                    .test(seed, 5_000, Mass::Exactly(1.0), |r| ramp(r, 0.0), pdf)
                    .unwrap()
                    .p_value
            })
            .collect();
        p.sort_by(f64::total_cmp);
        let distance = (0..200)
            .map(|i| (p[i] - (i as f64 + 0.5) / 200.0).abs())
            .fold(0.0, f64::max);
        // Use the Kolmogorov–Smirnov bound at level 1e-3: 1.95 / √200.
        assert!(distance < 1.95 / 200f64.sqrt(), "{distance}");
    }

    #[test]
    fn finds_a_shape_that_is_wrong_by_a_few_percent() {
        // The mass is correct and the density is wrong by at most 5 %: only the statistics detect
        // it.
        let pdf = |[x, y]: [f64; 2]| 2.0 * x * (1.0 + 0.05 * (std::f64::consts::TAU * y).sin());
        let report = table()
            .test(3, 200_000, Mass::Exactly(1.0), |r| ramp(r, 0.0), pdf)
            .unwrap();
        assert!(report.p_value < 1e-6, "{report:?}");
    }

    #[test]
    fn finds_a_wrong_normalisation() {
        let wrong = |[x, _]: [f64; 2]| 1.94 * x;
        let exact = table().test(4, 100_000, Mass::Exactly(1.0), |r| ramp(r, 0.0), wrong);
        assert!(matches!(exact, Err(ChiSquareFailure::Mass { .. })));
        let free = table()
            .test(4, 100_000, Mass::AtMostOne, |r| ramp(r, 0.0), wrong)
            .unwrap();
        assert!(free.p_value < 1e-6, "{free:?}");
        let twice = table().test(4, 10, Mass::AtMostOne, |r| ramp(r, 0.0), |[x, _]| 4.0 * x);
        assert!(matches!(twice, Err(ChiSquareFailure::Mass { .. })));
    }

    #[test]
    fn finds_samples_where_the_density_is_zero() {
        let half = |[x, _]: [f64; 2]| if x < 0.5 { 0.0 } else { 8.0 / 3.0 * x };
        let result = table().test(5, 10_000, Mass::Exactly(1.0), |r| ramp(r, 0.0), half);
        assert!(matches!(
            result,
            Err(ChiSquareFailure::ZeroDensity { .. } | ChiSquareFailure::Mass { .. })
        ));
        let outside = table().test(
            6,
            10,
            Mass::Exactly(1.0),
            |_| Some([f64::NAN, 0.0]),
            |_| 1.0,
        );
        assert!(matches!(outside, Err(ChiSquareFailure::Outside { .. })));
    }
}
