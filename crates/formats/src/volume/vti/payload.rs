//! Values of an array of a `.vti` file, in any encoding.
//!
//! Binary data begin with a header of integers of 32 or 64 bits. Uncompressed, it is the number of
//! bytes. Compressed, it is the number of blocks, the size of a block, the size of the last block
//! if it differs, and the compressed sizes. "VTK XML Formats", docs.vtk.org.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::Node;

use super::{bad, integer};
use crate::element::{Element, Encoding};
use crate::error::Problem;
use crate::volume::layout::Layout;
use crate::volume::{INFLATION, Sample};

/// Appended data after the XML part of a file.
pub(super) struct Appended<'a> {
    bytes: &'a [u8],
    is_base64: bool,
}

impl<'a> Appended<'a> {
    /// Wraps the bytes after the underscore.
    pub(super) fn new(bytes: &'a [u8], is_base64: bool) -> Self {
        Appended { bytes, is_base64 }
    }

    fn from(&self, offset: usize) -> Result<Cow<'a, [u8]>, Problem> {
        let beyond = || bad(format!("an offset of {offset} beyond its appended data"));
        let bytes = self.bytes.get(offset..).ok_or_else(beyond)?;
        if self.is_base64 {
            let end = bytes.iter().position(|b| *b == b'<');
            Ok(decode(&bytes[..end.unwrap_or(bytes.len())])?.into())
        } else {
            Ok(bytes.into())
        }
    }
}

/// Encoding of numbers.
pub(super) struct Payload {
    encoding: Encoding,
    wide: bool,
    compression: Option<Compression>,
}

/// Compression of the blocks of a file.
#[derive(Clone, Copy)]
enum Compression {
    Zlib,
    Lz4,
}

impl Compression {
    /// Returns the compression by VTK's name of the compressor; `None` if blocks are not
    /// compressed.
    fn of(compressor: Option<&str>) -> Result<Option<Self>, Problem> {
        match compressor {
            None | Some("") => Ok(None),
            Some("vtkZLibDataCompressor") => Ok(Some(Compression::Zlib)),
            Some("vtkLZ4DataCompressor") => Ok(Some(Compression::Lz4)),
            Some(other) => Err(Problem::Unsupported(format!(
                "compression by {other}: let VTK write the file with zlib (SetCompressorTypeToZLib), LZ4, or no compressor"
            ))),
        }
    }

    /// Appends a decompressed block. An LZ4 block has at most `whole` bytes. The output is limited
    /// to about `left` bytes.
    fn expand(
        self,
        block: &[u8],
        [whole, left]: [usize; 2],
        out: &mut Vec<u8>,
    ) -> Result<(), Problem> {
        let damaged = |e: String| bad(format!("a compressed block is damaged: {e}"));
        match self {
            Compression::Zlib => {
                let mut block = ZlibDecoder::new(block).take(left as u64 + 1);
                block.read_to_end(out).map_err(|e| damaged(e.to_string()))?;
            }
            Compression::Lz4 => {
                let bytes = lz4_flex::block::decompress(block, whole.min(left));
                out.extend(bytes.map_err(|e| damaged(e.to_string()))?);
            }
        }
        Ok(())
    }
}

impl Payload {
    /// Reads the encoding from the attributes of a file and of an array.
    pub(super) fn of(root: Node, data: Node) -> Result<Self, Problem> {
        Ok(Payload {
            encoding: Encoding {
                element: element(data.attribute("type").unwrap_or(""))?,
                big: root.attribute("byte_order") == Some("BigEndian"),
            },
            wide: root.attribute("header_type") == Some("UInt64"),
            compression: Compression::of(root.attribute("compressor"))?,
        })
    }

    /// Returns the type of numbers.
    pub(super) fn element(&self) -> Element {
        self.encoding.element
    }

    /// Reads the values of an array.
    pub(super) fn values<T: Sample>(
        &self,
        data: Node,
        appended: Option<&Appended>,
        layout: &Layout,
    ) -> Result<Vec<T>, Problem> {
        let text = data.text().unwrap_or("");
        let bytes: Cow<[u8]> = match data.attribute("format") {
            Some("ascii") => return layout.parse(text),
            Some("binary") => decode(text.as_bytes())?.into(),
            Some("appended") => {
                let offset = integer(data.attribute("offset").unwrap_or(""))?;
                let none = || bad("it has no appended data".into());
                appended.ok_or_else(none)?.from(offset)?
            }
            other => return Err(bad(format!("an array of format {other:?}"))),
        };
        let expected = layout.count() * self.encoding.element.size();
        let payload: Cow<[u8]> = match self.compression {
            Some(compression) => self.inflate(compression, &bytes, expected)?.into(),
            None => self.plain(&bytes, expected)?.into(),
        };
        layout.read(&mut &payload[..], self.encoding)
    }

    /// Reads one integer of a header. Returns it, and the bytes after it.
    fn header<'b>(&self, bytes: &'b [u8]) -> Result<(usize, &'b [u8]), Problem> {
        let size = if self.wide { 8 } else { 4 };
        let cut = || bad("the data of its array end early".into());
        let (head, rest) = bytes.split_at_checked(size).ok_or_else(cut)?;
        let mut word = [0; 8];
        word[..size].copy_from_slice(head);
        if self.encoding.big {
            word[..size].reverse();
        }
        let number = usize::try_from(u64::from_le_bytes(word));
        Ok((number.map_err(|_| cut())?, rest))
    }

    fn plain<'b>(&self, bytes: &'b [u8], expected: usize) -> Result<&'b [u8], Problem> {
        let (size, rest) = self.header(bytes)?;
        check_size(expected, size)?;
        rest.get(..size).ok_or(Problem::Truncated {
            expected: size as u64,
            found: rest.len() as u64,
        })
    }

    fn inflate(
        &self,
        compression: Compression,
        bytes: &[u8],
        expected: usize,
    ) -> Result<Vec<u8>, Problem> {
        // Check the size before allocation: the data cannot become larger than this.
        if expected as u64 > (bytes.len() as u64).saturating_mul(INFLATION) {
            return Err(Problem::Truncated {
                expected: expected as u64,
                found: bytes.len() as u64,
            });
        }
        let (blocks, rest) = self.header(bytes)?;
        let (whole, rest) = self.header(rest)?;
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
            compression.expand(block, [whole, expected - out.len()], &mut out)?;
            check_size(expected, out.len().max(expected))?;
            rest = after;
        }
        check_size(expected, out.len())?;
        Ok(out)
    }
}

fn check_size(expected: usize, found: usize) -> Result<(), Problem> {
    if expected == found {
        Ok(())
    } else {
        Err(Problem::Mismatch {
            expected: format!("an array of {expected} bytes"),
            found: format!("{found}"),
        })
    }
}

/// Returns VTK's name of a number type.
pub(super) fn word(element: Element) -> &'static str {
    match element {
        Element::F16 | Element::F32 => "Float32",
        Element::F64 => "Float64",
        Element::I8 => "Int8",
        Element::I16 => "Int16",
        Element::I32 => "Int32",
        Element::I64 => "Int64",
        Element::U8 => "UInt8",
        Element::U16 => "UInt16",
        Element::U32 => "UInt32",
        Element::U64 => "UInt64",
    }
}

fn element(name: &str) -> Result<Element, Problem> {
    let same = |element: &Element| *element != Element::F16 && word(*element) == name;
    let found = Element::ALL.into_iter().find(same);
    found.ok_or_else(|| Problem::Unsupported(format!("numbers of type '{name}'")))
}

/// Decodes base64 text, ignoring blanks. Header and data may be encoded separately: padding ends a
/// part, not the whole text.
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
