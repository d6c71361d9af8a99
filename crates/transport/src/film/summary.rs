//! Means of whole images, and their errors.

use super::{Film, Pixel};

impl Film {
    /// Mean over the image and over the channels, with its standard error. Channels of one group
    /// share their paths, so their errors are added up as fully correlated. Pixels are taken as
    /// independent unless [`Film::add_whole`] knows better.
    pub fn summary(&self) -> (f64, f64) {
        self.summary_of(None)
    }

    /// As [`Film::summary`], of one layer.
    pub fn layer_summary(&self, layer: usize) -> (f64, f64) {
        self.summary_of(Some(layer))
    }

    fn summary_of(&self, layer: Option<usize>) -> (f64, f64) {
        let n = self.width * self.height;
        let (mut mean, mut variance) = (0.0, 0.0);
        for group in 0..self.groups() {
            let lanes = self.lanes(group);
            let square = |pixel: &Pixel| {
                let deviation = pixel.variance_of_mean().map(f64::sqrt);
                deviation.0[..lanes].iter().sum::<f64>().powi(2)
            };
            let pixels = || (0..n).map(|i| self.pixel(group, i, layer));
            mean += pixels().flat_map(|p| p.mean().0).sum::<f64>();
            variance += match self.whole(group, layer) {
                whole if whole.count > 0 => square(whole) * (n * n) as f64,
                _ => pixels().map(|p| square(&p)).sum(),
            };
        }
        let scale = (n * self.channels) as f64;
        (mean / scale, variance.sqrt() / scale)
    }

    fn whole(&self, group: usize, layer: Option<usize>) -> &Pixel {
        match (layer, &self.layers) {
            (Some(layer), Some(layers)) => layers.whole(group, layer),
            _ => &self.whole[group],
        }
    }

    /// The root of the mean, over pixels and channels, of the variances of pixels' means.
    pub fn rms_error(&self) -> f64 {
        let n = self.width * self.height;
        let mut sum = 0.0;
        for group in 0..self.groups() {
            let lanes = self.lanes(group);
            let variance = |p: &Pixel| p.variance_of_mean().0[..lanes].iter().sum::<f64>();
            sum += self.group(group).iter().map(variance).sum::<f64>();
        }
        (sum / (n * self.channels) as f64).sqrt()
    }
}
