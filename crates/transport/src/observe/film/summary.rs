//! Means of whole images and their errors (docs/theory.md#effective-samples).

use super::{Film, Pixel};
use crate::moments::{MIN_EFFECTIVE, Tail};

impl Film {
    /// Returns the mean over all pixels and channels, with its standard error. Channels of one
    /// group share their paths, so their errors add up as fully correlated. Pixels count as
    /// independent, unless one path contributes to several pixels: then the samples of the whole
    /// image give the error. If these are fewer than [`MIN_EFFECTIVE`] and the samples of
    /// different cells are independent, the variances of pixels give it.
    pub fn summary(&self) -> (f64, f64) {
        self.summary_of(None)
    }

    /// Returns the mean and standard error of one layer, computed like [`Film::summary`].
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
            let of_pixels = || pixels().map(|p| square(&p)).sum::<f64>();
            variance += match (self.whole(group, layer), self.shape.noise) {
                (whole, _) if whole.count == 0 => of_pixels(),
                // Planted error "image errors of pixels that share samples, as if they did not", found by morgana-transport/transport::reconstruction::stated_errors_are_the_spread_over_seeds:
                // (whole, Some(noise)) if self.few_images(whole) => of_pixels() / noise.max(1.0),
                (whole, Some(noise)) if self.few_images(whole) => of_pixels() / noise,
                (whole, _) => square(whole) * (n * n) as f64,
            };
        }
        let scale = (n * self.shape.channels) as f64;
        (mean / scale, variance.sqrt() / scale)
    }

    /// Returns true if there are too few samples of the whole image to give the error of its mean.
    fn few_images(&self, whole: &Pixel) -> bool {
        (whole.count as f64) < MIN_EFFECTIVE
    }

    /// Returns true if the error of [`Film::summary`], or of [`Film::layer_summary`], is
    /// unreliable: the mean has fewer than [`MIN_EFFECTIVE`] effective samples, or a heavy
    /// [tail](Film::tail). An image without light is flagged. A layer without light is not flagged,
    /// because possibly no path of the scene belongs to it.
    pub fn few_in_all(&self, layer: Option<usize>) -> bool {
        let (mean, error) = self.summary_of(layer);
        if mean == 0.0 {
            return layer.is_none();
        }
        let squares = (error / mean).powi(2) + 1.0 / self.scores(layer) as f64;
        squares * MIN_EFFECTIVE > 1.0 || self.tail(layer).is_heavy()
    }

    /// Returns the fraction of unreliable variances among the non-zero values of pixels and
    /// channels.
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

    /// Returns the heaviest tail of the scores behind [`Film::summary`], or
    /// [`Film::layer_summary`], over all channels. It is the tail of the samples of pixels or,
    /// where pixels share paths, of the samples of the whole image. Both are examined, because the
    /// few samples of the whole image hide rare bright samples of pixels.
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

    /// Returns the number of independent scores of the image's mean: samples of the whole image, or
    /// samples of all pixels.
    fn scores(&self, layer: Option<usize>) -> u64 {
        let of_group = |group| match (self.whole(group, layer), self.shape.noise) {
            (whole, _) if whole.count == 0 => self.groups[group].samples(),
            (whole, Some(_)) if self.few_images(whole) => self.groups[group].samples(),
            (whole, _) => whole.count,
        };
        (0..self.groups()).map(of_group).min().unwrap_or(0)
    }

    fn whole(&self, group: usize, layer: Option<usize>) -> &Pixel {
        match (layer, &self.layers) {
            (Some(layer), Some(layers)) => layers.whole(group, layer),
            _ => &self.groups[group].whole,
        }
    }

    /// Returns the root mean square, over pixels and channels, of the standard errors of pixels.
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
