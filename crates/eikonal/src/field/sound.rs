//! What sound does to a field: its period, and the index at another instant of it (docs/theory.md#sound). Fields without sound
//! stay as they are.

use super::Field;

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

    /// Shortest and longest wavelength of the sound in the field, in scene units, whatever its amplitude;
    /// `None` without sound. Under a transform that stretches directions differently, a mean of them.
    pub fn sound_wavelengths(&self) -> Option<[f64; 2]> {
        match self {
            Field::Acoustic(f) => f.wavelengths(),
            Field::SampledSound(f) => Some(f.wavelengths()),
            Field::Sum(f) => f
                .terms()
                .filter_map(Field::sound_wavelengths)
                .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]),
            Field::Affine(f) => {
                let inner = f.inner().sound_wavelengths()?;
                Some(inner.map(|length| length * f.mean_scale()))
            }
            Field::Scaled(f) => f.inner().sound_wavelengths(),
            _ => None,
        }
    }
}
