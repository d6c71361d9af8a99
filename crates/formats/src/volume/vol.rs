//! Mitsuba's `.vol` files, version 3.
//!
//! The file is little-endian. It has `VOL`, a byte with the version, and as 32-bit integers the
//! encoding, the sizes along x, y, z and the number of channels. The corners of the bounding box
//! follow as six float32, then the values. Encodings are 1, float32; 2, float16; 3, uint8, in which
//! 0 to 255 represent 0 to 1; 4, directions in 16 bits (Mitsuba 0.5 manual, `gridvolume`).
//! Directions are not supported.

use std::io::{BufReader, Read, Write};
use std::path::Path;

use glam::DVec3;

use super::layout::Layout;
use super::{Format, Sample, Volume};
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::{atomic, binary, input};

/// Size of the header, in bytes.
const HEADER: usize = 48;
const VERSION: u8 = 3;
const FLOAT32: i32 = 1;
const FLOAT16: i32 = 2;
const UINT8: i32 = 3;
const DIRECTIONS: i32 = 4;

/// Reads a volume.
///
/// # Errors
///
/// A file that cannot be read, or is not a `.vol` file of version 3 with numbers. A size that
/// differs from the header. NaN or infinite values.
pub fn read<T: Sample>(path: &Path) -> Result<Volume<T>, FileError> {
    let (mut reader, size) = input::open(path)?;
    read_from(&mut reader, size).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8]) -> Result<Volume<T>, Problem> {
    read_from(&mut BufReader::new(bytes), bytes.len() as u64)
}

fn read_from<T: Sample>(reader: &mut impl Read, size: u64) -> Result<Volume<T>, Problem> {
    let mut header = Vec::with_capacity(HEADER);
    reader
        .take(HEADER as u64)
        .read_to_end(&mut header)
        .map_err(Problem::Read)?;
    if !header.starts_with(b"VOL") {
        let reason = "it does not begin with 'VOL'".to_owned();
        return Err(Problem::WrongFormat {
            format: "VOL",
            reason,
        });
    }
    let Ok(header) = <[u8; HEADER]>::try_from(header) else {
        return Err(Problem::Truncated {
            expected: HEADER as u64,
            found: size,
        });
    };
    if header[3] != VERSION {
        return Err(Problem::Unsupported(format!("VOL version {}", header[3])));
    }
    let (words, _) = header[4..].as_chunks::<4>();
    let integer = |i: usize| i32::from_le_bytes(words[i]);
    let element = element(integer(0))?;
    let length = |i| {
        let n = integer(i);
        usize::try_from(n).map_err(|_| Problem::Malformed(format!("a size of {n} in the header")))
    };
    let layout = Layout::plain([length(1)?, length(2)?, length(3)?], length(4)?)?;
    binary::check_size(layout.count(), element.size(), HEADER as u64, size)?;
    let data = layout.read(reader, Encoding::little(element))?;
    let volume = Volume::new(layout.size, layout.channels, data)?;
    let corner = |from: usize| {
        DVec3::from_array([0, 1, 2].map(|i| f64::from(f32::from_le_bytes(words[from + i]))))
    };
    let volume = volume.with_bbox([corner(5), corner(8)]);
    match element {
        Element::U8 => volume.scaled(1.0 / 255.0, 0.0),
        _ => Ok(volume.with_element(element)),
    }
}

fn element(encoding: i32) -> Result<Element, Problem> {
    match encoding {
        FLOAT32 => Ok(Element::F32),
        FLOAT16 => Ok(Element::F16),
        UINT8 => Ok(Element::U8),
        DIRECTIONS => {
            let message = "VOL encoding 4, directions; a volume needs numbers (encodings 1, 2, 3)";
            Err(Problem::Unsupported(message.into()))
        }
        other => Err(Problem::Unsupported(format!(
            "VOL encoding {other}; known are 1 (float32), 2 (float16) and 3 (uint8)"
        ))),
    }
}

/// Writes a volume, completely or not at all: in half precision if its file has it, else in single
/// precision. The bounding box contains the cells around the samples, if they are aligned with the
/// axes. Otherwise it is the box of the volume's file, or the unit cube.
///
/// # Errors
///
/// A size beyond 32 bits, and all errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>) -> Result<(), FileError> {
    let [x, y, z] = volume.size();
    let element = Format::Vol.element(volume.element());
    let mut header = b"VOL".to_vec();
    header.push(VERSION);
    let encoding = match element {
        Element::F16 => FLOAT16,
        _ => FLOAT32,
    };
    header.extend(encoding.to_le_bytes());
    for length in [x, y, z, volume.channels()] {
        let too_large = |_| Problem::TooLarge(format!("{length} voxels along an axis")).at(path);
        header.extend(i32::try_from(length).map_err(too_large)?.to_le_bytes());
    }
    let corners = corners(volume).map(|corner| corner.as_vec3().to_array());
    header.extend(corners.iter().flatten().flat_map(|v| v.to_le_bytes()));
    atomic::write(path, |file| {
        file.write_all(&header)?;
        let values = volume.data().iter().map(|v| v.wide());
        Encoding::little(element).write(file, values)
    })
}

fn corners<T: Sample>(volume: &Volume<T>) -> [DVec3; 2] {
    let frame = volume.place();
    match (volume.frame(), volume.bbox()) {
        (None, Some(bbox)) => bbox,
        _ if frame.is_aligned() => {
            let half = 0.5 * frame.spacing();
            let last = DVec3::from_array(volume.size().map(|n| (n - 1) as f64));
            [frame.first - half, frame.first + frame.steps * last + half]
        }
        (_, bbox) => bbox.unwrap_or([DVec3::ZERO, DVec3::ONE]),
    }
}
