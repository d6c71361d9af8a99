//! Images as NumPy arrays.

use std::path::Path;

use super::ImageLayers;
use crate::error::{FileError, Problem};
use crate::npy;

/// Writes one layer as a float32 array `[row, column, channel]` with row 0 at the top, completely
/// or not at all.
///
/// # Errors
///
/// A missing layer, channels that do not match the size, and all errors of [`npy::write()`].
pub fn write(path: &Path, image: &ImageLayers, layer: &str) -> Result<(), FileError> {
    let data = interleave(image, layer).map_err(|problem| problem.at(path))?;
    let channels = data.len() / (image.width * image.height);
    npy::write(path, &[image.height, image.width, channels], &data)
}

fn interleave(image: &ImageLayers, layer: &str) -> Result<Vec<f32>, Problem> {
    image.check()?;
    let missing = || Problem::Malformed(format!("the image has no layer '{layer}'"));
    let layer = image.layer(layer).ok_or_else(missing)?;
    let pixels = 0..image.width * image.height;
    let pixel = |i: usize| layer.channels.iter().map(move |(_, values)| values[i]);
    Ok(pixels.flat_map(pixel).collect())
}
