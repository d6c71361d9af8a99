//! Sound in fields: its frequency and wavelength, and the index at any instant of its period
//! (docs/theory.md#sound). Fields without sound do not change.

use super::Field;

/// A sound in a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sound {
    /// Frequency in Hz, if known.
    pub frequency: Option<f64>,
    /// Wavelength in scene units. Under a transform that stretches directions differently, a mean
    /// over directions.
    pub wavelength: f64,
    /// Elasto-optic coefficient η = ρc² ∂n/∂p of a medium of density ρ and speed of sound c, if
    /// known.
    pub elasto_optic: Option<f64>,
}

impl Field {
    /// Returns the field at the phase `phase` = ωt of its sound, in radians; a field without sound
    /// is unchanged. Phase 0 is the phase of the field as created.
    pub fn at_phase(&self, phase: f64) -> Field {
        match self {
            Field::Acoustic(f) => f.at_phase(phase).into(),
            Field::SampledSound(f) => f.at_phase(phase).into(),
            Field::Sum(f) => f.map(|term| term.at_phase(phase)).into(),
            Field::Affine(f) => f.over(f.inner().at_phase(phase)).into(),
            Field::Scaled(f) => f.over(f.inner().at_phase(phase)).into(),
            _ => self.clone(),
        }
    }

    /// Returns the field with an amplitude of zero of its sound. The sound is still stored:
    /// [`Field::at_phase`] restores it.
    pub fn without_sound(&self) -> Field {
        match self {
            Field::Acoustic(f) => f.without_sound().into(),
            Field::SampledSound(f) => f.without_sound().into(),
            Field::Sum(f) => f.map(Field::without_sound).into(),
            Field::Affine(f) => f.over(f.inner().without_sound()).into(),
            Field::Scaled(f) => f.over(f.inner().without_sound()).into(),
            _ => self.clone(),
        }
    }

    /// Returns the sounds in the field, whatever their amplitudes.
    pub fn sounds(&self) -> Vec<Sound> {
        match self {
            Field::Acoustic(f) => f.sounds().collect(),
            Field::SampledSound(f) => vec![f.sound()],
            Field::Sum(f) => f.terms().flat_map(Field::sounds).collect(),
            Field::Affine(f) => {
                let mut sounds = f.inner().sounds();
                for sound in &mut sounds {
                    sound.wavelength *= f.mean_scale();
                }
                sounds
            }
            Field::Scaled(f) => f.inner().sounds(),
            _ => Vec::new(),
        }
    }

    /// Returns the shortest and the longest wavelength of the sounds in the field, in scene units;
    /// `None` without sound.
    pub fn sound_wavelengths(&self) -> Option<[f64; 2]> {
        let sounds = self.sounds().into_iter();
        sounds
            .map(|sound| [sound.wavelength; 2])
            .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}
