//! PNG files in sRGB.

use std::io::Cursor;
use std::path::Path;

use image::ImageFormat;
use png::{BitDepth, ColorType, Decoder, Encoder};

use super::RgbImage;
use super::tone::{Curve, Tone};
use crate::atomic;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes an image in sRGB, completely or not at all. `tone` is the exposure and the tone curve;
/// the file records it as texts `exposure` (stops) and `tone_map`, unless it has no effect.
///
/// # Errors
///
/// An image whose size does not match its pixels, and all errors of [`atomic::write()`].
pub fn write(path: &Path, image: &RgbImage, depth: Depth, tone: Tone) -> Result<(), FileError> {
    let bytes = encode(image, depth, tone).map_err(|problem| problem.at(path))?;
    atomic::write_bytes(path, &bytes)
}

/// Writes 8 bits per channel, with one pixel of `pixels` for each pixel of the size, row by row
/// from the top left. The pixels need not be in memory.
///
/// # Errors
///
/// Fails like [`write()`].
pub fn write_pixels(
    path: &Path,
    size: [usize; 2],
    pixels: impl Iterator<Item = [f32; 3]>,
    tone: Tone,
) -> Result<(), FileError> {
    let bytes = encode_pixels(size, pixels, Depth::Eight, tone, &[]);
    atomic::write_bytes(path, &bytes.map_err(|problem| problem.at(path))?)
}

/// Encodes an image as a PNG file.
///
/// # Errors
///
/// Fails like [`write()`], except for errors of the file system.
pub fn encode(image: &RgbImage, depth: Depth, tone: Tone) -> Result<Vec<u8>, Problem> {
    encode_described(image, depth, tone, &[])
}

/// Encodes an image with texts about it: names and contents.
pub(super) fn encode_described(
    image: &RgbImage,
    depth: Depth,
    tone: Tone,
    about: &[&(String, String)],
) -> Result<Vec<u8>, Problem> {
    let size = [image.width, image.height];
    if image.pixels.len() != image.width * image.height {
        return Err(mismatch(size, image.pixels.len()));
    }
    encode_pixels(size, image.pixels.iter().copied(), depth, tone, about)
}

fn encode_pixels(
    size: [usize; 2],
    pixels: impl Iterator<Item = [f32; 3]>,
    depth: Depth,
    tone: Tone,
    about: &[&(String, String)],
) -> Result<Vec<u8>, Problem> {
    let [width, height] = size;
    let side = |n| u32::try_from(n).ok().filter(|n| *n > 0);
    let wrong = || mismatch(size, 0);
    let (width, height) = (
        side(width).ok_or_else(wrong)?,
        side(height).ok_or_else(wrong)?,
    );
    let encoded = pixels.flatten().map(|v| tone.encode(v));
    let (depth, data): (_, Vec<u8>) = match depth {
        Depth::Eight => {
            let byte = |v: f64| (v * 255.0).round() as u8;
            (BitDepth::Eight, encoded.map(byte).collect())
        }
        Depth::Sixteen => {
            let bytes = |v: f64| ((v * 65535.0).round() as u16).to_be_bytes();
            (BitDepth::Sixteen, encoded.flat_map(bytes).collect())
        }
    };
    let channel = if depth == BitDepth::Eight { 1 } else { 2 };
    if data.len() != width as usize * height as usize * 3 * channel {
        return Err(mismatch(size, data.len() / (3 * channel)));
    }
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(depth);
    let about = about.iter().map(|(name, text)| (&**name, text.clone()));
    let written = (texts(tone).into_iter().chain(about))
        .try_for_each(|(name, text)| encoder.add_itxt_chunk(name.to_owned(), text))
        .and_then(|()| encoder.write_header())
        .and_then(|mut writer| {
            writer.write_image_data(&data)?;
            writer.finish()
        });
    written.map_err(|e| Problem::Malformed(format!("cannot be stored as PNG: {e}")))?;
    Ok(bytes)
}

/// Returns texts that describe the changes of the values before encoding.
fn texts(tone: Tone) -> Vec<(&'static str, String)> {
    let mut texts = Vec::new();
    if tone.exposure != 0.0 {
        texts.push(("exposure", tone.exposure.to_string()));
    }
    if tone.curve != Curve::default() {
        texts.push(("tone_map", tone.curve.name().to_owned()));
    }
    texts
}

fn mismatch([width, height]: [usize; 2], found: usize) -> Problem {
    Problem::Mismatch {
        expected: format!("{width} x {height} pixels"),
        found: found.to_string(),
    }
}

/// Reads an image and converts its values to linear values in [0, 1]. Transparency is dropped.
///
/// # Errors
///
/// A file that cannot be read or is not a valid PNG file.
pub fn read(path: &Path) -> Result<RgbImage, FileError> {
    read_within(path, Limits::default())
}

/// Reads a file within a limit of memory, as [`read`].
///
/// # Errors
///
/// As for [`read`].
pub fn read_within(path: &Path, limits: Limits) -> Result<RgbImage, FileError> {
    super::encoded::read(path, (ImageFormat::Png, "PNG"), limits)
}

/// Reads a file as [`read_within`], and undoes the tone that its texts state. Values that the tone
/// clipped stay clipped.
///
/// # Errors
///
/// As for [`read`].
pub(super) fn read_untoned(path: &Path, limits: Limits) -> Result<RgbImage, FileError> {
    let bytes = input::read(path)?;
    let mut image = decode_within(&bytes, limits).map_err(|problem| problem.at(path))?;
    let tone = tone(&bytes);
    for pixel in &mut image.pixels {
        *pixel = pixel.map(|value| tone.undo(value));
    }
    Ok(image)
}

/// Largest accepted exposure, in stops: larger exposures exceed single precision.
const MAX_STOPS: f64 = 100.0;

/// Returns the tone of a file, from its [texts].
fn tone(bytes: &[u8]) -> Tone {
    let Ok(reader) = Decoder::new(Cursor::new(bytes)).read_info() else {
        return Tone::default();
    };
    let of_name = |name: &str| {
        let texts = reader.info().utf8_text.iter();
        let mut texts = texts.filter(|text| text.keyword == name);
        texts.next().and_then(|text| text.get_text().ok())
    };
    let exposure = of_name("exposure").and_then(|text| text.parse().ok());
    let curve = of_name("tone_map");
    let curves = Curve::NAMES.iter();
    let curve = curve.and_then(|name| curves.clone().find(|(known, _)| *known == name));
    Tone {
        exposure: exposure
            .filter(|stops: &f64| stops.abs() <= MAX_STOPS)
            .unwrap_or(0.0),
        curve: curve.map_or(Curve::default(), |(_, curve)| *curve),
    }
}

/// Reads an image from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn decode(bytes: &[u8]) -> Result<RgbImage, Problem> {
    decode_within(bytes, Limits::default())
}

/// Reads an image from the bytes of a file within a limit of memory, as [`decode`].
///
/// # Errors
///
/// As for [`read`].
pub fn decode_within(bytes: &[u8], limits: Limits) -> Result<RgbImage, Problem> {
    super::encoded::decode(bytes, (ImageFormat::Png, "PNG"), limits)
}
