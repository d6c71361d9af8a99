//! Amplitude of sound at a place.

use glam::{DVec2, DVec3};

/// Amplitude of sound at a place. Complex numbers are vectors of their real and imaginary parts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoundAmplitude {
    /// Amplitude m of n².
    pub n2: DVec2,
    /// Real and imaginary parts of ∇m.
    pub gradient: [DVec3; 2],
}

impl SoundAmplitude {
    /// Returns the sum of two amplitudes.
    pub(super) fn plus(self, other: SoundAmplitude) -> Self {
        let [re, im] = self.gradient;
        SoundAmplitude {
            n2: self.n2 + other.n2,
            gradient: [re + other.gradient[0], im + other.gradient[1]],
        }
    }
}
