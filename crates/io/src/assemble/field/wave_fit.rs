//! Fit of sound with a known frequency to a time series.

use glam::{DMat3, DVec3};
use std::f64::consts::TAU;
use std::ops::Range;

/// Minimum number of samples of the pressure per period. Fewer samples cannot separate the sound
/// from its overtones.
const MIN_SAMPLES_PER_PERIOD: f64 = 4.0;

/// Parameters of a time series of sound.
pub(super) struct Oscillation {
    /// Frequency in Hz.
    pub frequency: f64,
    /// Time between frames in seconds.
    pub step: f64,
    /// Number of frames.
    pub frames: usize,
    /// Number of periods to fit, if the scene gives it.
    pub periods: Option<f64>,
}

/// Returns 1, cos ωt and sin ωt at frame `k`. Successive frames are `turns` periods apart.
pub(super) fn basis(turns: f64, k: usize) -> DVec3 {
    let (sin, cos) = (TAU * (turns * k as f64).fract()).sin_cos();
    DVec3::new(1.0, cos, sin)
}

/// Least-squares fit of m + a cos ωt + b sin ωt to the last samples of a series; t = 0 is the
/// series' first sample.
pub(super) struct WaveFit {
    pub used: Range<usize>,
    /// Periods between successive frames.
    pub turns: f64,
    /// Sums of the products of 1, cos and sin.
    normal: DMat3,
    /// Map from Σp, Σp cos, Σp sin to m, a, b.
    inverse: DMat3,
}

/// Sound fitted to a series.
pub(super) struct Fitted {
    /// Real and imaginary part of the amplitude.
    pub amplitude: [f64; 2],
    /// Reduction of the sum of squares when the sound is subtracted.
    pub explained: f64,
}

impl WaveFit {
    /// Prepares the fit to the last periods of a series.
    pub(super) fn new(series: &Oscillation) -> Result<Self, String> {
        let (step, count) = (series.step, series.frames);
        let turns = series.frequency * step;
        let per_period = 1.0 / turns;
        if per_period < MIN_SAMPLES_PER_PERIOD {
            return Err(format!(
                "a period of the sound has {per_period:.2} samples in time, of {step:.3e} s each: at least {MIN_SAMPLES_PER_PERIOD} are \
                 needed"
            ));
        }
        // Fit whole periods, by default all within the second half, where start-up transients have
        // decayed.
        let half = (0.5 * count as f64 / per_period).floor();
        let periods = series.periods.unwrap_or(half.max(1.0));
        let samples = (periods * per_period).round() as usize;
        if samples > count || samples < MIN_SAMPLES_PER_PERIOD as usize {
            return Err(format!(
                "the pressure has {count} samples in time, {:.2} periods of the sound: {periods} cannot be fitted",
                count as f64 / per_period
            ));
        }
        let used = count - samples..count;
        let mut normal = DMat3::ZERO;
        for k in used.clone() {
            let basis = basis(turns, k);
            normal += DMat3::from_cols(basis * basis.x, basis * basis.y, basis * basis.z);
        }
        Ok(WaveFit {
            used,
            turns,
            normal,
            inverse: normal.inverse(),
        })
    }

    /// Returns the sound in a series with the sums Σp, Σp cos, Σp sin.
    pub(super) fn solved(&self, sums: DVec3) -> Fitted {
        let [_, a, b] = (self.inverse * sums).to_array();
        // Σp² − Σ(p − h)² of h = a cos ωt + b sin ωt = Re((a − ib) e^{iωt}).
        let wave = DVec3::new(0.0, a, b);
        Fitted {
            amplitude: [a, -b],
            explained: 2.0 * wave.dot(sums) - wave.dot(self.normal * wave),
        }
    }
}
