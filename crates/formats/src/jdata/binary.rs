//! Binary form: BJData, draft 2, in little-endian byte order.

use std::io::{self, Write};

use super::{JdataValue, MAX_DEPTH, MAX_VALUES, PackedArray, compress, too_many, type_name};
use crate::element::Element;
use crate::error::Problem;

/// Returns true if bytes begin with an object of BJData. In JSON, a blank, a quotation mark or the
/// end of the object follows `{`.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    matches!(bytes, [b'{' | b'[', next, ..] if b"UiIulmLMB$#N".contains(next))
}

/// Parses an object or a list of BJData.
pub(super) fn parse(bytes: &[u8]) -> Result<JdataValue, Problem> {
    let mut reader = Reader {
        bytes,
        values: MAX_VALUES,
        depth: 0,
    };
    let value = reader.value()?;
    while let [b'N', rest @ ..] = reader.bytes {
        reader.bytes = rest;
    }
    match reader.bytes.len() {
        0 => Ok(value),
        extra => Err(Problem::TrailingBytes {
            extra: extra as u64,
        }),
    }
}

struct Reader<'a> {
    /// Bytes that are left.
    bytes: &'a [u8],
    /// Number of values that may follow.
    values: usize,
    depth: usize,
}

/// Type and number of the values of a list or an object.
struct Content {
    /// Marker of the type of all values.
    marker: Option<u8>,
    /// Length of each axis; `None` if an end marker follows the values.
    shape: Option<Vec<usize>>,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Problem> {
        let Some((taken, rest)) = self.bytes.split_at_checked(count) else {
            return Err(bad("it ends within a value"));
        };
        self.bytes = rest;
        Ok(taken)
    }

    /// Returns the next marker after padding.
    fn marker(&mut self) -> Result<u8, Problem> {
        loop {
            match self.take(1)?[0] {
                b'N' => {}
                marker => return Ok(marker),
            }
        }
    }

    fn value(&mut self) -> Result<JdataValue, Problem> {
        let marker = self.marker()?;
        self.of(marker)
    }

    /// Reads the value after a marker.
    fn of(&mut self, marker: u8) -> Result<JdataValue, Problem> {
        self.values = self.values.checked_sub(1).ok_or_else(too_many)?;
        if let Some(element) = element(marker) {
            return Ok(JdataValue::Number(self.number(element)?));
        }
        match marker {
            b'Z' => Ok(JdataValue::Null),
            b'T' => Ok(JdataValue::Boolean(true)),
            b'F' => Ok(JdataValue::Boolean(false)),
            b'C' => Ok(JdataValue::Text(char::from(self.take(1)?[0]).to_string())),
            b'S' => Ok(JdataValue::Text(self.text()?)),
            b'H' => {
                let text = self.text()?;
                let number = text.parse();
                number
                    .map(JdataValue::Number)
                    .map_err(|_| bad(&format!("'{text}' is not a number")))
            }
            b'[' | b'{' if self.depth == MAX_DEPTH => {
                Err(bad(&format!("it has more than {MAX_DEPTH} levels")))
            }
            b'[' | b'{' => {
                self.depth += 1;
                let value = if marker == b'[' {
                    self.list()
                } else {
                    self.object()
                };
                self.depth -= 1;
                value
            }
            marker => Err(bad(&format!("unknown marker {marker:#04x}"))),
        }
    }

    fn number(&mut self, element: Element) -> Result<f64, Problem> {
        let mut number = 0.0;
        element.decode(self.take(element.size())?, &mut |v| number = v);
        Ok(number)
    }

    /// Reads a length: an integer with its marker.
    fn length(&mut self) -> Result<usize, Problem> {
        let marker = self.marker()?;
        self.length_of(marker)
    }

    fn length_of(&mut self, marker: u8) -> Result<usize, Problem> {
        let integer = element(marker).filter(|e| e.is_integer());
        let length = self.number(integer.ok_or_else(|| bad("a length is not an integer"))?)?;
        if !(0.0..=9.0e15).contains(&length) {
            return Err(bad(&format!("a length of {length}")));
        }
        Ok(length as usize)
    }

    fn text(&mut self) -> Result<String, Problem> {
        let length = self.length()?;
        self.text_of(length)
    }

    fn text_of(&mut self, length: usize) -> Result<String, Problem> {
        let bytes = self.take(length)?;
        let text = std::str::from_utf8(bytes).map_err(|_| bad("a text is not UTF-8"))?;
        Ok(text.to_owned())
    }

    /// Reads the optional type and number of the values of a container.
    fn content(&mut self) -> Result<Content, Problem> {
        let mut marker = None;
        if self.bytes.starts_with(b"$") {
            self.take(1)?;
            marker = Some(self.take(1)?[0]);
        }
        if !self.bytes.starts_with(b"#") {
            return match marker {
                Some(_) => Err(bad("a type without a number of values")),
                None => Ok(Content {
                    marker,
                    shape: None,
                }),
            };
        }
        self.take(1)?;
        let next = self.marker()?;
        let shape = if next == b'[' {
            self.shape()?
        } else {
            vec![self.length_of(next)?]
        };
        Ok(Content {
            marker,
            shape: Some(shape),
        })
    }

    /// Reads the lengths of the axes of an array: a list of integers.
    fn shape(&mut self) -> Result<Vec<usize>, Problem> {
        let list = self.list()?;
        let lengths = list.numbers().unwrap_or_default();
        let whole =
            |v: &f64| (v.fract() == 0.0 && (0.0..=9.0e15).contains(v)).then_some(*v as usize);
        let shape: Option<Vec<usize>> = lengths.iter().map(whole).collect();
        shape
            .filter(|shape| !shape.is_empty())
            .ok_or_else(|| bad("the lengths of an array's axes are not integers"))
    }

    fn list(&mut self) -> Result<JdataValue, Problem> {
        let content = self.content()?;
        let count = match &content.shape {
            Some(shape) => shape.iter().try_fold(1usize, |n, m| n.checked_mul(*m)),
            None => return self.open_list(),
        };
        let count = count.ok_or_else(|| bad("the size of an array overflows"))?;
        if let Some(element) = content.marker.and_then(element) {
            let bytes = count.checked_mul(element.size());
            let bytes = self.take(bytes.unwrap_or(usize::MAX))?.to_vec();
            return Ok(JdataValue::Packed(PackedArray {
                element,
                shape: content.shape.unwrap_or_default(),
                column_major: false,
                bytes,
            }));
        }
        let mut items = Vec::new();
        for _ in 0..count {
            items.push(match content.marker {
                Some(marker) => self.of(marker)?,
                None => self.value()?,
            });
        }
        Ok(of_items(items))
    }

    fn open_list(&mut self) -> Result<JdataValue, Problem> {
        let mut items = Vec::new();
        loop {
            match self.marker()? {
                b']' => return Ok(of_items(items)),
                marker => items.push(self.of(marker)?),
            }
        }
    }

    fn object(&mut self) -> Result<JdataValue, Problem> {
        let content = self.content()?;
        let count = content.shape.map(|shape| shape.iter().product::<usize>());
        let mut entries = Vec::new();
        while count.is_none_or(|count| entries.len() < count) {
            let marker = self.marker()?;
            if count.is_none() && marker == b'}' {
                break;
            }
            let length = self.length_of(marker)?;
            let key = self.text_of(length)?;
            let value = match content.marker {
                Some(marker) => self.of(marker)?,
                None => self.value()?,
            };
            entries.push((key, value));
        }
        Ok(JdataValue::Object(entries))
    }
}

/// Makes a list, compactly if all its values are numbers.
fn of_items(items: Vec<JdataValue>) -> JdataValue {
    match items
        .iter()
        .map(JdataValue::number)
        .collect::<Option<Vec<f64>>>()
    {
        Some(numbers) if !numbers.is_empty() => JdataValue::Numbers(numbers),
        _ => JdataValue::List(items),
    }
}

/// Returns the number type of a marker.
fn element(marker: u8) -> Option<Element> {
    Some(match marker {
        b'i' => Element::I8,
        b'U' | b'B' => Element::U8,
        b'I' => Element::I16,
        b'u' => Element::U16,
        b'l' => Element::I32,
        b'm' => Element::U32,
        b'L' => Element::I64,
        b'M' => Element::U64,
        b'h' => Element::F16,
        b'd' => Element::F32,
        b'D' => Element::F64,
        _ => return None,
    })
}

/// Writes BJData.
pub(super) fn write(value: &JdataValue, out: &mut impl Write) -> io::Result<()> {
    match value {
        JdataValue::Null => out.write_all(b"Z"),
        JdataValue::Boolean(v) => out.write_all(if *v { b"T" } else { b"F" }),
        JdataValue::Number(v) => number(*v, out),
        JdataValue::Text(text) => {
            out.write_all(b"S")?;
            string(text, out)
        }
        JdataValue::Numbers(numbers) => {
            out.write_all(b"[")?;
            numbers.iter().try_for_each(|v| number(*v, out))?;
            out.write_all(b"]")
        }
        JdataValue::List(items) => {
            out.write_all(b"[")?;
            items.iter().try_for_each(|item| write(item, out))?;
            out.write_all(b"]")
        }
        JdataValue::Object(entries) => {
            out.write_all(b"{")?;
            for (key, value) in entries {
                string(key, out)?;
                write(value, out)?;
            }
            out.write_all(b"}")
        }
        JdataValue::Packed(packed) => array(packed, out),
    }
}

/// Writes a number in the shortest integer type, or in double precision.
fn number(v: f64, out: &mut impl Write) -> io::Result<()> {
    if v.fract() == 0.0 && v.abs() < f64::from(i32::MAX) {
        match v as i64 {
            n @ 0..=255 => out.write_all(&[b'U', n as u8]),
            n => {
                out.write_all(b"l")?;
                out.write_all(&(n as i32).to_le_bytes())
            }
        }
    } else {
        out.write_all(b"D")?;
        out.write_all(&v.to_le_bytes())
    }
}

/// Writes the length and the bytes of a text.
fn string(text: &str, out: &mut impl Write) -> io::Result<()> {
    length(text.len(), out)?;
    out.write_all(text.as_bytes())
}

fn length(n: usize, out: &mut impl Write) -> io::Result<()> {
    match u8::try_from(n) {
        Ok(n) => out.write_all(&[b'U', n]),
        Err(_) => {
            out.write_all(b"L")?;
            out.write_all(&(n as i64).to_le_bytes())
        }
    }
}

fn array(packed: &PackedArray, out: &mut impl Write) -> io::Result<()> {
    let count: usize = packed.shape.iter().product();
    let lengths = packed.shape.iter().map(|n| *n as f64).collect();
    let text = |text: &str| JdataValue::Text(text.to_owned());
    let mut entries = vec![
        ("_ArrayType_".to_owned(), text(type_name(packed.element))),
        ("_ArraySize_".to_owned(), JdataValue::Numbers(lengths)),
    ];
    if packed.column_major {
        entries.push(("_ArrayOrder_".to_owned(), text("c")));
    }
    entries.push(("_ArrayZipType_".to_owned(), text("zlib")));
    entries.push((
        "_ArrayZipSize_".to_owned(),
        JdataValue::Number(count as f64),
    ));
    out.write_all(b"{")?;
    for (key, value) in &entries {
        string(key, out)?;
        write(value, out)?;
    }
    string("_ArrayZipData_", out)?;
    let zipped = compress(&packed.bytes, Vec::new())?;
    out.write_all(b"[$U#")?;
    length(zipped.len(), out)?;
    out.write_all(&zipped)?;
    out.write_all(b"}")
}

fn bad(reason: &str) -> Problem {
    Problem::WrongFormat {
        format: "BJData",
        reason: reason.into(),
    }
}
