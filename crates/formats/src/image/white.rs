//! White balance of images on a screen.

use super::{ImageLayers, Layer};
use crate::cie;
use std::fmt;
use std::str::FromStr;

/// Range of colour temperatures, in K. The light of colder black bodies lies outside sRGB.
const KELVIN: [f64; 2] = [2000.0, 40_000.0];
/// Weights of linear red, green and blue of ITU-R BT.709 in luminance.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Colour of the light that is to look white on a screen. Its channels become equal, and its
/// luminance does not change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct White([f64; 3]);

impl White {
    /// Makes a colour of linear red, green and blue white; `None` unless all are above 0.
    pub fn of_colour(rgb: [f64; 3]) -> Option<Self> {
        let is_valid = rgb.iter().all(|v| *v > 0.0 && v.is_finite());
        is_valid.then_some(White(rgb))
    }

    /// Makes the light of a black body white; `None` for temperatures outside 2000 to 40 000 K.
    pub fn of_temperature(kelvin: f64) -> Option<Self> {
        let is_valid = (KELVIN[0]..=KELVIN[1]).contains(&kelvin);
        let colour = || White::of_colour(cie::srgb(|nm| cie::planck(nm, kelvin)));
        is_valid.then(colour).flatten()
    }

    /// Returns the factors of linear red, green and blue.
    pub fn gains(self) -> [f64; 3] {
        let luminance: f64 = self.0.iter().zip(LUMINANCE).map(|(v, w)| v * w).sum();
        self.0.map(|v| luminance / v)
    }
}

/// Text that is neither a temperature nor a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParseWhiteError;

impl fmt::Display for ParseWhiteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = KELVIN;
        write!(
            f,
            "expected the temperature of the light in K, from {low} to {high}, such as 3200, or the red, green and blue of a neutral surface, above 0, such as 1,0.8,0.5"
        )
    }
}

impl std::error::Error for ParseWhiteError {}

impl FromStr for White {
    type Err = ParseWhiteError;

    /// Parses a temperature in K (`3200` or `3200K`) or a colour (`RED,GREEN,BLUE`).
    fn from_str(text: &str) -> Result<Self, ParseWhiteError> {
        let numbers = text.trim().trim_end_matches(['K', 'k']).split(',');
        let numbers: Result<Vec<f64>, _> = numbers.map(|v| v.trim().parse()).collect();
        let white = match numbers.as_deref() {
            Ok([kelvin]) => White::of_temperature(*kelvin),
            Ok(&[r, g, b]) => White::of_colour([r, g, b]),
            _ => None,
        };
        white.ok_or(ParseWhiteError)
    }
}

impl ImageLayers {
    /// Returns the image on a screen with another white, as the only layer, with its attributes.
    #[must_use]
    pub fn balanced(self, white: White) -> Self {
        let gains = white.gains();
        let shown = self.on_screen().unwrap_or_default();
        let channel = |c: usize| {
            let values = shown.pixels.iter();
            let values = values.map(|pixel| (f64::from(pixel[c]) * gains[c]) as f32);
            (["R", "G", "B"][c].to_owned(), values.collect())
        };
        let layer = Layer {
            name: String::new(),
            channels: (0..3).map(channel).collect(),
        };
        ImageLayers {
            layers: vec![layer],
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gains(text: &str) -> [f64; 3] {
        text.parse::<White>().unwrap().gains()
    }

    #[test]
    fn neutral_colours_become_grey_of_their_luminance() {
        let colour = [0.5, 0.25, 0.125];
        let gains = gains("0.5,0.25, 0.125");
        let grey: Vec<f64> = colour.iter().zip(gains).map(|(v, g)| v * g).collect();
        let luminance = 0.2126 * 0.5 + 0.7152 * 0.25 + 0.0722 * 0.125;
        assert!(
            grey.iter().all(|v| (v - luminance).abs() < 1e-12),
            "{grey:?}"
        );
    }

    /// Planck's law at 3200 K has the chromaticity (0.4234, 0.3990) (Wyszecki and Stiles, Color
    /// Science, 1982). In linear sRGB of luminance 1 this is (1.680, 0.866, 0.326).
    #[test]
    fn warm_light_becomes_white() {
        let [r, g, b] = gains("3200K");
        for (gain, colour) in [(r, 1.680), (g, 0.866), (b, 0.326)] {
            assert!((gain * colour - 1.0).abs() < 0.01, "{gain} {colour}");
        }
        let daylight = gains("6504");
        assert!(
            daylight.iter().all(|g| (g - 1.0).abs() < 0.05),
            "{daylight:?}"
        );
    }

    #[test]
    fn other_texts_are_errors() {
        for text in [
            "", "warm", "1000", "1e9", "NaN", "1,2", "1,2,0", "1,2,-3", "1,2,inf",
        ] {
            assert_eq!(text.parse::<White>(), Err(ParseWhiteError), "{text}");
        }
    }
}
