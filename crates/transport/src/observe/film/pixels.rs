//! Sums over the samples of pixels, for one group of channels (docs/theory.md#film).

use crate::Spectrum;
use crate::moments::{Moments, Tail};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Sums over the samples of one pixel, or over the means of its
/// [replicates](crate::sampling::Replicates), for one group of channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pixel {
    /// Sums of each channel.
    pub(super) moments: [Moments; Spectrum::CHANNELS],
    /// Number of samples, or of replicates.
    pub count: u64,
}

impl Pixel {
    /// Returns the sums of `count` samples, by channel.
    pub(super) fn of(channels: &[Moments], count: u64) -> Self {
        let mut moments = [Moments::default(); Spectrum::CHANNELS];
        moments[..channels.len()].copy_from_slice(channels);
        Pixel { moments, count }
    }

    /// Adds one sample.
    pub(super) fn add(&mut self, value: Spectrum) {
        for (moments, value) in self.moments.iter_mut().zip(value.0) {
            moments.add(value);
        }
        self.count += 1;
    }

    /// Returns the mean of the samples; zero if there are none.
    pub fn mean(&self) -> Spectrum {
        Spectrum(std::array::from_fn(|channel| self.mean_of(channel)))
    }

    /// Returns the mean of one channel.
    pub(super) fn mean_of(&self, channel: usize) -> f64 {
        self.moments[channel].mean(self.count)
    }

    /// Returns an unbiased estimate of the variance of the mean; infinite for fewer than two
    /// samples.
    pub fn variance_of_mean(&self) -> Spectrum {
        Spectrum(std::array::from_fn(|channel| self.variance_of(channel)))
    }

    /// Returns the variance of the mean of one channel.
    pub(super) fn variance_of(&self, channel: usize) -> f64 {
        self.moments[channel].variance_of_mean(self.count)
    }

    /// Returns the tail of the samples of one channel: how much of their scatter the largest sample
    /// causes.
    pub(super) fn tail_of(&self, channel: usize) -> Tail {
        self.moments[channel].tail(self.count)
    }
}

impl AddAssign for Pixel {
    /// Adds the samples of another accumulator.
    fn add_assign(&mut self, other: Pixel) {
        for (moments, other) in self.moments.iter_mut().zip(other.moments) {
            *moments += other;
        }
        self.count += other.count;
    }
}

/// Number of samples of a pixel as a film stores it; at most
/// [`ReproducibleSum::MAX_NUMBERS`](crate::sum::ReproducibleSum::MAX_NUMBERS).
type Count = u32;

/// Returns the bytes that a film takes per pixel of a group.
pub(crate) const fn bytes_of_pixel(channels: usize) -> usize {
    channels * size_of::<Moments>() + size_of::<Count>()
}

/// Sums over the samples of all pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct GroupSums {
    channels: usize,
    /// Sums by pixel and channel; the channel varies fastest.
    moments: Vec<Moments>,
    /// Number of samples, or of replicates, of each pixel.
    counts: Vec<Count>,
    /// Samples of the image's mean, if pixels are not independent.
    pub whole: Pixel,
}

/// Mutable sums of a run of pixels.
#[derive(Debug)]
pub(super) struct PixelsMut<'a> {
    channels: usize,
    moments: &'a mut [Moments],
    counts: &'a mut [Count],
}

impl GroupSums {
    pub(super) fn new(pixels: usize, channels: usize) -> Self {
        GroupSums {
            channels,
            moments: vec![Moments::default(); pixels * channels],
            counts: vec![0; pixels],
            whole: Pixel::default(),
        }
    }

    /// Returns the number of channels, and lengths of the stored vectors.
    pub(super) fn size(&self) -> [usize; 3] {
        [self.channels, self.moments.len(), self.counts.len()]
    }

    /// Returns the [`size`](Self::size) for a number of pixels and channels.
    pub(super) fn sized(pixels: usize, channels: usize) -> [usize; 3] {
        [channels, pixels * channels, pixels]
    }

    pub(super) fn pixel(&self, i: usize) -> Pixel {
        let first = i * self.channels;
        Pixel::of(&self.moments[first..first + self.channels], self.count(i))
    }

    /// Returns the number of samples, or of replicates, of a pixel.
    pub(super) fn count(&self, i: usize) -> u64 {
        self.counts[i].into()
    }

    /// Returns the number of samples, or of replicates, of all pixels.
    pub(super) fn samples(&self) -> u64 {
        self.counts.iter().map(|count| u64::from(*count)).sum()
    }

    /// Sets the number of samples, or of replicates, of every pixel.
    pub(super) fn fill_up(&mut self, count: u64) {
        self.counts
            .fill(Count::try_from(count).unwrap_or(Count::MAX));
    }

    /// Adds the samples of another group of the same size.
    pub(super) fn merge(&mut self, other: &GroupSums) {
        let moments = self.moments.iter_mut().zip(&other.moments);
        moments.for_each(|(moments, other)| *moments += *other);
        let counts = self.counts.iter_mut().zip(&other.counts);
        counts.for_each(|(count, other)| *count = count.saturating_add(*other));
        self.whole += other.whole;
    }

    /// Returns all pixels.
    pub(super) fn all_mut(&mut self) -> PixelsMut<'_> {
        PixelsMut {
            channels: self.channels,
            moments: &mut self.moments,
            counts: &mut self.counts,
        }
    }

    /// Splits the pixels into runs of `pixels` pixels.
    pub(super) fn chunks_mut(&mut self, pixels: usize) -> impl Iterator<Item = PixelsMut<'_>> {
        let channels = self.channels;
        let moments = self.moments.chunks_mut(pixels * channels);
        let chunks = moments.zip(self.counts.chunks_mut(pixels));
        chunks.map(move |(moments, counts)| PixelsMut {
            channels,
            moments,
            counts,
        })
    }
}

impl PixelsMut<'_> {
    /// Adds one sample of a pixel.
    pub(super) fn add(&mut self, pixel: usize, value: Spectrum) {
        let first = pixel * self.channels;
        let moments = &mut self.moments[first..first + self.channels];
        for (moments, value) in moments.iter_mut().zip(value.0) {
            moments.add(value);
        }
        self.counts[pixel] += 1;
    }
}
