//! Images whose values are encoded as in sRGB.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, ImageReader, Limits};

use super::RgbImage;
use crate::error::{FileError, Problem};
use crate::scene::linear_from_srgb;

/// Bytes that one byte can stand for: DEFLATE codes 258 bytes with two bits at best (RFC 1951), each of which may be
/// eight pixels. A file that claims more is taken for damaged.
const MOST_COMPRESSION: u64 = 8 * 258 * 8 / 2;

/// Reads an image of a format, called `name` in messages, and makes its values linear; they are in [0, 1].
/// Transparency is dropped.
///
/// # Errors
///
/// A file that cannot be read or is not of the format.
pub(super) fn read(
    path: &Path,
    format: ImageFormat,
    name: &'static str,
) -> Result<RgbImage, FileError> {
    let bytes = fs::read(path).map_err(|e| Problem::Read(e).at(path))?;
    decode(&bytes, format, name).map_err(|problem| problem.at(path))
}

/// Reads an image from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub(super) fn decode(
    bytes: &[u8],
    format: ImageFormat,
    name: &'static str,
) -> Result<RgbImage, Problem> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_COMPRESSION * bytes.len() as u64);
    reader.limits(limits);
    let image = reader.decode().map_err(|error| Problem::WrongFormat {
        format: name,
        reason: error.to_string(),
    })?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let linear = |v: u16| linear_from_srgb(f64::from(v) / 65535.0) as f32;
    let pixels = image.into_rgb16();
    Ok(RgbImage {
        width,
        height,
        pixels: pixels.pixels().map(|pixel| pixel.0.map(linear)).collect(),
    })
}
