//! Images whose bias is known to second order.
//!
//! A sample V of a pixel comes with an estimate B of its bias, from the same photons. V − B is then
//! unbiased up to higher orders. Let V̄ and B̄ be the means over samples. With a probability that
//! depends on z, the error of the image is at most |B̄| + z·(standard error of V − B)
//! (docs/theory.md#bias-of-photon-maps).

use crate::Spectrum;
use crate::film::{Film, FilmShape, Pixel};
use serde::{Deserialize, Serialize};

/// Standard deviations within which a normal deviate lies with a probability of 97.5 %. A bound may
/// fail with a probability of 5 %. The other half of these 5 % is for the bias of fourth order that
/// the estimate leaves. With 95 % here, bounds held in 93.6 % of renders.
const DEVIATIONS: f64 = 2.241_402_727_604_947;

/// Image without its known bias: the mean of V − B.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Debiased {
    /// Film of V − B.
    pub film: Film,
}

impl Debiased {
    /// Creates an empty image.
    pub(super) fn new(shape: FilmShape) -> Self {
        Debiased {
            film: Film::of(shape),
        }
    }

    /// Returns an estimate of the bias of the mean over the image and its channels.
    pub fn bias(&self, image: &Film) -> f64 {
        image.summary().0 - self.film.summary().0
    }

    /// Returns the error of the mean over the image and its channels: the magnitude of its bias
    /// plus the standard error without it.
    pub fn error(&self, image: &Film) -> f64 {
        self.bias(image).abs() + self.film.summary().1
    }

    /// Returns the root mean square, over pixels and channels, of the pixels' errors: the magnitude
    /// of the bias plus the standard error without it.
    pub fn rms_error(&self, image: &Film) -> f64 {
        let errors = self.values(image, |bias, error| bias.abs() + error);
        let sum: f64 = errors.iter().map(|e| e * e).sum();
        (sum / errors.len() as f64).sqrt()
    }

    /// Returns the bias of every pixel, row by row with channels interleaved.
    pub fn pixel_bias(&self, image: &Film) -> Vec<f32> {
        self.stored(image, |bias, _| bias)
    }

    /// Returns a bound of every pixel's error by noise and bias, in the layout of
    /// [`Debiased::pixel_bias`]. It holds with a probability of at least 95 %.
    pub fn bound(&self, image: &Film) -> Vec<f32> {
        self.stored(image, |bias, error| bias.abs() + DEVIATIONS * error)
    }

    fn stored(&self, image: &Film, f: impl Fn(f64, f64) -> f64) -> Vec<f32> {
        self.values(image, f)
            .into_iter()
            .map(|v| v as f32)
            .collect()
    }

    /// Evaluates `f` at every pixel and channel, with the bias and the standard error without it.
    fn values(&self, image: &Film, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut out = Vec::with_capacity(image.width() * image.height() * image.channels());
        for i in 0..image.width() * image.height() {
            for group in 0..image.groups() {
                let [biased, debiased] = [image, &self.film].map(|film| film.pixel(group, i, None));
                out.extend(channel_values(&biased, &debiased, &f).take(image.channels_of(group)));
            }
        }
        out
    }
}

fn channel_values(
    biased: &Pixel,
    debiased: &Pixel,
    f: impl Fn(f64, f64) -> f64,
) -> impl Iterator<Item = f64> {
    let bias = biased.mean() - debiased.mean();
    let error = debiased.variance_of_mean().map(f64::sqrt);
    (0..Spectrum::CHANNELS).map(move |channel| f(bias[channel], error[channel]))
}
