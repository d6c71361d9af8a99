//! PNG files in sRGB.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};

use super::RgbImage;
use super::tone::Tone;
use crate::atomic;
use crate::error::{FileError, Problem};
use crate::input::Limits;

/// Bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes an image in sRGB, at once or not at all; `tone` says how bright it is.
///
/// # Errors
///
/// An image whose size does not fit its pixels, and everything that [`atomic::write()`] reports.
pub fn write(path: &Path, image: &RgbImage, depth: Depth, tone: Tone) -> Result<(), FileError> {
    let bytes = encode(image, depth, tone).map_err(|problem| problem.at(path))?;
    atomic::write_bytes(path, &bytes)
}

/// Writes 8 bits per channel of as many pixels as the size says, row by row from the top left, which need not be
/// in memory.
///
/// # Errors
///
/// As for [`write()`].
pub(crate) fn write_pixels(
    path: &Path,
    size: [usize; 2],
    pixels: impl Iterator<Item = [f32; 3]>,
    tone: Tone,
) -> Result<(), FileError> {
    let bytes = encode_pixels(size, pixels, Depth::Eight, tone);
    atomic::write_bytes(path, &bytes.map_err(|problem| problem.at(path))?)
}

/// The bytes of a PNG file.
///
/// # Errors
///
/// As for [`write()`], but for the file system.
pub fn encode(image: &RgbImage, depth: Depth, tone: Tone) -> Result<Vec<u8>, Problem> {
    let size = [image.width, image.height];
    if image.pixels.len() != image.width * image.height {
        return Err(mismatch(size, image.pixels.len()));
    }
    encode_pixels(size, image.pixels.iter().copied(), depth, tone)
}

fn encode_pixels(
    size: [usize; 2],
    pixels: impl Iterator<Item = [f32; 3]>,
    depth: Depth,
    tone: Tone,
) -> Result<Vec<u8>, Problem> {
    let [width, height] = size;
    let side = |n| u32::try_from(n).ok().filter(|n| *n > 0);
    let wrong = || mismatch(size, 0);
    let (width, height) = (
        side(width).ok_or_else(wrong)?,
        side(height).ok_or_else(wrong)?,
    );
    let encoded = pixels.flatten().map(|v| tone.encode(v));
    let dynamic = match depth {
        Depth::Eight => {
            let data = encoded.map(|v| (v * 255.0).round() as u8).collect();
            ImageBuffer::<Rgb<u8>, Vec<u8>>::from_raw(width, height, data).map(DynamicImage::from)
        }
        Depth::Sixteen => {
            let data = encoded.map(|v| (v * 65535.0).round() as u16).collect();
            ImageBuffer::<Rgb<u16>, Vec<u16>>::from_raw(width, height, data).map(DynamicImage::from)
        }
    };
    let mut bytes = Vec::new();
    let written = dynamic
        .ok_or_else(wrong)?
        .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png);
    written.map_err(|e| Problem::Malformed(format!("cannot be stored as PNG: {e}")))?;
    Ok(bytes)
}

fn mismatch([width, height]: [usize; 2], found: usize) -> Problem {
    Problem::Mismatch {
        expected: format!("{width} x {height} pixels"),
        found: found.to_string(),
    }
}

/// Reads an image and makes its values linear; they are in [0, 1]. Transparency is dropped.
///
/// # Errors
///
/// A file that cannot be read or is no valid PNG file.
pub fn read(path: &Path) -> Result<RgbImage, FileError> {
    read_within(path, Limits::default())
}

/// As [`read`], of a file that may take so much memory.
///
/// # Errors
///
/// As for [`read`].
pub fn read_within(path: &Path, limits: Limits) -> Result<RgbImage, FileError> {
    super::encoded::read(path, (ImageFormat::Png, "PNG"), limits)
}

/// Reads an image from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn decode(bytes: &[u8]) -> Result<RgbImage, Problem> {
    decode_within(bytes, Limits::default())
}

/// As [`decode`], of a file that may take so much memory.
///
/// # Errors
///
/// As for [`read`].
pub fn decode_within(bytes: &[u8], limits: Limits) -> Result<RgbImage, Problem> {
    super::encoded::decode(bytes, (ImageFormat::Png, "PNG"), limits)
}
