//! NumPy's `.npy` arrays.
//!
//! This crate has its own parser of headers: a header is a fixed dictionary with three entries, and
//! malicious files can make general parsers of Python literals exhaust the stack.

mod header;

use std::io::{self, BufReader, Read, Write};
use std::path::Path;

use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::{atomic, binary, input};
pub use header::NpyHeader;

/// Array as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct NpyArray {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// True if the first axis is the fastest in memory (Fortran), false if the last is (C).
    pub fortran_order: bool,
    /// Elements in the stored order.
    pub data: NpyData,
}

/// Elements of an array.
#[derive(Clone, Debug, PartialEq)]
pub enum NpyData {
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// Reads an array.
///
/// # Errors
///
/// A file that cannot be read or is not an `.npy` file. Other elements than floating-point numbers.
/// A size that differs from the header.
pub fn read(path: &Path) -> Result<NpyArray, FileError> {
    let (mut reader, size) = input::open(path)?;
    read_from(&mut reader, size).map_err(|problem| problem.at(path))
}

/// Reads an array from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8]) -> Result<NpyArray, Problem> {
    read_from(&mut BufReader::new(bytes), bytes.len() as u64)
}

fn read_from(reader: &mut impl Read, size: u64) -> Result<NpyArray, Problem> {
    let header = NpyHeader::read(reader, size)?;
    let Encoding { element, .. } = header.encoding;
    let count = binary::checked_count(&header.shape, element.size(), header.size, size)?;
    let data = match element {
        Element::F32 => NpyData::F32(elements(reader, &header, count, |v| v as f32)?),
        Element::F64 => NpyData::F64(elements(reader, &header, count, |v| v)?),
        other => {
            return Err(Problem::Mismatch {
                expected: "elements of type float32 or float64".to_owned(),
                found: other.to_string(),
            });
        }
    };
    Ok(NpyArray {
        shape: header.shape,
        fortran_order: header.fortran_order,
        data,
    })
}

fn elements<T>(
    reader: &mut impl Read,
    header: &NpyHeader,
    count: usize,
    convert: impl Fn(f64) -> T,
) -> Result<Vec<T>, Problem> {
    let mut data = Vec::with_capacity(count);
    let sink = |v| data.push(convert(v));
    header
        .encoding
        .read(reader, count, sink)
        .map_err(Problem::Read)?;
    Ok(data)
}

/// Writes an array of single-precision numbers in C order, completely or not at all.
///
/// # Errors
///
/// A shape that does not match the data, and all errors of [`atomic::write()`].
pub fn write(path: &Path, shape: &[usize], data: &[f32]) -> Result<(), FileError> {
    let count = shape
        .iter()
        .try_fold(1usize, |product, &n| product.checked_mul(n));
    if count != Some(data.len()) {
        let expected = format!("{} values", binary::product(shape));
        let found = format!("{} values", data.len());
        return Err(Problem::Mismatch { expected, found }.at(path));
    }
    write_values(path, shape, data.iter().copied())
}

/// Writes an array of single-precision numbers in C order, completely or not at all. `values` has
/// one value for each element, and need not be in memory.
///
/// # Errors
/// The file cannot be written.
pub fn write_values(
    path: &Path,
    shape: &[usize],
    values: impl Iterator<Item = f32>,
) -> Result<(), FileError> {
    atomic::write(path, |file| {
        write_elements(file, Element::F32, shape, values.map(f64::from))
    })
}

/// Writes an array in C order to an open file, with numbers of a type.
///
/// # Errors
/// The file cannot be written.
pub fn write_elements(
    file: &mut impl Write,
    element: Element,
    shape: &[usize],
    values: impl IntoIterator<Item = f64>,
) -> io::Result<()> {
    file.write_all(&header::bytes(header::descriptor(element), shape))?;
    Encoding::little(element).write(file, values)
}

/// Writes a text, as an array without axes, to an open file.
///
/// # Errors
/// The file cannot be written.
pub fn write_text(file: &mut impl Write, text: &str) -> io::Result<()> {
    let letters = text.chars().count().max(1);
    file.write_all(&header::bytes(&format!("<U{letters}"), &[]))?;
    let mut letters = text.chars();
    letters.try_for_each(|c| file.write_all(&u32::from(c).to_le_bytes()))
}

/// Reads a text that [`write_text`] wrote.
///
/// # Errors
/// Bytes in another form.
pub fn parse_text(bytes: &[u8]) -> Result<String, Problem> {
    let foreign = || Problem::Unsupported("arrays of text other than one string of UTF-32".into());
    // Find the line feed at the end of the header; characters of four bytes follow.
    let start = bytes.iter().position(|b| *b == b'\n').ok_or_else(foreign)? + 1;
    let letters = bytes[start..].chunks_exact(4);
    let letter = |b: &[u8]| char::from_u32(u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let text: Option<String> = letters.map(letter).collect();
    text.map(|t| t.trim_end_matches('\0').to_owned())
        .ok_or_else(foreign)
}
