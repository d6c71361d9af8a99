//! Blosc 1 with LZ4 or zlib: `README_CHUNK_FORMAT.rst` of c-blosc.
//!
//! A chunk consists of blocks, and a block of streams, each compressed separately. The bytes of the
//! numbers of a block may be shuffled: all first bytes, then all second bytes, and so on.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::bytes::Bytes;
use crate::error::Problem;

const SHUFFLED: u8 = 1;
const COPIED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const WHOLE: u8 = 16;
const LZ4: u8 = 1;
const ZLIB: u8 = 3;
/// Minimum number of numbers of a block with several streams, and maximum size of their type in
/// bytes.
const MIN_SPLIT_NUMBERS: usize = 128;
const MAX_SPLIT_SIZE: usize = 16;
/// Number of bytes to which OpenVDB pads its data before compression.
const PADDED: usize = 128;

/// Returns the first `size` bytes of a chunk. All further bytes are padding.
pub(super) fn unpack(bytes: &[u8], size: usize) -> Result<Vec<u8>, Problem> {
    let mut cursor = Bytes::new(bytes);
    let [_, _, flags, width] = cursor.array()?;
    let (whole, block) = (cursor.u32()? as usize, cursor.u32()? as usize);
    cursor.u32()?; // Skip the size of the chunk.
    if whole < size || whole > size.max(PADDED) || block == 0 || width == 0 {
        return Err(damaged());
    }
    if flags & COPIED != 0 {
        return Ok(cursor.take(size)?.to_vec());
    }
    if flags & BITS_SHUFFLED != 0 {
        return Err(Problem::Unsupported("Blosc with shuffled bits".into()));
    }
    let width = usize::from(width);
    let starts: Result<Vec<u32>, _> = (0..whole.div_ceil(block)).map(|_| cursor.u32()).collect();
    let mut out = Vec::with_capacity(whole);
    for start in starts? {
        let left = whole - out.len();
        let length = block.min(left);
        let is_split = flags & WHOLE == 0
            && width <= MAX_SPLIT_SIZE
            && block / width >= MIN_SPLIT_NUMBERS
            && length == block;
        let streams = if is_split { width } else { 1 };
        let mut cursor = Bytes::new(bytes.get(start as usize..).ok_or_else(damaged)?);
        let mut plain = Vec::with_capacity(length);
        for _ in 0..streams {
            stream(&mut cursor, flags >> 5, length / streams, &mut plain)?;
        }
        if plain.len() != length {
            return Err(damaged());
        }
        if flags & SHUFFLED != 0 && width > 1 {
            out.extend(unshuffled(&plain, width))
        } else {
            out.extend(plain)
        }
    }
    out.truncate(size);
    Ok(out)
}

/// Appends the content of a stream of `size` bytes.
fn stream(cursor: &mut Bytes, codec: u8, size: usize, out: &mut Vec<u8>) -> Result<(), Problem> {
    let packed = cursor.sized()?;
    if packed.len() == size {
        out.extend(packed);
        return Ok(());
    }
    let plain = match codec {
        LZ4 => lz4_flex::block::decompress(packed, size).map_err(|_| damaged())?,
        ZLIB => {
            let mut plain = Vec::new();
            let inflated = ZlibDecoder::new(packed)
                .take(size as u64)
                .read_to_end(&mut plain);
            inflated.map_err(|_| damaged())?;
            plain
        }
        other => {
            let message = format!("Blosc with codec {other} (only LZ4 and zlib are)");
            return Err(Problem::Unsupported(message));
        }
    };
    out.extend(plain);
    Ok(())
}

/// Restores the order of the bytes of numbers of `width` bytes. Remaining bytes are not shuffled.
fn unshuffled(bytes: &[u8], width: usize) -> impl Iterator<Item = u8> {
    let count = bytes.len() / width;
    let (numbers, rest) = bytes.split_at(count * width);
    let number = move |i| (0..width).map(move |b| numbers[b * count + i]);
    (0..count).flat_map(number).chain(rest.iter().copied())
}

fn damaged() -> Problem {
    Problem::Malformed("its Blosc data are damaged".into())
}
