//! Number types in files.

use half::f16;
use std::fmt;
use std::io::{self, Read, Write};

/// Number of values that are converted at a time.
const BLOCK: usize = 8192;

/// Number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// IEEE 754, 16 bits.
    F16,
    /// IEEE 754, 32 bits.
    F32,
    /// IEEE 754, 64 bits.
    F64,
    /// Signed, 8 bits.
    I8,
    /// Signed, 16 bits.
    I16,
    /// Signed, 32 bits.
    I32,
    /// Signed, 64 bits; exact up to 2⁵³.
    I64,
    /// Unsigned, 8 bits.
    U8,
    /// Unsigned, 16 bits.
    U16,
    /// Unsigned, 32 bits.
    U32,
    /// Unsigned, 64 bits; exact up to 2⁵³.
    U64,
}

impl Element {
    /// All types.
    pub const ALL: [Element; 11] = [
        Element::F16,
        Element::F32,
        Element::F64,
        Element::I8,
        Element::I16,
        Element::I32,
        Element::I64,
        Element::U8,
        Element::U16,
        Element::U32,
        Element::U64,
    ];

    /// Returns the name of the type, as in NumPy: `float32`.
    pub fn name(self) -> &'static str {
        match self {
            Element::F16 => "float16",
            Element::F32 => "float32",
            Element::F64 => "float64",
            Element::I8 => "int8",
            Element::I16 => "int16",
            Element::I32 => "int32",
            Element::I64 => "int64",
            Element::U8 => "uint8",
            Element::U16 => "uint16",
            Element::U32 => "uint32",
            Element::U64 => "uint64",
        }
    }

    /// Returns the type with the given name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|element| element.name() == name)
    }

    /// Returns the integer type of `size` bytes.
    pub(crate) fn integer(size: usize, signed: bool) -> Option<Self> {
        Some(match (size, signed) {
            (1, true) => Element::I8,
            (2, true) => Element::I16,
            (4, true) => Element::I32,
            (8, true) => Element::I64,
            (1, false) => Element::U8,
            (2, false) => Element::U16,
            (4, false) => Element::U32,
            (8, false) => Element::U64,
            _ => return None,
        })
    }

    /// Returns the size of a number in bytes.
    pub fn size(self) -> usize {
        match self {
            Element::I8 | Element::U8 => 1,
            Element::F16 | Element::I16 | Element::U16 => 2,
            Element::F32 | Element::I32 | Element::U32 => 4,
            Element::F64 | Element::I64 | Element::U64 => 8,
        }
    }

    /// Returns true for types of whole numbers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Element::F16 | Element::F32 | Element::F64)
    }

    /// Returns true if single precision represents all numbers of the type.
    pub fn is_single(self) -> bool {
        self.float() != Element::F64
    }

    /// Returns the type itself, or for integers a floating-point type that represents them.
    pub fn float(self) -> Self {
        match self {
            Element::F16 | Element::F32 | Element::F64 => self,
            integer if integer.size() <= 2 => Element::F32,
            _ => Element::F64,
        }
    }

    /// Returns the stored number for `v`: the nearest one. Beyond the range of the type, it is
    /// infinite or the end of the range.
    pub fn nearest(self, v: f64) -> f64 {
        match self {
            Element::F16 => f16::from_f64(v).to_f64(),
            Element::F32 => f64::from(v as f32),
            Element::F64 => v,
            Element::I8 => f64::from(v.round() as i8),
            Element::I16 => f64::from(v.round() as i16),
            Element::I32 => f64::from(v.round() as i32),
            Element::I64 => (v.round() as i64) as f64,
            Element::U8 => f64::from(v.round() as u8),
            Element::U16 => f64::from(v.round() as u16),
            Element::U32 => f64::from(v.round() as u32),
            Element::U64 => (v.round() as u64) as f64,
        }
    }

    /// Decodes numbers from little-endian bytes.
    pub fn decode(self, bytes: &[u8], sink: &mut impl FnMut(f64)) {
        match self {
            Element::F16 => words(bytes, |b| f16::from_le_bytes(b).to_f64(), sink),
            Element::F32 => words(bytes, |b| f64::from(f32::from_le_bytes(b)), sink),
            Element::F64 => words(bytes, f64::from_le_bytes, sink),
            Element::I8 => words(bytes, |b| f64::from(i8::from_le_bytes(b)), sink),
            Element::I16 => words(bytes, |b| f64::from(i16::from_le_bytes(b)), sink),
            Element::I32 => words(bytes, |b| f64::from(i32::from_le_bytes(b)), sink),
            Element::I64 => words(bytes, |b| i64::from_le_bytes(b) as f64, sink),
            Element::U8 => words(bytes, |b: [u8; 1]| f64::from(b[0]), sink),
            Element::U16 => words(bytes, |b| f64::from(u16::from_le_bytes(b)), sink),
            Element::U32 => words(bytes, |b| f64::from(u32::from_le_bytes(b)), sink),
            Element::U64 => words(bytes, |b| u64::from_le_bytes(b) as f64, sink),
        }
    }

    /// Encodes the number nearest to `v` in little-endian bytes.
    fn encode(self, v: f64, out: &mut Vec<u8>) {
        match self {
            Element::F16 => out.extend(f16::from_f64(v).to_le_bytes()),
            Element::F32 => out.extend((v as f32).to_le_bytes()),
            Element::F64 => out.extend(v.to_le_bytes()),
            Element::I8 => out.extend((v.round() as i8).to_le_bytes()),
            Element::I16 => out.extend((v.round() as i16).to_le_bytes()),
            Element::I32 => out.extend((v.round() as i32).to_le_bytes()),
            Element::I64 => out.extend((v.round() as i64).to_le_bytes()),
            Element::U8 => out.push(v.round() as u8),
            Element::U16 => out.extend((v.round() as u16).to_le_bytes()),
            Element::U32 => out.extend((v.round() as u32).to_le_bytes()),
            Element::U64 => out.extend((v.round() as u64).to_le_bytes()),
        }
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

fn words<const N: usize>(
    bytes: &[u8],
    convert: impl Fn([u8; N]) -> f64,
    sink: &mut impl FnMut(f64),
) {
    let (words, _) = bytes.as_chunks::<N>();
    words.iter().for_each(|word| sink(convert(*word)));
}

/// Number type and byte order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoding {
    /// Type of the numbers.
    pub element: Element,
    /// True if the most significant byte comes first.
    pub big: bool,
}

impl Encoding {
    /// Returns the encoding with the least significant byte first.
    pub const fn little(element: Element) -> Self {
        Encoding {
            element,
            big: false,
        }
    }

    pub(crate) const fn big(element: Element) -> Self {
        Encoding { element, big: true }
    }

    /// Reads `count` numbers, and passes each to `sink`.
    ///
    /// # Errors
    /// The reader fails or ends early.
    pub fn read(
        self,
        reader: &mut impl Read,
        count: usize,
        mut sink: impl FnMut(f64),
    ) -> io::Result<()> {
        let size = self.element.size();
        let mut buffer = vec![0; BLOCK.min(count) * size];
        let mut left = count;
        while left > 0 {
            let numbers = BLOCK.min(left);
            let block = &mut buffer[..numbers * size];
            reader.read_exact(block)?;
            if self.big {
                block.chunks_exact_mut(size).for_each(<[u8]>::reverse);
            }
            self.element.decode(block, &mut sink);
            left -= numbers;
        }
        Ok(())
    }

    /// Writes numbers, each rounded to the nearest number of the type.
    ///
    /// # Errors
    /// The writer fails.
    pub fn write(
        self,
        file: &mut impl Write,
        values: impl IntoIterator<Item = f64>,
    ) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(8);
        values.into_iter().try_for_each(|v| {
            bytes.clear();
            self.element.encode(v, &mut bytes);
            if self.big {
                bytes.reverse();
            }
            file.write_all(&bytes)
        })
    }
}
