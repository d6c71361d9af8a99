//! Mitsuba's `.vol` files, version 3.
//!
//! Little-endian: `VOL`, a byte with the version, the encoding (1 is float32), the sizes along x,
//! y, z and the number of channels as 32-bit integers, the corners of the bounding box as six
//! float32, then the values.

use std::io::{BufReader, Read, Write};
use std::path::Path;

use super::Volume;
use crate::error::{FileError, Problem};
use crate::{atomic, binary};

/// Bytes before the values.
const HEADER: usize = 48;
const VERSION: u8 = 3;
const FLOAT32: i32 = 1;
/// The bounding box that is written when a volume has none: the unit cube.
const UNIT: [[f32; 3]; 2] = [[0.0; 3], [1.0; 3]];

/// Reads a volume.
///
/// # Errors
///
/// A file that cannot be read, is no `.vol` file of version 3 with float32 values, does not have
/// the size that its header calls for, or holds NaN or infinite values.
pub fn read(path: &Path) -> Result<Volume, FileError> {
    let (mut reader, size) = binary::open(path)?;
    read_from(&mut reader, size).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8]) -> Result<Volume, Problem> {
    read_from(&mut BufReader::new(bytes), bytes.len() as u64)
}

fn read_from(reader: &mut impl Read, size: u64) -> Result<Volume, Problem> {
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
    if integer(0) != FLOAT32 {
        let message = format!("VOL encoding {} (only 1, float32, is)", integer(0));
        return Err(Problem::Unsupported(message));
    }
    let length = |i| {
        let n = integer(i);
        usize::try_from(n).map_err(|_| Problem::Malformed(format!("a size of {n} in the header")))
    };
    let shape = [length(1)?, length(2)?, length(3)?, length(4)?];
    let count = binary::checked_count(&shape, 4, HEADER as u64, size)?;
    let data = binary::values(reader, count, f32::from_le_bytes).map_err(Problem::Read)?;
    let corner = |from: usize| [0, 1, 2].map(|i| f32::from_le_bytes(words[from + i]));
    let bbox = [corner(5), corner(8)];
    Volume::new([shape[0], shape[1], shape[2]], shape[3], data, Some(bbox))
}

/// Writes a volume, at once or not at all. Without a bounding box, that of the unit cube is
/// written.
///
/// # Errors
///
/// A size beyond 32 bits, and everything that [`atomic::write()`] reports.
pub fn write(path: &Path, volume: &Volume) -> Result<(), FileError> {
    let [x, y, z] = volume.size();
    let mut header = b"VOL".to_vec();
    header.push(VERSION);
    header.extend(FLOAT32.to_le_bytes());
    for length in [x, y, z, volume.channels()] {
        let too_large = |_| Problem::TooLarge(format!("{length} voxels along an axis")).at(path);
        header.extend(i32::try_from(length).map_err(too_large)?.to_le_bytes());
    }
    let corners = volume.bbox().unwrap_or(UNIT);
    header.extend(corners.iter().flatten().flat_map(|v| v.to_le_bytes()));
    atomic::write(path, |file| {
        file.write_all(&header)?;
        volume
            .data()
            .iter()
            .try_for_each(|v| file.write_all(&v.to_le_bytes()))
    })
}
