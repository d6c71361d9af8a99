//! The values of an array of a `.vti` file, however they are encoded.
//!
//! Binary data begin with a header of integers of 32 or 64 bits: the number of bytes; or, compressed, the
//! number of blocks, the size of a block and of the last one if it differs, and the compressed sizes.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::Node;

use super::{bad, integer};
use crate::error::Problem;
use crate::volume::INFLATION;

/// What follows the header of a file.
pub(super) struct Appended<'a> {
    bytes: &'a [u8],
    is_base64: bool,
}

impl<'a> Appended<'a> {
    /// The bytes after the underscore.
    pub fn new(bytes: &'a [u8], is_base64: bool) -> Self {
        Appended { bytes, is_base64 }
    }

    fn from(&self, offset: usize) -> Result<Vec<u8>, Problem> {
        let beyond = || bad(format!("an offset of {offset} beyond its appended data"));
        let bytes = self.bytes.get(offset..).ok_or_else(beyond)?;
        match self.is_base64 {
            false => Ok(bytes.to_vec()),
            true => {
                let end = bytes.iter().position(|b| *b == b'<');
                decode(&bytes[..end.unwrap_or(bytes.len())])
            }
        }
    }
}

/// How numbers are written.
pub(super) struct Encoding<'a> {
    kind: &'a str,
    wide: bool,
    big: bool,
    zlib: bool,
}

impl<'a> Encoding<'a> {
    /// As the attributes of a file and of an array say.
    pub fn of(root: Node<'a, '_>, data: Node<'a, '_>) -> Result<Self, Problem> {
        let zlib = match root.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => return Err(Problem::Unsupported(format!("compression by {other}"))),
        };
        Ok(Encoding {
            kind: data.attribute("type").unwrap_or(""),
            wide: root.attribute("header_type") == Some("UInt64"),
            big: root.attribute("byte_order") == Some("BigEndian"),
            zlib,
        })
    }

    /// The values of an array that must have `count` of them.
    pub fn values(
        &self,
        data: Node,
        appended: Option<&Appended>,
        count: usize,
    ) -> Result<Vec<f64>, Problem> {
        let (size, convert) = converter(self.kind)?;
        let text = data.text().unwrap_or("");
        let bytes = match data.attribute("format") {
            Some("ascii") => return numbers(text, count),
            Some("binary") => decode(text.as_bytes())?,
            Some("appended") => {
                let offset = integer(data.attribute("offset").unwrap_or(""))?;
                let none = || bad("it has no appended data".into());
                appended.ok_or_else(none)?.from(offset)?
            }
            other => return Err(bad(format!("an array of format {other:?}"))),
        };
        let too_large = || Problem::TooLarge(format!("{count} values"));
        let expected = count.checked_mul(size).ok_or_else(too_large)?;
        let payload = match self.zlib {
            true => self.inflate(&bytes, expected)?,
            false => self.plain(&bytes, expected)?,
        };
        let number = |chunk: &[u8]| {
            let mut little = [0; 8];
            little[..size].copy_from_slice(chunk);
            if self.big {
                little[..size].reverse();
            }
            convert(little)
        };
        Ok(payload.chunks_exact(size).map(number).collect())
    }

    /// One integer of a header, and what follows.
    fn header<'b>(&self, bytes: &'b [u8]) -> Result<(usize, &'b [u8]), Problem> {
        let size = if self.wide { 8 } else { 4 };
        let cut = || bad("the data of its array end early".into());
        let (head, rest) = bytes.split_at_checked(size).ok_or_else(cut)?;
        let mut word = [0; 8];
        word[..size].copy_from_slice(head);
        if self.big {
            word[..size].reverse();
        }
        let number = usize::try_from(u64::from_le_bytes(word));
        Ok((number.map_err(|_| cut())?, rest))
    }

    fn plain(&self, bytes: &[u8], expected: usize) -> Result<Vec<u8>, Problem> {
        let (size, rest) = self.header(bytes)?;
        check_size(expected, size)?;
        let payload = rest.get(..size).ok_or(Problem::Truncated {
            expected: size as u64,
            found: rest.len() as u64,
        })?;
        Ok(payload.to_vec())
    }

    fn inflate(&self, bytes: &[u8], expected: usize) -> Result<Vec<u8>, Problem> {
        // Nothing is set aside for more than the data can become.
        if expected as u64 > (bytes.len() as u64).saturating_mul(INFLATION) {
            return Err(Problem::Truncated {
                expected: expected as u64,
                found: bytes.len() as u64,
            });
        }
        let (blocks, rest) = self.header(bytes)?;
        let (_, rest) = self.header(rest)?;
        let (_, mut rest) = self.header(rest)?;
        let mut sizes = Vec::new();
        for _ in 0..blocks {
            let (size, after) = self.header(rest)?;
            sizes.push(size);
            rest = after;
        }
        let mut out = Vec::new();
        for size in sizes {
            let cut = || bad("a compressed block ends early".into());
            let (block, after) = rest.split_at_checked(size).ok_or_else(cut)?;
            let left = (expected - out.len()) as u64 + 1;
            let inflated = ZlibDecoder::new(block).take(left).read_to_end(&mut out);
            inflated.map_err(|e| bad(format!("a compressed block is damaged: {e}")))?;
            check_size(expected, out.len().max(expected))?;
            rest = after;
        }
        check_size(expected, out.len())?;
        Ok(out)
    }
}

fn check_size(expected: usize, found: usize) -> Result<(), Problem> {
    match expected == found {
        true => Ok(()),
        false => Err(Problem::Mismatch {
            expected: format!("an array of {expected} bytes"),
            found: format!("{found}"),
        }),
    }
}

/// Bytes of a number, and what makes one of its bytes in little-endian order.
type Converter = (usize, fn([u8; 8]) -> f64);

/// That of the given type of numbers.
fn converter(kind: &str) -> Result<Converter, Problem> {
    fn head<const N: usize>(bytes: [u8; 8]) -> [u8; N] {
        std::array::from_fn(|i| bytes[i])
    }
    Ok(match kind {
        "Float32" => (4, |b| f64::from(f32::from_le_bytes(head(b)))),
        "Float64" => (8, f64::from_le_bytes),
        "Int8" => (1, |b| f64::from(b[0] as i8)),
        "UInt8" => (1, |b| f64::from(b[0])),
        "Int16" => (2, |b| f64::from(i16::from_le_bytes(head(b)))),
        "UInt16" => (2, |b| f64::from(u16::from_le_bytes(head(b)))),
        "Int32" => (4, |b| f64::from(i32::from_le_bytes(head(b)))),
        "UInt32" => (4, |b| f64::from(u32::from_le_bytes(head(b)))),
        "Int64" => (8, |b| i64::from_le_bytes(b) as f64),
        "UInt64" => (8, |b| u64::from_le_bytes(b) as f64),
        other => return Err(Problem::Unsupported(format!("numbers of type '{other}'"))),
    })
}

fn numbers(text: &str, count: usize) -> Result<Vec<f64>, Problem> {
    let words = text.split_whitespace();
    let number = |word: &str| {
        word.parse()
            .map_err(|_| bad(format!("'{word}' is not a number")))
    };
    let numbers: Vec<f64> = words.map(number).collect::<Result<_, _>>()?;
    match numbers.len() == count {
        true => Ok(numbers),
        false => Err(Problem::Mismatch {
            expected: format!("{count} values"),
            found: format!("{}", numbers.len()),
        }),
    }
}

/// The bytes of base64 text, blanks left out. Header and data may be encoded apart: padding ends a part,
/// not the whole.
fn decode(text: &[u8]) -> Result<Vec<u8>, Problem> {
    let text: Vec<u8> = text
        .iter()
        .copied()
        .filter(|b| !b.is_ascii_whitespace())
        .collect();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    for part in text.chunk_by(|a, b| !(*a == b'=' && *b != b'=')) {
        let decoded = STANDARD.decode_vec(part, &mut bytes);
        decoded.map_err(|e| bad(format!("its base64 is damaged: {e}")))?;
    }
    Ok(bytes)
}
