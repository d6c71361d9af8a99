//! Films: what is accumulated per pixel.

mod filter;
mod footprint;

pub use filter::Filter;
pub use footprint::footprint;

use crate::Spectrum;

/// Sums over the samples of one pixel, for one group of channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Σ value.
    pub sum: Spectrum,
    /// Σ value².
    pub sum_of_squares: Spectrum,
    /// Number of samples.
    pub count: u64,
}

impl Pixel {
    /// Adds one sample.
    pub fn add(&mut self, value: Spectrum) {
        self.sum += value;
        self.sum_of_squares += value * value;
        self.count += 1;
    }

    /// Adds the samples of another accumulator.
    pub fn merge(&mut self, other: &Pixel) {
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
        self.count += other.count;
    }

    /// Mean of the samples; zero if there are none.
    pub fn mean(&self) -> Spectrum {
        match self.count {
            0 => Spectrum::ZERO,
            n => self.sum / n as f64,
        }
    }

    /// Unbiased estimate of the variance of the mean; infinite for fewer than two samples.
    pub fn variance_of_mean(&self) -> Spectrum {
        if self.count < 2 {
            return Spectrum::splat(f64::INFINITY);
        }
        let n = self.count as f64;
        let mean = self.mean();
        let scatter = self.sum_of_squares - mean * mean * n;
        scatter.map(|s| s.max(0.0) / (n * (n - 1.0)))
    }
}

/// Accumulated image: `width × height` pixels from the top left, with any number of channels, which
/// are kept in groups of [`Spectrum::LANES`].
///
/// Filters other than the box are sampled in proportion to their value, so every pixel is a plain
/// mean of independent samples and its variance is known without bias.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: usize,
    height: usize,
    channels: usize,
    pixels: Vec<Pixel>,
    /// For each group, samples of the image's mean, if pixels are not independent.
    whole: Vec<Pixel>,
}

impl Film {
    /// An empty film; no argument may be zero.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        let groups = channels.div_ceil(Spectrum::LANES);
        Film {
            width,
            height,
            channels,
            pixels: vec![Pixel::default(); width * height * groups],
            whole: vec![Pixel::default(); groups],
        }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Number of spectral channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Number of channel groups.
    pub fn groups(&self) -> usize {
        self.channels.div_ceil(Spectrum::LANES)
    }

    /// Pixels of a group, row by row.
    pub fn group(&self, group: usize) -> &[Pixel] {
        let n = self.width * self.height;
        &self.pixels[group * n..(group + 1) * n]
    }

    /// See [`Film::group`].
    pub fn group_mut(&mut self, group: usize) -> &mut [Pixel] {
        let n = self.width * self.height;
        &mut self.pixels[group * n..(group + 1) * n]
    }

    /// The pixels of all groups, group by group.
    pub fn groups_mut(&mut self) -> impl Iterator<Item = &mut [Pixel]> {
        self.pixels.chunks_exact_mut(self.width * self.height)
    }

    /// Takes note of a sample of the mean over all pixels of a group: needed where one path contributes
    /// to many pixels, so that the error of the image's mean does not follow from the errors of pixels.
    pub fn add_whole(&mut self, group: usize, mean: Spectrum) {
        self.whole[group].add(mean);
    }

    /// A quantity of every pixel, row by row with channels interleaved.
    fn plane(&self, f: impl Fn(&Pixel) -> Spectrum) -> Vec<f32> {
        let n = self.width * self.height;
        let mut out = Vec::with_capacity(n * self.channels);
        for i in 0..n {
            for c in 0..self.channels {
                let pixel = &self.pixels[c / Spectrum::LANES * n + i];
                out.push(f(pixel)[c % Spectrum::LANES] as f32);
            }
        }
        out
    }

    /// Means: row by row with channels interleaved.
    pub fn mean(&self) -> Vec<f32> {
        self.plane(Pixel::mean)
    }

    /// Variances of the means, same layout.
    pub fn variance(&self) -> Vec<f32> {
        self.plane(Pixel::variance_of_mean)
    }

    /// Number of samples of each pixel, row by row.
    pub fn counts(&self) -> Vec<u64> {
        self.group(0).iter().map(|p| p.count).collect()
    }

    /// Total number of samples over all pixels and groups.
    pub fn samples(&self) -> u64 {
        self.pixels.iter().map(|p| p.count).sum()
    }

    /// Mean over the image and over the channels, with its standard error. Channels of one group
    /// share their paths, so their errors are added up as fully correlated. Pixels are taken as
    /// independent unless [`Film::add_whole`] knows better.
    pub fn summary(&self) -> (f64, f64) {
        let n = (self.width * self.height) as f64;
        let (mut mean, mut variance) = (0.0, 0.0);
        for group in 0..self.groups() {
            let lanes = (self.channels - group * Spectrum::LANES).min(Spectrum::LANES);
            let square = |pixel: &Pixel| {
                let deviation = pixel.variance_of_mean().map(f64::sqrt);
                deviation.0[..lanes].iter().sum::<f64>().powi(2)
            };
            let pixels = self.group(group);
            mean += pixels.iter().flat_map(|p| p.mean().0).sum::<f64>();
            variance += match &self.whole[group] {
                whole if whole.count > 0 => square(whole) * n * n,
                _ => pixels.iter().map(square).sum(),
            };
        }
        let scale = n * self.channels as f64;
        (mean / scale, variance.sqrt() / scale)
    }
}
