//! Radiance files (`.hdr`, `.rgbe`): linear red, green and blue with a common exponent.

use std::io::Cursor;
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageError};

use super::RgbImage;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Memory for each pixel, in bytes: three numbers of 32 bits, in the decoder and here.
const BYTES_PER_PIXEL: u64 = 24;
/// Largest number of pixels per byte: a run of 127 numbers takes two bytes, and a pixel has four
/// numbers.
const MAX_COMPRESSION: u64 = 127 / 8 + 1;

/// Reads an image.
///
/// # Errors
///
/// A file that cannot be read, is not a valid Radiance file, or takes too much memory.
pub(super) fn read(path: &Path, limits: Limits) -> Result<RgbImage, FileError> {
    let bytes = input::read(path)?;
    decode_within(&bytes, limits).map_err(|problem| problem.at(path))
}

/// Reads an image from the bytes of a file within a limit of memory. The header's `EXPOSURE` and
/// `COLORCORR` are ignored, as in Mitsuba.
///
/// # Errors
///
/// Bytes that are not a valid Radiance file, or that take too much memory.
pub fn decode_within(bytes: &[u8], limits: Limits) -> Result<RgbImage, Problem> {
    let wrong = |reason: String| Problem::WrongFormat {
        format: "Radiance",
        reason,
    };
    let failed = |error: ImageError| wrong(error.to_string());
    // Check only the prefix: programs write different names of the format after it.
    if !bytes.starts_with(b"#?") {
        return Err(wrong("it does not begin with '#?'".to_owned()));
    }
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let (pixels, size) = (u64::from(width) * u64::from(height), bytes.len() as u64);
    if pixels == 0 {
        return Err(Problem::Empty("the image has no pixels".to_owned()));
    }
    if pixels > MAX_COMPRESSION * size {
        return Err(wrong(format!("{width} x {height} pixels in {size} bytes")));
    }
    limits.check(pixels, BYTES_PER_PIXEL, size)?;
    let image = DynamicImage::from_decoder(decoder).map_err(failed)?;
    Ok(RgbImage {
        width: width as usize,
        height: height as usize,
        pixels: image.into_rgb32f().pixels().map(|pixel| pixel.0).collect(),
    })
}
