//! The amplitude of sound that is sampled on a grid (docs/theory.md#tagged-light).

use super::Bspline;
use super::sound_amplitude::SoundAmplitude;
use glam::{DVec2, DVec3};

/// Splines of n₀² + ½ Re m and of n₀² + ½ Im m, unless these are zero.
#[derive(Clone, Debug)]
pub(super) struct SampledAmplitude {
    parts: [Option<Bspline>; 2],
    /// n₀².
    n2: f64,
    /// Largest |m|.
    largest: f64,
}

impl SampledAmplitude {
    pub(super) fn new(parts: [Option<Bspline>; 2], n2: f64, largest: f64) -> Self {
        SampledAmplitude { parts, n2, largest }
    }

    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    pub(super) fn memory(&self) -> usize {
        self.parts.iter().flatten().map(Bspline::memory).sum()
    }

    /// The value alone.
    pub(super) fn value(&self, x: DVec3) -> DVec2 {
        let [re, im] = match &self.parts {
            [Some(re), Some(im)] => re.values(im, x),
            [re, im] => [re, im].map(|part| part.as_ref().map_or(self.n2, |spline| spline.n2(x))),
        };
        2.0 * DVec2::new(re - self.n2, im - self.n2)
    }

    pub(super) fn at(&self, x: DVec3) -> SoundAmplitude {
        let silent = (self.n2, DVec3::ZERO);
        let [re, im] = match &self.parts {
            [Some(re), Some(im)] => re.gradients(im, x),
            [re, im] => {
                [re, im].map(|part| part.as_ref().map_or(silent, |spline| spline.gradient(x)))
            }
        };
        let n2 = DVec2::new(re.0 - self.n2, im.0 - self.n2);
        SoundAmplitude {
            n2: 2.0 * n2,
            gradient: [2.0 * re.1, 2.0 * im.1],
        }
    }
}
