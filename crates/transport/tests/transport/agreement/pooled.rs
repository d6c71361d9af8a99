//! Deviations pooled over scenes, for errors too small to be seen in a single scene.
//!
//! The relative deviation of `path` or `particle` from `bdpt` is averaged over all scenes that
//! share a level of a factor, weighted by its inverse variance. An estimate that is low at random
//! also has a low estimated variance, so that weights from the same batches would favour it. The
//! batches are therefore split in two halves, and each half supplies the weights of the other.

use crate::agreement::compare::Row;
use testkit::batches::moments;
use testkit::z_test::{p_value, z_score};

/// Smallest relative error that enters a weight, so that a few scenes do not dominate the mean.
const MIN_ERROR: f64 = 0.02;

/// A mean deviation over scenes.
pub struct Pooled {
    /// Level that the scenes share.
    pub level: String,
    /// Number of scenes.
    pub scenes: usize,
    /// Relative deviations of path and of particle from bdpt, with standard errors; `None` if all
    /// scenes omit the estimator.
    pub deviation: [Option<(f64, f64)>; 2],
}

impl Pooled {
    /// Names and p-values of its comparisons.
    pub fn p_values(&self) -> impl Iterator<Item = (String, f64)> {
        let estimators = ["path", "particle"].into_iter().zip(self.deviation);
        estimators.filter_map(|(name, deviation)| {
            let (mean, error) = deviation?;
            let p = p_value(z_score(mean, error, 0.0));
            Some((format!("{name} pooled over {}", self.level), p))
        })
    }
}

/// Returns the relative deviation of an estimator's batches from bdpt, and its variance.
fn deviation(batches: &[f64], reference: &[f64]) -> (f64, f64) {
    let (a, b) = (moments(batches), moments(reference));
    let scale = 0.5 * (a.mean() + b.mean());
    let variance = a.standard_error().powi(2) + b.standard_error().powi(2);
    ((a.mean() - b.mean()) / scale, variance / scale.powi(2))
}

/// Pools the scenes whose levels include `level`.
pub fn pool(level: &str, rows: &[&Row]) -> Pooled {
    let over = |estimator: usize| {
        let (mut sum, mut weights, mut variance) = (0.0, 0.0, 0.0);
        for row in rows {
            let (Some(batches), Some(reference)) = (&row.batches[estimator], &row.batches[2])
            else {
                continue;
            };
            let half = batches.len() / 2;
            let (a, b) = (batches.split_at(half), reference.split_at(half));
            let halves = [deviation(a.0, b.0), deviation(a.1, b.1)];
            for (this, other) in [(halves[0], halves[1]), (halves[1], halves[0])] {
                let weight = 1.0 / other.1.max(MIN_ERROR * MIN_ERROR);
                sum += weight * this.0;
                variance += weight * weight * this.1;
                weights += weight;
            }
        }
        (weights > 0.0).then_some((sum / weights, variance.sqrt() / weights))
    };
    Pooled {
        level: level.into(),
        scenes: rows.len(),
        deviation: [over(0), over(1)],
    }
}

/// Formats a table with one line per level. `sigmas` is the deviation in standard errors that is
/// found.
pub fn table(pooled: &[Pooled], sigmas: f64) -> String {
    let mut out = String::from(
        "| scenes with | number | path − bdpt | particle − bdpt | detectable, path | particle |\n\
         |---|---|---|---|---|---|\n",
    );
    for p in pooled {
        let show = |deviation: Option<(f64, f64)>| match deviation {
            Some((mean, error)) => (
                format!("{:+.2} ± {:.2} %", 100.0 * mean, 100.0 * error),
                format!("{:.1} %", 100.0 * sigmas * error),
            ),
            None => ("–".into(), "–".into()),
        };
        let [path, particle] = p.deviation.map(show);
        let (level, n) = (&p.level, p.scenes);
        out += &format!(
            "| {level} | {n} | {} | {} | {} | {} |\n",
            path.0, particle.0, path.1, particle.1
        );
    }
    out
}
