//! What sound does to a field: its period, and the index at another instant of it (docs/theory.md#sound). Fields without sound
//! stay as they are.

use super::Field;

/// A sound in a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sound {
    /// In Hz, if it is known.
    pub frequency: Option<f64>,
    /// In scene units. Under a transform that stretches directions differently, a mean of them.
    pub wavelength: f64,
    /// η = ρc² ∂n/∂p, of a medium of density ρ and speed of sound c, if it is known.
    pub elasto_optic: Option<f64>,
}

impl Field {
    /// The field at the phase `phase` = ωt of its sound, in radians; the field itself if there is no sound
    /// in it. Phase 0 is the field as it was made.
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

    /// The field without its sound, which is still in it: [`Field::at_phase`] brings it back.
    pub fn at_rest(&self) -> Field {
        match self {
            Field::Acoustic(f) => f.at_rest().into(),
            Field::SampledSound(f) => f.at_rest().into(),
            Field::Sum(f) => f.map(Field::at_rest).into(),
            Field::Affine(f) => f.over(f.inner().at_rest()).into(),
            Field::Scaled(f) => f.over(f.inner().at_rest()).into(),
            _ => self.clone(),
        }
    }

    /// The sounds in the field, whatever their amplitudes.
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

    /// Shortest and longest wavelength of the sounds in the field, in scene units; `None` without sound.
    pub fn sound_wavelengths(&self) -> Option<[f64; 2]> {
        let sounds = self.sounds().into_iter();
        sounds
            .map(|sound| [sound.wavelength; 2])
            .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}
