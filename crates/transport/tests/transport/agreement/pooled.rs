//! Deviations pooled over scenes: what is too small to be seen in one of them.
//!
//! A scene's relative deviation of `path` or `particle` from `bdpt` is averaged over all scenes that share a
//! level of a factor, with weights that fall with its variance. An estimate of light that is low by chance
//! has a low estimate of its variance too, so that weights taken from the same batches would favour it: the
//! batches are split in two halves, each of which weighs the other.

use crate::agreement::compare::Row;
use testkit::batches::moments;
use testkit::z_test::{p_value, z_score};

/// Relative errors below this do not make a scene weigh more: no few scenes decide.
const FINEST: f64 = 0.02;

/// A mean deviation over scenes.
pub struct Pooled {
    /// What the scenes share.
    pub level: String,
    /// Number of scenes.
    pub scenes: usize,
    /// Of path and of particle against bdpt: relative, with the standard error; `None` where the estimator
    /// is left out of all scenes.
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

/// Relative deviation of an estimator's batches from those of bdpt, and its variance.
fn deviation(batches: &[f64], reference: &[f64]) -> (f64, f64) {
    let (a, b) = (moments(batches), moments(reference));
    let scale = 0.5 * (a.mean() + b.mean());
    let variance = a.standard_error().powi(2) + b.standard_error().powi(2);
    ((a.mean() - b.mean()) / scale, variance / scale.powi(2))
}

/// The scenes whose levels include `level`.
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
                let weight = 1.0 / other.1.max(FINEST * FINEST);
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

/// One line per level. `sigmas`: how many standard errors a deviation needs to be found.
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
