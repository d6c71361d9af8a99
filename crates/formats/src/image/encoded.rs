//! Images with values that are encoded as in sRGB.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use super::RgbImage;
use crate::colour::linear_from_srgb;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Largest ratio of decompressed to compressed size. DEFLATE encodes at most 258 bytes in two bits
/// (RFC 1951), and a byte may hold eight pixels. A file with a larger ratio is damaged.
const MAX_COMPRESSION: u64 = 8 * 258 * 8 / 2;
/// Memory for each pixel in addition to the file's own format, in bytes: three numbers of 16 bits,
/// and three of 32 bits.
const BYTES_PER_PIXEL: u64 = 18;

/// Image format, and its name in messages.
pub(super) type Named = (ImageFormat, &'static str);

/// Reads an image in a format, and converts its values to linear values in [0, 1]. Transparency is
/// dropped.
///
/// # Errors
///
/// A file that cannot be read, is not of the format, or takes too much memory.
pub(super) fn read(path: &Path, format: Named, limits: Limits) -> Result<RgbImage, FileError> {
    let bytes = input::read(path)?;
    decode(&bytes, format, limits).map_err(|problem| problem.at(path))
}

/// Reads an image from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub(super) fn decode(
    bytes: &[u8],
    (format, name): Named,
    limits: Limits,
) -> Result<RgbImage, Problem> {
    let wrong = |error: ImageError| Problem::WrongFormat {
        format: name,
        reason: error.to_string(),
    };
    let size = bytes.len() as u64;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut allowed = image::Limits::default();
    allowed.max_alloc = Some((MAX_COMPRESSION * size).min(limits.most(size)));
    reader.limits(allowed);
    let decoder = reader.into_decoder().map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let pixel = BYTES_PER_PIXEL + u64::from(decoder.color_type().bytes_per_pixel());
    limits.check(u64::from(width) * u64::from(height), pixel, size)?;
    let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let linear = |v: u16| linear_from_srgb(f64::from(v) / 65535.0) as f32;
    let pixels = image.into_rgb16();
    Ok(RgbImage {
        width,
        height,
        pixels: pixels.pixels().map(|pixel| pixel.0.map(linear)).collect(),
    })
}
