//! Header of `.npy` files.

use std::io::Read;

use crate::element::{Element, Encoding};
use crate::error::Problem;

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Longest accepted header, in bytes; NumPy's own limit.
const MAX_HEADER_SIZE: u64 = 10_000;
/// Largest number of axes of an array; NumPy's own limit.
const MAX_AXES: usize = 32;
/// Alignment to which the size of the header is padded, in bytes.
const ALIGNMENT: usize = 64;

/// Metadata before the data.
pub struct NpyHeader {
    /// Type of the numbers and the order of their bytes.
    pub encoding: Encoding,
    /// True if the first index varies fastest.
    pub fortran_order: bool,
    /// Shape of the array, with a last axis of two for complex numbers.
    pub shape: Vec<usize>,
    /// Number of bytes before the data.
    pub size: u64,
}

/// Returns NumPy's name of a number type, with the least significant byte first.
pub(super) fn descriptor(element: Element) -> &'static str {
    match element {
        Element::F16 => "<f2",
        Element::F32 => "<f4",
        Element::F64 => "<f8",
        Element::I8 => "|i1",
        Element::I16 => "<i2",
        Element::I32 => "<i4",
        Element::I64 => "<i8",
        Element::U8 => "|u1",
        Element::U16 => "<u2",
        Element::U32 => "<u4",
        Element::U64 => "<u8",
    }
}

/// Returns the encoding of an array's numbers, and true if each element is two of them: a complex
/// number.
fn encoding(word: &str) -> Result<(Encoding, bool), Problem> {
    let complex = match &word.get(1..) {
        Some("c8") => Some("f4"),
        Some("c16") => Some("f8"),
        _ => None,
    };
    match complex {
        Some(part) => Ok((real(&format!("{}{part}", &word[..1]))?, true)),
        None => Ok((real(word)?, false)),
    }
}

fn real(word: &str) -> Result<Encoding, Problem> {
    let (order, kind) = word.split_at_checked(1).unwrap_or_default();
    let same = |element: &Element| descriptor(*element)[1..] == *kind;
    match (order, Element::ALL.into_iter().find(same)) {
        ("<" | "|", Some(element)) => Ok(Encoding::little(element)),
        (">", Some(element)) => Ok(Encoding::big(element)),
        _ => Err(Problem::Mismatch {
            expected: "elements that are integers, floating-point or complex numbers".to_owned(),
            found: format!("'{word}'"),
        }),
    }
}

impl NpyHeader {
    /// Reads the header of a file of `size` bytes.
    ///
    /// # Errors
    /// An invalid header, or a header that does not match the file.
    pub fn read(reader: &mut impl Read, size: u64) -> Result<Self, Problem> {
        let truncated = |expected| Problem::Truncated {
            expected,
            found: size,
        };
        let mut start = [0; 8];
        reader.read_exact(&mut start).map_err(|_| truncated(10))?;
        if start[..6] != *MAGIC {
            return Err(wrong_format("it does not begin with the magic bytes"));
        }
        let (length, before) = match start[6] {
            1 => {
                let mut bytes = [0; 2];
                reader.read_exact(&mut bytes).map_err(|_| truncated(10))?;
                (u64::from(u16::from_le_bytes(bytes)), 10)
            }
            2 | 3 => {
                let mut bytes = [0; 4];
                reader.read_exact(&mut bytes).map_err(|_| truncated(12))?;
                (u64::from(u32::from_le_bytes(bytes)), 12)
            }
            other => return Err(Problem::Unsupported(format!("NPY version {other}"))),
        };
        if length > MAX_HEADER_SIZE {
            return Err(Problem::TooLarge(format!("a header of {length} bytes")));
        }
        let mut text = vec![0; length as usize];
        reader
            .read_exact(&mut text)
            .map_err(|_| truncated(before + length))?;
        let text = str::from_utf8(&text).map_err(|_| wrong_format("its header is not text"))?;
        parse(text, before + length)
    }
}

/// Parses `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }`.
fn parse(text: &str, size: u64) -> Result<NpyHeader, Problem> {
    let mut cursor = Cursor { rest: text.trim() };
    let (mut encoding, mut fortran_order, mut shape) = (None, None, None);
    cursor.expect('{')?;
    while !cursor.accept('}') {
        let key = cursor.string()?;
        cursor.expect(':')?;
        match key {
            "descr" => encoding = Some(self::encoding(cursor.string()?)?),
            "fortran_order" => fortran_order = Some(cursor.boolean()?),
            "shape" => shape = Some(cursor.shape()?),
            other => {
                return Err(wrong_format(&format!(
                    "unknown entry '{other}' in its header"
                )));
            }
        }
        if !cursor.accept(',') {
            cursor.expect('}')?;
            break;
        }
    }
    let missing = |name| move || wrong_format(&format!("its header has no '{name}'"));
    let (encoding, complex) = encoding.ok_or_else(missing("descr"))?;
    let fortran_order = fortran_order.ok_or_else(missing("fortran_order"))?;
    let mut shape = shape.ok_or_else(missing("shape"))?;
    if complex && fortran_order {
        return Err(Problem::Mismatch {
            expected: "complex numbers in C order (numpy.ascontiguousarray)".to_owned(),
            found: "Fortran order".to_owned(),
        });
    }
    // Append an axis of real and imaginary part.
    shape.extend(complex.then_some(2));
    Ok(NpyHeader {
        encoding,
        fortran_order,
        shape,
        size,
    })
}

fn wrong_format(reason: &str) -> Problem {
    Problem::WrongFormat {
        format: "NPY",
        reason: reason.to_owned(),
    }
}

struct Cursor<'t> {
    rest: &'t str,
}

impl<'t> Cursor<'t> {
    fn accept(&mut self, wanted: char) -> bool {
        match self.rest.trim_start().strip_prefix(wanted) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn expect(&mut self, wanted: char) -> Result<(), Problem> {
        if self.accept(wanted) {
            return Ok(());
        }
        let found: String = self.rest.trim_start().chars().take(20).collect();
        Err(wrong_format(&format!(
            "expected '{wanted}' in its header, found '{found}'"
        )))
    }

    fn string(&mut self) -> Result<&'t str, Problem> {
        let quote = if self.accept('"') { '"' } else { '\'' };
        if quote == '\'' {
            self.expect('\'')?;
        }
        let (text, rest) = self
            .rest
            .split_once(quote)
            .ok_or_else(|| wrong_format("a text in its header does not end"))?;
        self.rest = rest;
        Ok(text)
    }

    fn boolean(&mut self) -> Result<bool, Problem> {
        let rest = self.rest.trim_start();
        for (word, value) in [("True", true), ("False", false)] {
            if let Some(rest) = rest.strip_prefix(word) {
                self.rest = rest;
                return Ok(value);
            }
        }
        Err(wrong_format(
            "'fortran_order' in its header is neither True nor False",
        ))
    }

    fn shape(&mut self) -> Result<Vec<usize>, Problem> {
        self.expect('(')?;
        let mut shape = Vec::new();
        while !self.accept(')') {
            if shape.len() == MAX_AXES {
                return Err(Problem::TooLarge(format!("more than {MAX_AXES} axes")));
            }
            shape.push(self.number()?);
            if !self.accept(',') {
                self.expect(')')?;
                break;
            }
        }
        Ok(shape)
    }

    fn number(&mut self) -> Result<usize, Problem> {
        let rest = self.rest.trim_start();
        let end = rest
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(rest.len());
        let (digits, rest) = rest.split_at(end);
        self.rest = rest;
        if digits.is_empty() {
            return Err(wrong_format(
                "'shape' in its header holds something other than numbers",
            ));
        }
        digits
            .parse()
            .map_err(|_| Problem::TooLarge(format!("an axis of length {digits}")))
    }
}

/// Makes the header of an array in C order with NumPy's `descriptor` of its elements.
pub(super) fn bytes(descriptor: &str, shape: &[usize]) -> Vec<u8> {
    let axes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut text = format!(
        "{{'descr': '{descriptor}', 'fortran_order': False, 'shape': ({}), }}",
        axes.trim_end()
    );
    // Pad the dictionary with blanks, and end it with a line break.
    let unpadded = MAGIC.len() + 4 + text.len() + 1;
    text.push_str(&" ".repeat(unpadded.next_multiple_of(ALIGNMENT) - unpadded));
    text.push('\n');
    // Store the length: shapes have few axes, so that it always fits.
    let length = u16::try_from(text.len()).unwrap_or(u16::MAX);
    [MAGIC, &[1u8, 0][..], &length.to_le_bytes(), text.as_bytes()].concat()
}
