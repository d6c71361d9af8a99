//! Exposure of images on a screen, by the rule in docs/images.md.

use super::RgbImage;
use super::tone::{Curve, Tone};

/// Exposure of an image on a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// Automatic exposure: see [`Exposure::of`].
    #[default]
    Auto,
    /// Given number of stops for all images; 0 changes nothing.
    Stops(f64),
}

/// Fraction of the lit pixels below the bright level. A few outliers, or a small light, have no
/// effect on the level.
const BRIGHT_FRACTION: f64 = 0.99;
/// Range of luminances of the bright level. Within the range, an image is neither dark nor
/// overexposed.
const LEVELS: [f64; 2] = [0.5, 1.0];
/// Smallest luminance of the median lit pixel after darkening. A large light in view then does not
/// make the rest of the image black.
const MIN_MEDIAN: f64 = 0.1;
/// Number of exposure steps per stop. Rounding makes exposures of equal scenes with different noise
/// equal.
const STEPS_PER_STOP: f64 = 4.0;

/// Weights of linear red, green and blue of ITU-R BT.709 in luminance.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Exposure {
    /// Returns the number of stops for an image of these linear colours.
    pub fn stops(self, pixels: impl Iterator<Item = [f32; 3]>) -> f64 {
        match self {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => Exposure::of(pixels),
        }
    }

    /// Returns the exposure of an image as a tone, with a given curve.
    pub fn tone(self, curve: Curve, image: &RgbImage) -> Tone {
        Tone {
            exposure: self.stops(image.pixels.iter().copied()),
            curve,
        }
    }

    /// Returns the automatic number of stops, a multiple of a quarter, from the luminances of lit
    /// pixels, which are above zero.
    ///
    /// If their 99th percentile is below 0.5, the result is the smallest number that raises it to
    /// 0.5. If it is above 1, the result is the smallest darkening that lowers it to 1, but does
    /// not lower their median below 0.1. In other cases, and without lit pixels, it is 0. NaN is
    /// not lit.
    pub fn of(pixels: impl Iterator<Item = [f32; 3]>) -> f64 {
        let luminance = |[r, g, b]: [f32; 3]| {
            let [wr, wg, wb] = LUMINANCE;
            (wr * f64::from(r) + wg * f64::from(g) + wb * f64::from(b)) as f32
        };
        let lit = pixels.map(luminance).filter(|l| *l > 0.0);
        let mut lit: Vec<f32> = lit.map(|l| l.min(f32::MAX)).collect();
        let (Some(bright), Some(median)) =
            (quantile(&mut lit, BRIGHT_FRACTION), quantile(&mut lit, 0.5))
        else {
            return 0.0;
        };
        let stops_to = |level: f64, from: f64| (level / from).log2();
        let [least, most] = LEVELS;
        if bright < least {
            (stops_to(least, bright) * STEPS_PER_STOP).ceil() / STEPS_PER_STOP
        } else if bright > most {
            let limit = stops_to(MIN_MEDIAN, median).min(0.0);
            let stops = (stops_to(most, bright) * STEPS_PER_STOP).floor() / STEPS_PER_STOP;
            stops.max((limit * STEPS_PER_STOP).ceil() / STEPS_PER_STOP)
        } else {
            0.0
        }
    }
}

/// Returns the smallest value that is at least as large as the fraction `share` of all values;
/// `None` without values.
fn quantile(values: &mut [f32], share: f64) -> Option<f64> {
    let rank = (share * values.len() as f64).ceil() as usize;
    let index = rank.clamp(1, values.len().max(1)) - 1;
    if values.is_empty() {
        return None;
    }
    let (_, value, _) = values.select_nth_unstable_by(index, f32::total_cmp);
    Some(f64::from(*value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(levels: impl IntoIterator<Item = f32>) -> f64 {
        Exposure::of(levels.into_iter().map(|v| [v; 3]))
    }

    /// Compares levels from 1/8 to 4 of a grey picture with results by hand: log₂ of 0.5 or 1
    /// divided by the level, rounded away from zero to a quarter.
    #[test]
    fn grey_pictures_become_half_to_white() {
        for (level, stops) in [
            (0.125, 2.0),
            (0.3, 0.75),
            (0.5, 0.0),
            (0.9, 0.0),
            (1.0, 0.0),
            (1.1, -0.25),
            (4.0, -2.0),
        ] {
            assert_eq!(of([level; 7]), stops, "{level}");
        }
    }

    #[test]
    fn what_is_shown_well_is_left_alone() {
        let stops = of((0..1000).map(|i| i as f32 / 1200.0));
        assert_eq!(stops, 0.0);
    }

    /// Adds one very bright pixel to 1000, and a light over a twentieth of the picture.
    #[test]
    fn neither_fireflies_nor_lights_make_a_picture_black() {
        let room = || (0..1000).map(|i| 0.2 + i as f32 / 2000.0);
        assert_eq!(of(room().chain([1e6])), of(room()));
        let light = of(room().chain([100.0; 50]));
        let median = 0.45 * light.exp2();
        assert!((-2.25..0.0).contains(&light) && median >= 0.1, "{light}");
    }

    #[test]
    fn only_lit_pixels_count() {
        let beam = [0.01; 100];
        assert_eq!(of(beam.into_iter().chain([0.0; 10_000])), of(beam));
        let odd = [f32::NAN, f32::NEG_INFINITY, -1.0, 0.0];
        assert_eq!(of(beam.into_iter().chain(odd)), of(beam));
        assert_eq!(of(odd), 0.0);
        assert_eq!(of([]), 0.0);
    }

    /// Checks that exposed pictures need no further exposure, at every level of normal numbers.
    #[test]
    fn exposing_twice_is_exposing_once() {
        for exponent in -120..127 {
            let level = f64::from(exponent).exp2() * 1.37;
            let stops = of([level as f32; 3]);
            assert!(stops.is_finite() && (stops * 4.0).fract() == 0.0);
            let exposed = (f64::from(level as f32) * stops.exp2()) as f32;
            assert!((0.4999..1.0001).contains(&exposed), "{level}: {exposed}");
        }
        assert!(of([f32::INFINITY; 3]).is_finite() && of([f32::from_bits(1); 3]).is_finite());
    }

    #[test]
    fn a_wish_is_granted() {
        assert_eq!(Exposure::Stops(0.3).stops([[1e-6; 3]].into_iter()), 0.3);
    }
}
