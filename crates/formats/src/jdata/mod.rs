//! JData: trees of values with annotated arrays, as text (JSON) or binary (BJData).
//!
//! <https://github.com/NeuroJSON/jdata> defines annotated arrays, and
//! <https://github.com/NeuroJSON/bjdata> the binary form, draft 2. Files of MCX have this format.

mod array;
mod binary;
mod text;

use std::io::{self, Write};
use std::path::Path;

use crate::atomic;
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};

pub use array::{AnnotatedArray, Annotations, Payload};

/// Largest number of values outside of lists of numbers. These values take up to 100 bytes of
/// memory each.
const MAX_VALUES: usize = 1 << 20;
/// Largest depth of lists and objects.
const MAX_DEPTH: usize = 64;

/// Tree of values.
#[derive(Clone, Debug, PartialEq)]
pub enum JdataValue {
    /// Absent value.
    Null,
    /// Truth value.
    Boolean(bool),
    /// Number.
    Number(f64),
    /// Text.
    Text(String),
    /// List of numbers.
    Numbers(Vec<f64>),
    /// List of any values.
    List(Vec<JdataValue>),
    /// Values by name.
    Object(Vec<(String, JdataValue)>),
    /// Typed array. In text it is an annotated array.
    Packed(PackedArray),
}

/// Typed array in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedArray {
    /// Type of the numbers.
    pub element: Element,
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// True if the first index varies fastest.
    pub column_major: bool,
    /// Numbers, in little-endian byte order.
    pub bytes: Vec<u8>,
}

/// JdataForm of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JdataForm {
    /// JSON; arrays are compressed by zlib and encoded in base64.
    Text,
    /// BJData; arrays are compressed by zlib.
    Binary,
}

impl JdataForm {
    /// Returns the form of a file's extension: binary for `.bnii`, `.jdb` and `.bjd`, else text.
    pub fn of(path: &Path) -> JdataForm {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "bnii" | "jdb" | "bjd" => JdataForm::Binary,
            _ => JdataForm::Text,
        }
    }
}

impl JdataValue {
    /// Creates an object of values by name.
    pub fn object<'a>(entries: impl IntoIterator<Item = (&'a str, JdataValue)>) -> Self {
        let owned = |(key, value): (&str, JdataValue)| (key.to_owned(), value);
        JdataValue::Object(entries.into_iter().map(owned).collect())
    }

    /// Parses a file of either form.
    ///
    /// # Errors
    ///
    /// Bytes of neither form, more than a million values outside of lists of numbers, and more than
    /// 64 levels.
    pub fn parse(bytes: &[u8]) -> Result<JdataValue, Problem> {
        if binary::is_one(bytes) {
            binary::parse(bytes)
        } else {
            text::parse(bytes)
        }
    }

    /// Returns the value of a name in an object.
    pub fn get(&self, key: &str) -> Option<&JdataValue> {
        let JdataValue::Object(entries) = self else {
            return None;
        };
        entries.iter().find(|(name, _)| name == key).map(|e| &e.1)
    }

    /// Returns the number.
    pub fn number(&self) -> Option<f64> {
        match self {
            JdataValue::Number(v) => Some(*v),
            _ => None,
        }
    }

    /// Returns the text.
    pub fn text(&self) -> Option<&str> {
        match self {
            JdataValue::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the numbers of a list, or of a typed array of one axis.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        match self {
            JdataValue::Number(v) => Some(vec![*v]),
            JdataValue::Numbers(numbers) => Some(numbers.clone()),
            JdataValue::List(items) if items.is_empty() => Some(Vec::new()),
            JdataValue::Packed(packed) if packed.shape.len() == 1 => {
                let mut numbers = Vec::with_capacity(packed.shape[0]);
                packed
                    .element
                    .decode(&packed.bytes, &mut |v| numbers.push(v));
                Some(numbers)
            }
            _ => None,
        }
    }

    /// Returns the annotated and typed arrays of a tree of objects, and lists of lists of numbers.
    /// Names are paths with `/`; an array at the root has the name `data`.
    pub fn arrays(&self) -> Vec<(String, &JdataValue)> {
        let mut found = Vec::new();
        self.gather("", &mut found);
        found
    }

    /// Returns true for a list of lists of numbers.
    fn is_table(&self) -> bool {
        let is_row = |row: &JdataValue| matches!(row, JdataValue::Numbers(row) if !row.is_empty());
        matches!(self, JdataValue::List(rows) if !rows.is_empty() && rows.iter().all(is_row))
    }

    fn gather<'a>(&'a self, path: &str, found: &mut Vec<(String, &'a JdataValue)>) {
        if AnnotatedArray::is_one(self)
            || matches!(self, JdataValue::Packed(p) if p.shape.len() > 1)
            || self.is_table()
        {
            let name = if path.is_empty() { "data" } else { path };
            found.push((name.to_owned(), self));
        } else if let JdataValue::Object(entries) = self {
            for (key, value) in entries {
                match path {
                    "" => value.gather(key, found),
                    path => value.gather(&format!("{path}/{key}"), found),
                }
            }
        }
    }

    /// Writes a file, completely or not at all.
    ///
    /// # Errors
    ///
    /// All errors of [`atomic::write()`].
    pub fn write(&self, path: &Path, form: JdataForm) -> Result<(), FileError> {
        atomic::write(path, |file| match form {
            JdataForm::Text => {
                text::write(self, file)?;
                writeln!(file)
            }
            JdataForm::Binary => binary::write(self, file),
        })
    }
}

impl PackedArray {
    /// Makes an array; numbers are rounded to the type.
    ///
    /// # Errors
    ///
    /// A shape that does not match the numbers.
    pub fn new(
        element: Element,
        shape: Vec<usize>,
        column_major: bool,
        values: impl IntoIterator<Item = f64>,
    ) -> Result<Self, Problem> {
        let mut bytes = Vec::new();
        // Writing to memory does not fail.
        let written = Encoding::little(element).write(&mut bytes, values);
        written.map_err(Problem::Write)?;
        let count = shape.iter().try_fold(1usize, |n, m| n.checked_mul(*m));
        if count.and_then(|n| n.checked_mul(element.size())) == Some(bytes.len()) {
            Ok(PackedArray {
                element,
                shape,
                column_major,
                bytes,
            })
        } else {
            Err(Problem::Mismatch {
                expected: format!("an array of shape {shape:?}"),
                found: format!("{} numbers", bytes.len() / element.size()),
            })
        }
    }
}

/// Returns the name of a number type in annotations. JData has no numbers of 16 bits in floating
/// point.
pub(crate) fn type_name(element: Element) -> &'static str {
    match element {
        Element::F16 => "half",
        Element::F32 => "single",
        Element::F64 => "double",
        integer => integer.name(),
    }
}

/// Compresses bytes by zlib into `out`.
fn compress<W: Write>(bytes: &[u8], out: W) -> io::Result<W> {
    let mut encoder = flate2::write::ZlibEncoder::new(out, flate2::Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

/// Makes an error for too many values.
fn too_many() -> Problem {
    Problem::TooLarge(format!(
        "it has more than {MAX_VALUES} values outside of arrays"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> JdataValue {
        let array = |column_major| {
            let values = (0..6).map(f64::from);
            JdataValue::Packed(
                PackedArray::new(Element::I16, vec![2, 3], column_major, values).unwrap(),
            )
        };
        JdataValue::Object(vec![
            ("a \"name\"".into(), JdataValue::Text("µ\n".into())),
            ("none".into(), JdataValue::Null),
            (
                "list".into(),
                JdataValue::List(vec![JdataValue::Boolean(true), JdataValue::Number(-2.5)]),
            ),
            (
                "numbers".into(),
                JdataValue::Numbers(vec![1.0, 70000.0, 0.1]),
            ),
            ("rows".into(), array(false)),
            ("columns".into(), array(true)),
        ])
    }

    #[test]
    fn round_trips() {
        let value = sample();
        let mut forms = [Vec::new(), Vec::new()];
        text::write(&value, &mut forms[0]).unwrap();
        binary::write(&value, &mut forms[1]).unwrap();
        for bytes in forms {
            let read = JdataValue::parse(&bytes).unwrap();
            for key in ["a \"name\"", "none", "list", "numbers"] {
                assert_eq!(read.get(key), value.get(key), "{key}");
            }
            for (key, column_major) in [("rows", false), ("columns", true)] {
                let array = AnnotatedArray::of(read.get(key).unwrap()).unwrap();
                assert_eq!(
                    (array.element, &array.shape[..]),
                    (Element::I16, &[2, 3][..])
                );
                assert_eq!(array.column_major, column_major);
                let mut values = Vec::new();
                array.each(|v| values.push(v)).unwrap();
                assert_eq!(values, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
            }
        }
    }

    #[test]
    fn hostile_sizes_and_depths() {
        let refused = |bytes: &[u8]| JdataValue::parse(bytes).unwrap_err().to_string();
        assert!(refused(&[b'['; 100]).contains("levels"));
        assert!(refused("[".repeat(100).as_bytes()).contains("levels"));
        let many = format!("[{}0]", "[],".repeat(MAX_VALUES));
        assert!(refused(many.as_bytes()).contains("values outside of arrays"));
        // An array of 2^31 - 1 numbers in 11 bytes, objects without values, a negative length.
        assert!(refused(b"{U\x01a[$d#l\xff\xff\xff\x7f").contains("ends"));
        assert!(refused(b"{$Z#l\xff\xff\xff\x7f").contains("ends"));
        assert!(refused(b"{U\x01a[$Z#l\xff\xff\xff\x7f}").contains("values outside of arrays"));
        assert!(refused(b"{i\xff").contains("length"));
        assert!(refused(b"{U\x01aY").contains("marker"));
        assert!(refused(b"{\"a\": 1").contains("line 1"));
    }
}
