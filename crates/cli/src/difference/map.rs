//! Difference maps, pixel by pixel.

use crate::config::MapFormat;
use io::FileError;
use io::compare::ZScores;
use io::image::png::Depth;
use io::image::tone::Tone;
use io::image::{ImageLayers, Layer, RgbImage, exr, png};
use io::scene::linear_from_srgb;
use plotters::prelude::{ColorMap, RGBColor, ViridisRGB};
use std::path::Path;

/// |z| at which colours are strongest.
const MAX_Z: f32 = 5.0;
/// Colour of unknown z, in sRGB.
const UNKNOWN: [f64; 3] = [0.6, 0.6, 0.6];

/// Writes a FLIP map: numbers in channel Y, or colours from violet (0) to yellow (1).
pub fn flip(
    path: &Path,
    format: MapFormat,
    size: [usize; 2],
    map: &[f32],
) -> Result<(), FileError> {
    match format {
        MapFormat::Exr => numbers(path, size, vec![("Y".into(), map.to_vec())]),
        MapFormat::Png => colours(path, size, |i| {
            let RGBColor(r, g, b) = ViridisRGB.get_color(map[i]);
            [r, g, b].map(|v| f64::from(v) / 255.0)
        }),
    }
}

/// Writes a map of z: numbers in the channels of the images, or colours. Colours show the channel
/// with the largest |z|: blue if z is negative, red if z is positive.
pub fn z(path: &Path, format: MapFormat, size: [usize; 2], z: &ZScores) -> Result<(), FileError> {
    let most = |i: usize| {
        let all = z.channels.iter().map(|(_, map)| map[i]);
        let known = all.filter(|z| z.is_finite());
        known.max_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    match format {
        MapFormat::Exr => numbers(path, size, z.channels.clone()),
        MapFormat::Png => colours(path, size, |i| most(i).map_or(UNKNOWN, diverging)),
    }
}

/// Returns the colour of z: white for zero, blue below, red above.
fn diverging(z: f32) -> [f64; 3] {
    let t = f64::from((z / MAX_Z).clamp(-1.0, 1.0));
    let end = if t < 0.0 {
        [0.13, 0.40, 0.67]
    } else {
        [0.70, 0.09, 0.17]
    };
    end.map(|v| 1.0 + (v - 1.0) * t.abs())
}

fn numbers(
    path: &Path,
    [width, height]: [usize; 2],
    channels: Vec<(String, Vec<f32>)>,
) -> Result<(), FileError> {
    let main = Layer {
        name: String::new(),
        channels,
    };
    let image = ImageLayers {
        width,
        height,
        layers: vec![main],
        attributes: Vec::new(),
    };
    exr::write(path, &image)
}

/// Writes a picture of sRGB colours.
fn colours(
    path: &Path,
    [width, height]: [usize; 2],
    colour: impl Fn(usize) -> [f64; 3],
) -> Result<(), FileError> {
    let linear = |i: usize| colour(i).map(|v| linear_from_srgb(v) as f32);
    let image = RgbImage {
        width,
        height,
        pixels: (0..width * height).map(linear).collect(),
    };
    png::write(path, &image, Depth::Eight, Tone::default())
}
