//! Sums of samples by brightness, to reduce the weight of rare bright samples (fireflies).
//!
//! The method is by Zirr, Hanika and Dachsbacher, "Re-weighting Firefly Samples for Improved
//! Finite-Sample Monte Carlo Estimates" (2018). Each sample is divided between two levels of
//! brightness b^i. The sum of a level tells how many samples had this brightness, in the pixel and
//! in the pixels around it. Levels with too few samples receive less weight. The result is biased:
//! it is too dark until there are many samples.
//!
//! Theory: docs/theory.md#outlier-rejection.

use crate::Spectrum;
use crate::sum::ReproducibleSum;
use serde::{Deserialize, Serialize};

/// Ratio of the brightness of neighbouring levels, b.
const BASE: f64 = 8.0;
/// Exponents of the darkest and the brightest level. Samples beyond belong to these two levels.
const EXPONENTS: std::ops::RangeInclusive<i32> = -10..=10;
/// Number of levels.
const LEVELS: usize = 21;
/// Smallest brightness of darker levels that the weights assume, relative to the mean of the image.
const MIN_RELATIVE_BRIGHTNESS: f64 = 0.05;

/// Sums of one group of channels by pixel, level and channel; the channel varies fastest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutlierRejection {
    channels: usize,
    sums: Vec<ReproducibleSum>,
}

/// Levels of a run of pixels.
#[derive(Debug)]
pub(super) struct LevelsMut<'a> {
    channels: usize,
    sums: &'a mut [ReproducibleSum],
}

impl OutlierRejection {
    /// Bytes per pixel and channel.
    pub(crate) const BYTES: usize = LEVELS * size_of::<ReproducibleSum>();

    pub(super) fn new(pixels: usize, channels: usize) -> Self {
        OutlierRejection {
            channels,
            sums: vec![ReproducibleSum::default(); pixels * LEVELS * channels],
        }
    }

    /// Splits the levels into runs of `pixels` pixels.
    pub(super) fn chunks_mut(&mut self, pixels: usize) -> impl Iterator<Item = LevelsMut<'_>> {
        let channels = self.channels;
        let chunks = self.sums.chunks_mut(pixels * LEVELS * channels);
        chunks.map(move |sums| LevelsMut { channels, sums })
    }

    /// Returns the number of channels, and number of stored sums.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.channels, self.sums.len()]
    }

    /// Returns the [`size`](Self::size) of an image with this number of pixels and channels.
    pub(super) fn sized(pixels: usize, channels: usize) -> [usize; 2] {
        [channels, pixels * LEVELS * channels]
    }

    /// Adds the samples of another image of the same size.
    pub(super) fn merge(&mut self, other: &OutlierRejection) {
        let sums = self.sums.iter_mut().zip(&other.sums);
        sums.for_each(|(sum, other)| *sum += *other);
    }

    /// Returns the sum of a level of a pixel; unused channels are zero.
    fn sum(&self, pixel: usize, level: usize) -> Spectrum {
        let first = (pixel * LEVELS + level) * self.channels;
        let mut values = Spectrum::ZERO;
        for (channel, sum) in self.sums[first..first + self.channels].iter().enumerate() {
            values[channel] = sum.value();
        }
        values
    }

    /// Returns the sum of all samples of a pixel, over all levels.
    pub fn total(&self, pixel: usize) -> Spectrum {
        let levels = (0..LEVELS).map(|level| self.sum(pixel, level));
        levels.fold(Spectrum::ZERO, |total, sum| total + sum)
    }

    /// Returns the reweighted image. `width` is its width, `samples` the number of samples per
    /// pixel.
    pub fn reweighted(&self, width: usize, samples: u64) -> Vec<Spectrum> {
        let pixels = self.sums.len() / (LEVELS * self.channels);
        let n = samples as f64;
        let brightness =
            self.sums.iter().map(|s| s.value()).sum::<f64>() / (self.channels * pixels) as f64 / n;
        let trusted = MIN_RELATIVE_BRIGHTNESS * brightness;
        let pixel = |i: usize| {
            let mut value = Spectrum::ZERO;
            for (level, exponent) in EXPONENTS.enumerate() {
                let sum = self.sum(i, level);
                if sum.is_zero() {
                    continue;
                }
                let so_far = value.sum() / self.channels as f64;
                let by_colour = so_far.max(trusted) * n / BASE.powi(exponent);
                let reliability = 0.5 * (self.by_count(i, width, level) + by_colour);
                value += sum * (reliability.clamp(0.0, 1.0) / n);
            }
            value
        };
        (0..pixels).map(pixel).collect()
    }

    /// Returns the number of samples with a level's brightness in a pixel, less one. If the mean
    /// over the surrounding 3 × 3 pixels is below one, that mean less one replaces it.
    fn by_count(&self, pixel: usize, width: usize, level: usize) -> f64 {
        let height = self.sums.len() / (LEVELS * self.channels * width);
        let (x, y) = (pixel % width, pixel / width);
        let (columns, rows) = (x.saturating_sub(1)..=x + 1, y.saturating_sub(1)..=y + 1);
        let (mut sum, mut number) = (0.0, 0.0);
        for row in rows.filter(|row| *row < height) {
            for column in columns.clone().filter(|column| *column < width) {
                sum += self.count(row * width + column, level);
                number += 1.0;
            }
        }
        match sum / number - 1.0 {
            around if around < 0.0 => around,
            _ => self.count(pixel, level) - 1.0,
        }
    }

    /// Estimates how many samples of a pixel had about the brightness of a level.
    fn count(&self, pixel: usize, level: usize) -> f64 {
        let levels = level.saturating_sub(1)..=(level + 1).min(LEVELS - 1);
        let count = |level: usize| {
            let exponent = EXPONENTS.start() + level as i32;
            self.sum(pixel, level).sum() / self.channels as f64 / BASE.powi(exponent)
        };
        levels.map(count).sum()
    }
}

impl LevelsMut<'_> {
    /// Adds a sample of a pixel.
    pub(super) fn add(&mut self, pixel: usize, value: Spectrum) {
        let brightness = value.0[..self.channels].iter().sum::<f64>() / self.channels as f64;
        let (lower, share) = place(brightness);
        for (level, share) in [(lower, share), (lower + 1, 1.0 - share)] {
            let first = (pixel * LEVELS + level) * self.channels;
            let sums = &mut self.sums[first..first + self.channels];
            for (sum, v) in sums.iter_mut().zip(value.0) {
                sum.add(v * share);
            }
        }
    }
}

/// Returns the lower of the two levels of a brightness, and the fraction of the sample that belongs
/// to it. The fraction is linear in the reciprocal of the brightness.
fn place(brightness: f64) -> (usize, f64) {
    let (first, last) = (*EXPONENTS.start(), *EXPONENTS.end());
    let exponent = brightness.max(f64::MIN_POSITIVE).log(BASE).floor();
    let exponent = exponent.clamp(f64::from(first), f64::from(last - 1)) as i32;
    let lower = BASE.powi(exponent);
    let share = (lower / brightness - 1.0 / BASE) / (1.0 - 1.0 / BASE);
    ((exponent - first) as usize, share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 7;

    impl OutlierRejection {
        fn all_mut(&mut self) -> LevelsMut<'_> {
            LevelsMut {
                channels: self.channels,
                sums: &mut self.sums,
            }
        }
    }

    /// Makes a 7 × 7 image of `samples` samples of brightness about `mean`, and one that is 10⁵
    /// times as bright. Returns it with the mean of the bright sample over `samples`.
    fn outlier(samples: u64, mean: f64) -> (OutlierRejection, f64) {
        let mut outliers = OutlierRejection::new(WIDTH * WIDTH, 1);
        let mut levels = outliers.all_mut();
        for pixel in 0..WIDTH * WIDTH {
            for sample in 0..samples {
                let wave = 1.0 + 0.5 * ((pixel as u64 + sample) as f64).sin();
                levels.add(pixel, Spectrum::splat(mean * wave));
            }
        }
        let firefly = 1e5 * mean;
        levels.add(WIDTH * 3 + 3, Spectrum::splat(firefly));
        (outliers, firefly / samples as f64)
    }

    #[test]
    fn levels_share_all_of_a_sample() {
        let values = [0.0, 1e-290, 1e-9, 0.3, 1.0, 7.999, 8.0, 123.0, 1e9, 1e30];
        for value in values {
            let mut outliers = OutlierRejection::new(1, 2);
            outliers
                .all_mut()
                .add(0, Spectrum([value, 2.0 * value, 9.0, 9.0]));
            let total = outliers.total(0);
            // Sums are accurate to 2⁻³².
            let bound = 2f64.powi(-32) * value;
            assert!((total[0] - value).abs() <= bound, "{value}");
            assert!((total[1] - 2.0 * value).abs() <= 2.0 * bound, "{value}");
        }
    }

    /// The two levels of a sample count it as about one sample.
    #[test]
    fn a_sample_counts_as_about_one() {
        for exponent in -80..80 {
            let mut outliers = OutlierRejection::new(1, 1);
            let value = 10f64.powf(f64::from(exponent) / 10.0);
            outliers.all_mut().add(0, Spectrum::splat(value));
            let (level, _) = place(value);
            let count = outliers.count(0, level);
            assert!((0.99..1.01).contains(&count), "{value}: {count}");
        }
    }

    #[test]
    fn an_outlier_is_removed_and_nothing_else() {
        for mean in [1.0, 1e-4, 300.0] {
            let (outliers, firefly) = outlier(64, mean);
            let image = outliers.reweighted(WIDTH, 64);
            for (i, value) in image.iter().enumerate() {
                let plain = outliers.total(i)[0] / 64.0;
                let wanted = if i == WIDTH * 3 + 3 {
                    plain - firefly
                } else {
                    plain
                };
                let error = (value[0] - wanted).abs() / mean;
                assert!(error < 0.02, "{i}: {} {wanted} {plain}", value[0]);
            }
        }
    }

    /// With more and more samples, frequent bright samples keep their full weight and the image
    /// converges to the plain mean.
    #[test]
    fn it_converges_to_the_plain_mean() {
        let error = |samples: u64| {
            let mut outliers = OutlierRejection::new(WIDTH * WIDTH, 1);
            let mut levels = outliers.all_mut();
            for pixel in 0..WIDTH * WIDTH {
                for sample in 0..samples {
                    let rare = (sample * 97 + pixel as u64 * 31).is_multiple_of(100);
                    levels.add(pixel, Spectrum::splat(if rare { 1000.0 } else { 1.0 }));
                }
            }
            let image = outliers.reweighted(WIDTH, samples);
            let errors = image.iter().enumerate();
            let error =
                |(i, v): (usize, &Spectrum)| 1.0 - v[0] * samples as f64 / outliers.total(i)[0];
            errors.map(error).fold(0.0, f64::max)
        };
        assert!(error(50) > 0.5);
        assert_eq!(error(4000), 0.0);
    }
}
