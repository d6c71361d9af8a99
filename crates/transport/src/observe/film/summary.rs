//! Means of whole images, and their errors (docs/theory.md#effective-samples).

use super::{Film, Pixel};
use crate::moments::{LEAST_EFFECTIVE, Tail};

impl Film {
    /// Mean over the image and over the channels, with its standard error. Channels of one group
    /// share their paths, so their errors are added up as fully correlated. Pixels are taken as
    /// independent unless one path contributes to many of them: then samples of the whole image tell the error.
    pub fn summary(&self) -> (f64, f64) {
        self.summary_of(None)
    }

    /// As [`Film::summary`], of one layer.
    pub fn layer_summary(&self, layer: usize) -> (f64, f64) {
        self.summary_of(Some(layer))
    }

    fn summary_of(&self, layer: Option<usize>) -> (f64, f64) {
        let n = self.shape.width * self.shape.height;
        let (mut mean, mut variance) = (0.0, 0.0);
        for group in 0..self.groups() {
            let channels = self.channels_of(group);
            let square = |pixel: &Pixel| {
                let deviation = pixel.variance_of_mean().map(f64::sqrt);
                deviation.0[..channels].iter().sum::<f64>().powi(2)
            };
            let pixels = || (0..n).map(|i| self.pixel(group, i, layer));
            mean += pixels().flat_map(|p| p.mean().0).sum::<f64>();
            variance += match self.whole(group, layer) {
                whole if whole.count > 0 => square(whole) * (n * n) as f64,
                _ => pixels().map(|p| square(&p)).sum(),
            };
        }
        let scale = (n * self.shape.channels) as f64;
        (mean / scale, variance.sqrt() / scale)
    }

    /// True if the error of [`Film::summary`], or of [`Film::layer_summary`], is not to be trusted: the mean is worth fewer than
    /// [`LEAST_EFFECTIVE`] samples, or a [tail](Film::tail) is heavy. An image without any light is flagged; a layer without light
    /// is not, for it may be one that none falls into.
    pub fn few_in_all(&self, layer: Option<usize>) -> bool {
        let (mean, error) = self.summary_of(layer);
        if mean == 0.0 {
            return layer.is_none();
        }
        let squares = (error / mean).powi(2) + 1.0 / self.scores(layer) as f64;
        squares * LEAST_EFFECTIVE > 1.0 || self.tail(layer).is_heavy()
    }

    /// Share of the values of pixels, among those that are not zero, whose variances are not to be trusted.
    pub fn few_pixels(&self, layer: Option<usize>) -> f64 {
        let (mut few, mut lit) = (0u64, 0u64);
        for channel in 0..self.shape.channels {
            for pixel in 0..self.shape.width * self.shape.height {
                lit += u64::from(self.mean_at(layer, channel, pixel) != 0.0);
                few += u64::from(self.few_at(layer, channel, pixel));
            }
        }
        few as f64 / lit.max(1) as f64
    }

    /// The heaviest tail of the scores behind [`Film::summary`], or [`Film::layer_summary`], over all channels: that of the samples
    /// of pixels, or, where pixels share paths, that of the samples of the whole image. Rare bright samples of pixels are hidden in
    /// the samples of the whole image, which are few: both are looked at.
    pub fn tail(&self, layer: Option<usize>) -> Tail {
        let channels =
            (0..self.groups()).flat_map(|g| (0..self.channels_of(g)).map(move |c| (g, c)));
        let tails = channels.flat_map(|(group, channel)| {
            let pixels = (0..self.shape.width * self.shape.height)
                .map(|i| self.pixel(group, i, layer).tail_of(channel))
                .fold(Tail::default(), Tail::beside);
            // Planted error "rare bright samples of pixels hidden in samples of the whole image", found by morgana-transport/transport::tails::particles_close_to_a_camera_are_flagged:
            // [[pixels, Tail::default()][usize::from(self.whole(group, layer).count > 0)], self.whole(group, layer).tail_of(channel)]
            [pixels, self.whole(group, layer).tail_of(channel)]
        });
        let heavier = |a: Tail, b: Tail| if b.excess() > a.excess() { b } else { a };
        tails.reduce(heavier).unwrap_or_default()
    }

    /// Number of independent scores of which the mean of the image is one: samples of the whole image, or of all pixels.
    fn scores(&self, layer: Option<usize>) -> u64 {
        let of_group = |group| match self.whole(group, layer).count {
            0 => self.groups[group].samples(),
            whole => whole,
        };
        (0..self.groups()).map(of_group).min().unwrap_or(0)
    }

    fn whole(&self, group: usize, layer: Option<usize>) -> &Pixel {
        match (layer, &self.layers) {
            (Some(layer), Some(layers)) => layers.whole(group, layer),
            _ => &self.groups[group].whole,
        }
    }

    /// The root of the mean, over pixels and channels, of the variances of pixels' means.
    pub fn rms_error(&self) -> f64 {
        let n = self.shape.width * self.shape.height;
        let mut sum = 0.0;
        for group in 0..self.groups() {
            let channels = self.channels_of(group);
            let variance = |p: Pixel| p.variance_of_mean().0[..channels].iter().sum::<f64>();
            sum += self.pixels(group).map(variance).sum::<f64>();
        }
        (sum / (n * self.shape.channels) as f64).sqrt()
    }
}
