//! Amplitude of sound that is sampled on a grid (docs/theory.md#tagged-light).

use super::Bspline;
use super::bspline::ComplexBspline;
use super::sound_amplitude::SoundAmplitude;
use glam::{DVec2, DVec3};

/// Amplitude m as a spline.
#[derive(Clone, Debug)]
pub(super) struct SampledAmplitude {
    /// Spline of m; `None` without sound.
    spline: Option<ComplexBspline>,
    /// Largest |m|.
    largest: f64,
}

impl SampledAmplitude {
    /// Creates the amplitude from splines of n₀² + ½ Re m and of n₀² + ½ Im m; `None` for a part
    /// that is zero.
    pub(super) fn new(parts: [Option<Bspline>; 2], n2: f64, largest: f64) -> Self {
        SampledAmplitude {
            spline: ComplexBspline::above(n2, parts, 2.0),
            largest,
        }
    }

    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    pub(super) fn memory(&self) -> usize {
        self.spline.as_ref().map_or(0, ComplexBspline::memory)
    }

    /// Returns the value alone.
    pub(super) fn value(&self, x: DVec3) -> DVec2 {
        let spline = self.spline.as_ref();
        spline.map_or(DVec2::ZERO, |spline| spline.value(x))
    }

    pub(super) fn at(&self, x: DVec3) -> SoundAmplitude {
        let Some(spline) = &self.spline else {
            return SoundAmplitude::default();
        };
        let (n2, gradient) = spline.gradient(x);
        SoundAmplitude { n2, gradient }
    }
}
