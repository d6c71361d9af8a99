//! Statistical quality of the bins of a reading.

use serde_json::{Value, json};
use transport::meter::Reading;

/// Summary of the statistical quality of a reading's bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Number of bins, over all channels.
    pub bins: usize,
    /// Number of bins that received no light.
    pub empty: usize,
    /// Number of bins that received light from too few particles for reliable errors.
    pub few: usize,
    /// Median relative standard error of the bins that received light.
    pub error: Option<f64>,
    /// Median effective number of particles of the bins that received light.
    pub effective: Option<f64>,
}

impl Quality {
    /// Computes the quality of a reading.
    pub fn of(reading: &Reading) -> Self {
        let bins = 0..reading.mean.len();
        let lit = || {
            let lit = reading.mean.written(bins.clone());
            lit.filter(|(_, mean)| *mean != 0.0)
        };
        let errors: Vec<f64> = lit()
            .map(|(i, mean)| reading.error[i] / mean.abs())
            .collect();
        Quality {
            bins: reading.mean.len(),
            empty: reading.mean.len() - errors.len(),
            few: reading
                .few
                .written(bins.clone())
                .filter(|(_, few)| *few)
                .count(),
            error: median(errors),
            effective: median(lit().map(|(i, _)| reading.effective[i]).collect()),
        }
    }

    /// Returns the fraction of bins with unreliable errors, among the bins that received light.
    pub fn few_share(&self) -> f64 {
        self.few as f64 / (self.bins - self.empty).max(1) as f64
    }

    /// Returns the entry of statistics for a reading with this name.
    pub fn json(&self, name: &str) -> Value {
        json!({
            "name": name,
            "bins": self.bins,
            "bins_without_light": self.empty,
            "bins_of_few_particles": self.few,
            "median_relative_error": self.error,
            "median_effective_particles": self.effective,
        })
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
