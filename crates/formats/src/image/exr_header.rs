//! Order of attributes in an EXR header.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::Range;

/// Number of bytes before the first attribute: the magic number and the version.
const START: usize = 8;

/// Number of bytes at the beginning of a file in which the header is searched first.
const FIRST_SEARCHED_BYTES: u64 = 1 << 16;

/// Sorts the attributes of a file with one part, which is open for reading, too.
pub(super) fn sort_in_file(writer: &mut BufWriter<File>) -> io::Result<()> {
    writer.flush()?;
    let file = writer.get_mut();
    let mut size = FIRST_SEARCHED_BYTES;
    loop {
        file.rewind()?;
        let mut bytes = Vec::new();
        file.take(size).read_to_end(&mut bytes)?;
        if sort_attributes(&mut bytes) || (bytes.len() as u64) < size {
            file.rewind()?;
            file.write_all(&bytes)?;
            file.seek(SeekFrom::End(0))?;
            return Ok(());
        }
        size *= 4;
    }
}

/// Sorts the attributes of a file with one part by name. Returns true if the bytes contain a whole
/// header; else they do not change.
pub(super) fn sort_attributes(bytes: &mut [u8]) -> bool {
    let Some(mut ranges) = attributes(bytes) else {
        return false;
    };
    let end = ranges.last().map_or(START, |range| range.end);
    // Compare bytes to order names: each attribute begins with its name and a zero byte.
    ranges.sort_by(|a, b| bytes[a.clone()].cmp(&bytes[b.clone()]));
    let sorted: Vec<u8> = ranges
        .into_iter()
        .flat_map(|range| bytes[range].to_vec())
        .collect();
    bytes[START..end].copy_from_slice(&sorted);
    true
}

/// Returns the range of each attribute: name, zero, type, zero, size (32 bits), value. A zero byte
/// instead of a name ends the list.
fn attributes(bytes: &[u8]) -> Option<Vec<Range<usize>>> {
    let mut ranges = Vec::new();
    let mut start = START;
    while *bytes.get(start)? != 0 {
        let type_start = after_text(bytes, start)?;
        let size_start = after_text(bytes, type_start)?;
        let (size, _) = bytes.get(size_start..)?.split_first_chunk::<4>()?;
        let size = usize::try_from(i32::from_le_bytes(*size)).ok()?;
        let end = size_start.checked_add(4)?.checked_add(size)?;
        if end > bytes.len() {
            return None;
        }
        ranges.push(start..end);
        start = end;
    }
    Some(ranges)
}

/// Returns the position after the zero byte at the end of the text at `start`.
fn after_text(bytes: &[u8], start: usize) -> Option<usize> {
    let length = bytes.get(start..)?.iter().position(|b| *b == 0)?;
    Some(start + length + 1)
}
