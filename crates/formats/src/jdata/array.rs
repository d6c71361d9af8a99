//! Arrays of numbers in JData annotations.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::{GzDecoder, ZlibDecoder};

use super::{JdataValue, PackedArray};
use crate::element::{Element, Encoding};
use crate::error::Problem;
use crate::tensor::{Numbers, Tensor};

/// Largest number of elements of an array.
const MAX_ELEMENTS: usize = 1 << 31;

/// Annotations of an array, as a file has them.
#[derive(Clone, Debug, Default)]
pub struct Annotations<'a> {
    /// `_ArrayType_`.
    pub kind: Option<&'a str>,
    /// `_ArraySize_`.
    pub size: Option<Vec<f64>>,
    /// `_ArrayOrder_`.
    pub order: Option<&'a str>,
    /// `_ArrayZipType_`.
    pub zip: Option<&'a str>,
    /// `_ArrayData_`.
    pub data: Option<Payload<'a>>,
    /// `_ArrayZipData_`.
    pub zipped: Option<Payload<'a>>,
}

/// Content of an array in a file.
#[derive(Clone, Debug)]
pub enum Payload<'a> {
    /// Numbers.
    Numbers(Cow<'a, [f64]>),
    /// Base64 text.
    Text(&'a str),
    /// Bytes.
    Bytes(&'a [u8]),
}

/// Array of numbers in annotations.
#[derive(Clone, Debug)]
pub struct AnnotatedArray<'a> {
    /// Type of the numbers.
    pub element: Element,
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// True if the first index varies fastest.
    pub column_major: bool,
    content: Content<'a>,
}

#[derive(Clone, Debug)]
enum Content<'a> {
    Numbers(Cow<'a, [f64]>),
    Bytes(Codec, Cow<'a, [u8]>),
}

/// Compression of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Codec {
    None,
    Zlib,
    Gzip,
}

impl<'a> AnnotatedArray<'a> {
    /// Reads annotations.
    ///
    /// # Errors
    ///
    /// Annotations that are missing, contradict each other, or have values that morgana does not
    /// support.
    pub fn new(annotations: Annotations<'a>) -> Result<Self, Problem> {
        let element = element(annotations.kind.unwrap_or(""))?;
        let shape = shape(annotations.size.as_deref())?;
        let count = shape.iter().try_fold(1usize, |n, m| n.checked_mul(*m));
        let count = count
            .filter(|n| (1..=MAX_ELEMENTS).contains(n))
            .ok_or_else(|| malformed("an array needs _ArraySize_ and numbers"))?;
        let content = match (annotations.zipped, annotations.data) {
            (Some(zipped), _) => Content::Bytes(
                codec(annotations.zip.unwrap_or(""))?,
                bytes(zipped, "_ArrayZipData_")?,
            ),
            (None, Some(Payload::Numbers(numbers))) => Content::Numbers(numbers),
            (None, Some(data)) => Content::Bytes(Codec::None, bytes(data, "_ArrayData_")?),
            (None, None) => {
                return Err(malformed(
                    "an array needs _ArrayData_, a list of numbers, or _ArrayZipData_, a text, with _ArrayZipType_",
                ));
            }
        };
        let found = match &content {
            Content::Numbers(numbers) => Some(numbers.len()),
            Content::Bytes(..) => None,
        };
        if let Some(found) = found.filter(|n| *n != count) {
            return Err(Problem::Mismatch {
                expected: format!("an array of shape {shape:?}"),
                found: format!("{found} numbers"),
            });
        }
        Ok(AnnotatedArray {
            element,
            shape,
            column_major: column_major(annotations.order)?,
            content,
        })
    }

    /// Reads an annotated array of a tree, a typed array, or lists of numbers in lists.
    ///
    /// # Errors
    ///
    /// The errors of [`AnnotatedArray::new`], and values that are no array.
    pub fn of(value: &'a JdataValue) -> Result<Self, Problem> {
        match value {
            JdataValue::Packed(packed) => Ok(AnnotatedArray::packed(packed)),
            JdataValue::Object(_) => AnnotatedArray::new(annotations(value)?),
            _ => nested(value),
        }
    }

    fn packed(packed: &'a PackedArray) -> Self {
        AnnotatedArray {
            element: packed.element,
            shape: packed.shape.clone(),
            column_major: packed.column_major,
            content: Content::Bytes(Codec::None, Cow::Borrowed(&packed.bytes)),
        }
    }

    /// Returns true for an object with annotations of an array.
    pub fn is_one(value: &JdataValue) -> bool {
        value.get("_ArrayType_").is_some() || value.get("_ArraySize_").is_some()
    }

    /// Returns the number of elements.
    pub fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns the number of bytes in the file, before decompression.
    pub fn stored(&self) -> u64 {
        match &self.content {
            Content::Numbers(numbers) => size_of_val(&**numbers) as u64,
            Content::Bytes(_, bytes) => bytes.len() as u64,
        }
    }

    /// Passes each number to `sink`, in the order of the file.
    ///
    /// # Errors
    ///
    /// Content that cannot be decompressed, or has another size. Some numbers may have been passed
    /// before the error.
    pub fn each(&self, mut sink: impl FnMut(f64)) -> Result<(), Problem> {
        let (codec, bytes) = match &self.content {
            Content::Numbers(numbers) => {
                numbers.iter().for_each(|v| sink(*v));
                return Ok(());
            }
            Content::Bytes(codec, bytes) => (*codec, &**bytes),
        };
        let mut reader: Box<dyn Read> = match codec {
            Codec::None => Box::new(bytes),
            Codec::Zlib => Box::new(ZlibDecoder::new(bytes)),
            Codec::Gzip => Box::new(GzDecoder::new(bytes)),
        };
        let expected = self.count() * self.element.size();
        let other = |more: &str| {
            malformed(&format!(
                "its data has {more} than the {expected} bytes of _ArraySize_"
            ))
        };
        Encoding::little(self.element)
            .read(&mut reader, self.count(), sink)
            .map_err(|e| match e.kind() {
                std::io::ErrorKind::UnexpectedEof => other("less"),
                _ => malformed(&format!("its data is not valid {}: {e}", codec.name())),
            })?;
        match reader.read(&mut [0]) {
            Ok(0) => Ok(()),
            _ => Err(other("more")),
        }
    }

    /// Returns the array with its last axis fastest.
    ///
    /// # Errors
    ///
    /// The errors of [`AnnotatedArray::each`].
    pub fn tensor(&self) -> Result<Tensor, Problem> {
        // Let memory grow with the content: the size may be wrong.
        let numbers = if self.element.is_single() {
            let mut values = Vec::new();
            self.each(|v| values.push(v as f32))?;
            Numbers::Single(self.rows_first(values))
        } else {
            let mut values = Vec::new();
            self.each(|v| values.push(v))?;
            Numbers::Double(self.rows_first(values))
        };
        Tensor::new(self.shape.clone(), numbers)
    }

    /// Sorts numbers of the file so that the last index varies fastest.
    fn rows_first<T: Copy>(&self, stored: Vec<T>) -> Vec<T> {
        if !self.column_major || self.shape.len() < 2 {
            return stored;
        }
        let mut sorted = stored.clone();
        let mut index = vec![0; self.shape.len()];
        for v in stored {
            let place = index
                .iter()
                .zip(&self.shape)
                .fold(0, |place, (i, n)| place * n + i);
            sorted[place] = v;
            for (i, n) in index.iter_mut().zip(&self.shape) {
                *i += 1;
                if *i < *n {
                    break;
                }
                *i = 0;
            }
        }
        sorted
    }
}

impl Codec {
    fn name(self) -> &'static str {
        match self {
            Codec::None => "base64",
            Codec::Zlib => "zlib",
            Codec::Gzip => "gzip",
        }
    }
}

fn annotations(value: &JdataValue) -> Result<Annotations<'_>, Problem> {
    for key in ["_ArrayIsComplex_", "_ArrayIsSparse_"] {
        let is_set = !matches!(
            value.get(key),
            None | Some(JdataValue::Boolean(false) | JdataValue::Null)
        );
        if is_set {
            let message = format!("arrays with {key}: save a dense array of real numbers");
            return Err(Problem::Unsupported(message));
        }
    }
    let text = |key| value.get(key).and_then(JdataValue::text);
    let payload = |key| {
        value.get(key).map(|value| match value {
            JdataValue::Text(text) => Payload::Text(text),
            JdataValue::Numbers(numbers) => Payload::Numbers(Cow::Borrowed(numbers)),
            JdataValue::Packed(packed) if packed.element.size() == 1 => {
                Payload::Bytes(&packed.bytes)
            }
            JdataValue::Packed(packed) => {
                let mut numbers = Vec::with_capacity(packed.bytes.len() / packed.element.size());
                packed
                    .element
                    .decode(&packed.bytes, &mut |v| numbers.push(v));
                Payload::Numbers(Cow::Owned(numbers))
            }
            other => Payload::Numbers(Cow::Owned(other.numbers().unwrap_or_default())),
        })
    };
    Ok(Annotations {
        kind: text("_ArrayType_"),
        size: value.get("_ArraySize_").and_then(JdataValue::numbers),
        order: text("_ArrayOrder_"),
        zip: text("_ArrayZipType_"),
        data: payload("_ArrayData_"),
        zipped: payload("_ArrayZipData_"),
    })
}

/// Reads lists of numbers in lists, all of equal lengths, as an array of doubles.
fn nested(value: &JdataValue) -> Result<AnnotatedArray<'_>, Problem> {
    let none = || malformed("it is neither an annotated array nor lists of numbers");
    let mut shape = Vec::new();
    let mut first = value;
    while let JdataValue::List(items) = first {
        shape.push(items.len());
        first = items.first().ok_or_else(none)?;
    }
    let JdataValue::Numbers(row) = first else {
        return Err(none());
    };
    shape.push(row.len());
    let mut numbers = Vec::new();
    gather(value, &shape, &mut numbers)
        .ok_or_else(|| malformed("its lists of numbers have different lengths"))?;
    Ok(AnnotatedArray {
        element: Element::F64,
        shape,
        column_major: false,
        content: Content::Numbers(Cow::Owned(numbers)),
    })
}

/// Collects the numbers of an array of a given shape; `None` if the shape is another.
fn gather(value: &JdataValue, shape: &[usize], numbers: &mut Vec<f64>) -> Option<()> {
    match (value, shape) {
        (JdataValue::Numbers(row), [length]) if row.len() == *length => {
            numbers.extend(row);
            Some(())
        }
        (JdataValue::List(items), [length, rest @ ..]) if items.len() == *length => items
            .iter()
            .try_for_each(|v| gather(v, rest, numbers).ok_or(()))
            .ok(),
        _ => None,
    }
}

fn element(name: &str) -> Result<Element, Problem> {
    let found = match name {
        "half" => Some(Element::F16),
        "single" => Some(Element::F32),
        "double" => Some(Element::F64),
        "logical" | "bool" => Some(Element::U8),
        name => Element::of_name(name),
    };
    found.ok_or_else(|| {
        malformed(&format!(
            "_ArrayType_ is '{name}', but must be uint8, int8, uint16, ..., int64, single or double"
        ))
    })
}

fn shape(sizes: Option<&[f64]>) -> Result<Vec<usize>, Problem> {
    let whole = |v: &f64| (v.fract() == 0.0 && *v >= 1.0).then_some(*v as usize);
    sizes
        .and_then(|sizes| sizes.iter().map(whole).collect())
        .ok_or_else(|| malformed("_ArraySize_ must be a list of whole numbers, each at least 1"))
}

fn column_major(order: Option<&str>) -> Result<bool, Problem> {
    match order.unwrap_or("r").to_ascii_lowercase().as_str() {
        "r" | "row" => Ok(false),
        "c" | "col" | "column" => Ok(true),
        other => Err(malformed(&format!(
            "_ArrayOrder_ is '{other}', but must be r (the last index varies fastest) or c (the first)"
        ))),
    }
}

fn codec(name: &str) -> Result<Codec, Problem> {
    match name.to_ascii_lowercase().as_str() {
        "zlib" => Ok(Codec::Zlib),
        "gzip" => Ok(Codec::Gzip),
        "base64" => Ok(Codec::None),
        _ => Err(malformed(&format!(
            "_ArrayZipType_ is '{name}', but must be zlib, gzip or base64: write the file with one of these"
        ))),
    }
}

/// Returns the bytes of a payload.
fn bytes<'a>(payload: Payload<'a>, key: &str) -> Result<Cow<'a, [u8]>, Problem> {
    match payload {
        Payload::Bytes(bytes) => Ok(Cow::Borrowed(bytes)),
        Payload::Text(text) => {
            let packed: Vec<u8> = text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
            let bytes = STANDARD.decode(packed);
            bytes
                .map(Cow::Owned)
                .map_err(|e| malformed(&format!("{key} is not base64: {e}")))
        }
        Payload::Numbers(_) => Err(malformed(&format!("{key} must be a text or bytes"))),
    }
}

fn malformed(message: &str) -> Problem {
    Problem::Malformed(message.to_owned())
}
