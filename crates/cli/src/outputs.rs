//! Images as files.

use crate::config::ImageFormat;
use io::FileError;
use io::image::png::Depth;
use io::image::{ImageLayers, Layer, RgbImage, exr, npy, png};
use std::path::Path;
use transport::Film;

/// A film as an image: its mean, and layers `variance` (of the mean) and `samples` (their number).
pub fn layers(film: &Film, names: &[String], attributes: Vec<(String, String)>) -> ImageLayers {
    let layer = |name: &str, values: &[f32]| Layer {
        name: name.into(),
        channels: names
            .iter()
            .cloned()
            .zip(planes(values, film.channels()))
            .collect(),
    };
    let counts = film.counts().into_iter().map(|n| n as f32).collect();
    let samples = Layer {
        name: "samples".into(),
        channels: vec![("N".into(), counts)],
    };
    ImageLayers {
        width: film.width(),
        height: film.height(),
        layers: vec![
            layer("", &film.mean()),
            layer("variance", &film.variance()),
            samples,
        ],
        attributes,
    }
}

/// Writes an image, completely or not at all.
pub fn write(
    path: &Path,
    format: ImageFormat,
    image: &ImageLayers,
    exposure: f64,
) -> Result<(), FileError> {
    match format {
        ImageFormat::Exr => exr::write(path, image),
        ImageFormat::Npy => npy::write(path, image, ""),
        ImageFormat::Png => png::write(path, &colour(image), Depth::Eight, exposure),
    }
}

/// Channels that are interleaved, one by one.
fn planes(values: &[f32], channels: usize) -> impl Iterator<Item = Vec<f32>> {
    (0..channels).map(move |c| values.iter().skip(c).step_by(channels).copied().collect())
}

/// What a screen shows: the image in colour, or the mean of its channels in grey if these are no
/// colours.
fn colour(image: &ImageLayers) -> RgbImage {
    image.rgb().unwrap_or_else(|| {
        let channels = &image.layers[0].channels;
        let grey = |i: usize| {
            let sum: f32 = channels.iter().map(|(_, values)| values[i]).sum();
            [sum / channels.len() as f32; 3]
        };
        RgbImage {
            width: image.width,
            height: image.height,
            pixels: (0..image.width * image.height).map(grey).collect(),
        }
    })
}
