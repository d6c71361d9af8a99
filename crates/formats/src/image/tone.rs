//! Conversion of linear values to values for a screen.

use super::{ImageLayers, RgbImage};
use crate::colour::srgb_from_linear;

/// Exposure and curve that convert linear values for a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Exposure in stops: values are multiplied by two to this power.
    pub exposure: f64,
    /// Curve for bright values.
    pub curve: Curve,
}

/// Curve for bright values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// Values are clipped at 1.
    #[default]
    Srgb,
    /// Values are compressed, as by photographic film, so that 5.6 becomes white and dark values
    /// become darker: the curve of J. Hable, "Uncharted 2: HDR Lighting", Game Developers
    /// Conference 2010. It acts on each channel.
    Filmic,
}

impl Curve {
    /// Names of all curves.
    pub const NAMES: [(&'static str, Curve); 2] = [
        (Curve::Srgb.name(), Curve::Srgb),
        (Curve::Filmic.name(), Curve::Filmic),
    ];

    /// Returns the name of the curve.
    pub const fn name(self) -> &'static str {
        match self {
            Curve::Srgb => "srgb",
            Curve::Filmic => "filmic",
        }
    }
}

impl Tone {
    /// Returns the value in sRGB, in [0, 1]; zero for NaN.
    pub fn encode(self, value: f32) -> f64 {
        let value = f64::from(value) * self.exposure.exp2();
        let value = match self.curve {
            Curve::Srgb => value,
            Curve::Filmic => filmic(value),
        };
        let value = if value.is_nan() { 0.0 } else { value };
        srgb_from_linear(value.clamp(0.0, 1.0))
    }
}

impl Tone {
    /// Restores the linear value from an encoded value that was converted to linear.
    pub(super) fn undo(self, shown: f32) -> f32 {
        let shown = f64::from(shown);
        let value = match self.curve {
            Curve::Srgb => shown,
            Curve::Filmic => unfilmed(shown),
        };
        (value * (-self.exposure).exp2()) as f32
    }
}

/// Linear value that becomes white, and the gain of the curve, as its author gives them.
const WHITE: f64 = 11.2;
const GAIN: f64 = 2.0;

fn filmic(value: f64) -> f64 {
    // Clip at white: the curve itself would end in ∞/∞.
    let value = (GAIN * value).clamp(0.0, WHITE);
    hable(value) / hable(WHITE)
}

/// Evaluates the curve with shoulder strength 0.15, linear strength 0.5, linear angle 0.1, toe
/// strength 0.2, toe 0.02/0.3.
fn hable(x: f64) -> f64 {
    (x * (0.15 * x + 0.1 * 0.5) + 0.2 * 0.02) / (x * (0.15 * x + 0.5) + 0.2 * 0.3) - 0.02 / 0.3
}

/// Inverts [`filmic`], in [0, 1]: a root of a quadratic equation.
fn unfilmed(shown: f64) -> f64 {
    let y = shown * hable(WHITE) + 0.02 / 0.3;
    let (a, b, c) = (
        0.15 * (1.0 - y),
        0.1 * 0.5 - 0.5 * y,
        0.2 * 0.02 - 0.2 * 0.3 * y,
    );
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    ((root - b) / (2.0 * a)).max(0.0) / GAIN
}

impl ImageLayers {
    /// Returns the main layer for a screen: its colours, also from wavelengths, or the mean of its
    /// channels in grey if they do not determine colours. `None` without a main layer.
    pub fn on_screen(&self) -> Option<RgbImage> {
        let coloured = self.rgb().or_else(|| self.spectral_rgb());
        coloured.or_else(|| {
            let channels = &self.layer("")?.channels;
            let grey = |i: usize| {
                let sum: f32 = channels.iter().map(|(_, values)| values[i]).sum();
                [sum / channels.len() as f32; 3]
            };
            Some(RgbImage {
                width: self.width,
                height: self.height,
                pixels: (0..self.width * self.height).map(grey).collect(),
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the author's curve, computed independently from his constants: middle grey,
    /// one, and white.
    #[test]
    fn filmic_goes_through_known_points() {
        for (value, expected) in [(0.0, 0.0), (0.18, 0.128_338), (1.0, 0.492_919), (5.6, 1.0)] {
            assert!(
                (filmic(value) - expected).abs() < 1e-6,
                "{value}: {}",
                filmic(value)
            );
        }
    }

    #[test]
    fn everything_has_a_place_on_the_screen() {
        for curve in Curve::NAMES.map(|(_, curve)| curve) {
            let tone = Tone {
                exposure: 1.0,
                curve,
            };
            assert_eq!(tone.encode(f32::NAN), 0.0);
            assert_eq!(tone.encode(-3.0), 0.0);
            assert!((tone.encode(f32::INFINITY) - 1.0).abs() < 1e-12);
            assert!(tone.encode(0.1) < tone.encode(0.2));
        }
    }

    #[test]
    fn tones_are_undone() {
        for curve in Curve::NAMES.map(|(_, curve)| curve) {
            let exposure = 0.75;
            let tone = Tone { exposure, curve };
            for value in [0.0, 1e-3, 0.02, 0.3, 0.55] {
                let shown = crate::colour::linear_from_srgb(tone.encode(value));
                let found = tone.undo(shown as f32);
                assert!(
                    (found - value).abs() < 1e-5 * (0.01 + value),
                    "{value}: {found}"
                );
            }
        }
        assert!((unfilmed(1.0) - 5.6).abs() < 1e-9);
    }

    #[test]
    fn a_stop_is_a_factor_of_two() {
        let [one, two] = [1.0, 2.0].map(|exposure| Tone {
            exposure,
            ..Tone::default()
        });
        assert_eq!(one.encode(0.2), two.encode(0.1));
    }
}
