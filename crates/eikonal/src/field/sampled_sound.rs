//! Sound that is sampled on a grid (docs/theory.md#sound).

use super::bspline::Sampling;
use super::error::{FieldError, positive};
use super::sampled_amplitude::SampledAmplitude;
use super::sound::Sound;
use super::{Bspline, Field, Jet, Placement};
use crate::bounds::{Aabb, FieldBounds};
use glam::{DVec2, DVec3};
use std::sync::{Arc, OnceLock};

/// Index n(x) = n₀ + Re(A(x) e^{iωt}) at an instant of the sound's period, with samples of the
/// complex amplitude A. Between samples, n² is a B-spline, as for an index sampled at this instant.
#[derive(Clone, Debug)]
pub struct SampledSound {
    instant: Bspline,
    /// Complex instant e^{iωt}; zero without sound.
    turn: DVec2,
    wave: Arc<SoundSamples>,
    /// Amplitude, computed when phases of light are first needed. Copies of the field share it.
    amplitude: Arc<OnceLock<Arc<SampledAmplitude>>>,
    /// Elasto-optic coefficient, see [`Sound::elasto_optic`].
    elasto_optic: Option<f64>,
}

/// Samples of the amplitude of sound, in units of index.
#[derive(Clone, Debug, PartialEq)]
pub struct SoundSamples {
    /// Number of samples along x, y, z.
    pub size: [usize; 3],
    /// Box of the samples.
    pub bounds: Aabb,
    /// Placement of the samples in the box.
    pub placement: Placement,
    /// Real and imaginary parts of A, x fastest.
    pub amplitude: Vec<[f32; 2]>,
    /// Mean index n₀, positive.
    pub n0: f64,
    /// Frequency of the sound in Hz, positive.
    pub frequency: f64,
    /// Wavelength of the sound in scene units, positive.
    pub wavelength: f64,
    /// Standard deviation of the noise of samples, in units of index, which the spline may smooth
    /// away.
    pub noise: f64,
}

impl SampledSound {
    /// Creates the field at phase 0.
    ///
    /// # Errors
    ///
    /// No samples or a wrong number of samples, an index that is not positive at some instant,
    /// values that are not finite.
    pub fn new(samples: SoundSamples) -> Result<Self, FieldError> {
        positive("frequency of sound", samples.frequency)?;
        positive("wavelength of sound", samples.wavelength)?;
        let most = |[re, im]: &[f32; 2]| f64::from(re.hypot(*im));
        let largest = samples.amplitude.iter().map(most).fold(0.0, f64::max);
        positive("least index in sound", samples.n0 - largest)?;
        let instant = samples.at_phase(0.0)?;
        Ok(SampledSound {
            instant,
            turn: DVec2::X,
            wave: Arc::new(samples),
            amplitude: Arc::default(),
            elasto_optic: None,
        })
    }

    /// Returns the field with the elasto-optic coefficient η = ρc² ∂n/∂p > 0 (0.32 in water), which
    /// determines how far sound moves scatterers.
    ///
    /// # Errors
    ///
    /// A coefficient that is not positive.
    pub fn with_elasto_optic(self, elasto_optic: f64) -> Result<Self, FieldError> {
        let elasto_optic = Some(positive("elasto-optic coefficient", elasto_optic)?);
        Ok(SampledSound {
            elasto_optic,
            ..self
        })
    }

    /// Returns the field at another phase, see [`Field::at_phase`].
    pub(super) fn at_phase(&self, phase: f64) -> Self {
        let wave = self.wave.clone();
        // Ignore errors: indices are positive at all instants, and the number of samples does not
        // change.
        let instant = wave
            .at_phase(phase)
            .unwrap_or_else(|_| self.instant.clone());
        SampledSound {
            instant,
            turn: DVec2::from_angle(phase),
            wave,
            amplitude: self.amplitude.clone(),
            elasto_optic: self.elasto_optic,
        }
    }

    /// Returns the field without sound, see [`Field::without_sound`].
    pub(super) fn without_sound(&self) -> Self {
        let instant = self.wave.spline(|_| self.wave.n0 * self.wave.n0);
        SampledSound {
            instant: instant.unwrap_or_else(|_| self.instant.clone()),
            turn: DVec2::ZERO,
            wave: self.wave.clone(),
            amplitude: self.amplitude.clone(),
            elasto_optic: self.elasto_optic,
        }
    }

    /// Converts derivatives with respect to samples of the index to derivatives with respect to n₀
    /// and the real and imaginary parts of all samples.
    pub(super) fn sample_derivative(&self, by_index: &[f64]) -> Vec<f64> {
        let parts = by_index
            .iter()
            .flat_map(|by| [by * self.turn.x, -by * self.turn.y]);
        [by_index.iter().sum()].into_iter().chain(parts).collect()
    }

    /// Converts changes of the parameters to changes of samples of the index: the transpose of
    /// `sample_derivative`.
    pub(super) fn sample_change(&self, change: &[f64]) -> Vec<f64> {
        let parts = change[1..].chunks_exact(2);
        let of = |part: &[f64]| change[0] + part[0] * self.turn.x - part[1] * self.turn.y;
        parts.map(of).collect()
    }

    pub(super) fn wave(&self) -> &SoundSamples {
        &self.wave
    }

    /// Returns the amplitude at all places, computed on first use.
    pub(super) fn amplitude(&self) -> Arc<SampledAmplitude> {
        let made = self.amplitude.get_or_init(|| Arc::new(self.wave.splines()));
        made.clone()
    }

    pub(super) fn sound(&self) -> Sound {
        Sound {
            frequency: Some(self.wave.frequency),
            wavelength: self.wave.wavelength,
            elasto_optic: self.elasto_optic,
        }
    }

    /// Returns the field at the instant.
    pub(super) fn instant(&self) -> &Bspline {
        &self.instant
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.instant.n2(x)
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        self.instant.gradient(x)
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        self.instant.jet(x)
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        self.instant.bounds(region)
    }

    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        self.instant.length_scale(x)
    }

    pub(super) fn is_constant(&self) -> bool {
        self.instant.is_constant()
    }

    pub(super) fn memory(&self) -> usize {
        let amplitude = self.amplitude.get().map_or(0, |made| made.memory());
        self.instant.memory() + self.wave.amplitude.len() * size_of::<[f32; 2]>() + amplitude
    }
}

impl SoundSamples {
    /// Returns the index at the phase ωt.
    fn at_phase(&self, phase: f64) -> Result<Bspline, FieldError> {
        let (sin, cos) = phase.sin_cos();
        self.spline(|[re, im]| (self.n0 + re * cos - im * sin).powi(2))
    }

    fn splines(&self) -> SampledAmplitude {
        let n2 = self.n0 * self.n0;
        let part = |i: usize| {
            let silent = self.amplitude.iter().all(|parts| parts[i] == 0.0);
            // Ignore errors: the number of samples is right, and all are positive, because |A| <
            // n₀.
            let spline = || self.spline(|parts| n2 + self.n0 * parts[i]).ok();
            (!silent).then(spline).flatten()
        };
        let most = |[re, im]: &[f32; 2]| f64::from(re.hypot(*im));
        let most = self.amplitude.iter().map(most).fold(0.0, f64::max);
        SampledAmplitude::new([part(0), part(1)], n2, 2.0 * self.n0 * most)
    }

    /// Creates the spline of n² = `square`(real and imaginary part of A).
    pub(super) fn spline(&self, square: impl Fn([f64; 2]) -> f64) -> Result<Bspline, FieldError> {
        let index = |parts: &[f32; 2]| square(parts.map(f64::from)).sqrt();
        let sampling = Sampling {
            noise: self.noise,
            double: true,
        };
        let samples = &self.amplitude;
        Bspline::converted(
            self.size,
            self.bounds,
            self.placement,
            samples,
            sampling,
            index,
        )
    }
}

impl From<SampledSound> for Field {
    fn from(field: SampledSound) -> Self {
        Field::SampledSound(Box::new(field))
    }
}
