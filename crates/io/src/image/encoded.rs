//! Images whose values are encoded as in sRGB.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::{ImageFormat, ImageReader};

use super::RgbImage;
use crate::error::{FileError, Problem};
use crate::scene::linear_from_srgb;

/// Reads an image of a format, called `name` in messages, and makes its values linear; they are in [0, 1].
/// Transparency is dropped. An image of more than 512 MiB is refused.
///
/// # Errors
///
/// A file that cannot be read or is not of the format.
pub(super) fn read(
    path: &Path,
    format: ImageFormat,
    name: &'static str,
) -> Result<RgbImage, FileError> {
    let file = File::open(path).map_err(|e| Problem::Read(e).at(path))?;
    let reader = ImageReader::with_format(BufReader::new(file), format);
    let image = reader.decode().map_err(|error| {
        Problem::WrongFormat {
            format: name,
            reason: error.to_string(),
        }
        .at(path)
    })?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let linear = |v: u16| linear_from_srgb(f64::from(v) / 65535.0) as f32;
    let pixels = image
        .into_rgb16()
        .pixels()
        .map(|pixel| pixel.0.map(linear))
        .collect();
    Ok(RgbImage {
        width,
        height,
        pixels,
    })
}
