//! Sound of one frequency, given by samples of its complex amplitude or of its pressure in time.

use super::super::sound_record::{FactSource, SeriesRecord};
use super::elasto_optic;
use super::wave_fit::{Oscillation, WaveFit, basis};
use crate::error::Problem;
use crate::query::Query;
use crate::volume::series::{FrameSums, Series, SeriesShape};
use glam::DVec3;

/// Maximum fraction of the pressure (root mean square) at other frequencies without a warning.
const MAX_OTHER: f64 = 0.05;
/// Maximum number of periods for a fit.
const MAX_PERIODS: f64 = 1e6;

/// Requested content of a volume of pressure that changes in time.
pub(super) enum RequestedSound {
    /// Single frame of a time series.
    Frame(usize),
    /// Sound of one frequency.
    Wave(Wave),
}

/// Sound of one frequency.
pub(super) struct Wave {
    /// Frequency in Hz.
    pub frequency: f64,
    /// Wavelength in scene units.
    pub wavelength: f64,
    /// Time between frames in seconds, if the scene gives it.
    time_step: Option<f64>,
    /// Number of periods to fit, if the scene gives it.
    periods: Option<f64>,
    /// Angle in radians that is added to the phase.
    time_phase: f64,
    /// Elasto-optic coefficient ρc² ∂n/∂p, if the scene gives it.
    pub elasto_optic: Option<f64>,
}

/// Representation of the sound by samples.
pub(super) enum Form {
    /// Real and imaginary part of the complex amplitude.
    Complex,
    /// Time series.
    InTime(WaveFit),
}

/// Sound computed from samples.
pub(super) struct Found {
    /// Complex amplitudes of the pressure in Pa.
    pub pressure: Vec<[f64; 2]>,
    /// Part of a time series that was used.
    pub series: Option<SeriesRecord>,
}

/// Warning with advice.
pub(super) struct WaveWarning {
    pub message: String,
    pub help: Option<&'static str>,
}

impl RequestedSound {
    /// Returns the parameters that are read for a request.
    pub(super) fn parameters(requested: Option<&Self>) -> &'static [&'static str] {
        match requested {
            None => &[],
            Some(RequestedSound::Frame(_)) => &["frame"],
            Some(RequestedSound::Wave(_)) => &[
                "frame",
                "reference",
                "smoothing",
                "condense",
                "frequency",
                "sound_speed",
                "time_step",
                "periods",
                "time_phase",
                "elasto_optic",
            ],
        }
    }

    /// Reads the request of a scene, or `None` for static pressure.
    pub(super) fn of(q: &mut Query) -> Option<Self> {
        let frame = q.has("frame").then(|| q.integer("frame") as usize);
        if !q.has("frequency") {
            return frame.map(RequestedSound::Frame);
        }
        if frame.is_some() {
            let message = "give a frame, or the frequency of the sound, not both";
            q.error("frame", message);
        }
        for name in ["reference", "smoothing", "condense"] {
            if q.has(name) {
                let message = "no effect on sound with a 'frequency', whose samples are amplitudes";
                q.error(name, message);
            }
        }
        let frequency = q.float("frequency");
        let speed = q.float("sound_speed");
        let positive = |q: &mut Query, name| q.float_if_given(name);
        Some(RequestedSound::Wave(Wave {
            frequency,
            wavelength: speed / frequency,
            time_step: positive(q, "time_step"),
            periods: positive(q, "periods").map(|n| n.min(MAX_PERIODS)),
            time_phase: q.float("time_phase"),
            elasto_optic: elasto_optic(q),
        }))
    }
}

/// Returns the sum that selects one frame.
pub(super) fn only(frame: usize, shape: SeriesShape) -> Result<FrameSums, Problem> {
    if frame >= shape.frames {
        return Err(Problem::Mismatch {
            expected: format!("more than {frame} channels or frames"),
            found: shape.frames.to_string(),
        });
    }
    Ok(FrameSums {
        used: frame..frame + 1,
        count: 1,
        weights: Box::new(|_| [1.0, 0.0, 0.0]),
    })
}

impl Wave {
    /// Determines the representation of the sound by the samples.
    pub(super) fn form(&self, shape: SeriesShape) -> Result<Form, Problem> {
        if shape.frames == 2 && self.time_step.is_none() {
            return Ok(Form::Complex);
        }
        let Some((step, _)) = self.step_of(shape) else {
            return Err(Problem::Unsaid(format!(
                "sound of a frequency is given by complex numbers, or by two channels, or in time: of {} channels the \
                 'time_step' must be known, in s",
                shape.frames
            )));
        };
        let fit = WaveFit::new(&Oscillation {
            frequency: self.frequency,
            step,
            frames: shape.frames,
            periods: self.periods,
        });
        fit.map(Form::InTime).map_err(Problem::Malformed)
    }

    /// Returns the complex amplitudes P of the pressure Re(P e^{iωt}), computed from sums over a
    /// series.
    pub(super) fn found(&self, form: &Form, series: Series) -> Found {
        let Series {
            sums,
            squares,
            shape,
        } = series;
        let (sin, cos) = self.time_phase.sin_cos();
        let turned = |[re, im]: [f64; 2]| [re * cos - im * sin, re * sin + im * cos];
        match form {
            Form::Complex => {
                let pairs = sums.data().chunks_exact(2);
                Found {
                    pressure: pairs.map(|pair| turned([pair[0], pair[1]])).collect(),
                    series: None,
                }
            }
            Form::InTime(fit) => {
                let mut explained = 0.0;
                let at_place = |sums: &[f64]| {
                    let fitted = fit.solved(DVec3::from_slice(sums));
                    explained += fitted.explained;
                    turned(fitted.amplitude)
                };
                let pressure = sums.data().chunks_exact(3).map(at_place).collect();
                let other = (squares - explained).max(0.0);
                let residual = if squares > 0.0 {
                    (other / squares).sqrt()
                } else {
                    0.0
                };
                Found {
                    pressure,
                    series: Some(SeriesRecord {
                        frames: shape.frames,
                        first: fit.used.start,
                        used: fit.used.len(),
                        time_step: self.step_of(shape),
                        residual: Some(residual),
                    }),
                }
            }
        }
    }

    /// Returns warnings about a series: a contradicting time step, and a large residual.
    pub(super) fn warnings(&self, record: &SeriesRecord, of_file: Option<f64>) -> Vec<WaveWarning> {
        let mut warnings = Vec::new();
        if let (Some(scene), Some(file)) = (self.time_step, of_file)
            && (scene - file).abs() > 1e-6 * file
        {
            warnings.push(WaveWarning {
                message: format!(
                    "the file has a time step of {file:.3e} s, the scene {scene:.3e} s: morgana uses the scene's"
                ),
                help: None,
            });
        }
        if let (Some(residual), Some((step, _))) = (record.residual, record.time_step)
            && residual > MAX_OTHER
        {
            warnings.push(WaveWarning {
                message: format!(
                    "{:.0} % of the pressure in its last {:.3} periods (root mean square) does not have the frequency {} Hz and is left out",
                    100.0 * residual,
                    record.used as f64 * step * self.frequency,
                    self.frequency
                ),
                help: Some(
                    "overtones, a mean or a start that still rings: check 'frequency' and 'time_step', or take 'periods' at the \
                     end of a longer run",
                ),
            });
        }
        warnings
    }

    /// Returns the time step with its source; the scene's time step takes precedence.
    fn step_of(&self, shape: SeriesShape) -> Option<(f64, FactSource)> {
        let of_scene = self.time_step.map(|step| (step, FactSource::Scene));
        of_scene.or_else(|| Some((shape.time_step?, FactSource::File)))
    }
}

impl Form {
    /// Returns the sums over frames from which the sound is computed.
    pub(super) fn sums(&self) -> FrameSums {
        match self {
            Form::Complex => FrameSums {
                used: 0..2,
                count: 2,
                weights: Box::new(|part| [f64::from(part == 0), f64::from(part == 1), 0.0]),
            },
            Form::InTime(fit) => {
                let turns = fit.turns;
                FrameSums {
                    used: fit.used.clone(),
                    count: 3,
                    weights: Box::new(move |k| basis(turns, k).to_array()),
                }
            }
        }
    }
}
