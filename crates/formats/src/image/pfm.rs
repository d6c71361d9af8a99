//! Portable float maps (`.pfm`): linear 32-bit numbers, in grey or in red, green and blue.

use std::io::Write;
use std::path::Path;

use super::RgbImage;
use crate::atomic;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Writes an image in colour, completely or not at all.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write(path: &Path, image: &RgbImage) -> Result<(), FileError> {
    atomic::write(path, |file| {
        // Write a negative scale, which indicates little-endian numbers.
        write!(file, "PF\n{} {}\n-1.0\n", image.width, image.height)?;
        let rows = image.pixels.chunks(image.width.max(1)).rev();
        let mut numbers = rows.flatten().flatten();
        numbers.try_for_each(|v| file.write_all(&v.to_le_bytes()))
    })
}

/// Reads an image.
///
/// # Errors
///
/// A file that cannot be read, is not a valid PFM file, or takes too much memory.
pub(super) fn read(path: &Path, limits: Limits) -> Result<RgbImage, FileError> {
    let bytes = input::read(path)?;
    decode_within(&bytes, limits).map_err(|problem| problem.at(path))
}

/// Reads an image from the bytes of a file within a limit of memory. Values are multiplied by the
/// scale of the header, as in Mitsuba.
///
/// # Errors
///
/// Bytes that are not a valid PFM file, or that take too much memory.
pub fn decode_within(bytes: &[u8], limits: Limits) -> Result<RgbImage, Problem> {
    let wrong = |reason: &str| Problem::WrongFormat {
        format: "PFM",
        reason: reason.to_owned(),
    };
    let mut rest = bytes;
    let channels = match word(&mut rest) {
        Some("PF") => 3,
        Some("Pf") => 1,
        _ => return Err(wrong("it does not begin with 'PF' or 'Pf'")),
    };
    let mut side = || -> Option<usize> { word(&mut rest)?.parse().ok().filter(|n| *n > 0) };
    let (Some(width), Some(height)) = (side(), side()) else {
        return Err(wrong("the header needs a width and a height"));
    };
    let scale = word(&mut rest).and_then(|word| word.parse::<f32>().ok());
    let scale = scale.filter(|v| v.is_finite() && *v != 0.0);
    let scale = scale.ok_or_else(|| wrong("the header needs a scale other than 0"))?;
    let row = width.checked_mul(4 * channels);
    let expected = row.and_then(|row| row.checked_mul(height));
    let found = rest.len() as u64;
    match expected {
        Some(expected) if expected <= rest.len() => rest = &rest[..expected],
        expected => {
            let expected = expected.map_or(u64::MAX, |n| n as u64);
            return Err(Problem::Truncated { expected, found });
        }
    }
    let pixel = size_of::<[f32; 3]>() as u64;
    limits.check((width * height) as u64, pixel, bytes.len() as u64)?;
    let number = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        let value = if scale < 0.0 {
            f32::from_le_bytes(bytes)
        } else {
            f32::from_be_bytes(bytes)
        };
        value * scale.abs()
    };
    // Reverse the rows: the last row comes first.
    let rows = rest.chunks_exact(4 * channels * width).rev();
    let pixels = rows.flat_map(|row| row.chunks_exact(4 * channels));
    let pixels = pixels.map(|pixel| match channels {
        1 => [number(pixel); 3],
        _ => [number(pixel), number(&pixel[4..]), number(&pixel[8..])],
    });
    Ok(RgbImage {
        width,
        height,
        pixels: pixels.collect(),
    })
}

/// Maximum length of a word in a header, in bytes.
const MAX_WORD_LENGTH: usize = 40;

/// Returns the next word of a header, which a single blank ends.
fn word<'b>(rest: &mut &'b [u8]) -> Option<&'b str> {
    *rest = rest.trim_ascii_start();
    let near = &rest[..rest.len().min(MAX_WORD_LENGTH)];
    let end = near.iter().position(u8::is_ascii_whitespace)?;
    let word = std::str::from_utf8(&rest[..end]).ok();
    *rest = &rest[end + 1..];
    word
}
