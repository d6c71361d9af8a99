//! PNG files in sRGB.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};

use super::RgbImage;
use crate::atomic;
use crate::error::{FileError, Problem};
use crate::scene::srgb_from_linear;

/// Bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes an image in sRGB, at once or not at all. Values are multiplied by 2^`exposure` and
/// clamped to [0, 1]; NaN becomes 0.
///
/// # Errors
///
/// An image whose size does not fit its pixels, and everything that [`atomic::write()`] reports.
pub fn write(path: &Path, image: &RgbImage, depth: Depth, exposure: f64) -> Result<(), FileError> {
    let bytes = encode(image, depth, exposure).map_err(|problem| problem.at(path))?;
    atomic::write_bytes(path, &bytes)
}

/// The bytes of a PNG file.
///
/// # Errors
///
/// As for [`write()`], but for the file system.
pub fn encode(image: &RgbImage, depth: Depth, exposure: f64) -> Result<Vec<u8>, Problem> {
    let mismatch = || Problem::Mismatch {
        expected: format!("{} x {} pixels", image.width, image.height),
        found: format!("{}", image.pixels.len()),
    };
    let side = |n: usize| {
        u32::try_from(n)
            .ok()
            .filter(|n| *n > 0)
            .ok_or_else(mismatch)
    };
    let (width, height) = (side(image.width)?, side(image.height)?);
    let scale = exposure.exp2();
    let encoded = image
        .pixels
        .iter()
        .flatten()
        .map(|v| srgb(f64::from(*v) * scale));
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
        .ok_or_else(mismatch)?
        .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png);
    written.map_err(|e| Problem::Malformed(format!("cannot be stored as PNG: {e}")))?;
    Ok(bytes)
}

fn srgb(value: f64) -> f64 {
    let value = if value.is_nan() { 0.0 } else { value };
    srgb_from_linear(value.clamp(0.0, 1.0))
}

/// Reads an image and makes its values linear; they are in [0, 1]. Transparency is dropped.
///
/// # Errors
///
/// A file that cannot be read or is no valid PNG file.
pub fn read(path: &Path) -> Result<RgbImage, FileError> {
    super::encoded::read(path, ImageFormat::Png, "PNG")
}
