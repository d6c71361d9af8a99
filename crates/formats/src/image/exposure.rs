//! How much brighter a screen shows an image: docs/images.md says by which rule.

use super::RgbImage;
use super::tone::{Curve, Tone};

/// How much brighter than its values an image is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// As much as the image needs: see [`Exposure::of`].
    #[default]
    Auto,
    /// By so many stops, whatever the image; 0 changes nothing.
    Stops(f64),
}

/// Share of the lit pixels that bright ones are above: a few fireflies, or a small light, do not matter.
const BRIGHT: f64 = 0.99;
/// Between these luminances the bright pixels are neither dark nor burnt out.
const LEVELS: [f64; 2] = [0.5, 1.0];
/// Luminance of the median lit pixel below which nothing is darkened: a large light in view does not make the rest black.
const DARK: f64 = 0.1;
/// Exposures are multiples of 1 stop by this, so that equal scenes with other noise are shown alike.
const STEPS: f64 = 4.0;

/// Weights of linear red, green and blue of ITU-R BT.709 in luminance.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Exposure {
    /// The stops for an image of these linear colours.
    pub fn stops(self, pixels: impl Iterator<Item = [f32; 3]>) -> f64 {
        match self {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => Exposure::of(pixels),
        }
    }

    /// The same as a tone, with the curve that follows.
    pub fn tone(self, curve: Curve, image: &RgbImage) -> Tone {
        Tone {
            exposure: self.stops(image.pixels.iter().copied()),
            curve,
        }
    }

    /// The stops that an image needs, a multiple of a quarter, from the luminances of its lit pixels, which are above zero.
    ///
    /// If their 99th percentile is below 0.5, the fewest that bring it there; if it is above 1, the fewest that bring it down to 1,
    /// but not so many that their median falls below 0.1. Otherwise, and without lit pixels, none. NaN is not lit.
    pub fn of(pixels: impl Iterator<Item = [f32; 3]>) -> f64 {
        let luminance = |[r, g, b]: [f32; 3]| {
            let [wr, wg, wb] = LUMINANCE;
            (wr * f64::from(r) + wg * f64::from(g) + wb * f64::from(b)) as f32
        };
        let lit = pixels.map(luminance).filter(|l| *l > 0.0);
        let mut lit: Vec<f32> = lit.map(|l| l.min(f32::MAX)).collect();
        let (Some(bright), Some(median)) = (quantile(&mut lit, BRIGHT), quantile(&mut lit, 0.5))
        else {
            return 0.0;
        };
        let stops_to = |level: f64, from: f64| (level / from).log2();
        let [least, most] = LEVELS;
        if bright < least {
            (stops_to(least, bright) * STEPS).ceil() / STEPS
        } else if bright > most {
            let limit = stops_to(DARK, median).min(0.0);
            let stops = (stops_to(most, bright) * STEPS).floor() / STEPS;
            stops.max((limit * STEPS).ceil() / STEPS)
        } else {
            0.0
        }
    }
}

/// The smallest value that at least this share of all is not above; `None` of no values.
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

    /// Levels from 1/8 to 4 of a grey picture, by hand: log₂ of 0.5 or 1 by the level, outwards to a quarter.
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

    /// One pixel of 1000 beyond all others, and a light over a twentieth of the picture.
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

    /// The picture that comes out needs nothing more, at every level that numbers have with all their digits.
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
