//! Sound of one frequency, by samples of its complex amplitude, or of its pressure in time.

use super::super::context::Context;
use super::super::sound_record::{FactSource, SeriesRecord};
use crate::diagnostic::Diagnostic;
use crate::query::{POSITIVE, Query};
use crate::scene::ObjectDescription;
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Samples of the pressure that a period must have: fewer do not tell the sound from its overtones.
const LEAST_PER_PERIOD: f64 = 4.0;
/// A larger share of the pressure, by its root mean square, that is not of the frequency draws a warning.
const MOST_OTHER: f64 = 0.05;
/// Most periods that are fitted.
const MOST_PERIODS: f64 = 1e6;

/// What is asked of a volume of pressure that changes in time.
pub(super) enum Asked {
    /// One of the instants of which it has samples.
    Frame(usize),
    /// The sound of a frequency.
    Wave(Wave),
}

/// Sound of a frequency.
pub(super) struct Wave {
    /// Hz.
    pub frequency: f64,
    /// Scene units.
    pub wavelength: f64,
    /// Seconds between samples in time, if the scene says.
    time_step: Option<f64>,
    /// Periods that are fitted, if the scene says.
    periods: Option<f64>,
    /// What is added to the phase.
    time_phase: f64,
}

/// The sound that samples say.
pub(super) struct Found {
    /// Complex amplitudes of the pressure, Pa.
    pub pressure: Vec<[f64; 2]>,
    /// What was used of a series in time.
    pub series: Option<SeriesRecord>,
}

/// Samples of the pressure at each place, of which those of one place are neighbours.
pub(super) struct Series<'v> {
    /// Number of samples at each place.
    pub count: usize,
    /// Seconds between them, if the file says.
    pub time_step: Option<f64>,
    /// The sample with a number.
    pub at: &'v dyn Fn(usize) -> f64,
    /// Number of places.
    pub places: usize,
}

impl Asked {
    /// What a scene asks for, if it is more than pressure at rest.
    pub(super) fn of(q: &mut Query) -> Option<Self> {
        let frame = q
            .has("frame")
            .then(|| q.integer_in("frame", 0.., None) as usize);
        if !q.has("frequency") {
            return frame.map(Asked::Frame);
        }
        if frame.is_some() {
            let message = "give a frame, or the frequency of the sound, not both";
            q.error("frame", message);
        }
        let frequency = q.float_in("frequency", POSITIVE, None);
        let speed = q.float_in("sound_speed", POSITIVE, None);
        let positive = |q: &mut Query, name| q.has(name).then(|| q.float_in(name, POSITIVE, None));
        Some(Asked::Wave(Wave {
            frequency,
            wavelength: speed / frequency,
            time_step: positive(q, "time_step"),
            periods: positive(q, "periods").map(|n| n.min(MOST_PERIODS)),
            time_phase: q.float_or("time_phase", 0.0),
        }))
    }
}

impl Wave {
    /// The complex amplitudes P of the pressure Re(P e^{iωt}) that samples say, two at each place if they are the amplitudes, else
    /// those of a series in time; `None` after an error.
    pub(super) fn amplitudes(
        &self,
        series: &Series,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> Option<Found> {
        let turn = self.turn();
        let turned =
            |[re, im]: [f64; 2]| [re * turn[0] - im * turn[1], re * turn[1] + im * turn[0]];
        if series.count == 2 && self.time_step.is_none() {
            let pair = |place: usize| [0, 1].map(|part| (series.at)(2 * place + part));
            let pressure = (0..series.places).map(|place| turned(pair(place)));
            return Some(Found {
                pressure: pressure.collect(),
                series: None,
            });
        }
        let fit = self.step_of(series).ok_or_else(|| {
            format!(
                "sound of a frequency is given by complex numbers, or by two channels, or in time: of {} channels the \
                 'time_step' must be known, in s",
                series.count
            )
        });
        let fit = fit.and_then(|(step, _)| Fit::new(self, series.count, step));
        let fit = fit
            .map_err(|message| context.error_at(&object.location, message))
            .ok()?;
        self.doubt_step(series, object, context);
        let (mut found, mut other, mut all) = (Vec::with_capacity(series.places), 0.0, 0.0);
        for place in 0..series.places {
            let fitted = fit.at(|k| (series.at)(series.count * place + k));
            found.push(turned(fitted.amplitude));
            other += fitted.other;
            all += fitted.all;
        }
        let share = (other / all).sqrt();
        if share > MOST_OTHER {
            let message = format!(
                "{:.0} % of the pressure in its last {:.3} periods (root mean square) is not of the frequency {} Hz: it is \
                 left out",
                100.0 * share,
                fit.periods(self),
                self.frequency
            );
            let help = "overtones, a mean or a start that still rings: check 'frequency' and 'time_step', or take 'periods' at the \
                        end of a longer run";
            let warning = Diagnostic::warning(message).help(help.to_owned());
            context.diagnostics.push(warning.at(&object.location));
        }
        Some(Found {
            pressure: found,
            series: Some(SeriesRecord {
                frames: series.count,
                first: fit.first,
                used: fit.waves.len(),
                time_step: self.step_of(series),
                residual: Some(if all > 0.0 { share } else { 0.0 }),
            }),
        })
    }

    /// The time step: that of the scene, if it says one.
    fn step_of(&self, series: &Series) -> Option<(f64, FactSource)> {
        let of_scene = self.time_step.map(|step| (step, FactSource::Scene));
        of_scene.or_else(|| Some((series.time_step?, FactSource::File)))
    }

    /// e^{iτ}.
    fn turn(&self) -> [f64; 2] {
        let (sin, cos) = self.time_phase.sin_cos();
        [cos, sin]
    }

    /// Warns where file and scene say different steps: the scene's counts.
    fn doubt_step(&self, series: &Series, object: &ObjectDescription, context: &mut Context) {
        if let (Some(scene), Some(file)) = (self.time_step, series.time_step)
            && (scene - file).abs() > 1e-6 * file
        {
            let message = format!(
                "the file has a time step of {file:.3e} s, the scene {scene:.3e} s: that of the scene counts"
            );
            context
                .diagnostics
                .push(Diagnostic::warning(message).at(&object.location));
        }
    }
}

/// A least-squares fit of m + a cos ωt + b sin ωt to the last samples of a series; t = 0 is its first.
struct Fit {
    first: usize,
    /// Cosine and sine at each sample from the first.
    waves: Vec<[f64; 2]>,
    /// From Σp, Σp cos, Σp sin to m, a, b.
    inverse: DMat3,
    step: f64,
}

/// Sound in a series.
struct Fitted {
    /// Real and imaginary part.
    amplitude: [f64; 2],
    /// Sum of the squares of what is not of its frequency.
    other: f64,
    /// Sum of all squares.
    all: f64,
}

impl Fit {
    fn new(wave: &Wave, count: usize, step: f64) -> Result<Self, String> {
        let per_period = 1.0 / (wave.frequency * step);
        if per_period < LEAST_PER_PERIOD {
            return Err(format!(
                "a period of the sound has {per_period:.2} samples in time, of {step:.3e} s each: at least {LEAST_PER_PERIOD} are \
                 needed"
            ));
        }
        // Whole periods; by default those of the second half, where the start has rung down.
        let half = (0.5 * count as f64 / per_period).floor();
        let periods = wave.periods.unwrap_or(half.max(1.0));
        let samples = (periods * per_period).round() as usize;
        if samples > count || samples < LEAST_PER_PERIOD as usize {
            return Err(format!(
                "the pressure has {count} samples in time, {:.2} periods of the sound: {periods} cannot be fitted",
                count as f64 / per_period
            ));
        }
        let first = count - samples;
        let wave_at = |k: usize| {
            let (sin, cos) = (TAU * wave.frequency * step * k as f64).sin_cos();
            [cos, sin]
        };
        let waves: Vec<[f64; 2]> = (first..count).map(wave_at).collect();
        let mut normal = DMat3::ZERO;
        for [cos, sin] in &waves {
            let basis = DVec3::new(1.0, *cos, *sin);
            normal += DMat3::from_cols(basis * basis.x, basis * basis.y, basis * basis.z);
        }
        Ok(Fit {
            first,
            waves,
            inverse: normal.inverse(),
            step,
        })
    }

    fn periods(&self, wave: &Wave) -> f64 {
        self.waves.len() as f64 * self.step * wave.frequency
    }

    /// What a series has of the sound.
    fn at(&self, sample: impl Fn(usize) -> f64) -> Fitted {
        let samples = || {
            let waves = self.waves.iter().zip(self.first..);
            waves.map(|(wave, k)| (sample(k), wave))
        };
        let mut sums = DVec3::ZERO;
        for (p, [cos, sin]) in samples() {
            sums += DVec3::new(1.0, *cos, *sin) * p;
        }
        let [_, a, b] = (self.inverse * sums).to_array();
        let (mut other, mut all) = (0.0, 0.0);
        for (p, [cos, sin]) in samples() {
            other += (p - a * cos - b * sin).powi(2);
            all += p * p;
        }
        // Re((a − ib) e^{iωt}) = a cos ωt + b sin ωt.
        Fitted {
            amplitude: [a, -b],
            other,
            all,
        }
    }
}
