//! Conversion of spectra to colours on a screen.

use super::{ImageLayers, RgbImage};
use crate::cie::{WHITE, matching, of_xyz};

/// Smallest X, Y and Z of white, relative to the mean of their matching functions over the
/// wavelengths. Below it, colours are undetermined.
const MIN_WHITE: f64 = 1e-3;

/// Returns the weights that convert radiances at some wavelengths (nm, in any order) to linear red,
/// green and blue.
///
/// X, Y and Z are sums over the wavelengths with the weights of the trapezoidal rule. White is
/// equal radiance at all wavelengths: X, Y and Z are divided by their values for equal radiance,
/// and multiplied by X, Y and Z of sRGB's white. Radiance 1 therefore becomes (1, 1, 1) for any
/// number and spacing of wavelengths. The result is `None` if the wavelengths do not determine
/// colours: a single wavelength, or no wavelength in the range of a matching function.
///
/// Colours outside the gamut, for example of single wavelengths, have negative components.
pub fn weights(wavelengths: &[f64]) -> Option<Vec<[f64; 3]>> {
    let steps = trapezoid(wavelengths);
    let xyz: Vec<[f64; 3]> = wavelengths
        .iter()
        .zip(&steps)
        .map(|(nm, step)| matching(*nm).map(|v| v * step))
        .collect();
    let white: [f64; 3] = std::array::from_fn(|c| xyz.iter().map(|v| v[c]).sum());
    let total: f64 = steps.iter().sum();
    if wavelengths.len() < 2 || white.iter().any(|w| *w <= MIN_WHITE * total) {
        return None;
    }
    let relative = |xyz: &[f64; 3]| std::array::from_fn(|c| xyz[c] / white[c] * WHITE[c]);
    Some(xyz.iter().map(|xyz| of_xyz(relative(xyz))).collect())
}

/// Returns half the distance between the neighbours of each wavelength; at the ends, half the
/// distance to the only neighbour.
fn trapezoid(wavelengths: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wavelengths.len()).collect();
    order.sort_by(|a, b| wavelengths[*a].total_cmp(&wavelengths[*b]));
    let mut steps = vec![0.0; wavelengths.len()];
    for pair in order.windows(2) {
        let half = 0.5 * (wavelengths[pair[1]] - wavelengths[pair[0]]);
        steps[pair[0]] += half;
        steps[pair[1]] += half;
    }
    steps
}

impl ImageLayers {
    /// Returns the main layer in colour, if its channels are wavelengths (`450nm` and so on) that
    /// determine colours: see [`weights`].
    pub(crate) fn spectral_rgb(&self) -> Option<RgbImage> {
        let channels = &self.layer("")?.channels;
        let nm = |(name, _): &(String, _)| name.strip_suffix("nm")?.parse().ok();
        let wavelengths: Vec<f64> = channels.iter().map(nm).collect::<Option<_>>()?;
        let weights = weights(&wavelengths)?;
        let pixel = |i: usize| {
            let mut rgb = [0.0; 3];
            for ((_, values), weights) in channels.iter().zip(&weights) {
                for (sum, weight) in rgb.iter_mut().zip(weights) {
                    *sum += weight * f64::from(values[i]);
                }
            }
            rgb.map(|v| v as f32)
        };
        Some(RgbImage {
            width: self.width,
            height: self.height,
            pixels: (0..self.width * self.height).map(pixel).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with four digits of the table of CIE 1931, at wavelengths over the visible range.
    #[test]
    fn matching_functions_are_those_of_the_table() {
        for (nm, table) in [
            (420.0, [0.1344, 0.0040, 0.6456]),
            (450.0, [0.3362, 0.0380, 1.7721]),
            (500.0, [0.0049, 0.3230, 0.2720]),
            (555.0, [0.5121, 1.0000, 0.0057]),
            (600.0, [1.0622, 0.6310, 0.0008]),
            (650.0, [0.2835, 0.1070, 0.0000]),
            (700.0, [0.0114, 0.0041, 0.0000]),
        ] {
            let found = matching(nm);
            for (f, t) in found.iter().zip(table) {
                assert!((f - t).abs() < 6e-5, "{nm} nm: {found:?}, {table:?}");
            }
        }
    }

    fn colour(wavelengths: &[f64], radiance: impl Fn(f64) -> f64) -> [f64; 3] {
        let weights = weights(wavelengths).unwrap();
        let mut rgb = [0.0; 3];
        for (nm, w) in wavelengths.iter().zip(weights) {
            rgb = std::array::from_fn(|c| rgb[c] + w[c] * radiance(*nm));
        }
        rgb
    }

    fn visible() -> Vec<f64> {
        (0..81).map(|i| 380.0 + 5.0 * f64::from(i)).collect()
    }

    #[test]
    fn equal_energy_is_white_for_every_list() {
        let uneven = [620.0, 450.0, 480.0, 560.0, 700.0];
        for list in [&visible()[..], &uneven] {
            for part in colour(list, |_| 0.5) {
                assert!((part - 0.5).abs() < 5e-4, "{part}");
            }
        }
    }

    /// Checks that the luminance of a spectrum is the integral over ȳ, relative to the luminance of
    /// white.
    #[test]
    fn luminance_is_weighted_by_the_second_matching_function() {
        let ramp = |nm: f64| (nm - 380.0) / 400.0;
        let [r, g, b] = colour(&visible(), ramp);
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let sum = |f: &dyn Fn(f64) -> f64| visible().iter().map(|nm| f(*nm)).sum::<f64>();
        let expected = sum(&|nm| matching(nm)[1] * ramp(nm)) / sum(&|nm| matching(nm)[1]);
        assert!(
            (luminance - expected).abs() < 2e-3,
            "{luminance}, {expected}"
        );
    }

    #[test]
    fn hues_are_in_order() {
        let line = |at: f64| move |nm: f64| f64::from(u8::from((nm - at).abs() < 3.0));
        let largest = |rgb: [f64; 3]| (0..3).max_by(|a, b| rgb[*a].total_cmp(&rgb[*b]));
        for (nm, channel) in [(630.0, 0), (530.0, 1), (450.0, 2)] {
            assert_eq!(largest(colour(&visible(), line(nm))), Some(channel));
        }
    }

    #[test]
    fn wavelengths_that_tell_no_colours_have_none() {
        for list in [&[532.0][..], &[700.0, 720.0], &[1064.0, 1310.0], &[]] {
            assert_eq!(weights(list), None);
        }
    }
}
